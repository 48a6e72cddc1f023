"""Halo and star around a light, compared with NumPy's interpolation and the formula of each spike."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model.glow import halo_light, star_light

KNOTS = np.log([2.0, 5.0, 11.0, 40.0, 90.0])
VALUES = np.log([[8.0, 6.0, 7.0], [3.0, 2.0, 1.0], [1.0, 0.4, 0.2], [0.02, 0.03, 0.01], [1e-30, 0.002, 1e-3]])
DARK = np.log(2e-30)


def by_numpy(radius):
    """Return the radial profile at some radii, shape (P, 3)."""
    at = np.log(np.maximum(radius, 1e-300))
    light = np.exp(np.stack([np.interp(at, KNOTS, VALUES[:, m]) for m in range(3)], axis=1))
    light[light <= 2e-30] = 0.0
    light[at > KNOTS[-1]] = 0.0
    return light


def test_a_halo_is_its_profile_times_its_strength_plus_a_constant():
    # random order, so that the search for a knot starts anywhere; also the centre, and beyond the last knot
    rng = np.random.default_rng(2)
    radius, angle = np.concatenate([[0.0, 1e-9, 89.9, 90.1], rng.uniform(0.0, 120.0, 400)]), rng.uniform(0.0, 6.3, 404)
    x, y, even = radius * np.cos(angle), radius * np.sin(angle), np.array([0.1, 0.0, 0.3])
    out = np.empty((404, 3))
    halo_light(x, y, KNOTS, VALUES, DARK, 0.7, even, out)
    assert np.allclose(out, 0.7 * by_numpy(radius) + even, rtol=1e-10, atol=0.0)


@pytest.mark.parametrize("spikes", [3, 8])
def test_a_star_falls_off_across_its_nearest_spike(spikes):
    rng = np.random.default_rng(3)
    first, width = 0.4, 1.5
    x, y = rng.uniform(-100.0, 100.0, (2, 2000))
    out = np.empty((2000, 3))
    star_light(x, y, spikes, first, width, KNOTS, VALUES, DARK, out)
    # find the half line nearest to each place by dot products
    ways = first + 2.0 * np.pi * np.arange(spikes) / spikes
    along = x[:, None] * np.cos(ways) + y[:, None] * np.sin(ways)
    across = (y[:, None] * np.cos(ways) - x[:, None] * np.sin(ways))[np.arange(2000), along.argmax(axis=1)]
    light = np.exp(-0.5 * (across / width) ** 2)[:, None] * by_numpy(np.hypot(x, y))
    assert np.count_nonzero(out[:, 1]) > 100
    assert np.allclose(out, light, rtol=1e-9, atol=1e-13)
