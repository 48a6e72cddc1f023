"""Fresnel and thin films: the checks of physics.md, and a comparison with `tmm`."""

from __future__ import annotations

import math

import numpy as np
import pytest
import tmm
from hypothesis import given, settings
from hypothesis import strategies as st

from flarewright.errors import FlarewrightError
from flarewright.model import Bare, Film, QuarterWave, Stack
from flarewright.optics.coatings.thin_film import (
    film_stack,
    reflectance_table,
    stack_reflectance,
    stack_reflectance_transmittance,
)

index = st.floats(1.0, 2.5)
films = st.lists(st.tuples(st.floats(1.0, 4.0), st.floats(0.0, 2000.0)), max_size=6)
wavelength = st.floats(360.0, 830.0)
cosine = st.floats(0.0, 1.0)


def fresnel(n1, n2, c1):
    """Hullin section 3.1, with total reflection."""
    s2 = n1 / n2 * np.sqrt(1 - c1 * c1)
    if s2 >= 1:
        return 1.0
    c2 = np.sqrt(1 - s2 * s2)
    rs = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2)
    rp = (n1 * c2 - n2 * c1) / (n1 * c2 + n2 * c1)
    return 0.5 * (rs * rs + rp * rp)


def one_film(n0, n1, n2, d, lam, c0):
    """Airy's formula of physics.md, both polarisations."""
    c1, c2 = (np.sqrt(1 - (n0 / n) ** 2 * (1 - c0 * c0) + 0j) for n in (n1, n2))
    phase = np.exp(2j * 2 * np.pi * n1 * d * c1 / lam)

    def r(a, b):
        return (a - b) / (a + b)

    out = 0.0
    for r01, r12 in (
        (r(n0 * c0, n1 * c1), r(n1 * c1, n2 * c2)),
        (r(n1 * c0, n0 * c1), r(n2 * c1, n1 * c2)),
    ):
        out += 0.5 * abs((r01 + r12 * phase) / (1 + r01 * r12 * phase)) ** 2
    return out


def test_quarter_wave_of_magnesium_fluoride_at_532_nm_is_96_4_nm():
    n, d = film_stack(QuarterWave(center_wavelength_nm=532), 1.0, 1.5)
    assert n == (1.38,)
    assert d[0] == pytest.approx(96.4, abs=0.05)


def test_hullin_figure_4_minimum_of_that_film():
    n, d = film_stack(QuarterWave(center_wavelength_nm=532), 1.0, 1.5)
    expected = ((1.5 - 1.38**2) / (1.5 + 1.38**2)) ** 2
    assert stack_reflectance(1.0, 1.5, n, d, 532.0, 1.0) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("n0", "n2"), [(1.0, 1.5), (1.5, 1.0), (1.62, 1.75)])
def test_an_ideal_quarter_wave_reflects_nothing_at_its_centre(n0, n2):
    n, d = film_stack(QuarterWave(center_wavelength_nm=550, index="ideal"), n0, n2)
    assert n[0] == pytest.approx(math.sqrt(n0 * n2))
    assert stack_reflectance(n0, n2, n, d, 550.0, 1.0) < 1e-30
    assert stack_reflectance(n0, n2, n, d, 450.0, 1.0) > 1e-6


def test_film_stack_of_each_coating():
    assert film_stack(None, 1.0, 1.5) == ((), ())
    assert film_stack(Bare(), 1.0, 1.5) == ((), ())
    assert film_stack(Film(index=1.7, thickness_nm=80), 1.0, 1.5) == ((1.7,), (80.0,))
    assert film_stack(QuarterWave(center_wavelength_nm=600, index=1.5), 1.0, 2.0) == ((1.5,), (100.0,))
    n, d = film_stack(QuarterWave(center_wavelength_nm=600, index=1.5, thickness_offset_nm=12), 1.0, 2.0)
    assert (n, d) == ((1.5,), (112.0,))
    assert film_stack(QuarterWave(center_wavelength_nm=600), 1.9, 1.8)[0][0] == pytest.approx(math.sqrt(1.9 * 1.8))


def test_a_stack_is_listed_from_the_lower_index():
    stack = Stack(layers=(Film(index=1.38, thickness_nm=90), Film(index=2.1, thickness_nm=130)))
    assert film_stack(stack, 1.0, 1.5) == ((1.38, 2.1), (90.0, 130.0))
    assert film_stack(stack, 1.5, 1.0) == ((2.1, 1.38), (130.0, 90.0))


def test_an_offset_that_eats_the_film_is_refused():
    with pytest.raises(FlarewrightError, match="thickness_offset_nm -200"):
        film_stack(QuarterWave(center_wavelength_nm=500, thickness_offset_nm=-200), 1.0, 1.5)


@settings(max_examples=100, deadline=None)
@given(index, index, films, wavelength, cosine)
def test_no_light_is_lost(n0, n2, stack, lam, c):
    n, d = [f[0] for f in stack], [f[1] for f in stack]
    R, T = stack_reflectance_transmittance(n0, n2, n, d, lam, c)
    np.testing.assert_allclose(R + T, 1.0, rtol=0, atol=1e-9)
    assert np.all((R >= 0) & (T >= 0))


@settings(max_examples=80, deadline=None)
@given(index, index, films, wavelength, st.floats(1e-4, 1.0))
def test_a_stack_is_the_same_from_both_sides_at_one_snell_invariant(n0, n2, stack, lam, c0):
    sine = n0 * math.sqrt(1 - c0 * c0) / n2
    if sine >= 1.0:
        return
    c2 = math.sqrt(1 - sine * sine)
    n, d = [f[0] for f in stack], [f[1] for f in stack]
    forward = stack_reflectance_transmittance(n0, n2, n, d, lam, c0)
    backward = stack_reflectance_transmittance(n2, n0, n[::-1], d[::-1], lam, c2)
    # near grazing, the cosine behind has the rounding error of 1 - sin^2, so the bound is loose
    np.testing.assert_allclose(forward, backward, rtol=0, atol=1e-8 / min(c0, c2))


@settings(max_examples=60, deadline=None)
@given(index, index, cosine)
def test_no_film_is_fresnel(n0, n2, c):
    if n0 == n2:
        return
    assert stack_reflectance(n0, n2, (), (), 550.0, c) == pytest.approx(fresnel(n0, n2, c), abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(index, index, st.floats(1.0, 3.0), st.floats(0.0, 500.0), wavelength, st.floats(0.01, 1.0))
def test_one_film_is_airys_formula(n0, n2, n1, d, lam, c):
    assert stack_reflectance(n0, n2, (n1,), (d,), lam, c) == pytest.approx(one_film(n0, n1, n2, d, lam, c), abs=1e-9)


@pytest.mark.parametrize("stacks", [300, pytest.param(1500, marks=pytest.mark.slow)])
def test_agrees_with_tmm(stacks):
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(stacks):
        count = rng.integers(0, 7)
        n0, n2 = rng.uniform(1.0, 2.2, 2)
        n, d = rng.uniform(1.0, 2.6, count), rng.uniform(0.0, 400.0, count)
        lam, angle = rng.uniform(380.0, 780.0), rng.uniform(0.0, math.radians(89.5))
        R, T = stack_reflectance_transmittance(n0, n2, n, d, lam, math.cos(angle))
        for k, polarisation in enumerate("sp"):
            other = tmm.coh_tmm(polarisation, [n0, *n, n2], [math.inf, *d, math.inf], angle, lam)
            worst = max(worst, abs(R[k] - other["R"]))
            if n0 * math.sin(angle) < n2:
                worst = max(worst, abs(T[k] - other["T"]))
    assert worst < 1e-12


def test_films_thinner_than_the_evanescent_wave_let_light_tunnel():
    _, T = stack_reflectance_transmittance(1.5, 1.5, (1.0,), (50.0,), 550.0, math.cos(math.radians(60)))
    other = tmm.coh_tmm("p", [1.5, 1.0, 1.5], [math.inf, 50.0, math.inf], math.radians(60), 550.0)
    assert 0.1 < T[1] < 0.99
    assert T[1] == pytest.approx(other["T"], abs=1e-12)


def test_very_thick_evanescent_films_do_not_overflow():
    R, T = stack_reflectance_transmittance(4.0, 4.0, (1.0,) * 50, (20000.0,) * 50, 360.0, 0.1)
    np.testing.assert_allclose(R, 1.0, atol=1e-12)
    np.testing.assert_array_equal(T, 0.0)


def test_total_reflection_and_grazing():
    assert stack_reflectance(1.8, 1.0, (1.38,), (96.4,), 532.0, 0.3) == pytest.approx(1.0, abs=1e-14)
    assert stack_reflectance(1.0, 1.5, (), (), 532.0, 0.0) == 1.0
    assert stack_reflectance(1.5, 1.5, (), (), 532.0, 0.0) == 0.0


def test_arrays_broadcast():
    lam = np.linspace(400, 700, 5)[:, None]
    c = np.linspace(0, 1, 7)
    R = stack_reflectance(1.0, 1.6, (1.38, 2.0), (90.0, 50.0), lam, c)
    assert R.shape == (5, 7)
    assert R[2, 3] == stack_reflectance(1.0, 1.6, (1.38, 2.0), (90.0, 50.0), lam[2, 0], c[3])


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ((1.0, 1.5, (), (), 500.0, 1.1), "cos_front"),
        ((1.0, 1.5, (), (), 500.0, -0.1), "cos_front"),
        ((1.0, 1.5, (), (), 500.0, math.nan), "cos_front"),
        ((1.0, 1.5, (), (), 0.0, 1.0), "positive"),
        ((1.0, -1.5, (), (), 500.0, 1.0), "positive"),
        ((1.0, 1.5, (1.4,), (), 500.0, 1.0), "1 film indices but 0"),
        ((1.0, 1.5, (1.4,), (-1.0,), 500.0, 1.0), "not negative"),
    ],
)
def test_nothing_is_clamped_silently(args, words):
    with pytest.raises(ValueError, match=words):
        stack_reflectance(*args)


def hullin_supplement(theta1, lam, d, n1, n2, n3):
    """The shader of the supplement as public codes copy it, with its errors."""
    theta2, theta3 = math.asin(math.sin(theta1) * n1 / n2), math.asin(math.sin(theta1) * n1 / n3)
    rs01 = -math.sin(theta1 - theta2) / math.sin(theta1 + theta2)
    rp01 = math.tan(theta1 - theta2) / math.tan(theta1 + theta2)
    ts01 = 2 * math.sin(theta2) * math.cos(theta1) / math.sin(theta1 + theta2)
    tp01 = ts01 * math.cos(theta1 - theta2)
    rs12 = -math.sin(theta2 - theta3) / math.sin(theta2 + theta3)
    rp12 = math.tan(theta2 - theta3) / math.tan(theta2 + theta3)
    ris, rip = ts01 * ts01 * rs12, tp01 * tp01 * rp12
    dy = d * n2
    dx = math.tan(theta2) * dy
    relative = 4 * math.pi / lam * (math.hypot(dx, dy) - dx * math.sin(theta1))
    s = rs01**2 + ris**2 + 2 * rs01 * ris * math.cos(relative)
    p = rp01**2 + rip**2 + 2 * rp01 * rip * math.cos(relative)
    return 0.5 * (s + p)


@pytest.mark.parametrize("glass", [1.5, 1.6, 1.7])
@pytest.mark.parametrize("degrees", [0.1, 20.0, 30.0])
def test_the_copied_shader_reflects_too_much(glass, degrees):
    """The papers' shader is wrong by factors; our matrix value agrees with Airy's formula."""
    theta, d = math.radians(degrees), 532 / (4 * 1.38)
    ours = float(stack_reflectance(1.0, glass, (1.38,), (d,), 532.0, math.cos(theta)))
    assert ours == pytest.approx(one_film(1.0, 1.38, glass, d, 532.0, math.cos(theta)), rel=1e-10)
    assert 1.2 < hullin_supplement(theta, 532.0, d, 1.0, 1.38, glass) / ours < 2.7


@pytest.mark.parametrize(
    ("n0", "n2", "coating", "bound"),
    [
        (1.0, 1.5168, None, 1e-5),
        (1.8, 1.0, None, 1e-5),
        (1.52, 1.75, None, 1e-5),
        (1.0, 1.5168, QuarterWave(center_wavelength_nm=532), 1e-5),
        (1.7, 1.0, QuarterWave(center_wavelength_nm=430), 1e-5),
        (1.0, 1.6, Stack(layers=(Film(index=1.38, thickness_nm=96), Film(index=2.0, thickness_nm=130))), 5e-5),
    ],
)
@pytest.mark.parametrize("lam", [400.0, 550.0, 700.0])
def test_linear_interpolation_in_the_table(n0, n2, coating, bound, lam):
    n, d = film_stack(coating, n0, n2)
    table = reflectance_table(n0, n2, n, d, lam)
    assert table.shape == (1025,)
    c = np.random.default_rng(1).uniform(0.0, 1.0, 4000)
    low, high, films = (n0, n2, slice(None)) if n0 < n2 else (n2, n0, slice(None, None, -1))
    direct = stack_reflectance(low, high, n[films], d[films], lam, c)
    looked_up = np.interp(c, np.linspace(0, 1, 1025), table)
    assert np.max(np.abs(looked_up / direct - 1)) < bound


@pytest.mark.parametrize("lam", [450.0, 550.0, 650.0])
def test_the_table_where_a_film_extinguishes_the_reflection(lam):
    n, d = film_stack(QuarterWave(center_wavelength_nm=550, index="ideal"), 1.0, 1.7)
    c = np.random.default_rng(1).uniform(0.0, 1.0, 4000)
    looked_up = np.interp(c, np.linspace(0, 1, 1025), reflectance_table(1.0, 1.7, n, d, lam))
    assert np.max(np.abs(looked_up - stack_reflectance(1.0, 1.7, n, d, lam, c))) < 1e-5


def test_table_from_both_directions():
    n, d = film_stack(QuarterWave(center_wavelength_nm=532), 1.0, 1.6)
    table = reflectance_table(1.0, 1.6, n, d, 500.0)
    np.testing.assert_allclose(table, reflectance_table(1.6, 1.0, n, d, 500.0), rtol=1e-13)
    # a ray inside the glass looks up the cosine that it has in air
    c_glass = 0.95
    c_air = math.sqrt(1 - 1.6**2 * (1 - c_glass**2))
    inside = stack_reflectance(1.6, 1.0, n, d, 500.0, c_glass)
    assert np.interp(c_air, np.linspace(0, 1, 1025), table) == pytest.approx(float(inside), rel=1e-5)


def test_table_of_nothing_is_zero_and_needs_two_samples():
    assert not reflectance_table(1.5, 1.5, (), (), 500.0).any()
    with pytest.raises(ValueError, match="at least 2"):
        reflectance_table(1.0, 1.5, (), (), 500.0, samples=1)
