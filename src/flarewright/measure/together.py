"""All ghosts of one view measured together: brightness, place and size of each, with what they owe to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_changes import draw_with_changes
from ..kernels.measure_edges import sum_along_rows, sum_changes_along_rows
from ..kernels.measure_mesh import window_of
from ..kernels.measure_pupil import FIRST_G, FIRST_I
from .curves import Pose, posed
from .fit import MODEL_ERROR, OUTLIER, Shape
from .found import CHANNELS
from .normal import inverse, solution
from .numbers import Floats
from .views import View

Shapes = tuple[Shape, Shape, Shape]

# ghosts are measured together in pictures halved until they are no wider: three numbers a ghost need no more
WIDTH = 240
# brightness, shift and size of each ghost, then an even background of each colour
PER_GHOST = 3
# how far a ghost is looked for from where it is foretold: brightness, shift (of its radius and of the picture), size
_BRIGHTNESS, _RADII, _WIDTHS, _SIZE = 3.0, 0.3, 0.01, 0.2
# of a view's pixels so many, percent, are darker than an even background may be bright
_DARK = 10.0
# a step that gains less than this part of the cost is the last
_GAIN = 1e-3
# the derivatives that make a shift and a change of size
_FREE = np.array([0, *range(FIRST_G, FIRST_I)], dtype=np.int64)


def halvings(width: int) -> int:
    """Return how often pictures so wide are halved to be measured in."""
    times = 0
    while width > WIDTH * 2**times:
        times += 1
    return times


@dataclass(frozen=True)
class Measured:
    """What one view tells of its ghosts.

    Attributes
    ----------
    poses : tuple of Pose
    error : ndarray, shape (G, 3)
        Standard deviations of brightness, shift and size; infinite where nothing tells.
    crossing : ndarray, shape (G,)
        By which factor the other ghosts widen the error of the brightness.
    inside : ndarray, shape (G,)
        Part of the box around each that lies in the frame.
    cost : float
        Weighted squares that are left.
    """

    poses: tuple[Pose, ...]
    error: Floats
    crossing: Floats
    inside: Floats
    cost: float


@dataclass(frozen=True)
class _Drawn:
    """A ghost with its derivatives inside its window, one colour."""

    ghost: int
    part: tuple[slice, slice]
    picture: Floats
    changes: Floats


def measure_together(
    ghosts: Sequence[Shapes], expected: Sequence[Pose], view: View, *, steps: int = 6, sure: bool = True
) -> Measured:
    """Fit brightness, shift and size of every ghost in one view, all at once.

    Parameters
    ----------
    ghosts : sequence of tuple of Shape
        Red, green and blue.
    expected : sequence of Pose
        Where each is foretold; the search stays near it.
    view : View
        Halo and star taken off.
    steps : int
        Of Gauss and Newton, at most, before outliers count less and after.
    sure : bool
        What the model may miss counts as noise too.

    Returns
    -------
    Measured

    Notes
    -----
    The brightness is linear and may come out below 0, as noise does. Weak priors about the foretold pose keep a ghost
    that nobody sees where it is; they are part of no told error that is smaller than half of theirs.
    """
    poses = list(expected)
    spread = np.array([_spreads(shapes[1], view) for shapes in ghosts]).reshape(-1, PER_GHOST)
    size = PER_GHOST * len(ghosts)
    prior = np.zeros(size + CHANNELS)
    prior[:size] = 1.0 / spread.ravel() ** 2
    # or it would stand in for a ghost that fills the picture, and be far below 0 beside one that is far too bright
    prior[size:] = 1.0 / _evenness(view) ** 2
    # a ghost far from where it is foretold looks like an outlier: these count less only near the end
    for doubting in (False, True) if sure else (False,):
        matrix, side, cost, count = _normal(ghosts, poses, view, sure, doubting)
        for _ in range(steps):
            off = np.array([_difference(e, p) for e, p in zip(expected, poses, strict=True)]).reshape(-1, PER_GHOST)
            pulled = side.copy()
            pulled[:size] += prior[:size] * off.ravel()
            step = solution(matrix + np.diag(prior + 1e-12), pulled)[:size]
            trial = [_stepped(*each) for each in zip(poses, step.reshape(-1, PER_GHOST), spread, strict=True)]
            there = _normal(ghosts, trial, view, sure, doubting)
            if there[2] > cost:
                break
            enough = there[2] > (1.0 - _GAIN) * cost
            poses, (matrix, side, cost, count) = trial, there
            if enough:
                break
    whole = inverse(matrix + np.diag(prior + 1e-12))[:size, :size]
    # a view that is missed by more than noise makes all of them less certain
    excess = max(1.0, cost / max(count - size, 1))
    error = np.sqrt(np.maximum(np.diag(whole), 0.0) * excess).reshape(-1, PER_GHOST)
    # an error that is mostly the prior's tells nothing
    error[error > 0.7 * spread] = np.inf
    alone = np.array([
        np.linalg.inv(matrix[3 * g : 3 * g + 3, 3 * g : 3 * g + 3] + np.diag(prior[3 * g : 3 * g + 3]))[0, 0]
        for g in range(len(ghosts))
    ])  # fmt: skip
    crossing = np.maximum(np.sqrt(np.diag(whole)[::PER_GHOST] / np.maximum(alone, 1e-300)), 1.0)
    inside = np.array([_inside(shapes[1], pose, view) for shapes, pose in zip(ghosts, poses, strict=True)])
    return Measured(tuple(poses), error, crossing, inside, cost)


def _difference(a: Pose, b: Pose) -> tuple[float, float, float]:
    return a.brightness - b.brightness, a.along_px - b.along_px, a.size - b.size


def _spreads(shape: Shape, view: View) -> tuple[float, float, float]:
    radius = abs(float(shape.numbers[FIRST_G]))
    return _BRIGHTNESS, _RADII * radius + _WIDTHS * view.size_px[0], _SIZE


def _evenness(view: View) -> Floats:
    """Return how bright an even background may be, by colour: about as bright as the darkest places."""
    known = np.where(np.isfinite(view.variance), view.pixels, np.nan).reshape(-1, CHANNELS)
    shown = np.isfinite(known).any(axis=0)
    dark = np.where(shown, np.nanpercentile(np.where(shown, known, 0.0), _DARK, axis=0), 0.0)
    least = view.darkest_noise if np.isfinite(view.darkest_noise) else 0.0
    return np.asarray(np.maximum(dark, max(least, 1e-12)), dtype=np.float64)


def _stepped(pose: Pose, step: Floats, limit: Floats) -> Pose:
    cut = np.clip(step[1:], -limit[1:], limit[1:])
    size = min(max(pose.size + float(cut[1]), 0.4), 2.0)
    return Pose(pose.brightness + float(step[0]), pose.along_px + float(cut[0]), size)


def _normal(
    ghosts: Sequence[Shapes], poses: Sequence[Pose], view: View, sure: bool, doubting: bool
) -> tuple[Floats, Floats, float, int]:
    """Return the normal matrix, its right side, the cost of a view, and how many numbers it has."""
    size = PER_GHOST * len(ghosts) + CHANNELS
    matrix, side, total, count = np.zeros((size, size)), np.zeros(size), 0.0, 0
    for m in range(CHANNELS):
        drawn = [_draw(g, shapes[m], pose, view) for g, (shapes, pose) in enumerate(zip(ghosts, poses, strict=True))]
        there = [one for one in drawn if one is not None]
        picture = np.zeros(view.pixels.shape[:2])
        for one in there:
            picture[one.part] += poses[one.ghost].brightness * one.picture
        variance = view.variance[..., m].astype(np.float64)
        weight = _weights(view.pixels[..., m], variance, picture, sure)
        level = PER_GHOST * len(ghosts) + m
        # the even background is best known without ghosts; it is refitted with them below
        left = view.pixels[..., m] - picture
        left = np.where(weight > 0.0, left, 0.0)
        if doubting:
            weight = weight / (1.0 + weight * left**2 / OUTLIER**2)
        total += float((weight * left**2).sum())
        count += int(np.count_nonzero(weight))
        matrix[level, level] += float(weight.sum())
        side[level] += float((weight * left).sum())
        for a, one in enumerate(there):
            rows = slice(PER_GHOST * one.ghost, PER_GHOST * one.ghost + PER_GHOST)
            weighted = one.changes * weight[one.part][..., None]
            side[rows] += np.einsum("ijk,ij->k", weighted, left[one.part])
            ones = weighted.sum(axis=(0, 1))
            matrix[rows, level] += ones
            matrix[level, rows] += ones
            for other in there[a:]:
                block = _overlap(one, weighted, other)
                columns = slice(PER_GHOST * other.ghost, PER_GHOST * other.ghost + PER_GHOST)
                matrix[rows, columns] += block
                if other is not one:
                    matrix[columns, rows] += block.T
    return matrix, side, total, count


def _weights(pixels: NDArray[np.float32], variance: Floats, picture: Floats, sure: bool) -> Floats:
    known = np.isfinite(variance)
    error = MODEL_ERROR * np.maximum(np.abs(picture), np.abs(pixels)) if sure else 0.0
    return np.asarray(np.where(known, 1.0 / (np.where(known, variance, 1.0) + error**2), 0.0))


def _draw(ghost: int, shape: Shape, pose: Pose, view: View) -> _Drawn | None:
    """Draw a ghost as bright as foretold, and what changes with brightness, shift and size."""
    numbers = posed(shape.numbers, view.sigma, Pose(1.0, pose.along_px, pose.size))
    left, top, width, height = window_of(numbers, shape.discs, view.sigma, view.frame, *view.size_px)
    if not width:
        return None
    plane, changes = np.zeros((height, width + 1)), np.zeros((height, width + 1, _FREE.size))
    draw_with_changes(numbers, shape.discs, view.sigma, _FREE, view.frame, left, top, plane, changes)
    sum_along_rows(plane)
    sum_changes_along_rows(changes)
    picture, by = plane[:, :width], changes[:, :width]
    # a ghost that is not seen has no place either: its light, not below a tenth, scales what place and size change
    level = max(pose.brightness, 0.1)
    shift = level * by[..., 0] / view.sigma if view.sigma > 0.0 else np.zeros_like(picture)
    growth = level * (by[..., 1:] @ shape.numbers[FIRST_G:FIRST_I])
    part = (slice(top, top + height), slice(left, left + width))
    return _Drawn(ghost, part, picture, np.stack([picture, shift, growth], axis=-1))


def _overlap(one: _Drawn, weighted: Floats, other: _Drawn) -> Floats:
    """Return the products of two ghosts' derivatives where their windows meet, shape (3, 3)."""
    spans = []
    for a, b in zip(one.part, other.part, strict=True):
        low, high = max(a.start, b.start), min(a.stop, b.stop)
        if high <= low:
            return np.zeros((PER_GHOST, PER_GHOST))
        spans.append((slice(low - a.start, high - a.start), slice(low - b.start, high - b.start)))
    mine = weighted[spans[0][0], spans[1][0]].reshape(-1, PER_GHOST)
    theirs = other.changes[spans[0][1], spans[1][1]].reshape(-1, PER_GHOST)
    return np.asarray(mine.T @ theirs, dtype=np.float64)


def _inside(shape: Shape, pose: Pose, view: View) -> float:
    """Return which part of the box around a ghost the frame leaves."""
    numbers = posed(shape.numbers, view.sigma, Pose(1.0, pose.along_px, pose.size))
    width, height = view.size_px
    far = 8 * max(width, height)
    around = view.frame + np.array([far, far, 0.0, 0.0, 0.0])
    _, _, w, h = window_of(numbers, shape.discs, view.sigma, view.frame, width, height)
    _, _, whole_w, whole_h = window_of(numbers, shape.discs, view.sigma, around, width + 2 * far, height + 2 * far)
    return min(w * h / (whole_w * whole_h), 1.0) if whole_w * whole_h > 0 else 0.0
