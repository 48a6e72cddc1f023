"""The opening of the iris: area, symmetry, and limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flarewright.model import Iris
from flarewright.optics.pupil.iris import blade_edges, iris_outline, transmission


def f_values(edges, p):
    q = p[None] - edges[:, 2, None, None] * edges[:, None, :2]
    return np.einsum("bpi,bi->bp", q, edges[:, :2]) + 0.5 * edges[:, 3, None] * np.sum(q * q, axis=-1)


def area_by_quadrature(iris, h):
    """Integrate rho^2 / 2 over the polar angle, by Gauss-Legendre from corner to middle of an edge."""
    edges = blade_edges(iris, h)
    _, _, offset, curvature = edges[0]
    k = curvature * offset
    node, weight = np.polynomial.legendre.leggauss(60)
    half = math.pi / iris.blades
    b = (1 - k) * np.cos(half * (node + 1) / 2)
    rho = offset * (2 - k) / (b + np.sqrt(b * b + k * (2 - k)))
    return 2 * iris.blades * np.sum(weight * rho**2) / 2 * half / 2


@settings(deadline=None)
@given(st.integers(3, 24), st.floats(0.0, 0.999), st.floats(0.1, 50.0))
def test_blades_have_the_area_of_the_round_opening(blades, rounding, h):
    iris = Iris(blades=blades, rounding=rounding)
    assert area_by_quadrature(iris, h) == pytest.approx(math.pi * h * h, rel=1e-9)


def test_straight_blades_make_the_regular_polygon():
    h, n = 5.0, 6
    edges = blade_edges(Iris(blades=n), h)
    assert edges.shape == (n, 4)
    assert not edges[:, 3].any()
    np.testing.assert_allclose(edges[:, 2], h * math.sqrt(math.pi / (n * math.tan(math.pi / n))), rtol=1e-14)


def test_first_edge_is_up_and_the_others_follow_counter_clockwise():
    edges = blade_edges(Iris(blades=5), 1.0)
    np.testing.assert_allclose(edges[0, :2], (0, 1), atol=1e-15)
    assert edges[1, 0] < 0
    turned = blade_edges(Iris(blades=5, rotation_deg=90), 1.0)
    np.testing.assert_allclose(turned[0, :2], (-1, 0), atol=1e-15)


def test_round_opening_is_exactly_the_circle():
    for iris in (Iris(), Iris(blades=7, rounding=1.0)):
        edges = blade_edges(iris, 3.0)
        assert edges.shape == (1, 4)
        p = 3.0 * np.stack([np.cos(t := np.linspace(0, 6.3, 50)), np.sin(t)], axis=1)
        np.testing.assert_allclose(f_values(edges, p), 0.0, atol=1e-14)
        grad = edges[0, :2] + edges[0, 3] * (p - edges[0, 2] * edges[0, :2])
        np.testing.assert_allclose(np.linalg.norm(grad, axis=1), 1.0, rtol=1e-14)
        assert f_values(edges, np.zeros((1, 2)))[0, 0] < 0


@settings(deadline=None)
@given(st.integers(0, 24).filter(lambda b: b not in (1, 2)), st.floats(0.0, 1.0), st.floats(-360, 360))
def test_the_outline_lies_on_the_border(blades, rounding, turn):
    iris = Iris(blades=blades, rounding=rounding, rotation_deg=turn)
    line = iris_outline(iris, 2.0, 100)
    assert 100 <= len(line) < 100 + 24
    np.testing.assert_allclose(f_values(blade_edges(iris, 2.0), line).max(axis=0), 0.0, atol=1e-12)
    x, y = line.T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert 0.985 < shoelace / (4 * math.pi) <= 1.0 + 1e-12


def test_rounding_tends_to_the_circle_and_to_the_polygon():
    radius = np.linalg.norm(iris_outline(Iris(blades=6, rounding=1 - 1e-9), 1.0, 60), axis=1)
    np.testing.assert_allclose(radius, 1.0, atol=1e-9)
    np.testing.assert_allclose(
        iris_outline(Iris(blades=6, rounding=1e-9), 1.0, 60), iris_outline(Iris(blades=6), 1.0, 60), atol=1e-8
    )


@pytest.mark.parametrize("iris", [Iris(), Iris(blades=6, rotation_deg=10), Iris(blades=7, rounding=0.4)])
def test_antialiased_transmission_keeps_the_area(iris):
    at = (np.arange(400) + 0.5) / 400 * 3 - 1.5
    t = transmission(iris, 1.0, at, at[:, None], footprint=3 / 400)
    assert t.sum() * (3 / 400) ** 2 == pytest.approx(math.pi, rel=2e-5)
    assert t.min() == 0.0
    assert t.max() == 1.0
    hard = transmission(iris, 1.0, at, at[:, None])
    assert set(np.unique(hard)) == {0.0, 1.0}


def test_transmission_is_symmetric():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-1.3, 1.3, (2, 500))
    iris = Iris(blades=5, rounding=0.3)
    t = transmission(iris, 1.0, x, y, footprint=0.1)
    np.testing.assert_allclose(transmission(iris, 1.0, -x, y, footprint=0.1), t, atol=1e-12)
    a = 2 * math.pi / 5
    turned = transmission(
        iris, 1.0, x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a), footprint=0.1
    )
    np.testing.assert_allclose(turned, t, atol=1e-12)


def test_a_mask_spans_the_square_around_the_opening():
    mask = np.zeros((4, 4))
    mask[0, 3] = 1.0  # top right
    assert transmission(Iris(), 2.0, 1.5, 1.5, mask=mask) == 1.0
    assert transmission(Iris(), 2.0, -1.5, 1.5, mask=mask) == 0.0
    assert transmission(Iris(), 2.0, 5.0, 1.5, mask=mask) == 0.0
    assert transmission(Iris(), 2.0, 1.5, 2.0, mask=mask) == 0.5
    # a quarter turn counter-clockwise moves the top right to the top left
    assert transmission(Iris(rotation_deg=90), 2.0, -1.5, 1.5, mask=mask) == pytest.approx(1.0)


def test_bad_arguments():
    with pytest.raises(ValueError, match="positive"):
        blade_edges(Iris(), 0.0)
    with pytest.raises(ValueError, match="at least 3"):
        iris_outline(Iris(), 1.0, 2)
