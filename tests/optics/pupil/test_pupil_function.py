"""The wave behind the pupil: effect of an image of the opening on light and on amplitude."""

import numpy as np
import pytest

from flarewright.model import Iris
from flarewright.optics.pupil.pupil_function import PupilImage, pupil_amplitude


def test_a_grey_image_lets_light_through_as_drawn_and_the_wave_as_its_root():
    """Irradiance is the square of the amplitude, so all light is the sum of squared amplitudes (Parseval)."""
    grey = np.tile(np.linspace(0.1, 1.0, 32), (32, 1))
    pupil = pupil_amplitude(Iris(), PupilImage(b"grey", grey), 1.0, 5.0, None, None, 0.0)
    spacing = pupil.at[1] - pupil.at[0]
    assert (pupil.amplitude**2).sum() * spacing**2 == pytest.approx(pupil.light, rel=1e-12)
    # the image spans two radii each way: the mean of the ramp over an area of four
    assert pupil.light == pytest.approx(4.0 * grey.mean(), rel=2e-3)
    middle = len(pupil.at) // 2
    inside = np.abs(pupil.at) < 0.9
    row = pupil.opening[middle, inside]
    np.testing.assert_allclose(row, np.interp(pupil.at[inside], (np.arange(32) + 0.5) / 16.0 - 1.0, grey[0]), atol=2e-3)
    np.testing.assert_allclose(pupil.amplitude[middle, inside], np.sqrt(row), rtol=1e-12)
