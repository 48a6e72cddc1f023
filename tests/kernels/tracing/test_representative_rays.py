"""Rays that represent a bundle: chosen in one step as in two."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.tracing.representative_rays import choose_representatives, choose_seen, seen_rays
from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X


@pytest.mark.parametrize("halves", [1, 2])
def test_seen_rays_are_chosen_as_a_mask_would_choose_them(halves):
    rng = np.random.default_rng(11)
    places = rng.uniform(-1.0, 1.0, (500, 2))
    triangles = rng.integers(0, 500, (900, 3))
    rays = np.zeros((500, STOP_X + 2))
    rays[:, ALIVE], rays[:, REL] = rng.random(500) < 0.9, rng.uniform(0.5, 1.1, 500)
    rays[:, :2], rays[:, STOP_X:] = 8.0 * places, 1.6 * places
    # a blade that cuts a part of the circle, in the frame of either half
    blades = np.array([[0.6, 0.8, 0.7, 0.0]])
    axes = np.array([[[0.8, 0.6], [-0.6, 0.8]], [[-0.8, -0.6], [-0.6, 0.8]]])[:halves]
    corners = np.array([[[30.0, 4.0, 1.0], [20.0, -1.0, 3.0]], [[30.0, -4.0, 1.0], [20.0, 1.0, 3.0]]])[:halves]
    passing = np.stack([
        seen_rays(rays, 1.9, blades, one, corner, 64.0, 36.0) for one, corner in zip(axes, corners, strict=True)
    ])  # fmt: skip
    assert passing.sum(axis=1).min() > 50
    expected = choose_representatives(places, triangles, 3, passing, 40) % 500
    found = choose_seen(rays, places, triangles, 3, 1.9, blades, axes, corners, 64.0, 36.0, 40)
    np.testing.assert_array_equal(found, expected)
    nowhere = corners + np.array([[[1e6, 0.0, 0.0], [0.0, 0.0, 0.0]]])
    assert choose_seen(rays, places, triangles, 3, 1.9, blades, axes, nowhere, 64.0, 36.0, 40).size == 0
