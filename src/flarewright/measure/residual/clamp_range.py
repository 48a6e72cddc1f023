"""Learn how far light moves from one photograph to the next.

A replay between two photographs can be wrong by much: residual of a ghost is warped to a wrong place and darkens it,
or light that both photographs cut at an edge is drawn beyond that edge. The true value lies in the range that both
photographs show nearby. Each photograph between two others gives the size of that neighbourhood: the distance within
which the two others show light at least as bright and as dark.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy import ndimage

from ...model.measurement.clamp_ranges import ANYWHERE, packed_reaches
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Indices
from ..core.neighbourhood import brightest, darkest
from ..core.views import View
from ..replay.motion_warp import middles
from ..replay.sprites import where_predicted
from .sprite_fit import light_in_cells, nearest_views

Cells = Indices

# distances to search on each side, in rising order, cells; beyond the last one the range is unlimited
_DISTANCES = (0, 1, 2, 3, 4, 6, 8, 11, 15)
# tolerance of light against the neighbours' range: times its noise, plus part of the light
_NOISE_SIGMAS, _RELATIVE_TOLERANCE = 3.0, 0.03
# photographs on each side that show where bright light occurs, and the part of its brightness that counts as such
_WINDOW, _AS_BRIGHT = 4, 0.3
# cells per side of a block
_BLOCK = 2


def with_reaches(model: GhostModel, views: Sequence[View], threads: int | None = None) -> GhostModel:
    """Return a model whose sprites that follow ghosts have the distances that light moves between their images.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        As photographed. Of the views of one image, the one nearest to its constellation counts.
    threads : int, optional

    Returns
    -------
    GhostModel
        Unchanged where no sprite has three images.
    """
    return where_predicted(model, lambda one: _learned(one, views, threads))


def _learned(sprite: Sprite, views: Sequence[View], threads: int | None) -> Sprite:
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        seen = list(pool.map(lambda k: light_in_cells(sprite, views[k]), nearest_views(sprite, views)))
        # unmeasured light has no upper limit
        brights = [np.where(np.isnan(light), np.inf, light).max(axis=2) for light, _ in seen]
        inner = list(pool.map(lambda k: _distances(seen, brights, k), range(1, len(seen) - 1)))
    # the first and the last photograph have no neighbour on one side
    gone = np.stack([inner[0], *inner, inner[-1]])
    cells = _over_blocks(np.maximum(gone[:-1], gone[1:]))
    return sprite.replace(reaches=packed_reaches(_BLOCK, cells))


def _over_blocks(cells: Cells) -> Cells:
    """Return the maximum of each block, shape (K, R, C, 2), of cells, shape (K, rows, columns, 2)."""
    rows, columns = (middles(side, _BLOCK).size for side in cells.shape[1:3])
    wide = np.zeros((len(cells), rows * _BLOCK, columns * _BLOCK, 2), np.int64)
    wide[:, : cells.shape[1], : cells.shape[2]] = cells
    return np.asarray(wide.reshape(-1, rows, _BLOCK, columns, _BLOCK, 2).max(axis=(2, 4)))


def _distances(seen: Sequence[tuple[Floats, Floats]], brights: Sequence[Floats], k: int) -> Cells:
    """Return how far the light of a photograph's cells moves, for dark and bright, shape (rows, columns, 2)."""
    here, noise = seen[k]
    off = _NOISE_SIGMAS * noise + _RELATIVE_TOLERANCE * np.abs(here)
    before, after = seen[k - 1][0], seen[k + 1][0]
    # where neither neighbour was measured the range is unlimited
    low, high = (np.nan_to_num(how(before, after), nan=far) for how, far in ((np.fmin, -np.inf), (np.fmax, np.inf)))
    hidden = np.isnan(here)
    dark, bright = np.full((2, *here.shape[:2]), ANYWHERE)
    for far in reversed(_DISTANCES):
        dark[((here >= darkest(low, far) - off) | hidden).all(axis=2)] = far
        bright[((here <= brightest(high, far) + off) | hidden).all(axis=2)] = far
    light = np.where(hidden, -np.inf, here).max(axis=2)
    most = _passing_limit(brights[max(k - _WINDOW, 0) : k + _WINDOW + 1])
    return np.stack([_over_passed_cells(dark), _over_passed_cells(bright, light, most)], axis=2)


def _passing_limit(brights: Sequence[Floats]) -> Floats:
    """Return the upper limit of light that passes each cell: the brightest light on both sides, shape (rows, columns).

    Ghosts move along the light's line. Where no light occurs on one side, an edge cuts them off.
    """
    ever, far = np.max(brights, axis=0), _DISTANCES[-1]
    width = far + 1
    behind, onward = (
        ndimage.maximum_filter1d(ever, width, axis=1, mode="constant", cval=np.inf, origin=shift)
        for shift in (far // 2, -(width // 2))
    )
    return np.asarray(np.minimum(behind, onward))


def _over_passed_cells(found: Cells, light: Floats | None = None, most: Floats | None = None) -> Cells:
    """Return the distance of the farthest-moving light that passes a cell: halfway it has moved half of it.

    Light passes only cells where `most` allows for its brightness.
    """
    out = found.copy()
    for far in (*_DISTANCES[1:], ANYWHERE):
        half = (min(far, _DISTANCES[-1]) + 1) // 2
        of = found == far
        if light is None or most is None:
            near = brightest(of.astype(float)[..., None], half)[..., 0] > 0.0
        else:
            passing = brightest(np.where(of, light, -np.inf)[..., None], half)[..., 0]
            near = (passing > -np.inf) & (most >= _AS_BRIGHT * passing)
        out[near] = np.maximum(out[near], far)
    return out
