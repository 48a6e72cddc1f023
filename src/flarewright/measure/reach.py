"""How far light goes from one photograph to the next.

Between two photographs a replay can be wrong by much: what a ghost leaves is carried where it does not belong, and
lies there as darkness, or a light that is cut off at a border in both is drawn beyond it. What is there in truth lies
between what both photographs show nearby. How near is told by every photograph that has one on each side: so far as
one has to look in these for light as bright, and for light as dark.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import GhostModel
from ..model.reaches import ANYWHERE, packed_reaches
from ..model.sprite import Sprite
from .held import brightest, darkest
from .moved import middles
from .sprite_fit import nearest_views, told
from .sprites import where_foretold
from .views import View

Floats = NDArray[np.float64]
Cells = NDArray[np.int64]

# cells that are looked at to each side, one after the other; farther off anything may come from anywhere
_LOOKED = (0, 1, 2, 3, 4, 6, 8, 11, 15)
# by which light may be darker or brighter than what is told: times its noise, and part of it
_NOISY, _PART = 3.0, 0.03
# photographs to each side that tell where light as bright is ever seen, and which part of it is as bright
_WINDOW, _AS_BRIGHT = 4, 0.3
# cells to each side of a block
_BLOCK = 2


def with_reaches(model: GhostModel, views: Sequence[View], threads: int | None = None) -> GhostModel:
    """Return a model whose sprites that follow ghosts know how far light goes between their pictures.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        As photographed. Of several that made one picture, the nearest to its constellation tells.
    threads : int, optional

    Returns
    -------
    GhostModel
        The same where no sprite has three pictures.
    """
    return where_foretold(model, lambda one: _learned(one, views, threads))


def _learned(sprite: Sprite, views: Sequence[View], threads: int | None) -> Sprite:
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        seen = list(pool.map(lambda k: told(sprite, views[k]), nearest_views(sprite, views)))
        # what is not seen may be as bright as you like
        brights = [np.where(np.isnan(light), np.inf, light).max(axis=2) for light, _ in seen]
        inner = list(pool.map(lambda k: _gone(seen, brights, k), range(1, len(seen) - 1)))
    # the first and the last have none beside them on one side
    gone = np.stack([inner[0], *inner, inner[-1]])
    cells = _over_blocks(np.maximum(gone[:-1], gone[1:]))
    out: Sprite = sprite.replace(reaches=packed_reaches(_BLOCK, cells))
    return out


def _over_blocks(cells: Cells) -> Cells:
    """Return the largest of each block, shape (K, R, C, 2), of cells, shape (K, rows, columns, 2)."""
    rows, columns = (middles(side, _BLOCK).size for side in cells.shape[1:3])
    wide = np.zeros((len(cells), rows * _BLOCK, columns * _BLOCK, 2), np.int64)
    wide[:, : cells.shape[1], : cells.shape[2]] = cells
    return np.asarray(wide.reshape(-1, rows, _BLOCK, columns, _BLOCK, 2).max(axis=(2, 4)))


def _gone(seen: Sequence[tuple[Floats, Floats]], brights: Sequence[Floats], k: int) -> Cells:
    """Tell how far light has come that passes the cells of a photograph, dark and bright, shape (rows, columns, 2)."""
    here, noise = seen[k]
    off = _NOISY * noise + _PART * np.abs(here)
    before, after = seen[k - 1][0], seen[k + 1][0]
    # what neither shows may be anything
    low, high = (np.nan_to_num(how(before, after), nan=far) for how, far in ((np.fmin, -np.inf), (np.fmax, np.inf)))
    hidden = np.isnan(here)
    dark, bright = np.full((2, *here.shape[:2]), ANYWHERE)
    for far in reversed(_LOOKED):
        dark[((here >= darkest(low, far) - off) | hidden).all(axis=2)] = far
        bright[((here <= brightest(high, far) + off) | hidden).all(axis=2)] = far
    light = np.where(hidden, -np.inf, here).max(axis=2)
    most = _on_its_way(brights[max(k - _WINDOW, 0) : k + _WINDOW + 1])
    return np.stack([_passed(dark), _passed(bright, light, most)], axis=2)


def _on_its_way(brights: Sequence[Floats]) -> Floats:
    """Return how bright light may be that comes to each cell: as bright as on both its sides, shape (rows, columns).

    Ghosts go along the light's line. Where none ever was, nor beyond, there is an edge that cuts them off.
    """
    ever, far = np.max(brights, axis=0), _LOOKED[-1]
    wide = np.pad(ever, [(0, 0), (far, far)], constant_values=np.inf)
    # one after the other, each and those that follow it
    onward = np.lib.stride_tricks.sliding_window_view(wide, far + 1, axis=1).max(axis=-1)
    return np.asarray(np.minimum(onward[:, :-far], onward[:, far:]))


def _passed(found: Cells, light: Floats | None = None, most: Floats | None = None) -> Cells:
    """Return how far what passes a cell goes: halfway it has gone half of it, to any side.

    Light goes only where there may be light that is `most` so bright.
    """
    out = found.copy()
    for far in (*_LOOKED[1:], ANYWHERE):
        half = (min(far, _LOOKED[-1]) + 1) // 2
        of = found == far
        if light is None or most is None:
            near = brightest(of.astype(float)[..., None], half)[..., 0] > 0.0
        else:
            passing = brightest(np.where(of, light, -np.inf)[..., None], half)[..., 0]
            near = (passing > -np.inf) & (most >= _AS_BRIGHT * passing)
        out[near] = np.maximum(out[near], far)
    return out
