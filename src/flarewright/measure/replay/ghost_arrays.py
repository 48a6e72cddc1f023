"""Convert a model's ghosts to the arrays of the drawing kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.ghost_model.draw import draw_ghosts
from ...model.measurement.ghost_model import AberrationGhost, BezierGhost, Curves, GhostModel
from ...typing import Floats, Indices
from ..core.parameter_vector import NUMBERS, channel_numbers
from ..core.pose_curves import pose_at, posed

# aberration ghosts, their numbers, shape (3, G, 53), the number of discs of each, shape (3, G), and Bezier ghosts
Packed = tuple[tuple[AberrationGhost, ...], Floats, Indices, tuple[BezierGhost, ...]]


def pack(model: GhostModel) -> Packed:
    """Return a model's ghosts as arrays for `model_image.draw_packed`, reusable for many pictures."""
    meshes = tuple(ghost for ghost in model.ghosts if isinstance(ghost, AberrationGhost))
    curves = tuple(ghost for ghost in model.ghosts if isinstance(ghost, BezierGhost))
    numbers = np.zeros((3, len(meshes), NUMBERS))
    counts = np.zeros((3, len(meshes)), np.int64)
    for k, ghost in enumerate(meshes):
        for m, channel in enumerate((ghost.red, ghost.green, ghost.blue)):
            numbers[m, k], counts[m, k] = channel_numbers(channel, ghost.blades), len(channel.discs)
    return meshes, numbers, counts, curves


def posed_numbers(meshes: Sequence[AberrationGhost], numbers: Floats, constellation_deg: float, sigma: float) -> Floats:
    """Apply the ghosts' curves at a constellation to their numbers, shape (3, G, 53)."""
    out = numbers
    for k, ghost in enumerate(meshes):
        if ghost.curves != Curves():
            out = out.copy() if out is numbers else out
            pose = pose_at(ghost.curves, constellation_deg, ghost.visible_deg)
            for m in range(3):
                out[m, k] = posed(numbers[m, k], sigma, pose)
    return out


def one_colour(
    numbers: Floats, counts: Indices, there: Floats, sigma: float, frame: Floats, shape: tuple[int, int]
) -> Floats:
    """Draw ghosts in one colour.

    Parameters
    ----------
    numbers : ndarray, shape (G, 53)
        At a constellation, from `posed_numbers`.
    counts : ndarray, shape (G,)
        Number of discs that cut each ghost.
    there : ndarray, shape (G,)
        Visible part of each ghost's light.
    sigma : float
        Length of the field vector.
    frame : ndarray, shape (5,)
        From `parameter_vector.frame`.
    shape : tuple of int
        Rows and columns.

    Returns
    -------
    ndarray, shape (rows, columns)
        Radiance; rounding can make it slightly negative.
    """
    plane = np.zeros((shape[0], shape[1] + 1))
    draw_ghosts(numbers, counts, there, sigma, frame, plane)
    return plane.cumsum(axis=1)[:, :-1]
