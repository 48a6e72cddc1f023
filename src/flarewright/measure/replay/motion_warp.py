"""Interpolate the residual between two photographs by the method that predicts left-out photographs best locally.

The residual stays in place, or it moves as measured in the images: in the residual alone, as the light of an unknown
ghost does, or in ghosts and residual together, as the borders of a ghost that is drawn wrongly do.
"""

from __future__ import annotations

import numpy as np

from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Indices, Pixels
from ..core.parameter_vector import field, visible
from .ghost_arrays import Packed, one_colour, posed_numbers
from .sprites import cells_frame, interval, samples, sprite_at


def block_to_cells(values: Floats, block: int, shape: tuple[int, int]) -> Floats:
    """Interpolate values of blocks to every cell, linearly between the blocks' centres.

    Parameters
    ----------
    values : ndarray, shape (R, C, ...)
    block : int
        Cells per side of a block.
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


def middles(count: int, block: int) -> Indices:
    """Return the centre cells of the blocks that cover `count` cells."""
    return np.minimum(np.arange(0, count, block) + block // 2, count - 1)


def moved_vectors(steps: Floats, block: int, part: float, under: Floats | None = None) -> Floats:
    """Move vectors to where they point: each to its block plus a part of its motion, shape (R, C, 3).

    Parameters
    ----------
    steps : ndarray, shape (R, C, 3)
        Cells down and along, and weight.
    block : int
        Cells per side of a block.
    part : float
        Part of the whole motion; negative is backwards.
    under : ndarray, shape (R, C, 3), optional
        Values where no vector arrives; None: the unmoved vectors. Where several arrive, the largest weight wins.
    """
    flat = steps.reshape(-1, 3)
    here = np.stack(np.unravel_index(np.arange(len(flat)), steps.shape[:2]), axis=1)
    # round half up, not half to even, so that neighbours stay neighbours
    there = np.floor(here + (part / block) * flat[:, :2] + 0.5).astype(np.int64)
    order = np.argsort(flat[:, 2], kind="stable")
    inside = np.all((there >= 0) & (there < steps.shape[:2]), axis=1)
    order = order[inside[order]]
    out = np.full(steps.shape, -1.0)
    out[there[order, 0], there[order, 1]] = flat[order]
    # fill blocks that no vector reached
    below, least = (steps, 0.0) if under is None else (under, under[..., 2])
    return np.where((out[..., 2] < least)[..., None], below, out)


def displaced(picture: Pixels, moves: Floats) -> Floats:
    """Sample an image at an offset from each cell, shape (rows, columns, 2): cells down and along."""
    row, column = np.mgrid[: picture.shape[0], : picture.shape[1]]
    read = samples(picture, (column + moves[..., 1]).ravel(), (row + moves[..., 0]).ravel())
    return read.reshape(picture.shape).astype(np.float64)


def interpolated(before: Pixels, after: Pixels, moves: Floats, part: float) -> Floats:
    """Interpolate between two images along their motion, at a part of the interval."""
    return (1.0 - part) * displaced(before, -part * moves) + part * displaced(after, (1.0 - part) * moves)


def ghosts_light(sprite: Sprite, packed: Packed, model: GhostModel, constellation_deg: float) -> Pixels:
    """Draw ghosts into a sprite's cells, shape (rows, columns, 3), except those that blob sprites correct."""
    meshes, numbers, counts, _ = packed
    sigma = abs(field(constellation_deg, model.largest_deg))
    blobs = {one.ghost for one in model.sprites if one.follows == "speck"}
    there = visible(meshes, constellation_deg) * np.array([ghost.name not in blobs for ghost in meshes])
    bent = posed_numbers(meshes, numbers, constellation_deg, sigma)
    frame, shape = cells_frame(sprite), (sprite.rows, sprite.columns)
    colours = [one_colour(bent[m], counts[m], there, sigma, frame, shape) for m in range(3)]
    return np.stack(colours, axis=-1).astype(np.float32)


def warped_sprite(sprite: Sprite, packed: Packed, model: GhostModel, constellation_deg: float) -> Pixels:
    """Compute the image of a sprite that follows ghosts: three predictions, mixed by their learned shares.

    Parameters
    ----------
    sprite : Sprite
    packed : Packed
        The model's ghosts, from `pack`.
    model : GhostModel
    constellation_deg : float

    Returns
    -------
    ndarray, shape (rows, columns, 3), float32
        The sprite's own images at photographed constellations; linear between them where it has no moves.
    """
    k, moves = interval(sprite, constellation_deg), sprite.moves
    still = sprite_at(sprite, constellation_deg)
    if k is None or moves is None:
        return still
    shape = sprite.rows, sprite.columns
    angles = sprite.constellation_deg[k : k + 2]
    part = (constellation_deg - angles[0]) / (angles[1] - angles[0])
    before, after = sprite.pictures[k], sprite.pictures[k + 1]
    shares = block_to_cells(np.moveaxis(moves.shares(k), 0, -1), moves.block, shape)
    left, whole = (
        block_to_cells(moved_vectors(steps, moves.block, part - 0.5)[..., :2], moves.block, shape)
        for steps in moves.steps(k)
    )
    drawn = [ghosts_light(sprite, packed, model, angle) for angle in (*angles, constellation_deg)]
    of_left = interpolated(before, after, left, part)
    of_whole = interpolated(before + drawn[0], after + drawn[1], whole, part) - drawn[2]
    rest = 1.0 - shares.sum(axis=2)
    mixed = rest[..., None] * still + shares[..., :1] * of_left + shares[..., 1:] * of_whole
    return np.asarray(mixed, dtype=np.float32)
