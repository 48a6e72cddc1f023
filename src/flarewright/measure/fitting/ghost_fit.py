"""Fit one ghost to all constellations at once: Levenberg-Marquardt with noise weights, inside the ghost's window."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.edge_coverage import sum_along_rows
from ...kernels.ghost_model.ghost_mesh import window_of
from ...kernels.ghost_model.jacobian import draw_with_changes
from ...kernels.ghost_model.pupil_mesh import BELOW, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, SOFT
from ...typing import Floats, Indices
from ..core.checkpoint import recorded
from ..core.parameter_vector import NUMBERS
from ..core.parameters import Shape, free_numbers, stepped
from ..core.scratch import ScratchBuffer
from ..core.views import View
from .colour_prior import Expectation, expectation, nothing
from .levenberg_marquardt import NEAR, minimize
from .normal_equations import inverse
from .patches import Patch, Patches, PatchResidual, equations, laid_out, residual_in
from .settings import FitSettings, PriorSettings

Part = tuple[slice, slice]

_NONE = np.zeros(0, np.int64)
_NO_CHANGES = np.zeros((0, 0, 0))
_PLANES = ScratchBuffer()


@recorded
@dataclass(frozen=True)
class Fit:
    """Result of a fit.

    Attributes
    ----------
    shape : Shape
    free : ndarray of int
        Indices of the fitted parameters.
    covariance : ndarray, shape (Q, Q)
        Covariance of the fitted parameters.
    cost : float
        Weighted squares over the fitted pixels.
    count : int
        Number of fitted pixels.
    doubt : float
        Pixels per independent observation; see `witness`.
    """

    shape: Shape
    free: Indices
    covariance: Floats
    cost: float
    count: int
    doubt: float = 1.0

    @property
    def uncertainty(self) -> Floats:
        """Standard deviation of all 53 parameters; 0 for those that were not fitted."""
        deviation = np.zeros(NUMBERS)
        # residuals above the noise increase the errors of all parameters
        excess = max(self.doubt, self.cost / max(self.count - self.free.size, 1))
        deviation[self.free] = np.sqrt(np.maximum(np.diag(self.covariance), 0.0) * excess)
        return deviation


def fitted_numbers(known: Fit | None, shape: Shape) -> Indices:
    """Return the parameters to refit: those of a fit with the same number of discs, or else the first-order ones."""
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
    """Return the rows and columns of a view that a shape touches, and its picture there."""
    left, top, width, height = window_of(shape.numbers, shape.discs, view.sigma, view.frame, *view.size_px)
    if not width:
        return np.s_[0:0, 0:0], np.zeros((0, 0))
    plane = _PLANES.zeros(height, width + 1)
    draw_with_changes(shape.numbers, shape.discs, view.sigma, _NONE, view.frame, left, top, plane, _NO_CHANGES)
    sum_along_rows(plane)
    return np.s_[top : top + height, left : left + width], plane[:, :width].copy()


def brightens(shape: Shape, views: Sequence[View]) -> bool:
    """Return whether a shape adds light to the views in total; its rims may leave only parts of negative intensity."""
    return sum(float(light_of(shape, view)[1].sum()) for view in views) > 0.0


def priors(shape: Shape, free: Indices, width: int, settings: PriorSettings = PriorSettings()) -> Floats:
    """Return inverse variances of a prior with mean 0 for the parameters of ghosts of real lenses.

    Parameters
    ----------
    shape : Shape
        Its size and brightness scale the prior.
    free : ndarray of int, shape (Q,)
        Indices of the parameters.
    width : int
        Width of the whole picture, pixels.
    settings : PriorSettings

    Returns
    -------
    ndarray, shape (Q,)

    Notes
    -----
    `benchmarks.measure.terms` traces the spread. Of 636 unvignetted ghosts of nine lenses at f/5.6, nine in ten have
    first-order aberrations below 0.1 to 0.4 of their size (v of f: 0.8). Three in four have each higher-order term
    below 0.1, and brightness that changes by less than 0.25 over the pupil; at f/2.8 about twice as much. The best
    denominator 1 + b v + c w of 140 ghosts of five lenses has b below 0.35 and c below 1.0 for three in four, 0.6 and
    2.2 for nine in ten.
    """
    size = max(float(np.abs(shape.numbers[FIRST_G])), settings.least_size * width)
    light = max(float(np.abs(shape.numbers[FIRST_I])), 1e-12)
    spread = np.empty(NUMBERS)
    for at in (0, FIRST_G):
        # position and size are almost free; a ghost in focus on the axis may be large off axis
        spread[at : at + 4] = (
            settings.wide * width, settings.first_order * size, settings.first_order * size, settings.by_field * width,
        )  # fmt: skip
        spread[at + 4 : at + 10] = settings.higher_order * size
    # a brightness slope that reaches 0 inside the pupil would imitate a rim
    spread[FIRST_I : FIRST_I + 4] = light * np.array([2.0 * settings.wide, *settings.slopes])
    spread[FIRST_I + 4 : FIRST_DISC] = settings.higher_slopes * light
    spread[FIRST_DISC:] = 3.0
    spread[SOFT] = (settings.softness * width) ** 2
    spread[LATERAL:BELOW] = settings.softness * width
    spread[BELOW:] = settings.denominator
    return np.asarray(1.0 / spread[free] ** 2)


def witness(cost: float, count: int, alike: float) -> float:
    """Return the number of pixels per independent observation of a fit, at least 1.

    Parameters
    ----------
    cost : float
        Weighted squares of the residual.
    count : int
        Expectation of these squares from noise alone: pixels minus free parameters.
    alike : float
        Pixels that share one model error.

    Notes
    -----
    The weights of a fit treat every pixel as independent, which holds for noise. The error of the model, above all
    light of unknown ghosts, is common to neighbouring pixels: the fit counts the misfit beyond noise `alike` times. The
    factor returned here scales the weight of the priors to compensate.
    """
    return 1.0 + alike * max(cost / max(count, 1) - 1.0, 0.0)


def expected(
    shape: Shape, free: Indices, width: int, doubt: float, like: Shape | None, settings: PriorSettings = PriorSettings()
) -> Expectation:
    """Return the prior of a ghost's parameters from ghosts of real lenses and from another colour.

    Parameters
    ----------
    shape : Shape
    free : ndarray of int, shape (Q,)
    width : int
        Width of the whole picture, pixels.
    doubt : float
        From `witness`.
    like : Shape or None
        See `colour_prior.expectation`.
    settings : PriorSettings
    """
    prior = priors(shape, free, width, settings)
    # no prior knowledge of the position of rims: their weight stays as it is
    prior[(free < FIRST_DISC) | (free >= SOFT)] *= doubt
    return expectation(prior, shape, free, width, doubt, like, settings)


def refine(
    shape: Shape, patches: Sequence[Patch], free: Indices, *, width: int, steps: int = 12, offset: bool = True,
    error: float | None = None, tails: bool = True, alike: bool = True, damping: float = NEAR,
    like: Shape | None = None, pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> Fit:  # fmt: skip
    """Fit the parameters of one ghost to patches by the Levenberg-Marquardt method.

    Parameters
    ----------
    shape : Shape
        Start values.
    patches : sequence of Patch
    free : ndarray of int
        Indices of the parameters to fit.
    width : int
        Width of the whole picture, pixels; scales the priors.
    steps : int
        Maximum number of steps.
    offset : bool
        Fit a uniform background in every patch.
    error : float, optional
        Expected model error, as a fraction of the light (default: `settings.model_error`); above 0 outliers lose
        weight, too.
    tails : bool
        False: outliers keep their weight.
    alike : bool
        Neighbouring pixels share model errors, see `witness`. False while most ghosts are unknown, as they cause the
        misfit then.
    damping : float
        See `levenberg_marquardt.minimize`.
    like : Shape, optional
        The same ghost in its leading colour; see `colour_prior.ties`.
    pool : executor, optional
        Runs the patches; sums are taken in patch order.
    settings : FitSettings

    Notes
    -----
    See `levenberg_marquardt`; the Jacobian is the exact derivative of the drawn picture.
    """
    error = settings.model_error if error is None else error
    alike = alike and error > 0.0
    search = _Search(laid_out(patches), free, width, offset, error, tails, alike, pool, like, settings=settings)
    last, matrix = search.descend(shape, steps, damping)
    covariance = inverse(search.slopes(last)[0] if matrix is None else matrix)
    cost, count = last.missed.cost, last.missed.count
    return Fit(
        last.shape, free, covariance, cost, count, witness(cost, count - free.size, settings.alike_px) if alike else 1.0
    )


def improve(
    shape: Shape, patches: Sequence[Patch], free: Indices, *, width: int, steps: int, offset: bool = True,
    error: float | None = None, tails: bool = True, alike: bool = True, pool: ThreadPoolExecutor | None = None,
    settings: FitSettings = FitSettings(),
) -> tuple[Shape, float]:  # fmt: skip
    """Refine a shape like `refine`; return shape and cost, without the covariance, which trials do not need."""
    error = settings.model_error if error is None else error
    search = _Search(
        laid_out(patches), free, width, offset, error, tails, alike and error > 0.0, pool, None, settings=settings
    )
    last, _ = search.descend(shape, steps)
    return last.shape, last.cost


@dataclass(frozen=True)
class _State:
    """State of a search; `expected` is the prior at the state before the last step."""

    shape: Shape
    expected: Expectation
    cost: float
    missed: PatchResidual


@dataclass(frozen=True)
class _Search:
    """Levenberg-Marquardt search for one ghost; see `refine`."""

    patches: Patches
    free: Indices
    width: int
    offset: bool
    error: float
    tails: bool
    alike: bool
    pool: ThreadPoolExecutor | None
    like: Shape | None
    settings: FitSettings

    def descend(self, shape: Shape, steps: int, damping: float = NEAR) -> tuple[_State, Floats | None]:
        """Minimize the cost; return the last state, and its normal matrix when known."""
        return minimize(
            self.look(shape), steps, slopes=self.slopes, reweighted=self.reweighted,
            moved=lambda at, step: self.look(stepped(at.shape, self.free, step), at.expected),
            # the model error bounds the useful accuracy of a search; a measurement is fitted to the noise limit
            min_gain=1e-4 if self.error > 0.0 else 1e-7, damping=damping,
        )  # fmt: skip

    def look(self, shape: Shape, expected: Expectation | None = None) -> _State:
        """Draw a shape and return its state."""
        miss = residual_in(
            shape, self.patches, offset=self.offset, error=self.error, tails=self.tails, pool=self.pool,
            settings=self.settings,
        )  # fmt: skip
        return self.weighed(shape, nothing(self.free.size) if expected is None else expected, miss)

    def reweighted(self, at: _State) -> _State:
        """Return a state with the prior recomputed from its shape and misfit."""
        doubt = witness(at.missed.cost, at.missed.count - self.free.size, self.settings.alike_px) if self.alike else 1.0
        return self.weighed(
            at.shape, expected(at.shape, self.free, self.width, doubt, self.like, self.settings.priors), at.missed
        )

    def weighed(self, shape: Shape, expected: Expectation, miss: PatchResidual) -> _State:
        """Return a state with the cost of residual and prior."""
        return _State(shape, expected, miss.cost + expected.squares(shape.numbers[self.free]), miss)

    def slopes(self, at: _State) -> tuple[Floats, Floats]:
        """Return normal matrix and right-hand side."""
        matrices, sides = equations(at.shape, self.free, self.patches, at.missed, offset=self.offset, pool=self.pool)
        off = at.shape.numbers[self.free] - at.expected.toward
        return matrices.sum(axis=0) + np.diag(at.expected.weights), sides.sum(axis=0) - at.expected.weights * off


def cost_of(
    shape: Shape, patches: Sequence[Patch], *, offset: bool = True, error: float | None = None, tails: bool = True,
    settings: FitSettings = FitSettings(),
) -> float:  # fmt: skip
    """Return the cost of a shape on patches, without the priors."""
    error = settings.model_error if error is None else error
    return residual_in(shape, laid_out(patches), offset=offset, error=error, tails=tails, settings=settings).cost
