"""Put what is left of a flare together between two photographs, in the way that foretold photographs best there.

Ghosts' boxes tell how borders of known ghosts move. What belongs to no ghost, or to one that is drawn with another
outline than it has, moves as the pictures themselves tell: what is left alone, or ghosts and what is left together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import GhostModel
from ..model.moves import Moves
from ..model.sprite import Sprite
from .numbers import field, visible
from .packed import Packed, one_colour, posed_numbers
from .sprites import Pixels, cells_frame, samples

Floats = NDArray[np.float64]


def spread(values: Floats, block: int, shape: tuple[int, int]) -> Floats:
    """Return what blocks hold for every cell, linear between their middles.

    Parameters
    ----------
    values : ndarray, shape (R, C, ...)
    block : int
        Cells to each side of a block.
    shape : tuple of int
        Rows and columns of cells.

    Returns
    -------
    ndarray, shape (rows, columns, ...)
    """
    out = values
    for axis, count in enumerate(shape):
        at = np.clip((np.arange(count) - block // 2) / block, 0.0, out.shape[axis] - 1.0)
        below = np.minimum(at.astype(np.int64), max(out.shape[axis] - 2, 0))
        above = np.minimum(below + 1, out.shape[axis] - 1)
        part = (at - below).reshape([-1 if m == axis else 1 for m in range(out.ndim)])
        out = (1.0 - part) * out.take(below, axis) + part * out.take(above, axis)
    return out


def middles(count: int, block: int) -> NDArray[np.int64]:
    """Return the cells in the middle of blocks, so many that these cover `count` cells."""
    return np.minimum(np.arange(0, count, block) + block // 2, count - 1)


def landed(steps: Floats, block: int, part: float, under: Floats | None = None) -> Floats:
    """Return moves by where what moves is a part of its way off where they are told, shape (R, C, 3).

    Parameters
    ----------
    steps : ndarray, shape (R, C, 3)
        Cells down and along, and weight.
    block : int
        Cells to each side of a block.
    part : float
        Of a whole move, below 0 backwards.
    under : ndarray, shape (R, C, 3), optional
        What is there already; None: the moves as told. Where several come together, the largest weight stays.
    """
    flat = steps.reshape(-1, 3)
    here = np.stack(np.unravel_index(np.arange(len(flat)), steps.shape[:2]), axis=1)
    # not to even ones, so that neighbours stay neighbours
    there = np.floor(here + (part / block) * flat[:, :2] + 0.5).astype(np.int64)
    order = np.argsort(flat[:, 2], kind="stable")
    inside = np.all((there >= 0) & (there < steps.shape[:2]), axis=1)
    order = order[inside[order]]
    out = np.full(steps.shape, -1.0)
    out[there[order, 0], there[order, 1]] = flat[order]
    # where nothing came
    below, least = (steps, 0.0) if under is None else (under, under[..., 2])
    return np.where((out[..., 2] < least)[..., None], below, out)


def displaced(picture: Pixels, moves: Floats) -> Floats:
    """Read a picture at places off each cell, shape (rows, columns, 2): cells down and along."""
    row, column = np.mgrid[: picture.shape[0], : picture.shape[1]]
    read = samples(picture, (column + moves[..., 1]).ravel(), (row + moves[..., 0]).ravel())
    return read.reshape(picture.shape).astype(np.float64)


def halfway(before: Pixels, after: Pixels, moves: Floats, part: float) -> Floats:
    """Return the picture between two, a part of the way along, of what moves from the one to the other."""
    return (1.0 - part) * displaced(before, -part * moves) + part * displaced(after, (1.0 - part) * moves)


def ghosts_light(sprite: Sprite, packed: Packed, model: GhostModel, constellation_deg: float) -> Pixels:
    """Draw ghosts into a sprite's cells, shape (rows, columns, 3); those that specks stand for are left out."""
    meshes, numbers, counts, _ = packed
    sigma = abs(field(constellation_deg, model.largest_deg))
    specks = {one.ghost for one in model.sprites if one.follows == "speck"}
    there = visible(meshes, constellation_deg) * np.array([ghost.name not in specks for ghost in meshes])
    bent = posed_numbers(meshes, numbers, constellation_deg, sigma)
    frame, shape = cells_frame(sprite), (sprite.rows, sprite.columns)
    colours = [one_colour(bent[m], counts[m], there, sigma, frame, shape) for m in range(3)]
    return np.stack(colours, axis=-1).astype(np.float32)


def mixed(
    sprite: Sprite, moves: Moves, packed: Packed, model: GhostModel, interval: int, constellation_deg: float,
    boxed: Floats,
) -> Floats:  # fmt: skip
    """Mix what is left between two pictures of a sprite from what three ways tell of it.

    Parameters
    ----------
    sprite : Sprite
    moves : Moves
        The sprite's.
    packed : Packed
        The model's ghosts, from `pack`.
    model : GhostModel
    interval : int
        Index of the picture before.
    constellation_deg : float
    boxed : ndarray, shape (rows, columns, 3)
        What goes with the boxes of ghosts, from `carried`.

    Returns
    -------
    ndarray, shape (rows, columns, 3)
    """
    shape = sprite.rows, sprite.columns
    angles = sprite.constellation_deg[interval : interval + 2]
    part = (constellation_deg - angles[0]) / (angles[1] - angles[0])
    before, after = sprite.pictures[interval], sprite.pictures[interval + 1]
    shares = spread(np.moveaxis(moves.shares(interval), 0, -1), moves.block, shape)
    left, whole = (
        spread(landed(steps, moves.block, part - 0.5)[..., :2], moves.block, shape) for steps in moves.steps(interval)
    )
    drawn = [ghosts_light(sprite, packed, model, angle) for angle in (*angles, constellation_deg)]
    of_left = halfway(before, after, left, part)
    of_whole = halfway(before + drawn[0], after + drawn[1], whole, part) - drawn[2]
    rest = 1.0 - shares.sum(axis=2)
    return np.asarray(rest[..., None] * boxed + shares[..., :1] * of_left + shares[..., 1:] * of_whole)
