"""Spectra and colour: known chromaticities, white, sums that do not depend on the sampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flarewright.errors import FlarewrightError
from flarewright.model import D65, BlackBody, EqualEnergy, Lines, Tabulated
from flarewright.optics.colour.rgb import xyz_to_rgb_matrix
from flarewright.optics.colour.spectrum import (
    band_weights,
    cie_1931,
    cubics,
    planck,
    sampled_wavelengths,
    spectral_power,
    spectrum_xyz,
    traced_wavelengths,
)

SODIUM = Lines(lines=((588.995, 2.0), (589.592, 1.0)))


def xy(spectrum):
    xyz = spectrum_xyz(spectrum)
    return xyz[:2] / xyz.sum()


def test_chromaticities_of_known_lights():
    np.testing.assert_allclose(xy(D65()), (0.31272, 0.32903), atol=2e-5)
    np.testing.assert_allclose(xy(EqualEnergy()), (1 / 3, 1 / 3), atol=5e-5)
    # illuminant A is 2856 K on today's temperature scale to 0.1 K
    np.testing.assert_allclose(xy(BlackBody(temperature_k=2855.54)), (0.44758, 0.40745), atol=3e-5)
    # the Planckian locus passes 0.003 below the daylight locus at 6504 K
    np.testing.assert_allclose(xy(BlackBody(temperature_k=6504)), (0.3135, 0.3236), atol=2e-4)
    np.testing.assert_allclose(xy(SODIUM), (0.5704, 0.4290), atol=1e-4)


def test_white_is_one_in_both_spaces():
    for space in ("rec709", "acescg"):
        rgb = band_weights(D65(), traced_wavelengths(7), space).sum(axis=0)
        np.testing.assert_allclose(rgb, 1.0, atol=1e-3)


def test_every_light_has_luminance_one():
    Y = np.linalg.inv(xyz_to_rgb_matrix("rec709"))[1]
    for light in (D65(), EqualEnergy(), BlackBody(temperature_k=500), BlackBody(temperature_k=1e5), SODIUM):
        assert Y @ band_weights(light, [450, 540, 610], "rec709").sum(axis=0) == pytest.approx(1.0, abs=1e-12)


@settings(deadline=None)
@given(st.integers(1, 81), st.sampled_from([D65(), BlackBody(temperature_k=3000), SODIUM]))
def test_the_sum_does_not_depend_on_the_sampling(count, light):
    fine = band_weights(light, np.arange(360, 831, 5), "acescg").sum(axis=0)
    np.testing.assert_allclose(band_weights(light, traced_wavelengths(count), "acescg").sum(axis=0), fine, atol=1e-12)


def test_dense_samples_integrate_what_steep_films_reflect():
    """Two broadband films of a Flektogon reflect 13 times as much at 400 nm as at 420."""
    nodes, fine = sampled_wavelengths(1, D65()), np.arange(360.0, 830.5, 0.5)

    def light(wave, **how):
        return np.exp(-0.13 * np.clip(wave - 395.0, 0.0, None)) @ band_weights(D65(), wave, "rec709", **how)

    exact = light(fine)
    assert np.abs(light(nodes, cubic=True) - exact).max() < 0.006 * exact.max()
    assert np.abs(light(nodes) - exact).max() > 0.02 * exact.max()


def test_weights_integrate_what_is_linear_between_the_nodes():
    nodes = traced_wavelengths(5)
    slope = np.interp(np.arange(360, 831), nodes, nodes)
    direct = slope @ band_weights(EqualEnergy(), np.arange(360, 831), "rec709")
    np.testing.assert_allclose(nodes @ band_weights(EqualEnergy(), nodes, "rec709"), direct, rtol=1e-12)


def test_a_line_is_split_between_its_neighbours_only():
    w = band_weights(Lines(lines=((560.0, 3.0),)), [500.0, 550.0, 600.0, 650.0], "rec709")
    assert not w[0].any()
    assert not w[3].any()
    np.testing.assert_allclose(w[1], 4 * w[2], rtol=1e-12)


def test_saturated_light_keeps_its_negatives():
    assert band_weights(Lines(lines=((500.0, 1.0),)), [500.0], "rec709")[0, 0] < -0.5


def test_traced_wavelengths():
    np.testing.assert_allclose(traced_wavelengths(31), np.arange(400, 701, 10))
    np.testing.assert_array_equal(traced_wavelengths(1), [550.0])
    np.testing.assert_array_equal(traced_wavelengths(3), [450, 540, 610])
    np.testing.assert_array_equal(traced_wavelengths(7, SODIUM), [588.995, 589.592])
    assert len(traced_wavelengths(1, SODIUM)) == 1
    for n in (4, 7, 15, 81):
        nodes = traced_wavelengths(n)
        assert len(nodes) == n
        np.testing.assert_allclose(np.diff(nodes), 310 / n)
    with pytest.raises(ValueError, match="at least one"):
        traced_wavelengths(0)


def test_cubic_interpolation_of_the_colour_matching_functions():
    # ISO/CIE 11664-1 table 1 at wavelengths that the 5 nm table lacks
    np.testing.assert_allclose(cie_1931(555.0), (0.5120501, 1.0000000, 0.0057499990), atol=1e-6)
    np.testing.assert_allclose(cie_1931(589.0), (1.0180064, 0.7691547, 0.0011467), atol=1e-4)
    np.testing.assert_allclose(cie_1931(463.0), (0.2689178, 0.06804208, 1.5960223), atol=1.5e-3)
    assert not cie_1931([359.0, 831.0]).any()


@pytest.mark.parametrize("lines", [((435.83, 1.0), (546.07, 1.0)), ((435.5, 1.0),), ((589.592, 1.0),)])
def test_a_fine_table_holds_lines_between_whole_nanometres(lines):
    """A table in steps of 0.05 nm is as bright and has the colour of its lines, wherever they lie."""
    wave = np.arange(380.0, 780.0, 0.05)
    power = sum(part * np.exp(-0.5 * ((wave - nm) / 0.1) ** 2) for nm, part in lines)
    table = Tabulated(wavelength_nm=tuple(wave), power=tuple(power))
    np.testing.assert_allclose(spectrum_xyz(table), spectrum_xyz(Lines(lines=lines)), rtol=2e-3)
    # where it is even, a table has the colours of one in coarse steps, of which the ends count half a nanometre more
    even = Tabulated(wavelength_nm=(400.0, 400.25, 700.0), power=(1.0, 1.0, 1.0))
    coarse = Tabulated(wavelength_nm=(400.0, 700.0), power=(1.0, 1.0))
    np.testing.assert_allclose(spectrum_xyz(even), spectrum_xyz(coarse), rtol=1e-3)


def test_planck():
    # Stefan-Boltzmann: the integral of the radiance is sigma T^4 / pi.
    nm = np.geomspace(50, 1e6, 200000)
    L = planck(nm, 3000.0)
    assert np.sum((L[1:] + L[:-1]) * np.diff(nm)) / 2 == pytest.approx(5.670374e-8 * 3000**4 / np.pi, rel=1e-5)
    assert nm[np.argmax(L)] == pytest.approx(2.897771955e6 / 3000, rel=1e-3)


def test_spectral_power():
    assert spectral_power(D65(), 560.0) == 100.0
    assert spectral_power(EqualEnergy(), [1.0, 2.0]).tolist() == [1.0, 1.0]
    table = Tabulated(wavelength_nm=(500, 600), power=(0, 2))
    np.testing.assert_allclose(spectral_power(table, [400, 550, 600, 601]), [0, 1, 2, 0])
    with pytest.raises(ValueError, match="per nm"):
        spectral_power(SODIUM, 589.0)


@pytest.mark.parametrize(
    "dark",
    [
        Tabulated(wavelength_nm=(900, 1000), power=(1, 1)),
        Lines(lines=((500.0, 0.0),)),
        Tabulated(wavelength_nm=(400, 700), power=(0, 0)),
    ],
)
def test_a_light_without_visible_power_is_refused(dark):
    with pytest.raises(FlarewrightError, match="no visible light"):
        band_weights(dark, [550.0], "rec709")


def test_unordered_wavelengths_are_refused():
    with pytest.raises(ValueError, match="rise"):
        band_weights(D65(), [600.0, 500.0], "rec709")


def test_matrices():
    np.testing.assert_allclose(
        xyz_to_rgb_matrix("rec709"),
        [[3.2410, -1.5374, -0.4986], [-0.9692, 1.8760, 0.0416], [0.0556, -0.2040, 1.0570]],
        atol=2e-4,
    )
    rec709_to_acescg = xyz_to_rgb_matrix("acescg") @ np.linalg.inv(xyz_to_rgb_matrix("rec709"))
    np.testing.assert_allclose(
        rec709_to_acescg,
        [[0.61310, 0.33952, 0.04738], [0.07019, 0.91635, 0.01345], [0.02062, 0.10957, 0.86981]],
        atol=2e-5,
    )
    with pytest.raises(ValueError, match="unknown"):
        xyz_to_rgb_matrix("bt2020")


@pytest.mark.parametrize("count", [3, 4])
def test_lines_are_traced_at_themselves_where_they_are_no_more_than_the_wavelengths(count):
    mercury = Lines(lines=((578.0, 0.5), (435.833, 1.0), (546.074, 1.0), (400.0, 0.0)))
    assert traced_wavelengths(count, mercury).tolist() == [435.833, 546.074, 578.0]
    # with one wavelength fewer than lines, wavelengths represent ranges again
    assert traced_wavelengths(2, mercury).tolist() == traced_wavelengths(2).tolist()


def test_cubics_reproduce_cubic_curves_and_are_constant_beyond():
    nodes = np.array([360.0, 362.5, 366.0, 370.0, 372.5, 380.0])
    places = np.linspace(355.0, 385.0, 61)
    weights = cubics(places, nodes)
    inside = np.clip(places, nodes[0], nodes[-1])
    for power in range(4):
        np.testing.assert_allclose(((nodes - 370.0) ** power) @ weights, (inside - 370.0) ** power, atol=1e-9)
    assert ((weights != 0.0).sum(axis=0) <= 4).all()
    # too few nodes for a cubic: lines
    assert cubics(np.array([1.25]), [1.0, 2.0]).ravel().tolist() == [0.75, 0.25]
    with pytest.raises(ValueError, match="rise"):
        cubics(places, nodes[::-1])
