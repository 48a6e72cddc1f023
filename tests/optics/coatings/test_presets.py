"""The standard coatings against their stated reflectances, computed by Rouard's summation instead of matrices."""

import numpy as np
import pytest

from flarewright.model import D65, Bare, Everywhere, Film, InTurn, QuarterWave, Standard
from flarewright.optics.coatings.presets import BROADBAND_GLASS, STANDARD_COATINGS, standard_films
from flarewright.optics.coatings.response import BAND_NM, coating_response
from flarewright.optics.coatings.thin_film import film_stack, stack_reflectance, stack_reflectance_transmittance
from flarewright.optics.colour.cie1931 import cie_1931
from flarewright.optics.colour.spectrum import spectral_power
from flarewright.optics.rays.pack import resolve_coatings
from flarewright.render.scene.resolve import load_lens

NAMES = [known.name for known in STANDARD_COATINGS]
BAND = np.linspace(*BAND_NM, 131)


def rouard(n_front, n_back, indices, thicknesses_nm, lam, angle):
    """Add the reflections of a stack film by film from the glass outwards (Rouard 1937), for s and p."""
    n = np.array([n_front, *indices, n_back])
    cos = np.sqrt(1 - (n_front * np.sin(angle) / n) ** 2 + 0j)
    out = 0.0
    for eta in (n * cos, n / cos):
        step = (eta[:-1] - eta[1:]) / (eta[:-1] + eta[1:])
        r = step[-1]
        for k in range(len(indices) - 1, -1, -1):
            phase = np.exp(4j * np.pi * n[k + 1] * thicknesses_nm[k] * cos[k + 1] / lam)
            r = (step[k] + r * phase) / (1 + step[k] * r * phase)
        out += 0.5 * abs(r) ** 2
    return out


def mean_reflectance(name, glass):
    n, d = film_stack(Standard(name=name), 1.0, glass)
    return np.mean([rouard(1.0, glass, n, d, lam, 0.0) for lam in BAND])


@pytest.mark.parametrize(
    ("name", "glass", "stated"),
    [
        ("uncoated-1930s", 1.52, 0.04258), ("uncoated-1930s", 1.80, 0.08163),
        ("single-1950s", 1.52, 0.01414), ("single-1950s", 1.80, 0.00514),
        ("early-multicoat", 1.52, 0.00118), ("early-multicoat", 1.80, 0.00171),
        ("modern-broadband", 1.52, 0.00141), ("modern-broadband", 1.80, 0.00131),
    ],
)  # fmt: skip
def test_the_mean_reflectance_that_the_docs_state(name, glass, stated):
    assert mean_reflectance(name, glass) == pytest.approx(stated, abs=1e-5)


@pytest.mark.parametrize(
    ("name", "densest", "bound"), [("early-multicoat", 1.95, 0.0045), ("modern-broadband", 2.11, 0.00145)]
)
def test_multicoatings_suit_every_glass(name, densest, bound):
    """Also between the designs, for every glass index of a catalogue."""
    assert max(mean_reflectance(name, glass) for glass in np.arange(1.42, densest, 0.0125)) < bound


def test_the_third_film_of_the_early_multicoat_ends_where_it_stops_helping():
    below, above = (standard_films("early-multicoat", glass) for glass in (1.63, 1.6301))
    assert (len(below), len(above)) == (3, 2)
    at_centre = [
        stack_reflectance(1.0, 1.63, [f.index for f in films], [f.thickness_nm for f in films], 530.0, 1.0)
        for films in (below, above)
    ]
    assert at_centre[0] == pytest.approx(at_centre[1], rel=0.05)


def test_the_modern_one_is_flat_over_the_band_where_the_early_one_is_not():
    for glass in (1.52, 1.65, 1.8, 1.95):
        worst = {}
        for name in ("early-multicoat", "modern-broadband"):
            n, d = film_stack(Standard(name=name), 1.0, glass)
            worst[name] = max(rouard(1.0, glass, n, d, lam, 0.0) for lam in BAND)
        assert worst["modern-broadband"] < 0.0065
        assert worst["early-multicoat"] > 1.2 * worst["modern-broadband"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("glass", [1.49, 1.7, 1.92])
def test_matrices_agree_with_rouard_and_lose_no_light(name, glass):
    n, d = film_stack(Standard(name=name), 1.0, glass)
    for lam in (400.0, 530.0, 690.0):
        for angle in np.radians([0.0, 20.0, 45.0, 75.0]):
            R, T = stack_reflectance_transmittance(1.0, glass, n, d, lam, np.cos(angle))
            assert 0.5 * (R[0] + R[1]) == pytest.approx(rouard(1.0, glass, n, d, lam, angle), abs=1e-13)
            np.testing.assert_allclose(R + T, 1.0, atol=1e-12)


@pytest.mark.parametrize("glass", [1.46, 1.52, 1.8])
def test_a_quarter_wave_at_its_centre_is_the_formula(glass):
    n, d = film_stack(Standard(name="single-1950s"), 1.0, glass)
    expected = ((glass - 1.38**2) / (glass + 1.38**2)) ** 2
    assert stack_reflectance(1.0, glass, n, d, 550.0, 1.0) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("glass", [1.46, 1.52, 1.65, 1.8, 2.0])
def test_at_its_centre_the_early_multicoat_has_no_half_wave(glass):
    n, d = film_stack(Standard(name="early-multicoat"), 1.0, glass)
    Y = n[0] ** 2 * glass / n[2] ** 2 if len(n) == 3 else n[0] ** 2 / glass
    assert stack_reflectance(1.0, glass, n, d, 530.0, 1.0) == pytest.approx(((1 - Y) / (1 + Y)) ** 2, abs=1e-12)


@pytest.mark.parametrize("name", ["single-1950s", "early-multicoat", "modern-broadband"])
def test_thicker_films_move_the_curve_to_longer_wavelengths(name):
    """Films of one index at all wavelengths depend only on thickness over wavelength."""
    as_is, thicker = film_stack(Standard(name=name), 1.0, 1.7), film_stack(Standard(name=name, thickness=1.1), 1.0, 1.7)
    wave = np.linspace(400.0, 700.0, 31)
    expected = stack_reflectance(1.0, 1.7, *as_is, wave, 0.9)
    np.testing.assert_allclose(stack_reflectance(1.0, 1.7, *thicker, 1.1 * wave, 0.9), expected, rtol=1e-9)


def test_coatings_in_turn_skip_what_is_cemented():
    lens = load_lens("heliar-tronnier")
    deck = (Standard(name="single-1950s"), Bare(), QuarterWave(center_wavelength_nm=450.0))
    dealt = resolve_coatings(lens, InTurn(coatings=deck))
    everywhere = resolve_coatings(lens, Everywhere(coating=deck[0]))
    air = [k for k, coating in enumerate(everywhere) if coating is not None]
    assert [dealt[k] for k in air] == [deck[k % 3] for k in range(len(air))]
    assert all(dealt[k] is None for k in range(len(lens.rows)) if k not in air)


def test_films_run_from_the_air_whichever_way_the_light_goes():
    front = film_stack(Standard(name="modern-broadband"), 1.0, 1.7)
    back = film_stack(Standard(name="modern-broadband"), 1.7, 1.0)
    assert (front[0][::-1], front[1][::-1]) == back
    assert front[0][0] == 1.38


def test_designs_beyond_the_table_stay_the_last_ones():
    for outside, last in ((1.3, BROADBAND_GLASS[0]), (2.4, BROADBAND_GLASS[-1])):
        assert standard_films("modern-broadband", outside) == standard_films("modern-broadband", last)


def test_each_glass_of_a_lens_gets_its_own_design_and_cemented_surfaces_none():
    lens = load_lens("heliar-tronnier")
    coatings = resolve_coatings(lens, Everywhere(coating=Standard(name="modern-broadband")))
    cemented = [k for k in range(1, len(lens.rows)) if coatings[k] is None and k != lens.stop_row]
    assert cemented
    assert coatings[0] == Standard(name="modern-broadband")


def test_the_response_adds_up():
    response = coating_response(Standard(name="single-1950s"), 1.52, 1.52, [0.0, 40.0])
    n, d = film_stack(Standard(name="single-1950s"), 1.0, 1.52)
    direct = stack_reflectance(1.0, 1.52, n, d, response.wavelengths_nm, np.cos(np.radians(40.0)))
    np.testing.assert_allclose(response.reflectance[1], direct, rtol=1e-14)
    # the luminous reflectance is a mean of R, so it lies between its extremes
    assert response.reflectance[0].min() < response.luminous_reflectance[0] < response.reflectance[0].max()
    # bare glass of constant index reflects white
    bare = coating_response(None, 1.52, 1.52, 0.0)
    np.testing.assert_allclose(bare.rgb, (0.52 / 2.52) ** 2, rtol=2e-3)


def test_the_response_of_a_cemented_surface():
    """By Fresnel, two glasses of nearly one index reflect almost nothing; a film between them reflects more."""
    bare = coating_response(None, 1.62, 1.62, 0.0, (1.60, 1.60))
    np.testing.assert_allclose(bare.reflectance, (0.02 / 3.22) ** 2, rtol=1e-12)
    film = coating_response(Film(index=1.38, thickness_nm=100.0), 1.62, 1.62, 0.0, (1.60, 1.60))
    assert film.luminous_reflectance[0] > 100.0 * bare.luminous_reflectance[0]


def test_the_colour_of_a_coating_is_rec709_in_each_channel():
    """Direct sum: CIE 15 from R and daylight, then the matrix of IEC 61966-2-1."""
    response = coating_response(Standard(name="single-1950s"), 1.52, 1.52, [0.0, 40.0])
    wave = response.wavelengths_nm
    white = spectral_power(D65(), wave)[:, None] * cie_1931(wave)
    xyz = response.reflectance @ white / white[:, 1].sum()
    printed = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    np.testing.assert_allclose(response.rgb, xyz @ printed.T, rtol=3e-3)
    # the film's reflection is purple
    red, green, blue = response.rgb[0]
    assert min(red, blue) > 1.1 * green
