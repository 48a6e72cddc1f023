"""The centre of a pupil compared with the map written out, and with its finite differences."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model.pupil_centre import fill_middles
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, FIRST_G, FIRST_I
from flarewright.measure.core.parameter_vector import NUMBERS


def landed(numbers, x, y, sigma):
    """Return the place of a pupil point on the sensor, along the field and across it."""
    u, v, w = x * x + y * y, x * sigma, sigma * sigma
    terms = np.array([1.0, u, v, w, u * u, u * v, v * v, u * w, v * w, w * w])
    f, g = numbers[:FIRST_G] @ terms, numbers[FIRST_G:FIRST_I] @ terms
    below = 1.0 + numbers[BELOW] * v + numbers[BELOW + 1] * w
    return np.array([(sigma * f + x * g) / below, y * g / below])


def middles(numbers, sigma):
    out = np.zeros((3, sigma.size))
    fill_middles(np.tile(numbers, (sigma.size, 1)), sigma, out)
    return out


def test_place_size_and_radiance_are_those_of_the_map():
    numbers = np.zeros(NUMBERS)
    rng = np.random.default_rng(4)
    numbers[:10], numbers[10:20] = rng.normal(0.0, 8.0, 10), rng.normal(0.0, 2.0, 10)
    numbers[10] = 30.0
    numbers[20:30] = 900.0, 50.0, -20.0, 80.0, 3.0, 4.0, 5.0, 6.0, 7.0, -30.0
    numbers[BELOW:] = 0.2, -0.3
    sigma, h = np.array([0.0, 0.4, 0.9]), 1e-5
    place, size, radiance = middles(numbers, sigma)
    for k, s in enumerate(sigma):
        by = [(landed(numbers, *step, s) - landed(numbers, *-step, s)) / (2.0 * h) for step in h * np.eye(2)]
        assert place[k] == pytest.approx(landed(numbers, 0.0, 0.0, s)[0], abs=1e-9)
        assert size[k] == pytest.approx(by[1][1], rel=1e-7)
        light = 900.0 + 80.0 * s**2 - 30.0 * s**4
        assert radiance[k] == pytest.approx(light / abs(np.linalg.det(by)), rel=1e-7)


def test_light_is_not_negative_and_a_degenerate_centre_has_no_radiance():
    numbers = np.zeros(NUMBERS)
    numbers[10], numbers[20] = 3.0, -5.0
    assert middles(numbers, np.array([0.5]))[2] == 0.0
    numbers[10], numbers[20] = 0.0, 5.0
    assert np.isnan(middles(numbers, np.array([0.5]))[2]).all()
