"""Put together between two photographs what is finer than a sprite's cells.

Fine lines, rings inside ghosts above all, are narrower than cells that hold little noise. They are read from
photographs at the size of a pixel, and carried where the blocks of cells around them go, as much of them as foretold
photographs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.detail import Detail
from ..model.moves import Moves
from ..model.sprite import Sprite
from .moved import halfway, landed, spread
from .sprites import Pixels, between, interval

Floats = NDArray[np.float64]


def ways_on(moves: Moves, k: int, part: float) -> Floats:
    """Return where blocks go in each way of detail, by where they are a part of the way along.

    Parameters
    ----------
    moves : Moves
    k : int
        Index of the interval.
    part : float
        From 0 to 1.

    Returns
    -------
    ndarray, shape (WAYS, rows, columns, 2)
        Cells of the sprite, down and along.
    """
    told = [landed(steps, moves.block, part - 0.5)[..., :2] for steps in moves.steps(k)]
    return np.stack([np.zeros_like(told[0]), *told])


def fine(values: Floats, sprite: Sprite, block: int, parts: int) -> Floats:
    """Return what blocks of a sprite's cells hold for every cell of its detail."""
    return spread(values, block * parts, (sprite.rows * parts, sprite.columns * parts))


def detail_at(sprite: Sprite, detail: Detail, constellation_deg: float) -> Pixels:
    """Return the detail of a sprite at a constellation.

    Parameters
    ----------
    sprite : Sprite
        That has moves.
    detail : Detail
        The sprite's.
    constellation_deg : float

    Returns
    -------
    ndarray, shape (parts rows, parts columns, 3), float32
        At constellations that were photographed all of it, and halfway between two the learned share.
    """
    angles = np.array(sprite.constellation_deg)
    cells = sprite.rows, sprite.columns
    k = interval(sprite, constellation_deg)
    if k is None:
        before, far = between(angles, constellation_deg)
        return detail.picture(int(before + (far > 0.0)), *cells)
    assert sprite.moves is not None
    part = float(between(angles, constellation_deg)[1])
    ways = detail.ways(k)[None, ..., None]
    moves = np.take_along_axis(ways_on(sprite.moves, k, part), ways, axis=0)[0]
    shift = detail.parts * fine(moves, sprite, detail.block, detail.parts)
    share = 1.0 - 4.0 * part * (1.0 - part) * (1.0 - fine(detail.shares(k), sprite, detail.block, detail.parts))
    light = halfway(detail.picture(k, *cells), detail.picture(k + 1, *cells), shift, part)
    return np.asarray(share[..., None] * light, dtype=np.float32)
