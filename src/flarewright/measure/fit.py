"""Fit ghosts to all constellations at once: Levenberg-Marquardt with noise weights, inside each ghost's window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_edges import sum_along_rows
from ..kernels.measure_mesh import draw_with_changes, window_of
from ..kernels.measure_normal import normal_equations
from ..kernels.measure_pupil import DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, SOFT
from .normal import inverse, solution
from .numbers import NUMBERS, Floats
from .views import View, halved

Indices = NDArray[np.int64]

# a ghost is fitted on pictures halved until its window has about so many pixels
AREA = 7000
# part of the light that the model may miss without blame, so that bright ghosts do not rule faint ones
MODEL_ERROR = 0.03
# standard deviations beyond which a pixel counts less and less
OUTLIER = 4.0
# what softness is usual, part of the picture's width
_SOFTNESS = 0.005
_NONE = np.zeros(0, np.int64)


@dataclass(frozen=True)
class Shape:
    """One colour of one ghost while it is fitted.

    Attributes
    ----------
    numbers : ndarray, shape (45,)
        See `kernels.measure_pupil`.
    discs : int
    """

    numbers: Floats
    discs: int = 0


@dataclass(frozen=True)
class Fit:
    """What came of it.

    Attributes
    ----------
    shape : Shape
    free : ndarray of int
        Numbers that were fitted.
    covariance : ndarray, shape (Q, Q)
        Of those.
    cost : float
        Weighted squares over the pixels looked at.
    count : int
        Pixels looked at.
    """

    shape: Shape
    free: Indices
    covariance: Floats
    cost: float
    count: int

    @property
    def uncertainty(self) -> Floats:
        """Standard deviation of all 45 numbers; 0 for those that were not fitted."""
        deviation = np.zeros(NUMBERS)
        # pixels that the model misses by more than noise make all numbers less certain
        excess = max(1.0, self.cost / max(self.count - self.free.size, 1))
        deviation[self.free] = np.sqrt(np.maximum(np.diag(self.covariance), 0.0) * excess)
        return deviation


@dataclass(frozen=True)
class Patch:
    """The part of a view that one fit looks at, at its resolution."""

    sigma: float
    frame: Floats
    left: int
    top: int
    pixels: Floats
    weight: Floats


def free_numbers(order: int, discs: int, intensity_order: int, soft: bool = False) -> Indices:
    """Return which numbers to fit.

    Parameters
    ----------
    order : int
        0: place, size and their change with the field; 1: Seidel's aberrations; 2: all.
    discs : int
    intensity_order : int
        0: even; 1: first order in u, v, w; 2: all.
    soft : bool
        Also how soft the borders are.
    """
    geometry = {0: (0, 3), 1: (0, 1, 2, 3), 2: tuple(range(10))}[order]
    light = {0: (0,), 1: (0, 1, 2, 3), 2: tuple(range(10))}[intensity_order]
    picked = [*geometry, *(FIRST_G + k for k in geometry), *(FIRST_I + k for k in light)]
    picked += [FIRST_DISC + k for k in range(DISC_NUMBERS * discs)]
    picked += [SOFT] if soft else []
    return np.array(picked, dtype=np.int64)


def render(shape: Shape, view: View, scale: float = 1.0) -> Floats:
    """Draw a shape into a picture of a view's size, shape (H, W)."""
    width, height = view.size_px
    plane = np.zeros((height, width + 1))
    draw_with_changes(shape.numbers, shape.discs, view.sigma, _NONE, view.frame, 0, 0, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    return scale * plane[:, :width]


def scaled(frame: Floats, times: int) -> Floats:
    """Return the frame of a picture halved so often."""
    factor = 0.5**times
    return np.array([frame[0] * factor, frame[1] * factor, frame[2], frame[3], frame[4] * factor])


def patches_of(
    shape: Shape, views: Sequence[View], channel: int, masks: Sequence[NDArray[np.bool_]] | None = None
) -> list[Patch]:
    """Cut out what a ghost touches, and a margin, from every view.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
        Their pixels hold this ghost alone, as far as it is known.
    channel : int
    masks : sequence of ndarray of bool, optional
        Where to look, per view.

    Returns
    -------
    list of Patch
        Of the views that show it.
    """
    windows = [window_of(shape.numbers, shape.discs, view.sigma, view.frame, *view.size_px) for view in views]
    areas = [window[2] * window[3] for window in windows if window[2]]
    if not areas:
        return []
    times = max(0, int(np.ceil(0.5 * np.log2(max(float(np.median(areas)) / AREA, 1.0)))))
    found = []
    for k, (view, (left, top, width, height)) in enumerate(zip(views, windows, strict=True)):
        if not width:
            continue
        margin, side = 4 + int(0.12 * max(width, height)), 2**times
        x0, y0 = max(left - margin, 0) // side, max(top - margin, 0) // side
        x1 = min(left + width + margin, view.size_px[0]) // side
        y1 = min(top + height + margin, view.size_px[1]) // side
        if x1 - x0 < 3 or y1 - y0 < 3:
            continue
        part = np.s_[y0 * side : y1 * side, x0 * side : x1 * side]
        pixels = halved(view.pixels[part][..., channel], times)
        variance = halved(view.variance[part][..., channel], times, variance=True)
        if masks is not None:
            variance = np.where(halved(masks[k][part].astype(np.float32), times) > 0.99, variance, np.inf)
        found.append(
            Patch(view.sigma, scaled(view.frame, times), x0, y0, pixels.astype(float), 1.0 / variance.astype(float))
        )
    return found


def evaluate(
    shape: Shape, free: Indices, patch: Patch, offset: bool, error: float, tails: bool = True
) -> tuple[float, int, Floats, Floats]:
    """Return cost, pixels, normal matrix and right side of one patch."""
    height, width = patch.pixels.shape
    plane, changes = np.zeros((height, width + 1)), np.zeros((height, width + 1, free.size))
    draw_with_changes(shape.numbers, shape.discs, patch.sigma, free, patch.frame, patch.left, patch.top, plane, changes)
    sum_along_rows(plane)
    model = plane[:, :width]
    weight = _weights(patch, model, error)
    residual = patch.pixels - model
    total = weight.sum()
    if offset and total > 0.0:
        residual = residual - (weight * residual).sum() / total
    # heavy tails: other ghosts that are not known yet
    if error > 0.0 and tails:
        weight = weight / (1.0 + weight * residual**2 / OUTLIER**2)
        total = weight.sum()
    cost = float((weight * residual**2).sum())
    count = int(np.count_nonzero(weight))
    matrix, side, mean = np.empty((free.size, free.size)), np.empty(free.size), np.empty(free.size)
    if free.size:
        normal_equations(changes, weight, residual, matrix, side, mean)
    if offset and total > 0.0:
        matrix -= np.outer(mean, mean) / total
    return cost, count, matrix, side


def _weights(patch: Patch, model: Floats, error: float) -> Floats:
    """Return inverse variances, the model's own error included."""
    if error <= 0.0:
        return patch.weight
    level = np.maximum(np.abs(model), np.abs(patch.pixels))
    return np.asarray(patch.weight / (1.0 + patch.weight * (error * level) ** 2))


def priors(shape: Shape, free: Indices, width: int) -> Floats:
    """Return weak inverse variances of numbers about 0, which keep unseen directions still."""
    spread = np.full(NUMBERS, max(float(np.abs(shape.numbers[FIRST_G])), 0.04 * width))
    spread[[0, 3, FIRST_G]] = 5.0 * width
    # a slope in brightness that reaches 0 inside the pupil would play a rim's part
    spread[FIRST_I:FIRST_DISC] = 0.5 * max(float(np.abs(shape.numbers[FIRST_I])), 1e-12)
    spread[FIRST_I] *= 20.0
    spread[FIRST_DISC:] = 3.0
    spread[SOFT] = (_SOFTNESS * width) ** 2
    return np.asarray(1.0 / spread[free] ** 2)


def refine(
    shape: Shape,
    patches: Sequence[Patch],
    free: Indices,
    *,
    width: int,
    steps: int = 12,
    offset: bool = True,
    error: float = MODEL_ERROR,
    tails: bool = True,
    pool: ThreadPoolExecutor | None = None,
) -> Fit:
    """Fit one ghost's numbers to patches by Levenberg-Marquardt.

    Parameters
    ----------
    shape : Shape
        Where to begin.
    patches : sequence of Patch
    free : ndarray of int
        Numbers to fit.
    width : int
        Of the whole picture, pixels; scales the priors.
    steps : int
        At most.
    offset : bool
        Every patch has an unknown even background.
    error : float
        Part of the light that the model may miss; above 0 outliers count less, too.
    tails : bool
        False: they count as all do.
    pool : executor, optional
        Runs the patches; sums are taken in their order.

    Returns
    -------
    Fit

    Notes
    -----
    Marquardt (1963): the damping scales with the diagonal. The Jacobian is the drawn picture's own derivative.
    """
    run: Callable[..., object] = map if pool is None else pool.map

    def look(trial: Shape) -> tuple[float, int, Floats, Floats]:
        parts: list[tuple[float, int, Floats, Floats]] = list(
            run(lambda patch: evaluate(trial, free, patch, offset, error, tails), patches)  # type: ignore[call-overload]
        )
        prior = priors(shape, free, width)
        at = trial.numbers[free]
        cost = sum(part[0] for part in parts) + float(prior @ at**2)
        matrix = np.sum([part[2] for part in parts], axis=0) + np.diag(prior)
        return cost, sum(part[1] for part in parts), matrix, np.sum([part[3] for part in parts], axis=0) - prior * at

    cost, count, matrix, side = look(shape)
    damping = 1e-3
    for _ in range(steps):
        improved = False
        for _retry in range(8):
            step = solution(matrix + damping * np.diag(np.diag(matrix)), side)
            trial = stepped(shape, free, step)
            trial_cost, trial_count, trial_matrix, trial_side = look(trial)
            if trial_cost < cost:
                improved = True
                break
            damping = max(damping, 1e-4) * 6.0
        if not improved:
            break
        gained = cost - trial_cost
        shape, cost, count, matrix, side = trial, trial_cost, trial_count, trial_matrix, trial_side
        damping *= 0.2
        # a search needs no more than its model is worth; a measurement ends where noise hides every step
        if gained < (1e-4 if error > 0.0 else 1e-7) * cost:
            break
    return Fit(shape, free, inverse(matrix), cost, count)


def stepped(shape: Shape, free: Indices, step: Floats) -> Shape:
    """Return a shape moved by a step; a disc never shrinks below a twentieth, and softness not below 0."""
    numbers = shape.numbers.copy()
    numbers[free] += step
    for k in range(shape.discs):
        at = FIRST_DISC + DISC_NUMBERS * k + 2
        numbers[at] = max(numbers[at], 0.05)
    # softer than half as wide as it is, a ghost would be a blot
    numbers[SOFT] = min(max(numbers[SOFT], 0.0), 0.25 * numbers[FIRST_G] ** 2)
    return replace(shape, numbers=numbers)


def cost_of(
    shape: Shape, patches: Sequence[Patch], *, offset: bool = True, error: float = MODEL_ERROR, tails: bool = True
) -> float:
    """Return the cost of a shape on patches, without the priors."""
    none = np.zeros(0, np.int64)
    return sum(evaluate(shape, none, patch, offset, error, tails)[0] for patch in patches)


@dataclass(frozen=True)
class Presence:
    """How much of a ghost one view shows.

    Attributes
    ----------
    amplitude : float
        1: as bright as the shape says; 0 when the view does not reach it.
    error : float
        Standard deviation of the amplitude; infinite when the view does not reach it.
    """

    amplitude: float
    error: float


def presence(shape: Shape, view: View, channel: int, error: float = MODEL_ERROR) -> Presence:
    """Return how much of a shape a view shows, an even background aside.

    Parameters
    ----------
    shape : Shape
    view : View
        Its pixels hold this ghost alone, as far as it is known.
    channel : int
    error : float
        Part of the light that the model may miss.
    """
    patches = patches_of(shape, [view], channel)
    if not patches:
        return Presence(0.0, np.inf)
    patch = patches[0]
    height, width = patch.pixels.shape
    plane = np.zeros((height, width + 1))
    none = np.zeros((height, width + 1, 0))
    draw_with_changes(
        shape.numbers, shape.discs, patch.sigma, np.zeros(0, np.int64), patch.frame, patch.left, patch.top, plane, none
    )
    sum_along_rows(plane)
    model = plane[:, :width]
    weight = _weights(patch, model, error)
    total = weight.sum()
    if not total > 0.0:
        return Presence(0.0, np.inf)
    even = model - (weight * model).sum() / total
    power = float((weight * even**2).sum())
    if not power > 1e-9:
        return Presence(0.0, np.inf)
    # other ghosts' edges count less and less: from the shape's own brightness on
    weight = weight / (1.0 + weight * (patch.pixels - model) ** 2 / (4.0 * OUTLIER) ** 2)
    total = weight.sum()
    even = model - (weight * model).sum() / total
    power = float((weight * even**2).sum())
    return Presence(float((weight * even * patch.pixels).sum()) / max(power, 1e-300), max(power, 1e-300) ** -0.5)
