"""Measure brightness, shift and size of all ghosts of one view jointly, with the errors from their overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.frame_equations import add_together, draw_together, windows_together
from ...kernels.ghost_model.ghost_mesh import window_of
from ...kernels.ghost_model.pupil_mesh import FIRST_G, FIRST_I
from ...typing import Floats, Indices, Pixels
from ..core.checkpoint import recorded
from ..core.parameter_vector import NUMBERS
from ..core.parameters import Shape
from ..core.pose_curves import Pose, by_shift, posed
from ..core.scratch import ScratchBuffer
from ..core.views import View
from ..fitting.detected_ghost import CHANNELS
from ..fitting.normal_equations import inverse, solution
from .settings import FrameFitSettings

Shapes = tuple[Shape, Shape, Shape]

# parameters per ghost: brightness, shift and size; a uniform background of each colour follows
PER_GHOST = 3
# derivatives by shift and size scale with the brightness, at least this: an invisible ghost would have none
_LEAST_LEVEL = 0.1
# parameters whose derivatives make those of shift and size
_DERIVED = np.array([0, *range(FIRST_G, FIRST_I)], dtype=np.int64)
_ROOM = ScratchBuffer()


def frame_halvings(width: int, settings: FrameFitSettings = FrameFitSettings()) -> int:
    """Return the number of halvings of pictures of this width for `measure_together`."""
    times = 0
    while width > settings.width_px * 2**times:
        times += 1
    return times


@recorded
@dataclass(frozen=True)
class Measured:
    """Poses of all ghosts in one view.

    Attributes
    ----------
    poses : tuple of Pose
    error : ndarray, shape (G, 3)
        Standard deviations of brightness, shift and size; infinite where the view does not determine them.
    crossing : ndarray, shape (G,)
        Factor by which overlap with other ghosts increases the error of the brightness.
    inside : ndarray, shape (G,)
        Fraction of the bounding box of each ghost inside the frame.
    cost : float
        Weighted squares of the residual.
    """

    poses: tuple[Pose, ...]
    error: Floats
    crossing: Floats
    inside: Floats
    cost: float


@dataclass(frozen=True)
class _Drawn:
    """One colour of all ghosts of a view: the sum `picture`, and each ghost with its derivatives.

    See `kernels.ghost_model.frame_equations`.
    """

    picture: Floats
    pixels: Floats
    windows: Indices


def measure_some(
    ghosts: Sequence[Shapes], some: Sequence[int], expected: Sequence[Pose], view: View,
    settings: FrameFitSettings = FrameFitSettings(),
) -> Measured:  # fmt: skip
    """Fit the poses of some ghosts in one view, as `measure_together`; the view determines nothing of the others.

    Parameters
    ----------
    ghosts : sequence of tuple of Shape
    some : sequence of int
        Indices of the ghosts that the view can show.
    expected, view, settings
        As for `measure_together`.
    """
    found = measure_together([ghosts[g] for g in some], [expected[g] for g in some], view, settings)
    poses, chosen = list(expected), list(some)
    for g, pose in zip(chosen, found.poses, strict=True):
        poses[g] = pose
    error, crossing = np.full((len(ghosts), PER_GHOST), np.inf), np.ones(len(ghosts))
    inside = np.array([_inside(shapes[1], pose, view) for shapes, pose in zip(ghosts, poses, strict=True)])
    error[chosen], crossing[chosen] = found.error, found.crossing
    return Measured(tuple(poses), error, crossing, inside, found.cost)


def measure_together(
    ghosts: Sequence[Shapes], expected: Sequence[Pose], view: View, settings: FrameFitSettings = FrameFitSettings()
) -> Measured:
    """Fit brightness, shift and size of every ghost in one view, all at once.

    Parameters
    ----------
    ghosts : sequence of tuple of Shape
        Red, green and blue.
    expected : sequence of Pose
        Predicted poses; the fit stays near them.
    view : View
        With halo and star subtracted.
    settings : FrameFitSettings

    Notes
    -----
    The brightness is linear and can be negative, as noise is. Weak priors about the predicted poses keep an invisible
    ghost in place. An error above `settings.known` of the prior's spread counts as infinite: the prior determines the
    value then.
    """
    poses = list(expected)
    spread = np.array([_spreads(shapes[1], view, settings) for shapes in ghosts]).reshape(-1, PER_GHOST)
    size = PER_GHOST * len(ghosts)
    prior = np.zeros(size + CHANNELS)
    prior[:size] = 1.0 / spread.ravel() ** 2
    # without a prior the background would replace a ghost that fills the picture, or offset one that is too bright
    prior[size:] = 1.0 / _background_spread(view, settings) ** 2
    # a ghost far from its prediction looks like an outlier: reduce the weight of outliers only in the second pass
    drawn = _draw_colours(ghosts, poses, view)
    for robust in (False, True):
        matrix, side, cost, count = _normal_equations(drawn, view, size, robust, settings)
        for _ in range(settings.steps):
            off = np.array([_difference(e, p) for e, p in zip(expected, poses, strict=True)]).reshape(-1, PER_GHOST)
            pulled = side.copy()
            pulled[:size] += prior[:size] * off.ravel()
            step = solution(matrix + np.diag(prior + 1e-12), pulled)
            trial = [
                _stepped(*each, settings.sizes)
                for each in zip(poses, step[:size].reshape(-1, PER_GHOST), spread, strict=True)
            ]
            if float(step @ pulled) < settings.least_gain * cost:
                # the predicted gain is too small for another drawing
                poses = trial
                break
            redrawn = _draw_colours(ghosts, trial, view)
            there = _normal_equations(redrawn, view, size, robust, settings)
            if there[2] > cost:
                break
            enough = there[2] > (1.0 - settings.least_gain) * cost
            poses, drawn, (matrix, side, cost, count) = trial, redrawn, there
            if enough:
                break
    whole = inverse(matrix + np.diag(prior + 1e-12))[:size, :size]
    # a misfit beyond noise increases all errors
    excess = max(1.0, cost / max(count - size, 1))
    error = np.sqrt(np.maximum(np.diag(whole), 0.0) * excess).reshape(-1, PER_GHOST)
    # an error near the prior's spread means that the view does not determine the value
    error[error > settings.known * spread] = np.inf
    alone = np.array([
        np.linalg.inv(matrix[3 * g : 3 * g + 3, 3 * g : 3 * g + 3] + np.diag(prior[3 * g : 3 * g + 3]))[0, 0]
        for g in range(len(ghosts))
    ])  # fmt: skip
    crossing = np.maximum(np.sqrt(np.diag(whole)[::PER_GHOST] / np.maximum(alone, 1e-300)), 1.0)
    inside = np.array([_inside(shapes[1], pose, view) for shapes, pose in zip(ghosts, poses, strict=True)])
    return Measured(tuple(poses), error, crossing, inside, cost)


def _difference(a: Pose, b: Pose) -> tuple[float, float, float]:
    return a.brightness - b.brightness, a.along_px - b.along_px, a.size - b.size


def _spreads(shape: Shape, view: View, settings: FrameFitSettings) -> tuple[float, float, float]:
    radius = abs(float(shape.numbers[FIRST_G]))
    shift = settings.shift_spread * radius + settings.shift_spread_width * view.size_px[0]
    return settings.brightness_spread, shift, settings.size_spread


def _background_spread(view: View, settings: FrameFitSettings) -> Floats:
    """Return the prior spread of the uniform background of each colour: the level of the darkest pixels."""
    known = view.measured.reshape(-1, CHANNELS)
    shown = np.isfinite(known).any(axis=0)
    dark = np.where(shown, np.nanpercentile(np.where(shown, known, 0.0), settings.dark_percentile, axis=0), 0.0)
    least = view.darkest_noise if np.isfinite(view.darkest_noise) else 0.0
    return np.asarray(np.maximum(dark, max(least, 1e-12)), dtype=np.float64)


def _stepped(pose: Pose, step: Floats, limit: Floats, sizes: tuple[float, float]) -> Pose:
    cut = np.clip(step[1:], -limit[1:], limit[1:])
    size = min(max(pose.size + float(cut[1]), sizes[0]), sizes[1])
    return Pose(pose.brightness + float(step[0]), pose.along_px + float(cut[0]), size)


def _normal_equations(
    drawn: Sequence[_Drawn], view: View, size: int, robust: bool, settings: FrameFitSettings
) -> tuple[Floats, Floats, float, int]:
    """Return normal matrix, right-hand side, cost and number of weighted pixel values of a view.

    The first `size` parameters belong to the ghosts; those of the uniform backgrounds follow.
    """
    matrix, side = np.zeros((size + CHANNELS, size + CHANNELS)), np.zeros(size + CHANNELS)
    total, count = 0.0, 0
    for m, colour in enumerate(drawn):
        weight = _weights(view.pixels[..., m], view.variance[..., m].astype(np.float64), colour.picture, settings)
        # the residual includes the uniform background, which each step solves again
        left = np.where(weight > 0.0, view.pixels[..., m] - colour.picture, 0.0)
        if robust:
            weight = weight / (1.0 + weight * left**2 / settings.outlier**2)
        total += float((weight * left**2).sum())
        count += int(np.count_nonzero(weight))
        add_together(colour.pixels, colour.windows, weight, left, size + m, matrix, side)
    return matrix, side, total, count


def _weights(pixels: Pixels, variance: Floats, picture: Floats, settings: FrameFitSettings) -> Floats:
    known = np.isfinite(variance)
    error = settings.model_error * np.maximum(np.abs(picture), np.abs(pixels))
    return np.asarray(np.where(known, 1.0 / (np.where(known, variance, 1.0) + error**2), 0.0))


def _draw_colours(ghosts: Sequence[Shapes], poses: Sequence[Pose], view: View) -> list[_Drawn]:
    """Draw every colour of all ghosts at their poses, with derivatives by brightness, shift and size."""
    return [_draw_colour([shapes[m] for shapes in ghosts], poses, view) for m in range(CHANNELS)]


def _draw_colour(shapes: Sequence[Shape], poses: Sequence[Pose], view: View) -> _Drawn:
    bare = [Pose(1.0, pose.along_px, pose.size) for pose in poses]
    numbers = [posed(shape.numbers, view.sigma, pose) for shape, pose in zip(shapes, bare, strict=True)]
    parameters, discs = np.reshape(numbers, (-1, NUMBERS)), np.array([shape.discs for shape in shapes], dtype=np.int64)
    windows = np.zeros((len(shapes), 6), np.int64)
    seen, count, largest = windows_together(parameters, discs, view.sigma, view.frame, *view.size_px, windows)
    windows, pixels = windows[:seen], np.empty((count, PER_GHOST))
    levels = np.array([max(pose.brightness, _LEAST_LEVEL) for pose in poses])
    shifts = levels * [by_shift(each, view.sigma) for each in numbers]
    growths = levels[:, None] * np.reshape(
        [shape.numbers[FIRST_G:FIRST_I] for shape in shapes], (-1, _DERIVED.size - 1)
    )
    room = _ROOM.some(largest * (_DERIVED.size + 1))
    draw_together(parameters, discs, view.sigma, view.frame, _DERIVED, windows, shifts, growths, room, pixels)
    picture = np.zeros(view.pixels.shape[:2])
    for g, start, top, left, height, width in windows:
        light = pixels[start : start + height * width, 0].reshape(height, width)
        picture[top : top + height, left : left + width] += poses[g].brightness * light
    return _Drawn(picture, pixels, windows)


def _inside(shape: Shape, pose: Pose, view: View) -> float:
    """Return the fraction of a ghost's bounding box that lies inside the frame."""
    numbers = posed(shape.numbers, view.sigma, Pose(1.0, pose.along_px, pose.size))
    width, height = view.size_px
    far = 8 * max(width, height)
    around = view.frame + np.array([far, far, 0.0, 0.0, 0.0])
    _, _, w, h = window_of(numbers, shape.discs, view.sigma, view.frame, width, height)
    _, _, whole_w, whole_h = window_of(numbers, shape.discs, view.sigma, around, width + 2 * far, height + 2 * far)
    return min(w * h / (whole_w * whole_h), 1.0) if whole_w * whole_h > 0 else 0.0
