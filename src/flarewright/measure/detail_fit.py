"""Learn what is finer than the cells of a sprite that follows ghosts, and how far it can be carried.

What photographs show beside all that is drawn at their constellations is kept at the size of a pixel, as far as it
stands out of noise. Every photograph that has one on each side tells what these two foretell of it: block by block the
way that does so best, and by which part of it squares are least.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..model.detail import Detail, packed_detail, told_detail
from ..model.ghost_model import GhostModel
from ..model.moves import Moves
from ..model.sprite import Sprite
from .detail import fine, ways_on
from .moved import displaced
from .moves_fit import mean_about
from .sprite_fit import darkest_noise, fine_cells, nearest_views, sure
from .sprites import Pixels, where_foretold
from .views import View, all_known

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# cells of detail along each side of a sprite's cell
_PARTS = 3
# a step between faint cells, of the noise of the darkest pixels averaged over a cell
_DIGIT = 3.0
# blocks to each side that tell about a block
_ABOUT = 1


def with_detail(
    model: GhostModel, views: Sequence[View], left: Sequence[Pixels], threads: int | None = None
) -> GhostModel:
    """Return a model whose sprites that follow ghosts have detail.

    Parameters
    ----------
    model : GhostModel
        With moves.
    views : sequence of View
        As photographed. Of several that made one picture of a sprite, the nearest to its constellation tells.
    left : sequence of ndarray, shape (H, W, 3)
        What they show beside all that the model draws; not a number where that is not known.

    Returns
    -------
    GhostModel
        The same where no sprite has three pictures.
    """
    return where_foretold(
        model, lambda one: one if one.moves is None else _learned(one, one.moves, views, left, threads)
    )


def _learned(
    sprite: Sprite, moves: Moves, views: Sequence[View], left: Sequence[Pixels], threads: int | None
) -> Sprite:
    angles = np.array(sprite.constellation_deg)
    unit = _DIGIT * darkest_noise(views) * _PARTS / sprite.grain_px

    def keep(k: int) -> tuple[str, Pixels, Mask]:
        light, variance = fine_cells(sprite, views[k], left[k], _PARTS)
        known = all_known(light)
        text, picture = told_detail(np.nan_to_num(sure(light[None], variance[None])[0]).astype(np.float32), unit)
        return text, picture, known

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        cells, pictures, known = zip(*pool.map(keep, nearest_views(sprite, views)), strict=True)
        inner = range(1, len(angles) - 1)
        foretold = list(pool.map(lambda k: _foretold(sprite, moves, pictures, known[k], angles, k), inner))
    ways, shares = _chosen(np.stack(foretold))
    detail: Detail = packed_detail(moves.block, _PARTS, unit, cells, ways, shares)
    out: Sprite = sprite.replace(detail=detail)
    return out


def _foretold(sprite: Sprite, moves: Moves, pictures: Sequence[Pixels], known: Mask, angles: Floats, k: int) -> Floats:
    """Compare a photograph's detail with what its neighbours foretell in each way.

    Returns
    -------
    ndarray, shape (2, ways, rows, columns)
        Sums over blocks: what is foretold times itself, and times what is there.
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
    """Add up values of cells over blocks of moves and those around, shape (rows, columns); 0 or more."""
    side = moves.block * _PARTS
    wide = np.zeros((moves.rows * side, moves.columns * side))
    wide[: values.shape[0], : values.shape[1]] = values
    sums = wide.reshape(moves.rows, side, moves.columns, side).sum(axis=(1, 3))
    # what is foretold the wrong way about tells nothing, and does not count against the photograph beside
    return np.asarray(np.maximum(mean_about(sums[None], _ABOUT)[0], 0.0))


def _chosen(foretold: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Choose the way and the share of each block and interval.

    Parameters
    ----------
    foretold : ndarray, shape (K - 2, 2, ways, rows, columns)
        Of inner photographs, from `_foretold`.

    Returns
    -------
    ways, shares : ndarray, shape (K - 1, rows, columns)
        By the photographs at both ends of an interval; the first and the last photograph are foretold by none.
    """
    ends = np.concatenate([foretold[:1], foretold, foretold[-1:]])
    own, true = np.moveaxis(ends[1:] + ends[:-1], 1, 0)
    # (true - share light)^2 is least at share = true light / light^2
    share = np.clip(true / np.maximum(own, 1e-30), 0.0, 1.0)
    spared = 2.0 * share * true - share**2 * own
    ways = spared.argmax(axis=1)
    return ways, np.take_along_axis(share, ways[:, None], axis=1)[:, 0]
