"""Smooth spectra of colours: the round trip from RGB to RGB."""

import numpy as np
import pytest

from flarewright.model import D65, Rgb
from flarewright.optics.colour.rgb_to_spectrum import uplift
from flarewright.optics.colour.spectrum import band_weights, spectral_power, traced_wavelengths

CORNERS = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)]
RANDOM = np.random.default_rng(7).random((40, 3)) ** 2


@pytest.mark.parametrize("rgb", [*CORNERS, (1.0, 0.6, 0.2), (0.02, 0.3, 5.0), *map(tuple, RANDOM)])
def test_a_colour_comes_back(rgb):
    nodes = traced_wavelengths(31)
    found = band_weights(Rgb(rgb=rgb), nodes, "rec709").sum(axis=0)
    wanted = np.array(rgb) / (np.array(rgb) @ [0.2126390059, 0.7151686788, 0.0721923154])
    # the D65 table differs slightly from the white of Rec.709, which is rounded to four digits
    assert found == pytest.approx(wanted, abs=3e-4 * wanted.max())


def test_white_is_d65_and_scale_does_not_matter():
    wave = np.arange(380.0, 781.0)
    white = spectral_power(Rgb(rgb=(3.0, 3.0, 3.0)), wave)
    assert white / white.max() == pytest.approx(spectral_power(D65(), wave) / spectral_power(D65(), wave).max())
    assert uplift((0.2, 0.4, 0.1)) == pytest.approx(uplift((2.0, 4.0, 1.0)), rel=1e-9)


@pytest.mark.parametrize("rgb", [(1.0, 0.5, 0.1), (0.3, 0.3, 1.0), (0.5, 1.0, 0.4)])
def test_spectra_are_smooth_and_never_below_zero(rgb):
    """Over 50 nm the curve on top of D65 changes by less than half: it has no lines."""
    wave = np.arange(400.0, 701.0)
    curve = spectral_power(Rgb(rgb=rgb), wave) / spectral_power(D65(), wave)
    assert curve.min() >= 0.0
    assert np.abs(curve[50:] - curve[:-50]).max() < 0.5
