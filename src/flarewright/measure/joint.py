"""The light of all ghosts at once: with their shapes known, what every one adds is linear, so it is solved, not sought.

Fitting one ghost after the other settles only slowly how overlapping ghosts share their light. Solved together, each
gets what no other explains better, and a fragment that the others can stand in for is told by how little is lost
without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_changes import draw_with_changes
from ..kernels.measure_edges import sum_along_rows, sum_changes_along_rows
from ..kernels.measure_mesh import window_of
from ..kernels.measure_pupil import FIRST_I
from .evenly import evenly
from .fit import ALIKE, MODEL_ERROR, priors, witness
from .found import CHANNELS, Found
from .numbers import Floats
from .patches import scaled
from .shape import Indices, Shape
from .shared_out import shared_out
from .views import View, halved

# light is solved in pictures halved until they are no wider, of no more constellations than this
_WIDTH, _VIEWS = 120, 25
# part of the squares where a ghost is that it alone must explain
NEEDED = 0.03
# numbers of a ghost's light that are solved: 1, u, v, w
_TERMS = np.arange(FIRST_I, FIRST_I + 4)


@dataclass(frozen=True)
class _Picture:
    """One view and the G `ghosts` that it shows: what each number of their light would add, shape (P, 4 G).

    An even background is nobody's: the means are taken off. `there`, shape (P, G), is where the ghosts are, `pixels` is
    what is seen, `light`, shape (4 G,), is what each number adds in all, `allowed`, shape (G,), is what a model may
    miss where each ghost is, in weighted squares.
    """

    ghosts: Indices
    basis: NDArray[np.float32]
    light: Floats
    there: NDArray[np.bool_]
    pixels: Floats
    weight: Floats
    allowed: Floats

    @property
    def columns(self) -> Indices:
        """Where the numbers of its ghosts stand among those of all."""
        return _columns(self.ghosts)


@dataclass(frozen=True)
class _Told:
    """What one colour tells of all ghosts' light: the equations `matrix` x = `side` of their numbers, shape (4 G,)."""

    pictures: Sequence[_Picture]
    matrix: Floats
    side: Floats


def lit(
    ghosts: Sequence[Found], views: Sequence[View], *, needed: float = NEEDED, pool: ThreadPoolExecutor | None = None
) -> list[Found]:
    """Solve the light of all ghosts and colours together, and leave out ghosts that the others can stand in for.

    Parameters
    ----------
    ghosts : sequence of Found
    views : sequence of View
        Glow taken off; what shall not count has infinite variance.
    needed : float
        Part of the squares that a ghost must explain alone, all colours together.
    pool : executor, optional

    Returns
    -------
    list of Found
    """
    if not ghosts:
        return []
    told = [_told(ghosts, views, m, pool) for m in range(CHANNELS)]
    kept = _needed(told, needed)
    at = _columns(kept)
    values = [
        np.asarray(np.linalg.solve(one.matrix[np.ix_(at, at)], one.side[at])).reshape(-1, _TERMS.size) for one in told
    ]
    return [_with_light(ghosts[int(k)], [values[m][n] for m in range(CHANNELS)]) for n, k in enumerate(kept)]


def _told(ghosts: Sequence[Found], views: Sequence[View], channel: int, pool: ThreadPoolExecutor | None) -> _Told:
    """Return what views tell of all ghosts' light in one colour."""
    pictures = _pictures(ghosts, views, channel, pool)
    width = views[0].size_px[0]
    prior = np.concatenate([priors(ghost.shapes[channel], _TERMS, width) for ghost in ghosts])
    matrix: Floats = np.zeros((prior.size, prior.size))
    side: Floats = np.zeros(prior.size)
    for one in pictures:
        # a matrix times itself: half of the work, and symmetric to the last bit
        root = np.sqrt(one.weight)
        scaled = one.basis * root[:, None]
        matrix[np.ix_(one.columns, one.columns)] += scaled.T @ scaled
        side[one.columns] += scaled.T @ (root * one.pixels)
    # a picture of fewer pixels has fewer that miss the model alike
    alike = max(ALIKE * (_WIDTH / width) ** 2, 1.0)
    first: Floats = np.asarray(np.linalg.solve(matrix + np.diag(prior), side))
    matrix += np.diag(prior * witness(*_missed(pictures, first), alike))
    return _Told(pictures, matrix, side)


def _missed(pictures: Sequence[_Picture], values: Floats) -> tuple[float, int]:
    """Return the weighted squares that ghosts of these numbers leave, and how many pixels they are of."""
    cost = sum(float(one.weight @ (one.pixels - one.basis @ values[one.columns]) ** 2) for one in pictures)
    return cost, sum(int(np.count_nonzero(one.weight)) for one in pictures)


def _columns(kept: Indices) -> Indices:
    """Return where the numbers of some ghosts stand among those of all."""
    return np.asarray((_TERMS.size * kept[:, None] + np.arange(_TERMS.size)).ravel())


def _needed(told: Sequence[_Told], least: float) -> Indices:
    """Return the ghosts that stay when the least needed one is left out, again and again.

    What the squares grow by without some of the numbers, all others solved anew, is x' (C)^-1 x with x their values
    and C their part of the inverse matrix. The squares of all colours count together: coatings leave many a ghost
    purple, which green hardly shows.
    """
    kept = np.arange(told[0].side.size // _TERMS.size)
    adds = [_adds(one) for one in told]
    allowed = np.sum([_allowed(one, kept.size) for one in told], axis=0)
    while kept.size:
        at = _columns(kept)
        grown, seen, lit_up, rests = (np.zeros(kept.size) for _ in range(4))
        for colour, adding in zip(told, adds, strict=True):
            inverse = np.linalg.inv(colour.matrix[np.ix_(at, at)])
            values = inverse @ colour.side[at]
            rests += _rests(colour, at, values)[kept]
            for n in range(kept.size):
                part = slice(_TERMS.size * n, _TERMS.size * (n + 1))
                own, light = at[part], values[part]
                grown[n] += float(light @ np.linalg.solve(inverse[part, part], light))
                seen[n] += float(light @ colour.matrix[np.ix_(own, own)] @ light)
                lit_up[n] += adding[own] @ light
        # one that is fainter than what the model may miss of the others there is what it misses of them
        gains = np.minimum(grown / np.maximum(grown + rests, 1e-300), seen / np.maximum(allowed[kept], 1e-300) - 1.0)
        # a ghost that darkens is none: what its rims let through counts, not what its law says of the whole pupil
        gains[lit_up <= 0.0] = -1.0
        worst = int(np.argmin(gains))
        if gains[worst] >= least:
            break
        kept = np.delete(kept, worst)
    return kept


def _adds(colour: _Told) -> Floats:
    """Return how much light each number of each ghost adds in all, shape (4 G,)."""
    adds = np.zeros(colour.side.size)
    for one in colour.pictures:
        adds[one.columns] += one.light
    return adds


def _allowed(colour: _Told, count: int) -> Floats:
    """Return what a model may miss where each of all ghosts is, in weighted squares."""
    allowed = np.zeros(count)
    for one in colour.pictures:
        allowed[one.ghosts] += one.allowed
    return allowed


def _rests(colour: _Told, at: Indices, values: Floats) -> Floats:
    """Return the weighted squares that are left where each of all ghosts is, with these numbers of light."""
    everything = np.zeros(colour.side.size)
    everything[at] = values
    rests = np.zeros(colour.side.size // _TERMS.size)
    for one in colour.pictures:
        missed = one.pixels - one.basis @ everything[one.columns]
        rests[one.ghosts] += (one.weight * missed**2) @ one.there
    return rests


def _pictures(
    ghosts: Sequence[Found], views: Sequence[View], channel: int, pool: ThreadPoolExecutor | None
) -> list[_Picture]:
    """Draw what each number of each ghost's light would add to some views."""
    times = max(0, int(np.ceil(np.log2(views[0].size_px[0] / _WIDTH))))

    def one(k: int) -> _Picture:
        view = views[k]
        pixels = halved(view.pixels[..., channel], times).astype(float)
        variance = halved(view.variance[..., channel], times, variance=True).astype(float)
        height, width = pixels.shape
        shown = np.array([n for n, ghost in enumerate(ghosts) if ghost.first <= k <= ghost.last], dtype=np.int64)
        basis = np.zeros((height, width, shown.size, _TERMS.size), np.float32)
        model = np.zeros((height, width))
        for n, g in enumerate(shown):
            model += _add(ghosts[g].shapes[channel], view.sigma, scaled(view.frame, times), basis[:, :, n])
        level = np.maximum(np.abs(model), np.abs(pixels))
        allowed = (MODEL_ERROR * level) ** 2
        weight = np.where(np.isfinite(variance), 1.0 / (variance + allowed), 0.0).ravel()
        columns = basis.reshape(height * width, -1)
        total = max(float(weight.sum()), 1e-300)
        seen = np.where(weight > 0.0, pixels.ravel(), 0.0)
        there = columns[:, :: _TERMS.size] != 0.0
        light = columns.sum(axis=0, dtype=np.float64)
        columns = columns - ((weight @ columns) / total).astype(np.float32)
        missed = (weight * allowed.ravel()) @ there
        return _Picture(shown, columns, light, there, seen - float(weight @ seen) / total, weight, missed)

    return shared_out(one, evenly(range(len(views)), _VIEWS), pool=pool)


def _add(shape: Shape, sigma: float, frame: Floats, basis: NDArray[np.float32]) -> Floats:
    """Fill what the numbers of one shape's light add, shape (H, W, 4); return the picture as it is."""
    height, width = basis.shape[:2]
    out = np.zeros((height, width))
    left, top, w, h = window_of(shape.numbers, shape.discs, sigma, frame, width, height)
    if not w:
        return out
    plane, changes = np.zeros((h, w + 1)), np.zeros((h, w + 1, _TERMS.size))
    draw_with_changes(shape.numbers, shape.discs, sigma, _TERMS, frame, left, top, plane, changes)
    sum_along_rows(plane)
    sum_changes_along_rows(changes)
    basis[top : top + h, left : left + w] = changes[:, :w]
    out[top : top + h, left : left + w] = plane[:, :w]
    return out


def _with_light(ghost: Found, values: Sequence[Floats]) -> Found:
    """Return a ghost with other numbers of light."""
    shapes = []
    for shape, light in zip(ghost.shapes, values, strict=True):
        numbers = shape.numbers.copy()
        numbers[_TERMS] = light
        shapes.append(replace(shape, numbers=numbers))
    red, green, blue = shapes
    return replace(ghost, shapes=(red, green, blue))
