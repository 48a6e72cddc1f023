"""Learn how what is left moves between photographs, and where that is to be believed.

Block by block the move is looked for that takes one picture to the next, first in coarser pictures, and so that
neighbours agree. Then every photograph is foretold from the one before and the one after it, in each way, and where a
way does well it counts more.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_agree import agree, move_costs
from ..kernels.measure_motion import block_misfits, block_structure, refine_blocks
from ..model.ghost_model import GhostModel
from ..model.moves import packed_moves
from ..model.sprite import Sprite
from .carried import boxed
from .moved import displaced, ghosts_light, landed, middles, spread
from .packed import Packed, pack
from .sprites import Pixels, samples, where_foretold
from .views import halved

Floats = NDArray[np.float64]

# cells to each side of a block, and cells to each side of its middle that are compared
_BLOCK, _HALF = 4, 3
# farthest moves from one picture to the next, or from what a coarser one tells, cells: across the light's line and
# along it
_REACH = np.array([8, 14])
# how often pictures are halved to see moves that are longer, and cells by which a coarser picture may be wrong
_HALVED, _COARSE = 2, 4
# what it costs when neighbours differ by a cell, and by more: logarithms of squares
_STEP, _LEAP = 0.25, 4.0
# cells around a move that was told by a place nearby
_NEARBY = 2
# by which part a misfit is taken for larger with each cell of the move
_STIFF = 0.02
# cells to each side over which a way's misfits are averaged, and how fast a way counts less the more it misses by
_ABOUT, _STEEP = 5, 4.0
# what a cell may be off by in any case, in units of the sprite: to match, and to foretell
_MATCH, _FORETELL = 3.0, 2.0
# a move's weight: so many for each factor of 2 by which the misfit without it stands out of the noise, and at most
_LOUD, _LOUDEST = 4.0, 127.0


def with_moves(model: GhostModel, threads: int | None = None) -> GhostModel:
    """Return a model whose sprites that follow ghosts have moves.

    Parameters
    ----------
    model : GhostModel
    threads : int, optional

    Returns
    -------
    GhostModel
        The same where no sprite has three pictures.
    """
    packed = pack(model)
    return where_foretold(model, lambda one: _learned(one, packed, model, threads))


def _learned(sprite: Sprite, packed: Packed, model: GhostModel, threads: int | None) -> Sprite:
    left, angles = sprite.pictures, sprite.constellation_deg
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        whole = left + np.stack(list(pool.map(lambda angle: ghosts_light(sprite, packed, model, angle), angles)))
        boxed = np.stack(list(pool.map(lambda k: _missed_boxed(sprite, packed, model, k), _inner(left))))
        alone = _told_by(left, angles, sprite.unit, pool)
        # where no ghost is drawn both are the same pictures
        together = alone if np.array_equal(left, whole) else _told_by(whole, angles, sprite.unit, pool)
    (missed, steps), (missed_together, steps_together) = alone, together
    shares = _shares([_about(each, sprite.unit) for each in (boxed, missed, missed_together)])
    both = np.stack([steps, steps_together], axis=1)
    out: Sprite = sprite.replace(moves=packed_moves(_BLOCK, both, shares[:, 1:]))
    return out


def _told_by(pictures: Pixels, angles: Sequence[float], unit: float, pool: ThreadPoolExecutor) -> tuple[Floats, Floats]:
    """Return by how much photographs are missed that others foretell by their moves, and the moves halfway."""
    onward = _steps(pictures[:-1], pictures[1:], unit, pool)
    back = _steps(pictures[1:], pictures[:-1], unit, pool)
    halfway = [_halfway(*pair) for pair in zip(onward, back, strict=True)]
    return _missed(pictures, onward, back, angles, pool), _refined(pictures, halfway, pool)


def _inner(pictures: Pixels) -> range:
    """Return which photographs lie between two others."""
    return range(1, len(pictures) - 1)


def _steps(here: Pixels, there: Pixels, unit: float, pool: ThreadPoolExecutor) -> Floats:
    """Return the moves of each block from pictures to others, and their weights, shape (K - 1, R, C, 3)."""

    def match(k: int) -> Floats:
        around = _coarse(here[k], there[k], unit, _HALVED)
        moves, apart = _agreed(here[k], there[k], unit, around)
        rows, columns, noise = *_middles(here[k]), _noise(unit)
        still, structure = np.empty((*around.shape[:2], 1, 1), np.float32), np.empty(around.shape[:2])
        block_misfits(here[k], there[k], rows, columns, _HALF, np.zeros_like(around), still)
        block_structure(here[k], rows, columns, _HALF, structure)
        gained = still[..., 0, 0] - apart - (apart + noise) * _STIFF * np.hypot(moves[..., 0], moves[..., 1])
        # darkness finds darkness where light was before, and that is nothing that moves
        gained = np.maximum(np.minimum(gained, structure), 0.0)
        weight = np.minimum(_LOUD * np.log2(1.0 + gained / noise), _LOUDEST)
        return np.concatenate([moves, weight[..., None]], axis=-1)

    return np.stack(list(pool.map(match, range(len(here)))))


def _middles(picture: Pixels) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows and the columns of cells in the middle of blocks."""
    return middles(picture.shape[0], _BLOCK), middles(picture.shape[1], _BLOCK)


def _noise(unit: float) -> float:
    """Return the squares by which two blocks may differ in any case."""
    return 3 * (2 * _HALF + 1) ** 2 * (_MATCH * unit) ** 2


def _coarse(here: Pixels, there: Pixels, unit: float, times: int) -> NDArray[np.int64]:
    """Return around which move of each block to look, as pictures tell that are so often halved, shape (R, C, 2).

    It is none where none is so long that it would not be found without.
    """
    rows, columns = _middles(here)
    if not times:
        return np.zeros((rows.size, columns.size, 2), np.int64)
    small, other = _half_as_fine(here), _half_as_fine(there)
    # a cell of four has half their noise
    found, _ = _agreed(small, other, 0.5 * unit, _coarse(small, other, 0.5 * unit, times - 1))
    told = 2 * found[np.ix_(rows // (2 * _BLOCK), columns // (2 * _BLOCK))]
    return np.asarray(np.sign(told) * np.maximum(np.abs(told) - (_REACH - _COARSE), 0))


def _half_as_fine(picture: Pixels) -> Pixels:
    """Return means of two by two cells; at the border one may stand for two."""
    return halved(np.pad(picture, [(0, picture.shape[0] % 2), (0, picture.shape[1] % 2), (0, 0)], mode="edge"), 1)


def _agreed(
    here: Pixels, there: Pixels, unit: float, around: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return moves that suit blocks and their neighbours, shape (R, C, 2), and the squares by which they miss."""
    rows, columns = _middles(here)
    down, along = (np.arange(-reach, reach + 1) for reach in _REACH)
    apart = np.empty((rows.size, columns.size, down.size, along.size), np.float32)
    block_misfits(here, there, rows, columns, _HALF, around, apart)
    costs, sums = np.empty_like(apart), np.empty_like(apart)
    move_costs(apart, around, _noise(unit), _STIFF, costs)
    agree(costs, around, _STEP, _LEAP, sums)
    best = sums.reshape(*around.shape[:2], -1).argmin(axis=2)
    misses = np.take_along_axis(apart.reshape(*best.shape, -1), best[..., None], axis=2)[..., 0]
    return around + np.stack([down[best // along.size], along[best % along.size]], axis=-1), misses


def _halfway(onward: Floats, back: Floats) -> Floats:
    """Return moves by where things are halfway, from those told by where they are before and after, shape (R, C, 3)."""
    returned = back * np.array([-1.0, -1.0, 1.0])
    return landed(returned, _BLOCK, -0.5, landed(onward, _BLOCK, 0.5))


def _refined(pictures: Pixels, steps: Sequence[Floats], pool: ThreadPoolExecutor) -> Floats:
    """Return moves to parts of a cell, shape (K - 1, R, C, 3)."""
    rows, columns = (middles(count, _BLOCK) for count in pictures.shape[1:3])
    fine = list(pool.map(_doubled, pictures))

    def refine(k: int) -> Floats:
        out = steps[k].copy()
        refine_blocks(fine[k], fine[k + 1], rows, columns, _HALF, _NEARBY, out)
        return out

    return np.stack(list(pool.map(refine, range(len(steps)))))


def _doubled(picture: Pixels) -> Pixels:
    """Return a picture twice as fine, cell (r, c) at (2 r, 2 c)."""
    rows, columns = (2 * count - 1 for count in picture.shape[:2])
    row, column = np.mgrid[:rows, :columns] / 2.0
    return samples(picture, column.ravel(), row.ravel()).reshape(rows, columns, 3)


def _missed(
    pictures: Pixels, onward: Floats, back: Floats, angles: Sequence[float], pool: ThreadPoolExecutor
) -> Floats:
    """Return by which squares each inner photograph is missed when moves foretell it, shape (K - 2, rows, columns)."""
    shape = pictures.shape[1:3]

    def miss(k: int) -> Floats:
        part = (angles[k] - angles[k - 1]) / (angles[k + 1] - angles[k - 1])
        before = displaced(pictures[k - 1], spread(back[k - 1, ..., :2], _BLOCK, shape))
        after = displaced(pictures[k + 1], spread(onward[k, ..., :2], _BLOCK, shape))
        return np.asarray((((1.0 - part) * before + part * after - pictures[k]) ** 2).sum(axis=2))

    return np.stack(list(pool.map(miss, _inner(pictures))))


def _missed_boxed(sprite: Sprite, packed: Packed, model: GhostModel, k: int) -> Floats:
    """Return by which squares a photograph is missed when boxes of ghosts foretell it, shape (rows, columns)."""
    foretold = boxed(sprite, packed, model, (k - 1, k + 1), sprite.constellation_deg[k])
    return np.asarray(((foretold - sprite.pictures[k]) ** 2).sum(axis=2))


def _about(missed: Floats, unit: float) -> Floats:
    """Return misfits about each block of each interval, shape (K - 1, R, C): the mean of the photographs at its ends.

    The first and the last photograph are foretold by none.
    """
    rows, columns = (middles(count, _BLOCK) for count in missed.shape[1:])
    # differences of sums may end a little below 0
    about = np.maximum(mean_about(missed, _ABOUT), 0.0)[:, rows[:, None], columns]
    ends = np.concatenate([about[:1], about, about[-1:]])
    return np.asarray(0.5 * (ends[1:] + ends[:-1]) + (_FORETELL * unit) ** 2)


def mean_about(values: Floats, cells: int) -> Floats:
    """Return means over squares of so many cells to each side.

    Parameters
    ----------
    values : ndarray, shape (K, rows, columns)
    cells : int

    Returns
    -------
    ndarray, shape (K, rows, columns)
        Beyond the border values are as at the border.
    """
    side = 2 * cells + 1
    sums = np.pad(values, [(0, 0), (cells, cells), (cells, cells)], mode="edge")
    for axis in (1, 2):
        sums = np.pad(sums.cumsum(axis=axis), [(0, 0), *[(1, 0) if m == axis else (0, 0) for m in (1, 2)]])
        count = sums.shape[axis]
        sums = sums.take(range(side, count), axis) - sums.take(range(count - side), axis)
    return np.asarray(sums / side**2)


def _shares(about: Sequence[Floats]) -> Floats:
    """Return how much each way counts in each block of each interval, shape (K - 1, ways, R, C); in all 1."""
    least = np.min(about, axis=0)
    shares = np.stack([(each / least) ** -_STEEP for each in about], axis=1)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))
