"""Rays that represent a bundle: chosen in one step as in two."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.tracing.representative_rays import choose_representatives, choose_seen, seen_rays
from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X
from flarewright.model import Iris
from flarewright.optics.pupil.iris import blade_edges


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


@pytest.mark.parametrize(
    "iris",
    [Iris(), Iris(blades=5), Iris(blades=6, rounding=0.3, rotation_deg=17.0), Iris(blades=9, rounding=0.9), None],
)
def test_blades_pass_what_lies_on_their_open_side(iris):
    """Also close to the circle that no blade cuts, within which none is looked at."""
    rng = np.random.default_rng(3)
    blades = np.empty((0, 4)) if iris is None else blade_edges(iris, 2.0)
    angle, radius = rng.uniform(0.0, 2.0 * np.pi, 4000), rng.uniform(0.0, 3.0, 4000)
    if iris is not None:
        radius[:2000] = blades[0, 2] * (1.0 + rng.uniform(-1e-6, 1e-6, 2000))
        # in the middle of the first blade
        angle[:200] = np.arctan2(blades[0, 1], blades[0, 0])
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    rays = np.zeros((4000, STOP_X + 4))
    rays[:, ALIVE] = 1.0
    # at both crossings, in the meridional frame
    rays[:, STOP_X:] = np.tile(np.column_stack([x, y]) @ turn.T, 2)
    found = seen_rays(rays, 4.0, blades, turn, np.zeros((2, 3)), np.inf, np.inf)
    nx, ny, offset, curvature = blades.T[:, :, None]
    qx, qy = x - offset * nx, y - offset * ny
    border = nx * qx + ny * qy + 0.5 * curvature * (qx**2 + qy**2)
    clear = (np.abs(border) > 1e-12).all(axis=0)
    np.testing.assert_array_equal(found[clear], (border <= 0.0).all(axis=0)[clear])
    assert clear.sum() > 3900
    assert found.any()
    assert iris is None or (~found[:200]).sum() > 50 < found[:200].sum()


def test_a_blade_over_the_axis_blocks_it():
    rays = np.zeros((3, STOP_X + 2))
    rays[:, ALIVE], rays[:, STOP_X] = 1.0, [0.0, 0.5, -0.5]
    blades = np.array([[1.0, 0.0, -0.2, 0.0]])
    assert seen_rays(rays, 4.0, blades, np.eye(2), np.zeros((2, 3)), np.inf, np.inf).tolist() == [False, False, True]
