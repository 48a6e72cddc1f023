"""Gauss wavelengths: exact for polynomials, and for coated flare equal to 31 even wavelengths."""

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.model import D65, BlackBody, Camera, Everywhere, Light, Lines, Output, Project, Quality, QuarterWave
from flarewright.model.project.light import Tabulated
from flarewright.optics.colour.cie1931 import cie_1931
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.optics.colour.spectrum import band_weights, spectral_power
from flarewright.predict.lens_flare import luminous, statistics_quality
from flarewright.predict.wavelengths import luminous_lines
from flarewright.render.render import render

NM = np.arange(360.0, 831.0)


@pytest.mark.parametrize("spectrum", [D65(), BlackBody(temperature_k=2800.0)])
@pytest.mark.parametrize("count", [1, 3, 5, 9])
def test_polynomials_up_to_twice_the_nodes_are_exact(spectrum, count):
    lines = luminous_lines(spectrum, count).lines
    nodes, power = np.array(lines).T
    weights = power * cie_1931(nodes)[:, 1]
    assert weights.sum() == pytest.approx(1.0)
    light = spectral_power(spectrum, NM) * cie_1931(NM)[:, 1]
    for degree in range(2 * count):
        expected = (light * ((NM - 555.0) / 100.0) ** degree).sum() / light.sum()
        found = (weights * ((nodes - 555.0) / 100.0) ** degree).sum()
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-10)


def test_the_renderer_weighs_the_lines_as_gauss_does():
    lines = luminous_lines(D65(), 5)
    nodes, power = np.array(lines.lines).T
    luminance = band_weights(lines, nodes, "rec709") @ luminance_weights("rec709")
    np.testing.assert_allclose(luminance, power * cie_1931(nodes)[:, 1], rtol=1e-9)


def test_few_lines_stay_as_they_are_and_many_are_gathered():
    sodium = Lines(lines=((589.0, 2.0), (589.6, 1.0)))
    assert luminous_lines(sodium, 5) == sodium
    comb = Lines(lines=tuple((float(nm), 1.0) for nm in range(420, 700, 10)))
    assert len(luminous_lines(comb, 4).lines) == 4
    table = Tabulated(wavelength_nm=(400.0, 550.0, 700.0), power=(0.0, 1.0, 0.0))
    assert len(luminous_lines(table, 4).lines) == 4


@pytest.mark.parametrize(
    "dark",
    [
        Tabulated(wavelength_nm=(1200.0, 1300.0), power=(1.0, 1.0)),
        Tabulated(wavelength_nm=(500.0, 600.0), power=(0.0, 0.0)),
        Lines(lines=((589.0, 0.0),)),
    ],
)
def test_a_spectrum_without_visible_light_is_refused(dark):
    with pytest.raises(FlarewrightError, match="has no visible light; give it power between 380 and 780 nm"):
        luminous_lines(dark, 5)


def test_narrow_and_strong_tables_have_their_lines():
    narrow = Tabulated(wavelength_nm=(554.5, 555.5), power=(1.0, 1.0))
    assert luminous_lines(narrow, 5).lines == (pytest.approx((555.0, 1.0 / cie_1931(555.0)[1])),)
    weak, strong = (Tabulated(wavelength_nm=(400.0, 700.0), power=(power, power)) for power in (1.0, 1e308))
    assert luminous_lines(strong, 5) == luminous_lines(weak, 5)


def test_flare_of_a_quarter_wave_is_that_of_31_even_wavelengths():
    """Three even wavelengths make it brighter: they are where this coating reflects most."""
    project = Project(
        lens="triplet-pestrecov", f_number=5.6, coating=Everywhere(coating=QuarterWave(center_wavelength_nm=550.0)),
        lights=(Light(field_deg=(12.0, 3.0)),), camera=Camera(size_px=(48, 32), sensor_mm=(36.0, 24.0)),
        output=Output(starburst=False),
    )  # fmt: skip
    # rings move light within the picture
    even = Quality(wavelengths=31, bridge=False, ringing="off")

    def mean(given):
        return float((render(given).layers[0].pixels.astype(float) @ luminance_weights("rec709")).mean())

    truth = mean(project.replace(quality=even))
    assert mean(luminous(project, statistics_quality("final"))) == pytest.approx(truth, rel=0.015)
    assert mean(project.replace(quality=even.replace(wavelengths=3))) > 1.1 * truth
