"""Fit position, shape and brightness of all ghosts at once to all views by the Levenberg-Marquardt method.

Overlapping ghosts share light and borders. A fit of one ghost at a time sees the errors of the others in its residual
and converges slowly or not at all; the joint fit solves them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.ghost_mesh import window_of
from ...kernels.ghost_model.jacobian import draw_with_changes
from ...kernels.ghost_model.joint_equations import add_jointly
from ...kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_G, FIRST_I
from ...kernels.ghost_model.residuals import weigh_misfit
from ...typing import Floats, Indices, Pixels
from ..core.parallel import map_batched
from ..core.parameters import Shape, free_numbers, stepped
from ..core.sampling import evenly_spaced
from ..core.scratch import ScratchBuffer
from ..core.views import View, halved_pixels
from .colour_prior import Expectation, nothing
from .detected_ghost import DetectedGhost
from .ghost_fit import expected, witness
from .levenberg_marquardt import FAR, minimize
from .patches import scaled
from .settings import FitSettings, JointSettings

_NONE, _NO_CHANGES = np.zeros(0, np.int64), np.zeros((0, 0, 0))
_PLANES, _WINDOWS = ScratchBuffer(), ScratchBuffer()


def fit_shapes_jointly(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], pixels: Sequence[Pixels], channel: int, *, steps: int,
    likes: Sequence[Shape | None] = (), pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> list[Shape]:  # fmt: skip
    """Fit one colour of all ghosts at once.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
        The free parameters of each are those of its last fit in this colour, or the first-order ones before any fit.
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W)
        The colour channel of each view.
    channel : int
    steps : int
        Maximum number of steps.
    likes : sequence of Shape or None
        Each ghost in its leading colour; None: no prior from another colour. Empty: None for all.
    pool : executor, optional
        Runs the views; sums are taken in view order.
    settings : FitSettings
    """
    if not ghosts:
        return []
    small_views = [
        _small_view(ghosts, views[k], pixels[k], channel, k, settings.joint)
        for k in evenly_spaced(range(len(views)), settings.joint.shape_views)
    ]
    frees = [_free(ghost, channel) for ghost in ghosts]
    search = _Search(small_views, frees, views[0].size_px[0], pool, likes or [None] * len(ghosts), settings)
    return search.descend([ghost.shapes[channel] for ghost in ghosts], steps)


def _free(ghost: DetectedGhost, channel: int) -> Indices:
    """Return the parameters of a ghost to fit: all of the last fit but the slopes of brightness.

    `joint_intensities.lit` solves the slopes of brightness over the pupil. Free here as well, they would be degenerate
    with a mapping of the pupil that is stretched in its middle, and ghosts would drift.
    """
    fit, discs = ghost.fits[channel], ghost.shapes[channel].discs
    free = fit.free if fit is not None and fit.shape.discs == discs else free_numbers(1, discs, 0)
    return free[(free <= FIRST_I) | (free >= FIRST_DISC)]


@dataclass(frozen=True)
class _SmallView:
    """One halved view with its inverse variances `known`, and the indices of its visible ghosts."""

    sigma: float
    frame: Floats
    pixels: Floats
    known: Floats
    shown: list[int]


def _small_view(
    ghosts: Sequence[DetectedGhost], view: View, pixels: Pixels, channel: int, number: int, settings: JointSettings
) -> _SmallView:
    times = max(0, int(np.ceil(np.log2(view.size_px[0] / settings.shape_width_px))))
    shown = [g for g, ghost in enumerate(ghosts) if ghost.first <= number <= ghost.last]
    variance = halved_pixels(view.variance[..., channel], times, variance=True).astype(np.float64)
    small = halved_pixels(pixels, times).astype(np.float64)
    return _SmallView(view.sigma, scaled(view.frame, times), small, 1.0 / variance, shown)


def _step_fraction(shape: Shape, free: Indices, step: Floats, settings: JointSettings) -> float:
    """Return the fraction of a step that keeps enough of a ghost's brightness and size.

    The data hardly determine how two ghosts share light. A full step may take all light from one of them, and a ghost
    without light or size has no gradient to recover by.
    """
    part = 1.0
    for number in (FIRST_G, FIRST_I):
        was, by = abs(shape.numbers[number]), np.sign(shape.numbers[number]) * step[free == number].sum()
        if by < (settings.least_remaining - 1.0) * was:
            part = min(part, float((settings.least_remaining - 1.0) * was / by))
    return part


@dataclass(frozen=True)
class _Missed:
    """Residual of all shapes in one view.

    Attributes
    ----------
    cost : float
        Weighted squares.
    total : float
        Sum of the weights.
    count : int
        Number of pixels with weight.
    weight, residual : ndarray, shape (H, W)
    """

    cost: float
    total: float
    count: int
    weight: Floats
    residual: Floats


@dataclass(frozen=True)
class _State:
    """State of a search; `expected` is the prior at the state before the last step."""

    shapes: list[Shape]
    expected: Expectation
    cost: float
    missed: list[_Missed]


@dataclass(frozen=True)
class _Search:
    """Levenberg-Marquardt search over the free parameters of all ghosts, concatenated in ghost order."""

    views: Sequence[_SmallView]
    frees: Sequence[Indices]
    width: int
    pool: ThreadPoolExecutor | None
    likes: Sequence[Shape | None]
    settings: FitSettings

    def descend(self, shapes: list[Shape], steps: int) -> list[Shape]:
        """Minimize the cost; return the last shapes."""
        last, _ = minimize(
            self.look(shapes, None), steps, slopes=self.slopes, moved=self.moved, reweighted=self.reweighted,
            min_gain=self.settings.joint.least_gain, damping=FAR,
        )  # fmt: skip
        return last.shapes

    def look(self, shapes: list[Shape], expected: Expectation | None) -> _State:
        """Draw all shapes and return their state."""
        missed = map_batched(lambda view: self.missed(shapes, view), self.views, pool=self.pool)
        return self.weighed(shapes, nothing(int(self.ends[-1])) if expected is None else expected, missed)

    def weighed(self, shapes: list[Shape], expected: Expectation, missed: list[_Missed]) -> _State:
        """Return a state with the cost of residual and prior."""
        cost = sum(one.cost for one in missed) + expected.squares(self.numbers(shapes))
        return _State(shapes, expected, cost, missed)

    def reweighted(self, at: _State) -> _State:
        """Return a state with the prior recomputed from its shapes and misfit."""
        count = int(self.ends[-1])
        doubt = witness(
            sum(one.cost for one in at.missed), sum(one.count for one in at.missed) - count, self.settings.alike_px
        )
        parts = [
            expected(shape, free, self.width, doubt, like, self.settings.priors)
            for shape, free, like in zip(at.shapes, self.frees, self.likes, strict=True)
        ]
        weights, toward = (np.concatenate([getattr(each, name) for each in parts]) for name in ("weights", "toward"))
        return self.weighed(at.shapes, Expectation(weights, toward), at.missed)

    def moved(self, at: _State, step: Floats) -> _State:
        """Return the state one step away from another."""
        parts = np.split(step, self.ends[1:-1])
        shapes = [
            stepped(shape, free, _step_fraction(shape, free, part, self.settings.joint) * part)
            for shape, free, part in zip(at.shapes, self.frees, parts, strict=True)
        ]
        return self.look(shapes, at.expected)

    def slopes(self, at: _State) -> tuple[Floats, Floats]:
        """Return normal matrix and right-hand side."""
        side = -at.expected.weights * (self.numbers(at.shapes) - at.expected.toward)
        matrix = np.diag(at.expected.weights)
        # add each view's matrix as it arrives, as one matrix is large
        work = (map if self.pool is None else self.pool.map)(
            lambda view, missed: self.equations(at.shapes, view, missed), self.views, at.missed
        )
        for more, beside in work:
            matrix += more
            side += beside
        return matrix, side

    def missed(self, shapes: Sequence[Shape], view: _SmallView) -> _Missed:
        """Draw all shapes in one view and weigh the residual."""
        height, width = view.pixels.shape
        plane = _PLANES.zeros(height, width + 1)
        for g in view.shown:
            shape = shapes[g]
            left, top, w, h = window_of(shape.numbers, shape.discs, view.sigma, view.frame, width, height)
            if not w:
                continue
            # draw each ghost in a separate window: the blur of a soft ghost spreads everything in its window
            own = _WINDOWS.zeros(h, w + 1)
            draw_with_changes(shape.numbers, shape.discs, view.sigma, _NONE, view.frame, left, top, own, _NO_CHANGES)
            plane[top : top + h, left : left + w] += own[:, :w]
        weight, residual = np.empty((height, width)), np.empty((height, width))
        # outliers, which may belong to unknown ghosts, weigh less
        cost, total, count = weigh_misfit(
            plane, view.pixels, view.known, self.settings.model_error, self.settings.outlier, True, weight, residual
        )
        return _Missed(cost, total, count, weight, residual)

    def equations(self, shapes: Sequence[Shape], view: _SmallView, missed: _Missed) -> tuple[Floats, Floats]:
        """Return normal matrix and right-hand side of one view, with its uniform background eliminated."""
        height, width = view.pixels.shape
        drawn, windows, start = [np.zeros(0)], [], 0
        for g in view.shown:
            shape, free = shapes[g], self.frees[g]
            left, top, w, h = window_of(shape.numbers, shape.discs, view.sigma, view.frame, width, height)
            if not w:
                continue
            own, changes = _WINDOWS.zeros(h, w + 1), np.zeros((h, w + 1, free.size))
            draw_with_changes(shape.numbers, shape.discs, view.sigma, free, view.frame, left, top, own, changes)
            drawn.append(changes.ravel())
            windows.append((start, self.ends[g], free.size, top, left, h, w))
            start += changes.size
        count = int(self.ends[-1])
        matrix, side, mean = np.zeros((count, count)), np.zeros(count), np.zeros(count)
        table = np.array(windows, dtype=np.int64).reshape(-1, 7)
        add_jointly(np.concatenate(drawn), table, missed.weight, missed.residual, matrix, side, mean)
        if missed.total > 0.0:
            matrix -= np.outer(mean, mean) / missed.total
        return matrix, side

    @property
    def ends(self) -> Indices:
        """Offsets of the parameters of each ghost, and the end of the last."""
        return np.cumsum([0, *(free.size for free in self.frees)], dtype=np.int64)

    def numbers(self, shapes: Sequence[Shape]) -> Floats:
        """Return the free parameters of all ghosts."""
        return np.concatenate([shape.numbers[free] for shape, free in zip(shapes, self.frees, strict=True)])
