"""Learn detail finer than the cells of a sprite that follows ghosts, and its strength between photographs.

The residual of the photographs beside all that is drawn at their constellations is stored per pixel, where it exceeds
the noise. Each photograph between two others tests the predictions from these two: for each block the best way and the
share with the least squared error are stored.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...model.measurement.fine_detail import Detail, packed_detail, reported_detail
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.residual_motion import Moves
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Indices, Mask, Pixels
from ..core.views import View, all_finite
from ..replay.fine_detail import fine, ways_on
from ..replay.motion_warp import displaced
from ..replay.sprites import where_predicted
from .motion_fit import mean_about
from .sprite_fit import darkest_noise, fine_cells, nearest_views, sure

# detail cells per side of a sprite's cell
_PARTS = 3
# quantization step of faint cells, times the noise of the darkest pixels averaged over a cell
_DIGIT = 3.0
# neighbouring blocks on each side that contribute to a block
_ABOUT = 1


def with_detail(
    model: GhostModel, views: Sequence[View], left: Sequence[Pixels], threads: int | None = None
) -> GhostModel:
    """Return a model whose sprites that follow ghosts have detail.

    Parameters
    ----------
    model : GhostModel
        Model with moves.
    views : sequence of View
        As photographed. Of the views of one image, the one nearest to its constellation counts.
    left : sequence of ndarray, shape (H, W, 3)
        Residual of the views beside all that the model draws; NaN where unknown.
    threads : int, optional
        None: all cores; the detail does not depend on it.

    Returns
    -------
    GhostModel
        Unchanged where no sprite has three images.
    """
    return where_predicted(
        model, lambda one: one if one.moves is None else _learned(one, one.moves, views, left, threads)
    )


def _learned(
    sprite: Sprite, moves: Moves, views: Sequence[View], left: Sequence[Pixels], threads: int | None
) -> Sprite:
    angles = np.array(sprite.constellation_deg)
    unit = _DIGIT * darkest_noise(views) * _PARTS / sprite.grain_px

    def keep(k: int) -> tuple[str, Pixels, Mask]:
        light, variance = fine_cells(sprite, views[k], left[k], _PARTS)
        known = all_finite(light)
        text, picture = reported_detail(np.nan_to_num(sure(light[None], variance[None])[0]).astype(np.float32), unit)
        return text, picture, known

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        cells, pictures, known = zip(*pool.map(keep, nearest_views(sprite, views)), strict=True)
        inner = range(1, len(angles) - 1)
        predicted = list(pool.map(lambda k: _predicted(sprite, moves, pictures, known[k], angles, k), inner))
    ways, shares = _chosen(np.stack(predicted))
    detail: Detail = packed_detail(moves.block, _PARTS, unit, cells, ways, shares)
    return sprite.replace(detail=detail)


def _predicted(sprite: Sprite, moves: Moves, pictures: Sequence[Pixels], known: Mask, angles: Floats, k: int) -> Floats:
    """Compare a photograph's detail with the predictions from its neighbours, for each way.

    Returns
    -------
    ndarray, shape (2, ways, rows, columns)
        Sums over blocks: the prediction times itself, and the prediction times the photograph.
    """
    part = (angles[k] - angles[k - 1]) / (angles[k + 1] - angles[k - 1])
    there = np.where(known[..., None], pictures[k], 0.0)
    sums = []
    for came, goes in zip(ways_on(moves, k - 1, 1.0), ways_on(moves, k, 0.0), strict=True):
        before, after = (
            displaced(pictures[n], _PARTS * fine(steps, sprite, moves.block, _PARTS)) if steps.any() else pictures[n]
            for n, steps in ((k - 1, -came), (k + 1, goes))
        )
        light = np.where(known[..., None], (1.0 - part) * before + part * after, 0.0)
        sums.append([_blocks((light * other).sum(axis=2), moves) for other in (light, there)])
    return np.swapaxes(np.array(sums), 0, 1)


def _blocks(values: Floats, moves: Moves) -> Floats:
    """Sum values of cells over blocks of moves and adjacent blocks, shape (rows, columns); at least 0."""
    side = moves.block * _PARTS
    wide = np.zeros((moves.rows * side, moves.columns * side))
    wide[: values.shape[0], : values.shape[1]] = values
    sums = wide.reshape(moves.rows, side, moves.columns, side).sum(axis=(1, 3))
    # a prediction with the wrong sign is useless and must not offset the other end of the interval
    return np.asarray(np.maximum(mean_about(sums[None], _ABOUT)[0], 0.0))


def _chosen(predicted: Floats) -> tuple[Indices, Floats]:
    """Choose the way and the share of each block and interval.

    Parameters
    ----------
    predicted : ndarray, shape (K - 2, 2, ways, rows, columns)
        Of the inner photographs, from `_predicted`.

    Returns
    -------
    ways, shares : ndarray, shape (K - 1, rows, columns)
        From the photographs at both ends of an interval; the first and the last photograph have no prediction.
    """
    ends = np.concatenate([predicted[:1], predicted, predicted[-1:]])
    own, true = np.moveaxis(ends[1:] + ends[:-1], 1, 0)
    # (true - share light)^2 is least at share = true light / light^2
    share = np.clip(true / np.maximum(own, 1e-30), 0.0, 1.0)
    spared = 2.0 * share * true - share**2 * own
    ways = spared.argmax(axis=1)
    return ways, np.take_along_axis(share, ways[:, None], axis=1)[:, 0]
