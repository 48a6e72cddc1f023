"""Fit ghosts to all constellations at once: Levenberg-Marquardt with noise weights, inside each ghost's window."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..kernels.measure_changes import draw_with_changes
from ..kernels.measure_edges import sum_along_rows
from ..kernels.measure_mesh import window_of
from ..kernels.measure_pupil import BELOW, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, SOFT
from .colours import Expectation, expectation, nothing
from .marquardt import NEAR, descend
from .normal import inverse
from .numbers import NUMBERS, Floats
from .patches import Missed, Patch, Patches, equations, laid_out, missed
from .room import Room
from .shape import Indices, Shape, free_numbers, stepped
from .views import View

Part = tuple[slice, slice]

# part of the light that the model may miss without blame, so that bright ghosts do not rule faint ones
MODEL_ERROR = 0.03
# what ghosts are like, see `priors`: aberrations over the size, the size at least this part of the picture's width, the
# change of place and size with the field over the width; brightness over the pupil (u, v) and the field (w)
_FIRST_ORDER, _HIGHER_ORDER, _LEAST_SIZE = 0.3, 0.15, 0.04
_ANY, _BY_FIELD = 5.0, 0.3
_SLOPES, _HIGHER_SLOPES = (0.15, 0.25, 0.5), 0.25
# what f and g are divided by, its terms in v and w
_BELOW = (0.3, 2.0)
# what softness is usual, part of the picture's width
_SOFTNESS = 0.005
# pixels that miss a model alike: noise is every pixel's own, what cannot be drawn is not
ALIKE = 64.0
_NONE = np.zeros(0, np.int64)
_NO_CHANGES = np.zeros((0, 0, 0))
_PLANES = Room()


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
        """Standard deviation of all 53 numbers; 0 for those that were not fitted."""
        deviation = np.zeros(NUMBERS)
        # pixels that the model misses by more than noise make all numbers less certain
        excess = max(self.doubt, self.cost / max(self.count - self.free.size, 1))
        deviation[self.free] = np.sqrt(np.maximum(np.diag(self.covariance), 0.0) * excess)
        return deviation


def fitted_numbers(known: Fit | None, shape: Shape) -> Indices:
    """Return which numbers of a shape to fit again: those of a fit with as many discs, or first-order ones."""
    if known is not None and known.shape.discs == shape.discs:
        return known.free
    return free_numbers(1, shape.discs, 1, True)


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
    brightness that changes by less than 0.25 over the pupil; at f/2.8 about twice as much. Of 140 of five lenses three
    in four are best divided by 1 + b v + c w with b below 0.35 and c below 1.0, nine in ten by 0.6 and 2.2.
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
    spread[LATERAL:BELOW] = _SOFTNESS * width
    spread[BELOW:] = _BELOW
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


def expected(shape: Shape, free: Indices, width: int, doubt: float, like: Shape | None) -> Expectation:
    """Return what a ghost's numbers are expected to be, by what ghosts are like and by its other colours.

    Parameters
    ----------
    shape : Shape
    free : ndarray of int, shape (Q,)
    width : int
        Of the whole picture, pixels.
    doubt : float
        From `witness`.
    like : Shape or None
        See `colours.expectation`.
    """
    prior = priors(shape, free, width)
    # where a rim may lie nobody knows beforehand
    prior[(free < FIRST_DISC) | (free >= SOFT)] *= doubt
    return expectation(prior, shape, free, width, doubt, like)


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
    like: Shape | None = None,
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
    like : Shape, optional
        The same ghost in a colour that tells more of it; see `colours.ties`.
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
    search = _Search(laid_out(patches), free, width, offset, error, tails, alike, pool, like)
    last, matrix = search.descend(shape, steps, damping)
    covariance = inverse(search.slopes(last)[0] if matrix is None else matrix)
    cost, count = last.missed.cost, last.missed.count
    return Fit(last.shape, free, covariance, cost, count, witness(cost, count - free.size) if alike else 1.0)


def improve(
    shape: Shape,
    patches: Sequence[Patch],
    free: Indices,
    *,
    width: int,
    steps: int,
    offset: bool = True,
    error: float = MODEL_ERROR,
    tails: bool = True,
    alike: bool = True,
    pool: ThreadPoolExecutor | None = None,
) -> tuple[Shape, float]:
    """Return what `refine` makes of a shape, and its cost: for trials, of which nobody asks how sure they are."""
    search = _Search(laid_out(patches), free, width, offset, error, tails, alike and error > 0.0, pool)
    last, _ = search.descend(shape, steps)
    return last.shape, last.cost


@dataclass(frozen=True)
class _State:
    """Where a search stands: what is expected is that of the state from which the last step was taken."""

    shape: Shape
    expected: Expectation
    cost: float
    missed: Missed


@dataclass(frozen=True)
class _Search:
    """Levenberg and Marquardt's search; see `refine`."""

    patches: Patches
    free: Indices
    width: int
    offset: bool
    error: float
    tails: bool
    alike: bool
    pool: ThreadPoolExecutor | None
    like: Shape | None = None

    def descend(self, shape: Shape, steps: int, damping: float = NEAR) -> tuple[_State, Floats | None]:
        """Go down step by step; return the last state, and its normal matrix when it is known."""
        return descend(
            self.look(shape), steps, slopes=self.slopes, anew=self.anew,
            moved=lambda at, step: self.look(stepped(at.shape, self.free, step), at.expected),
            # a search needs no more than its model is worth; a measurement ends where noise hides every step
            enough=1e-4 if self.error > 0.0 else 1e-7, damping=damping,
        )  # fmt: skip

    def look(self, shape: Shape, expected: Expectation | None = None) -> _State:
        """Return the state of a shape."""
        miss = missed(shape, self.patches, offset=self.offset, error=self.error, tails=self.tails, pool=self.pool)
        return self.weighed(shape, nothing(self.free.size) if expected is None else expected, miss)

    def anew(self, at: _State) -> _State:
        """Return a state with what its shape and its misfit let expect."""
        doubt = witness(at.missed.cost, at.missed.count - self.free.size) if self.alike else 1.0
        return self.weighed(at.shape, expected(at.shape, self.free, self.width, doubt, self.like), at.missed)

    def weighed(self, shape: Shape, expected: Expectation, miss: Missed) -> _State:
        """Return a state with what is expected."""
        return _State(shape, expected, miss.cost + expected.squares(shape.numbers[self.free]), miss)

    def slopes(self, at: _State) -> tuple[Floats, Floats]:
        """Return normal matrix and right side."""
        matrices, sides = equations(at.shape, self.free, self.patches, at.missed, offset=self.offset, pool=self.pool)
        off = at.shape.numbers[self.free] - at.expected.toward
        return matrices.sum(axis=0) + np.diag(at.expected.weights), sides.sum(axis=0) - at.expected.weights * off


def cost_of(
    shape: Shape, patches: Sequence[Patch], *, offset: bool = True, error: float = MODEL_ERROR, tails: bool = True
) -> float:
    """Return the cost of a shape on patches, without the priors."""
    return missed(shape, laid_out(patches), offset=offset, error=error, tails=tails).cost
