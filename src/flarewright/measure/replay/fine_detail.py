"""Interpolate between two photographs the detail that is finer than a sprite's cells.

Fine lines, mostly rings inside ghosts, are narrower than cells that average enough pixels against noise. Detail is
stored per pixel of the photographs and moves with the blocks of cells around it. Its strength between photographs is
the learned share that predicted left-out photographs best.
"""

from __future__ import annotations

import numpy as np

from ...model.measurement.fine_detail import Detail
from ...model.measurement.residual_motion import Moves
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Pixels
from .motion_warp import block_to_cells, interpolated, moved_vectors
from .sprites import interval, sprite_interval


def ways_on(moves: Moves, k: int, part: float) -> Floats:
    """Return the motion of each block in each way of detail, by its position at a part of the interval.

    Parameters
    ----------
    moves : Moves
    k : int
        Index of the interval.
    part : float
        Relative position in the interval, from 0 to 1.

    Returns
    -------
    ndarray, shape (WAYS, rows, columns, 2)
        Cells of the sprite, down and along.
    """
    moved = [moved_vectors(steps, moves.block, part - 0.5)[..., :2] for steps in moves.steps(k)]
    return np.stack([np.zeros_like(moved[0]), *moved])


def fine(values: Floats, sprite: Sprite, block: int, parts: int) -> Floats:
    """Interpolate values of blocks of a sprite's cells to the cells of its detail."""
    return block_to_cells(values, block * parts, (sprite.rows * parts, sprite.columns * parts))


def detail_at(sprite: Sprite, detail: Detail, constellation_deg: float) -> Pixels:
    """Return the detail of a sprite at a constellation.

    Parameters
    ----------
    sprite : Sprite
        Sprite with `moves`.
    detail : Detail
        Detail of the sprite.
    constellation_deg : float

    Returns
    -------
    ndarray, shape (parts rows, parts columns, 3), float32
        All of the detail at photographed constellations, the learned share of it halfway between two.
    """
    angles = np.array(sprite.constellation_deg)
    cells = sprite.rows, sprite.columns
    k = interval(sprite, constellation_deg)
    if k is None:
        before, far = sprite_interval(angles, constellation_deg)
        return detail.picture(int(before + (far > 0.0)), *cells)
    assert sprite.moves is not None
    part = float(sprite_interval(angles, constellation_deg)[1])
    ways = detail.ways(k)[None, ..., None]
    moves = np.take_along_axis(ways_on(sprite.moves, k, part), ways, axis=0)[0]
    shift = detail.parts * fine(moves, sprite, detail.block, detail.parts)
    share = 1.0 - 4.0 * part * (1.0 - part) * (1.0 - fine(detail.shares(k), sprite, detail.block, detail.parts))
    light = interpolated(detail.picture(k, *cells), detail.picture(k + 1, *cells), shift, part)
    return np.asarray(share[..., None] * light, dtype=np.float32)
