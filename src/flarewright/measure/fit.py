"""Fit ghosts to all constellations at once: Levenberg-Marquardt with noise weights, inside each ghost's window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_changes import draw_with_changes
from ..kernels.measure_edges import sum_along_rows
from ..kernels.measure_mesh import window_of
from ..kernels.measure_misfit import weigh_misfit
from ..kernels.measure_normal import normal_equations
from ..kernels.measure_pupil import DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, SOFT
from .marquardt import NEAR, descend
from .normal import inverse
from .numbers import NUMBERS, Floats
from .room import Room
from .shared_out import shared_out
from .views import View, halved

Indices = NDArray[np.int64]
Made = TypeVar("Made")
Part = tuple[slice, slice]

# a ghost is fitted on pictures halved until its window has about so many pixels
AREA = 7000
# part of the light that the model may miss without blame, so that bright ghosts do not rule faint ones
MODEL_ERROR = 0.03
# standard deviations beyond which a pixel counts less and less
OUTLIER = 4.0
# what ghosts are like, see `priors`: aberrations over the size, the size at least this part of the picture's width, the
# change of place and size with the field over the width; brightness over the pupil (u, v) and the field (w)
_FIRST_ORDER, _HIGHER_ORDER, _LEAST_SIZE = 0.3, 0.15, 0.04
_ANY, _BY_FIELD = 5.0, 0.3
_SLOPES, _HIGHER_SLOPES = (0.15, 0.25, 0.5), 0.25
# what softness is usual, part of the picture's width
_SOFTNESS = 0.005
# by which wavelengths of a colour may shift a ghost and make it larger, part of its size
_PART = np.array([1.0, 0.25])
# pixels that miss a model alike: noise is every pixel's own, what cannot be drawn is not
ALIKE = 64.0
_NONE = np.zeros(0, np.int64)
_NO_CHANGES = np.zeros((0, 0, 0))
_PLANES, _CHANGES = Room(), Room()


@dataclass(frozen=True)
class Shape:
    """One colour of one ghost while it is fitted.

    Attributes
    ----------
    numbers : ndarray, shape (47,)
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
    doubt : float
        How many pixels count as one witness; see `witness`.
    """

    shape: Shape
    free: Indices
    covariance: Floats
    cost: float
    count: int
    doubt: float = 1.0

    @property
    def uncertainty(self) -> Floats:
        """Standard deviation of all 47 numbers; 0 for those that were not fitted."""
        deviation = np.zeros(NUMBERS)
        # pixels that the model misses by more than noise make all numbers less certain
        excess = max(self.doubt, self.cost / max(self.count - self.free.size, 1))
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


def free_numbers(order: int, discs: int, intensity_order: int, soft: bool = False, lateral: bool = False) -> Indices:
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
    lateral : bool
        And how far the channel's wavelengths part.
    """
    geometry = {0: (0, 3), 1: (0, 1, 2, 3), 2: tuple(range(10))}[order]
    light = {0: (0,), 1: (0, 1, 2, 3), 2: tuple(range(10))}[intensity_order]
    picked = [*geometry, *(FIRST_G + k for k in geometry), *(FIRST_I + k for k in light)]
    picked += [FIRST_DISC + k for k in range(DISC_NUMBERS * discs)]
    picked += [SOFT] if soft else []
    picked += [LATERAL, LATERAL + 1] if lateral else []
    return np.array(picked, dtype=np.int64)


def render(shape: Shape, view: View, scale: float = 1.0) -> Floats:
    """Draw a shape into a picture of a view's size, shape (H, W)."""
    picture = np.zeros(view.pixels.shape[:2])
    part, light = light_of(shape, view)
    picture[part] = scale * light
    return picture


def light_of(shape: Shape, view: View) -> tuple[Part, Floats]:
    """Return which rows and columns of a view a shape touches, and its picture there."""
    left, top, width, height = window_of(shape.numbers, shape.discs, view.sigma, view.frame, *view.size_px)
    if not width:
        return np.s_[0:0, 0:0], np.zeros((0, 0))
    plane = _PLANES.zeros(height, width + 1)
    draw_with_changes(shape.numbers, shape.discs, view.sigma, _NONE, view.frame, left, top, plane, _NO_CHANGES)
    sum_along_rows(plane)
    return np.s_[top : top + height, left : left + width], plane[:, :width].copy()


def brightens(shape: Shape, views: Sequence[View]) -> bool:
    """Tell whether a shape adds light to views, all in all: its rims may leave only a part of what its numbers say."""
    return sum(float(light_of(shape, view)[1].sum()) for view in views) > 0.0


def scaled(frame: Floats, times: int) -> Floats:
    """Return the frame of a picture halved so often."""
    factor = 0.5**times
    return np.array([frame[0] * factor, frame[1] * factor, frame[2], frame[3], frame[4] * factor])


def patches_of(
    shape: Shape,
    views: Sequence[View],
    channel: int,
    masks: Sequence[NDArray[np.bool_]] | None = None,
    beside: Shape | None = None,
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
    beside : Shape, optional
        What this one touches is cut out with it.

    Returns
    -------
    list of Patch
        Of the views that show it.
    """
    windows = [_window(shape, beside, view) for view in views]
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


def _window(shape: Shape, beside: Shape | None, view: View) -> tuple[int, int, int, int]:
    """Return left, top, width and height of what one shape, or either of two, touches in a view."""
    left, top, width, height = window_of(shape.numbers, shape.discs, view.sigma, view.frame, *view.size_px)
    if beside is None:
        return left, top, width, height
    x, y, w, h = _window(beside, None, view)
    if not (width and w):
        return (left, top, width, height) if width else (x, y, w, h)
    right, bottom = max(left + width, x + w), max(top + height, y + h)
    return min(left, x), min(top, y), right - min(left, x), bottom - min(top, y)


def shows(shape: Shape, views: Sequence[View]) -> bool:
    """Tell whether any view reaches a shape."""
    return any(_window(shape, None, view)[2] for view in views)


def coarser(patch: Patch) -> Patch:
    """Return a patch in a picture of half the resolution."""
    # whole pixels of that picture
    part = np.s_[patch.top % 2 :, patch.left % 2 :]
    with np.errstate(divide="ignore"):
        variance = (1.0 / patch.weight[part]).astype(np.float32)
    pixels, variance = halved(patch.pixels[part].astype(np.float32), 1), halved(variance, 1, variance=True)
    left, top = (patch.left + 1) // 2, (patch.top + 1) // 2
    return Patch(patch.sigma, scaled(patch.frame, 1), left, top, pixels.astype(float), 1.0 / variance.astype(float))


@dataclass(frozen=True)
class Misfit:
    """How a shape misses a patch.

    Attributes
    ----------
    cost : float
        Weighted squares.
    total : float
        Sum of the weights.
    count : int
        Pixels that have weight.
    weight, residual : ndarray, shape (H, W)
    """

    cost: float
    total: float
    count: int
    weight: Floats
    residual: Floats


def misfit(shape: Shape, patch: Patch, offset: bool, error: float, tails: bool = True) -> Misfit:
    """Draw a shape on a patch and weigh what it misses; see `refine`."""
    height, width = patch.pixels.shape
    plane, weight, residual = _PLANES.zeros(height, width + 1), np.empty((height, width)), np.empty((height, width))
    draw_with_changes(
        shape.numbers, shape.discs, patch.sigma, _NONE, patch.frame, patch.left, patch.top, plane, _NO_CHANGES
    )
    # heavy tails: other ghosts that are not known yet
    outlier = OUTLIER if error > 0.0 and tails else np.inf
    cost, total, count = weigh_misfit(
        plane, patch.pixels, patch.weight, max(error, 0.0), outlier, offset, weight, residual
    )
    return Misfit(cost, total, count, weight, residual)


def equations(shape: Shape, free: Indices, patch: Patch, missed: Misfit, offset: bool) -> tuple[Floats, Floats]:
    """Return normal matrix and right side of one patch by its misfit."""
    height, width = patch.pixels.shape
    plane, changes = _PLANES.zeros(height, width + 1), _CHANGES.zeros(height, width + 1, free.size)
    draw_with_changes(shape.numbers, shape.discs, patch.sigma, free, patch.frame, patch.left, patch.top, plane, changes)
    matrix, side, mean = np.empty((free.size, free.size)), np.empty(free.size), np.empty(free.size)
    normal_equations(changes, missed.weight, missed.residual, matrix, side, mean)
    if offset and missed.total > 0.0:
        matrix -= np.outer(mean, mean) / missed.total
    return matrix, side


def priors(shape: Shape, free: Indices, width: int) -> Floats:
    """Return inverse variances of numbers about 0: what ghosts of real lenses are like.

    Parameters
    ----------
    shape : Shape
        Its size and brightness scale them.
    free : ndarray of int, shape (Q,)
        Numbers that are asked for.
    width : int
        Of the whole picture, pixels.

    Returns
    -------
    ndarray, shape (Q,)

    Notes
    -----
    `benchmarks.measure.terms` traces them: of 636 whole ghosts of nine lenses at f/5.6 nine in ten have aberrations of
    first order below 0.1 to 0.4 of their size (but f's v, 0.8), three in four of any higher order below 0.1, and
    brightness that changes by less than 0.25 over the pupil; at f/2.8 about twice as much.
    """
    size = max(float(np.abs(shape.numbers[FIRST_G])), _LEAST_SIZE * width)
    light = max(float(np.abs(shape.numbers[FIRST_I])), 1e-12)
    spread = np.empty(NUMBERS)
    for at in (0, FIRST_G):
        # place and size may be any; in focus on the axis a ghost may be large elsewhere
        spread[at : at + 4] = _ANY * width, _FIRST_ORDER * size, _FIRST_ORDER * size, _BY_FIELD * width
        spread[at + 4 : at + 10] = _HIGHER_ORDER * size
    # a slope in brightness that reaches 0 inside the pupil would play a rim's part
    spread[FIRST_I : FIRST_I + 4] = light * np.array([2.0 * _ANY, *_SLOPES])
    spread[FIRST_I + 4 : FIRST_DISC] = _HIGHER_SLOPES * light
    spread[FIRST_DISC:] = 3.0
    spread[SOFT] = (_SOFTNESS * width) ** 2
    spread[LATERAL:] = _SOFTNESS * width
    return np.asarray(1.0 / spread[free] ** 2)


def witness(cost: float, count: int, alike: float = ALIKE) -> float:
    """Return how many pixels count as one witness of a fit, which is at least 1.

    Parameters
    ----------
    cost : float
        Weighted squares that are left.
    count : int
        Of pixels that noise alone would leave as much of.
    alike : float
        Pixels that miss a model alike.

    Notes
    -----
    Weights take every pixel for a witness of its own, as noise makes it. What a model cannot draw, other ghosts above
    all, neighbours see alike: the misfit beyond noise is told `alike` times. By as much more counts what is known of
    ghosts before one looks at them (`priors`).
    """
    return 1.0 + alike * max(cost / max(count, 1) - 1.0, 0.0)


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
    alike: bool = True,
    damping: float = NEAR,
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
    alike : bool
        Neighbours miss the model alike, see `witness`. False while most ghosts are unknown: the misfit is theirs then.
    damping : float
        See `marquardt.descend`.
    pool : executor, optional
        Runs the patches; sums are taken in their order.

    Returns
    -------
    Fit

    Notes
    -----
    See `marquardt`; the Jacobian is the drawn picture's own derivative.
    """
    alike = alike and error > 0.0
    search = _Search(patches, free, width, offset, error, tails, alike, pool)
    last, matrix = search.descend(shape, steps, damping)
    covariance = inverse(search.slopes(last)[0] if matrix is None else matrix)
    cost, count = sum(one.cost for one in last.missed), sum(one.count for one in last.missed)
    return Fit(last.shape, free, covariance, cost, count, witness(cost, count - free.size) if alike else 1.0)


def improve(
    shape: Shape,
    patches: Sequence[Patch],
    free: Indices,
    *,
    width: int,
    steps: int,
    error: float = MODEL_ERROR,
    tails: bool = True,
    alike: bool = True,
    pool: ThreadPoolExecutor | None = None,
) -> tuple[Shape, float]:
    """Return what `refine` makes of a shape, and its cost: for trials, of which nobody asks how sure they are."""
    last, _ = _Search(patches, free, width, True, error, tails, alike and error > 0.0, pool).descend(shape, steps)
    return last.shape, last.cost


@dataclass(frozen=True)
class _State:
    """Where a search stands: the prior is that of the state from which the last step was taken."""

    shape: Shape
    prior: Floats
    cost: float
    missed: list[Misfit]


@dataclass(frozen=True)
class _Search:
    """Levenberg and Marquardt's search; see `refine`."""

    patches: Sequence[Patch]
    free: Indices
    width: int
    offset: bool
    error: float
    tails: bool
    alike: bool
    pool: ThreadPoolExecutor | None

    def descend(self, shape: Shape, steps: int, damping: float = NEAR) -> tuple[_State, Floats | None]:
        """Go down step by step; return the last state, and its normal matrix when it is known."""
        return descend(
            self.look(shape), steps, slopes=self.slopes, anew=self.anew,
            moved=lambda at, step: self.look(stepped(at.shape, self.free, step), at.prior),
            # a search needs no more than its model is worth; a measurement ends where noise hides every step
            enough=1e-4 if self.error > 0.0 else 1e-7, damping=damping,
        )  # fmt: skip

    def look(self, shape: Shape, prior: Floats | None = None) -> _State:
        """Return the state of a shape."""
        missed = self.each(lambda patch: misfit(shape, patch, self.offset, self.error, self.tails), self.patches)
        return self.weighed(shape, np.zeros(self.free.size) if prior is None else prior, missed)

    def anew(self, at: _State) -> _State:
        """Return a state with the prior that its shape and its misfit ask for."""
        prior = priors(at.shape, self.free, self.width)
        if self.alike:
            count = sum(one.count for one in at.missed) - self.free.size
            # where a rim may lie nobody knows beforehand
            known = (self.free < FIRST_DISC) | (self.free >= SOFT)
            prior[known] *= witness(sum(one.cost for one in at.missed), count)
        return self.weighed(at.shape, prior, at.missed)

    def weighed(self, shape: Shape, prior: Floats, missed: list[Misfit]) -> _State:
        cost = sum(one.cost for one in missed) + float(prior @ shape.numbers[self.free] ** 2)
        return _State(shape, prior, cost, missed)

    def slopes(self, at: _State) -> tuple[Floats, Floats]:
        """Return normal matrix and right side."""
        parts = self.each(
            lambda patch, missed: equations(at.shape, self.free, patch, missed, self.offset), self.patches, at.missed
        )
        matrix = np.sum([part[0] for part in parts], axis=0) + np.diag(at.prior)
        return matrix, np.sum([part[1] for part in parts], axis=0) - at.prior * at.shape.numbers[self.free]

    def each(self, work: Callable[..., Made], *given: Sequence[object]) -> list[Made]:
        """Return what is made of every patch, in their order."""
        return shared_out(work, *given, pool=self.pool)


def stepped(shape: Shape, free: Indices, step: Floats) -> Shape:
    """Return a shape moved by a step; a disc never shrinks below a twentieth, and softness not below 0."""
    numbers = shape.numbers.copy()
    numbers[free] += step
    for k in range(shape.discs):
        at = FIRST_DISC + DISC_NUMBERS * k + 2
        numbers[at] = max(numbers[at], 0.05)
    # softer than half as wide as it is, a ghost would be a blot
    numbers[SOFT] = min(max(numbers[SOFT], 0.0), 0.25 * numbers[FIRST_G] ** 2)
    # and what grows much by colour would add light
    wide = np.abs(numbers[FIRST_G]) * _PART
    numbers[LATERAL:] = np.clip(numbers[LATERAL:], -wide, wide)
    return replace(shape, numbers=numbers)


def parted(shape: Shape) -> Shape:
    """Return a shape whose wavelengths part by half of what its borders are soft.

    Wavelengths that part one way look as those that part the other way: from where they do not, no search would begin.
    """
    numbers = shape.numbers.copy()
    if not numbers[LATERAL:].any():
        numbers[SOFT] *= 0.5
        numbers[LATERAL:] = np.sqrt(numbers[SOFT])
    return replace(shape, numbers=numbers)


def cost_of(
    shape: Shape, patches: Sequence[Patch], *, offset: bool = True, error: float = MODEL_ERROR, tails: bool = True
) -> float:
    """Return the cost of a shape on patches, without the priors."""
    return sum(misfit(shape, patch, offset, error, tails).cost for patch in patches)


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
    missed = misfit(shape, patch, False, error, tails=False)
    weight, model = missed.weight, patch.pixels - missed.residual
    if not missed.total > 0.0:
        return Presence(0.0, np.inf)
    even = model - (weight * model).sum() / missed.total
    power = float((weight * even**2).sum())
    if not power > 1e-9:
        return Presence(0.0, np.inf)
    # other ghosts' edges count less and less: from the shape's own brightness on
    weight = weight / (1.0 + weight * missed.residual**2 / (4.0 * OUTLIER) ** 2)
    total = weight.sum()
    even = model - (weight * model).sum() / total
    power = float((weight * even**2).sum())
    return Presence(float((weight * even * patch.pixels).sum()) / max(power, 1e-300), max(power, 1e-300) ** -0.5)
