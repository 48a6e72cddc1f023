"""All ghosts of one view measured together: brightness, place and size of each, with what they owe to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_mesh import window_of
from ..kernels.measure_pupil import FIRST_G, FIRST_I
from ..kernels.measure_together import add_together, draw_together, windows_together
from .curves import Pose, by_shift, posed
from .fit import MODEL_ERROR
from .found import CHANNELS
from .normal import inverse, solution
from .numbers import NUMBERS, Floats
from .patches import OUTLIER
from .room import Room
from .shape import Shape
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
_ROOM = Room()


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
    """One colour of all ghosts of a view: their sum, and what each adds and changes, see `kernels.measure_together`."""

    picture: Floats
    pixels: Floats
    windows: NDArray[np.int64]


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
    drawn = _drawn(ghosts, poses, view)
    for doubting in (False, True) if sure else (False,):
        matrix, side, cost, count = _normal(drawn, view, size, sure, doubting)
        for _ in range(steps):
            off = np.array([_difference(e, p) for e, p in zip(expected, poses, strict=True)]).reshape(-1, PER_GHOST)
            pulled = side.copy()
            pulled[:size] += prior[:size] * off.ravel()
            step = solution(matrix + np.diag(prior + 1e-12), pulled)
            trial = [_stepped(*each) for each in zip(poses, step[:size].reshape(-1, PER_GHOST), spread, strict=True)]
            if float(step @ pulled) < _GAIN * cost:
                # nothing is left to be told by another picture
                poses = trial
                break
            redrawn = _drawn(ghosts, trial, view)
            there = _normal(redrawn, view, size, sure, doubting)
            if there[2] > cost:
                break
            enough = there[2] > (1.0 - _GAIN) * cost
            poses, drawn, (matrix, side, cost, count) = trial, redrawn, there
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
    known = view.measured.reshape(-1, CHANNELS)
    shown = np.isfinite(known).any(axis=0)
    dark = np.where(shown, np.nanpercentile(np.where(shown, known, 0.0), _DARK, axis=0), 0.0)
    least = view.darkest_noise if np.isfinite(view.darkest_noise) else 0.0
    return np.asarray(np.maximum(dark, max(least, 1e-12)), dtype=np.float64)


def _stepped(pose: Pose, step: Floats, limit: Floats) -> Pose:
    cut = np.clip(step[1:], -limit[1:], limit[1:])
    size = min(max(pose.size + float(cut[1]), 0.4), 2.0)
    return Pose(pose.brightness + float(step[0]), pose.along_px + float(cut[0]), size)


def _normal(
    drawn: Sequence[_Drawn], view: View, size: int, sure: bool, doubting: bool
) -> tuple[Floats, Floats, float, int]:
    """Return the normal matrix, its right side, the cost of a view, and how many numbers it has.

    `size` numbers are the ghosts', those of the even backgrounds come after them.
    """
    matrix, side = np.zeros((size + CHANNELS, size + CHANNELS)), np.zeros(size + CHANNELS)
    total, count = 0.0, 0
    for m, colour in enumerate(drawn):
        weight = _weights(view.pixels[..., m], view.variance[..., m].astype(np.float64), colour.picture, sure)
        # the even background is best known without ghosts; it is refitted with them below
        left = np.where(weight > 0.0, view.pixels[..., m] - colour.picture, 0.0)
        if doubting:
            weight = weight / (1.0 + weight * left**2 / OUTLIER**2)
        total += float((weight * left**2).sum())
        count += int(np.count_nonzero(weight))
        add_together(colour.pixels, colour.windows, weight, left, size + m, matrix, side)
    return matrix, side, total, count


def _weights(pixels: NDArray[np.float32], variance: Floats, picture: Floats, sure: bool) -> Floats:
    known = np.isfinite(variance)
    error = MODEL_ERROR * np.maximum(np.abs(picture), np.abs(pixels)) if sure else 0.0
    return np.asarray(np.where(known, 1.0 / (np.where(known, variance, 1.0) + error**2), 0.0))


def _drawn(ghosts: Sequence[Shapes], poses: Sequence[Pose], view: View) -> list[_Drawn]:
    """Draw every colour of all ghosts as they are foretold, with what changes with brightness, shift and size."""
    return [_colour([shapes[m] for shapes in ghosts], poses, view) for m in range(CHANNELS)]


def _colour(shapes: Sequence[Shape], poses: Sequence[Pose], view: View) -> _Drawn:
    bare = [Pose(1.0, pose.along_px, pose.size) for pose in poses]
    numbers = [posed(shape.numbers, view.sigma, pose) for shape, pose in zip(shapes, bare, strict=True)]
    parameters, discs = np.reshape(numbers, (-1, NUMBERS)), np.array([shape.discs for shape in shapes], dtype=np.int64)
    windows = np.zeros((len(shapes), 6), np.int64)
    seen, count, largest = windows_together(parameters, discs, view.sigma, view.frame, *view.size_px, windows)
    windows, pixels = windows[:seen], np.empty((count, PER_GHOST))
    # a ghost that is not seen has no place either: its light, not below a tenth, scales what place and size change
    levels = np.array([max(pose.brightness, 0.1) for pose in poses])
    shifts = levels * [by_shift(each, view.sigma) for each in numbers]
    growths = levels[:, None] * np.reshape([shape.numbers[FIRST_G:FIRST_I] for shape in shapes], (-1, _FREE.size - 1))
    room = _ROOM.some(largest * (_FREE.size + 1))
    draw_together(parameters, discs, view.sigma, view.frame, _FREE, windows, shifts, growths, room, pixels)
    picture = np.zeros(view.pixels.shape[:2])
    for g, start, top, left, height, width in windows:
        light = pixels[start : start + height * width, 0].reshape(height, width)
        picture[top : top + height, left : left + width] += poses[g].brightness * light
    return _Drawn(picture, pixels, windows)


def _inside(shape: Shape, pose: Pose, view: View) -> float:
    """Return which part of the box around a ghost the frame leaves."""
    numbers = posed(shape.numbers, view.sigma, Pose(1.0, pose.along_px, pose.size))
    width, height = view.size_px
    far = 8 * max(width, height)
    around = view.frame + np.array([far, far, 0.0, 0.0, 0.0])
    _, _, w, h = window_of(numbers, shape.discs, view.sigma, view.frame, width, height)
    _, _, whole_w, whole_h = window_of(numbers, shape.discs, view.sigma, around, width + 2 * far, height + 2 * far)
    return min(w * h / (whole_w * whole_h), 1.0) if whole_w * whole_h > 0 else 0.0
