"""A model's ghosts as arrays, for kernels that draw them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_ghosts import draw_ghosts
from ..model.ghost_model import AberrationGhost, BezierGhost, Curves, GhostModel
from .curves import pose_at, posed
from .numbers import NUMBERS, channel_numbers

Floats = NDArray[np.float64]

# ghosts by their aberrations, their numbers, shape (3, G, 53), how many discs cut each, shape (3, G), and Walch's
Packed = tuple[tuple[AberrationGhost, ...], Floats, NDArray[np.int64], tuple[BezierGhost, ...]]


def pack(model: GhostModel) -> Packed:
    """Return a model's ghosts as `replay.draw_packed` takes them, for many pictures of one model."""
    meshes = tuple(ghost for ghost in model.ghosts if isinstance(ghost, AberrationGhost))
    curves = tuple(ghost for ghost in model.ghosts if isinstance(ghost, BezierGhost))
    numbers = np.zeros((3, len(meshes), NUMBERS))
    counts = np.zeros((3, len(meshes)), np.int64)
    for k, ghost in enumerate(meshes):
        for m, channel in enumerate((ghost.red, ghost.green, ghost.blue)):
            numbers[m, k], counts[m, k] = channel_numbers(channel, ghost.blades), len(channel.discs)
    return meshes, numbers, counts, curves


def posed_numbers(meshes: Sequence[AberrationGhost], numbers: Floats, constellation_deg: float, sigma: float) -> Floats:
    """Return the numbers, shape (3, G, 53), as the ghosts' curves bend them at a constellation."""
    out = numbers
    for k, ghost in enumerate(meshes):
        if ghost.curves != Curves():
            out = out.copy() if out is numbers else out
            pose = pose_at(ghost.curves, constellation_deg, ghost.visible_deg)
            for m in range(3):
                out[m, k] = posed(numbers[m, k], sigma, pose)
    return out


def one_colour(
    numbers: Floats, counts: NDArray[np.int64], there: Floats, sigma: float, frame: Floats, shape: tuple[int, int]
) -> Floats:
    """Draw ghosts in one colour.

    Parameters
    ----------
    numbers : ndarray, shape (G, 53)
        At a constellation, from `posed_numbers`.
    counts : ndarray, shape (G,)
        How many discs cut each.
    there : ndarray, shape (G,)
        Which part of each ghost's light is there.
    sigma : float
        Length of the field.
    frame : ndarray, shape (5,)
        From `numbers.frame`.
    shape : tuple of int
        Rows and columns.

    Returns
    -------
    ndarray, shape (rows, columns)
        Radiance, a little below 0 in places by rounding.
    """
    plane = np.zeros((shape[0], shape[1] + 1))
    draw_ghosts(numbers, counts, there, sigma, frame, plane)
    light: Floats = plane.cumsum(axis=1)[:, :-1]
    return light
