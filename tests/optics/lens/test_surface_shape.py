"""Shape and pose of surfaces: Zernike terms, sag and its gradient, frames."""

from __future__ import annotations

import numpy as np
import pytest
from prescriptions import TRIPLET, lens

from flarewright.errors import LensError, ProjectError
from flarewright.kernels.tracing.intersect import AXES, ORIGIN, sag_of_shape
from flarewright.model import Element, Figure, Lens
from flarewright.optics.lens.surface_shape import has_rotational_symmetry, sag, seen_along, shape_table, transposed
from flarewright.optics.lens.zernike import noll_order, zernike_polynomial


def shaped(row: int = 0, **fields) -> Lens:
    a_lens = lens(TRIPLET, 5.0)
    rows = list(a_lens.rows)
    rows[row] = rows[row].replace(**fields)
    return a_lens.replace(rows=tuple(rows))


def test_noll_orders_are_those_of_his_table():
    table = [(0, 0), (1, 1), (1, -1), (2, 0), (2, -2), (2, 2), (3, -1), (3, 1), (3, -3), (3, 3), (4, 0), (4, 2)]
    table.append((4, -2))
    assert [noll_order(j) for j in range(1, 14)] == table
    assert [noll_order(j)[0] for j in (15, 16, 21, 22, 28)] == [4, 5, 5, 6, 6]


def test_zernike_terms_are_orthonormal_over_the_disc():
    """Integrals in polar coordinates: Gauss in the radius, even steps in the angle, both exact at this degree."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    r, w = 0.5 * (nodes + 1.0), 0.5 * weights
    t = 2.0 * np.pi * np.arange(32) / 32
    x, y = np.outer(r, np.cos(t)), np.outer(r, np.sin(t))
    area = np.outer(w * r, np.full(32, 2.0 / 32))
    values = [np.polynomial.polynomial.polyval2d(x, y, zernike_polynomial(j)) for j in range(1, 29)]
    gram = np.array([[(a * b * area).sum() for b in values] for a in values])
    assert np.abs(gram - np.eye(28)).max() < 1e-12
    # the sign and the axis: term 2 is tilt along x, term 3 along y
    assert zernike_polynomial(2)[1, 0] == pytest.approx(2.0)
    assert zernike_polynomial(3)[0, 1] == pytest.approx(2.0)


ROWS = {
    "sphere": {"figure": Figure()},
    "conic": {"conic": -0.8, "figure": Figure()},
    "asphere": {"conic": 0.3, "asphere": (1e-5, -2e-7, 3e-10)},
    "odd asphere": {"conic": 0.3, "asphere": (1e-5,), "odd_asphere": (2e-4, -3e-6, 0.0, 1e-10)},
    "odd asphere of a plane": {"curvature": 0.0, "odd_asphere": (2e-4,)},
    "cylinder": {"curvature_x": 0.0},
    "cylinder across": {"curvature": 0.0, "curvature_x": 0.03, "conic_x": -2.0},
    "toroid": {"curvature_x": -0.02, "conic_x": 1.5, "conic": -0.5},
    "torus": {"curvature_x": -0.02, "conic": -0.5, "torus": True},
    "torus with terms": {"curvature_x": 0.03, "conic": 0.5, "torus": True, "asphere": (1e-5, -2e-7)},
    "torus without profile": {"curvature": 0.0, "curvature_x": 0.03, "torus": True},
}


@pytest.mark.parametrize("name", ROWS)
def test_the_kernel_and_the_drawing_see_the_same_sag(name):
    a_lens = shaped(**ROWS[name])
    table = shape_table(a_lens)
    x, y = np.random.default_rng(3).uniform(-6.0, 6.0, (2, 50))
    ours = np.array([sag_of_shape(table, 0, u, v)[0] for u, v in zip(x, y, strict=True)])
    assert np.abs(ours - sag(a_lens.rows[0], x, y)).max() < 1e-14


def test_a_torus_is_its_profile_rotated_about_its_line():
    """Each point keeps the distance 1 / cx - f(y) from the line through (0, ., 1 / cx)."""
    row = shaped(curvature_x=-1.0 / 45.0, conic=-0.5, torus=True, asphere=(1e-5, -2e-7)).rows[0]
    x, y = np.random.default_rng(6).uniform(-6.0, 6.0, (2, 50))
    profile = sag(row.replace(curvature_x=0.0), np.zeros(50), y)
    np.testing.assert_allclose(np.hypot(x, sag(row, x, y) + 45.0), profile + 45.0, rtol=1e-14)
    # it leaves the biconic form in the fourth order
    biconic = row.replace(torus=False, asphere=(), conic_x=0.0)
    near, far = (float(sag(row.replace(asphere=()), at, at) - sag(biconic, at, at)) for at in np.array([0.5, 1.0]))
    assert far / near == pytest.approx(16.0, rel=1e-2)


def test_a_torus_of_equal_radii_is_a_sphere():
    row = lens(TRIPLET, 5.0).rows[0]
    x, y = np.random.default_rng(7).uniform(-6.0, 6.0, (2, 50))
    np.testing.assert_allclose(sag(row.replace(torus=True), x, y), sag(row, x, y), rtol=1e-13)


@pytest.mark.parametrize("more", [{"conic_x": 0.5}, {"odd_asphere": (1e-5,)}])
def test_a_torus_is_a_circle_across_and_has_even_terms(more):
    with pytest.raises(ProjectError, match=f"a torus .* leave out {next(iter(more))}, or torus"):
        shaped(torus=True, **more)


HEIGHTS = tuple(tuple(row) for row in np.random.default_rng(5).uniform(0.0, 1.0, (9, 9)))
FIGURES = {
    "zernike": Figure(zernike_nm=tuple((j, 300.0 * (-1) ** j) for j in range(2, 29))),
    "image": Figure(image="made up", peak_valley_nm=5000.0, heights=HEIGHTS),
}


@pytest.mark.parametrize("name", [*ROWS, *FIGURES])
def test_gradients_are_differences_of_the_sag(name):
    table = shape_table(shaped(**(ROWS[name] if name in ROWS else {"figure": FIGURES[name]})))
    h = 1e-5
    for u, v in np.random.default_rng(4).uniform(-6.0, 6.0, (30, 2)):
        _, slope_x, slope_y, room = sag_of_shape(table, 0, u, v)
        across = (sag_of_shape(table, 0, u + h, v)[0] - sag_of_shape(table, 0, u - h, v)[0]) / (2.0 * h)
        along = (sag_of_shape(table, 0, u, v + h)[0] - sag_of_shape(table, 0, u, v - h)[0]) / (2.0 * h)
        assert (slope_x, slope_y) == (pytest.approx(across, abs=2e-9), pytest.approx(along, abs=2e-9))
        assert room > 0.0


@pytest.mark.parametrize("terms", ["asphere", "odd_asphere"])
def test_an_asphere_goes_on_smoothly_beyond_its_rim(terms):
    a_lens = shaped(**{terms: (1e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-18)})
    table = shape_table(a_lens)
    at = 1.1 * a_lens.rows[0].semi_diameter
    inside, outside = (sag_of_shape(table, 0, 0.0, at * f) for f in (1.0 - 1e-9, 1.0 + 1e-9))
    assert inside[0] == pytest.approx(outside[0], abs=1e-7)
    assert inside[2] == pytest.approx(outside[2], abs=1e-6)
    assert sag_of_shape(table, 0, 0.0, 1.5 * at)[0] < sag(a_lens.rows[0], np.array(0.0), np.array(1.5 * at))


def test_an_image_lies_as_it_is_seen_from_behind_the_camera():
    heights = np.zeros((8, 8))
    heights[6, 1] = 1.0  # right, below the middle
    table = shape_table(shaped(figure=Figure(image="x", peak_valley_nm=1e4, heights=tuple(map(tuple, heights)))))
    at = np.linspace(-9, 9, 19)
    plain = sag(lens(TRIPLET, 5.0).rows[0], *np.meshgrid(at, at))
    found = np.array([[sag_of_shape(table, 0, x, y)[0] for x in at] for y in at])
    top = np.unravel_index((found - plain).argmax(), plain.shape)
    assert at[top[1]] == pytest.approx(5.0, abs=1.0)
    assert at[top[0]] == pytest.approx(-5.0, abs=1.0)
    # 1e4 nm at a knot; the smoothing spline reduces it to (2/3)^2
    assert (found - plain).max() == pytest.approx(1e-2 * 4.0 / 9.0, rel=0.2)


def test_what_is_one_of_revolution():
    assert has_rotational_symmetry(lens(TRIPLET, 5.0))
    assert shape_table(lens(TRIPLET, 5.0)) is None
    assert has_rotational_symmetry(shaped(asphere=(1e-6,)))
    assert shape_table(shaped(asphere=(1e-6,))) is not None
    assert has_rotational_symmetry(shaped(odd_asphere=(1e-6,)))
    assert shape_table(shaped(odd_asphere=(1e-6,))) is not None
    assert has_rotational_symmetry(shaped(decentre=(0.0, 0.0), tilt_deg=(0.0, 0.0)))
    assert shape_table(shaped(decentre=(0.0, 0.0))) is None
    for fields in (
        {"curvature_x": 0.0},
        {"torus": True},
        {"decentre": (0.1, 0.0)},
        {"tilt_deg": (0.0, 1.0)},
        {"figure": Figure()},
    ):
        assert not has_rotational_symmetry(shaped(**fields))
    assert not has_rotational_symmetry(
        lens(TRIPLET, 5.0).replace(elements=(Element(rows=(0, 1), decentre=(0.0, 0.1)),))
    )


def test_an_element_turns_about_its_first_vertex_and_carries_its_rows():
    a_lens = lens(TRIPLET, 5.0).replace(elements=(Element(rows=(2, 3), decentre=(0.1, 0.2), tilt_deg=(0.0, 1.0)),))
    table = shape_table(a_lens)
    sine, cosine, gap = np.sin(np.radians(1.0)), np.cos(np.radians(1.0)), a_lens.rows[2].thickness
    assert table[2, ORIGIN : ORIGIN + 3] == pytest.approx([0.1, 0.2, 0.0])
    assert table[3, ORIGIN : ORIGIN + 3] == pytest.approx([0.1 + gap * sine, 0.2, gap * (cosine - 1.0)])
    # the axis of the tilted rows points towards +x
    assert table[3, AXES + 6 : AXES + 9] == pytest.approx([sine, 0.0, cosine])


def test_a_light_sees_a_surface_from_its_own_side():
    table = shape_table(shaped(decentre=(0.3, 0.0), tilt_deg=(0.0, 2.0)))
    axes = np.array([[0.0, 1.0], [1.0, 0.0]])  # the light comes along x
    seen = seen_along(table, axes)
    assert seen[0, ORIGIN : ORIGIN + 3] == pytest.approx([0.0, 0.3, 0.0])
    assert seen[0, AXES + 6 : AXES + 9] == pytest.approx([0.0, np.sin(np.radians(2.0)), np.cos(np.radians(2.0))])


def test_meridians_change_places():
    a_lens = shaped(curvature_x=0.0, conic=0.5, conic_x=0.1, decentre=(1.0, 0.0))
    other = transposed(a_lens).rows[0]
    assert (other.curvature, other.conic, *other.meridian_x) == (0.0, 0.1, a_lens.rows[0].curvature, 0.5)
    assert other.decentre is None
    torus = transposed(shaped(curvature_x=0.02, conic=0.5, torus=True, asphere=(1e-5,))).rows[0]
    assert (torus.curvature, torus.conic, torus.asphere, torus.torus) == (0.02, 0.0, (), False)


def test_a_figure_needs_a_rim_and_an_image_that_was_read():
    with pytest.raises(LensError, match="semi-diameter"):
        shape_table(shaped(figure=Figure(zernike_nm=((5, 1.0),)), semi_diameter=None))
    with pytest.raises(LensError, match="has not been read"):
        shape_table(shaped(figure=Figure(image="a.png", peak_valley_nm=1.0)))
