"""Measure how the residual moves between photographs, and where that motion is reliable.

Block matching with a smoothness term, from coarse to fine, gives the motion of each block from one image to the next.
Then each photograph is predicted from its two neighbours by each method, and methods with smaller errors get larger
shares, block by block.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy import ndimage

from ...kernels.ghost_model.block_matching import block_misfits, block_structure, refine_blocks
from ...kernels.ghost_model.motion_smoothness import agree, move_costs
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.residual_motion import packed_moves
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Indices, Pixels
from ..core.views import halved_pixels
from ..replay.ghost_arrays import Packed, pack
from ..replay.motion_warp import block_to_cells, displaced, ghosts_light, middles, moved_vectors
from ..replay.sprites import samples, where_predicted

# cells per side of a block, and half width of the area that is matched
_BLOCK, _HALF = 4, 3
# largest motion from one image to the next, or from the coarser estimate, cells: across the light's line and along it
_REACH = np.array([8, 14])
# number of halvings for longer motions, and error of a coarser estimate, cells
_HALVINGS, _COARSE = 2, 4
# smoothness cost of neighbours that differ by one cell, and by more: logarithms of squares
_STEP, _LEAP = 0.25, 4.0
# search range around the motion of a neighbouring block, cells
_NEARBY_CELLS = 2
# relative increase of a misfit per cell of motion
_STIFF = 0.02
# half width of the average of a method's misfits, cells, and exponent with which shares fall with the misfit
_AVERAGE_CELLS, _SHARE_EXPONENT = 5, 4.0
# tolerance of a cell in units of the sprite: for matching, and for prediction
_MATCH, _PREDICT = 3.0, 2.0
# weight of a motion for each factor of 2 of the zero-motion misfit over the noise, and largest weight
_WEIGHT_PER_STOP, _MOST_WEIGHT = 4.0, 127.0


def with_moves(model: GhostModel, threads: int | None = None) -> GhostModel:
    """Return a model whose sprites that follow ghosts have moves.

    Returns
    -------
    GhostModel
        Unchanged where no sprite has three images.
    """
    packed = pack(model)
    return where_predicted(model, lambda one: _learned(one, packed, model, threads))


def _learned(sprite: Sprite, packed: Packed, model: GhostModel, threads: int | None) -> Sprite:
    left, angles = sprite.pictures, sprite.constellation_deg
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        whole = left + np.stack(list(pool.map(lambda angle: ghosts_light(sprite, packed, model, angle), angles)))
        alone = _motion_of(left, angles, sprite.unit, pool)
        # without drawn ghosts both series are equal
        together = alone if np.array_equal(left, whole) else _motion_of(whole, angles, sprite.unit, pool)
        no_steps = np.zeros_like(alone[1])
        still = _missed(left, no_steps, no_steps, angles, pool)
    (missed, steps), (missed_together, steps_together) = alone, together
    shares = _shares([_averaged(each, sprite.unit) for each in (still, missed, missed_together)])
    both = np.stack([steps, steps_together], axis=1)
    return sprite.replace(moves=packed_moves(_BLOCK, both, shares[:, 1:]))


def _motion_of(
    pictures: Pixels, angles: Sequence[float], unit: float, pool: ThreadPoolExecutor
) -> tuple[Floats, Floats]:
    """Return the squared errors of photographs predicted by motion, and the moves at the middle of each interval."""
    onward = _steps(pictures[:-1], pictures[1:], unit, pool)
    back = _steps(pictures[1:], pictures[:-1], unit, pool)
    halfway = [_halfway(*pair) for pair in zip(onward, back, strict=True)]
    return _missed(pictures, onward, back, angles, pool), _refined(pictures, halfway, pool)


def _inner(pictures: Pixels) -> range:
    """Return the indices of photographs between two others."""
    return range(1, len(pictures) - 1)


def _steps(here: Pixels, there: Pixels, unit: float, pool: ThreadPoolExecutor) -> Floats:
    """Return the motion of each block from images to other images, and its weight, shape (K - 1, R, C, 3)."""

    def match(k: int) -> Floats:
        around = _coarse(here[k], there[k], unit, _HALVINGS)
        moves, apart = _agreed(here[k], there[k], unit, around)
        rows, columns, noise = *_middles(here[k]), _noise(unit)
        still, structure = np.empty((*around.shape[:2], 1, 1), np.float32), np.empty(around.shape[:2])
        block_misfits(here[k], there[k], rows, columns, _HALF, np.zeros_like(around), still)
        block_structure(here[k], rows, columns, _HALF, structure)
        gained = still[..., 0, 0] - apart - (apart + noise) * _STIFF * np.hypot(moves[..., 0], moves[..., 1])
        # a dark block matches any dark area, which is no motion
        gained = np.maximum(np.minimum(gained, structure), 0.0)
        weight = np.minimum(_WEIGHT_PER_STOP * np.log2(1.0 + gained / noise), _MOST_WEIGHT)
        return np.concatenate([moves, weight[..., None]], axis=-1)

    return np.stack(list(pool.map(match, range(len(here)))))


def _middles(picture: Pixels) -> tuple[Indices, Indices]:
    """Return the rows and the columns of the cells at the centres of blocks."""
    return middles(picture.shape[0], _BLOCK), middles(picture.shape[1], _BLOCK)


def _noise(unit: float) -> float:
    """Return the squared difference that two blocks can have by noise."""
    return 3 * (2 * _HALF + 1) ** 2 * (_MATCH * unit) ** 2


def _coarse(here: Pixels, there: Pixels, unit: float, times: int) -> Indices:
    """Return the centre of each block's search range, estimated from images halved `times` times, shape (R, C, 2).

    It is 0 where the motion is within the range around 0.
    """
    rows, columns = _middles(here)
    if not times:
        return np.zeros((rows.size, columns.size, 2), np.int64)
    small, other = _half_as_fine(here), _half_as_fine(there)
    # the mean of four cells has half their noise
    found, _ = _agreed(small, other, 0.5 * unit, _coarse(small, other, 0.5 * unit, times - 1))
    motion = 2 * found[np.ix_(rows // (2 * _BLOCK), columns // (2 * _BLOCK))]
    return np.asarray(np.sign(motion) * np.maximum(np.abs(motion) - (_REACH - _COARSE), 0))


def _half_as_fine(picture: Pixels) -> Pixels:
    """Average blocks of two by two cells; an odd border is repeated."""
    return halved_pixels(
        np.pad(picture, [(0, picture.shape[0] % 2), (0, picture.shape[1] % 2), (0, 0)], mode="edge"), 1
    )


def _agreed(here: Pixels, there: Pixels, unit: float, around: Indices) -> tuple[Indices, Pixels]:
    """Return the motions with the least cost including smoothness, shape (R, C, 2), and their squared misfits."""
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
    """Return the motion at positions in the middle of the interval, from both directions, shape (R, C, 3)."""
    returned = back * np.array([-1.0, -1.0, 1.0])
    return moved_vectors(returned, _BLOCK, -0.5, moved_vectors(onward, _BLOCK, 0.5))


def _refined(pictures: Pixels, steps: Sequence[Floats], pool: ThreadPoolExecutor) -> Floats:
    """Refine motions to fractions of a cell, shape (K - 1, R, C, 3)."""
    rows, columns = (middles(count, _BLOCK) for count in pictures.shape[1:3])
    fine = list(pool.map(_doubled, pictures))

    def refine(k: int) -> Floats:
        out = steps[k].copy()
        refine_blocks(fine[k], fine[k + 1], rows, columns, _HALF, _NEARBY_CELLS, out)
        return out

    return np.stack(list(pool.map(refine, range(len(steps)))))


def _doubled(picture: Pixels) -> Pixels:
    """Return an image at twice the resolution, cell (r, c) at (2 r, 2 c)."""
    rows, columns = (2 * count - 1 for count in picture.shape[:2])
    row, column = np.mgrid[:rows, :columns] / 2.0
    return samples(picture, column.ravel(), row.ravel()).reshape(rows, columns, 3)


def _missed(
    pictures: Pixels, onward: Floats, back: Floats, angles: Sequence[float], pool: ThreadPoolExecutor
) -> Floats:
    """Return the squared error of predicting each inner photograph by motion, shape (K - 2, rows, columns)."""
    shape = pictures.shape[1:3]

    def miss(k: int) -> Floats:
        part = (angles[k] - angles[k - 1]) / (angles[k + 1] - angles[k - 1])
        before = displaced(pictures[k - 1], block_to_cells(back[k - 1, ..., :2], _BLOCK, shape))
        after = displaced(pictures[k + 1], block_to_cells(onward[k, ..., :2], _BLOCK, shape))
        return np.asarray((((1.0 - part) * before + part * after - pictures[k]) ** 2).sum(axis=2))

    return np.stack(list(pool.map(miss, _inner(pictures))))


def _averaged(missed: Floats, unit: float) -> Floats:
    """Average the squared errors around each block of each interval, over both ends, shape (K - 1, R, C).

    The first and the last photograph have no prediction.
    """
    rows, columns = (middles(count, _BLOCK) for count in missed.shape[1:])
    # rounding of differences of sums can be negative
    about = np.maximum(mean_about(missed, _AVERAGE_CELLS), 0.0)[:, rows[:, None], columns]
    ends = np.concatenate([about[:1], about, about[-1:]])
    return np.asarray(0.5 * (ends[1:] + ends[:-1]) + (_PREDICT * unit) ** 2)


def mean_about(values: Floats, cells: int) -> Floats:
    """Average over squares with `cells` cells on each side.

    Parameters
    ----------
    values : ndarray, shape (K, rows, columns)
    cells : int

    Returns
    -------
    ndarray, shape (K, rows, columns)
        The border is repeated.
    """
    side = 2 * cells + 1
    return np.asarray(ndimage.uniform_filter(values, (1, side, side), mode="nearest"))


def _shares(about: Sequence[Floats]) -> Floats:
    """Return the share of each method in each block of each interval, shape (K - 1, methods, R, C); they sum to 1."""
    least = np.min(about, axis=0)
    shares = np.stack([(each / least) ** -_SHARE_EXPONENT for each in about], axis=1)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))
