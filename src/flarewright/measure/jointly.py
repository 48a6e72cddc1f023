"""Fit all ghosts at once: place, form and light of each, against all views, by Levenberg and Marquardt's way.

Ghosts that lie over each other share their light and their borders. Fitted one after the other each takes what the
others, still wrong, have left it, and they settle slowly or never; together each is given what no other explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..kernels.measure_changes import draw_with_changes
from ..kernels.measure_joint import add_jointly
from ..kernels.measure_mesh import window_of
from ..kernels.measure_misfit import weigh_misfit
from ..kernels.measure_pupil import FIRST_DISC, FIRST_G, FIRST_I
from .colours import Expectation, nothing
from .evenly import evenly
from .fit import MODEL_ERROR, expected, witness
from .found import Found
from .marquardt import FAR, descend
from .numbers import Floats
from .patches import OUTLIER, scaled
from .room import Room
from .shape import Indices, Shape, free_numbers, stepped
from .shared_out import shared_out
from .views import Pixels, View, halved

# ghosts are fitted at once in pictures halved until they are no wider, of so many constellations
_WIDTH, _VIEWS = 240, 16
# part of its light, and of its size, that a ghost keeps in one step
_STAYS = 0.5
# a step that gains less than this part of the cost is the last
_ENOUGH = 3e-4
_NONE, _NO_CHANGES = np.zeros(0, np.int64), np.zeros((0, 0, 0))
_PLANES, _WINDOWS = Room(), Room()


def fitted_jointly(
    ghosts: Sequence[Found],
    views: Sequence[View],
    pixels: Sequence[Pixels],
    channel: int,
    *,
    steps: int,
    error: float = MODEL_ERROR,
    tails: bool = True,
    likes: Sequence[Shape | None] = (),
    pool: ThreadPoolExecutor | None = None,
) -> list[Shape]:
    """Fit one colour of all ghosts at once.

    Parameters
    ----------
    ghosts : sequence of Found
        Of one that was fitted in this colour the same numbers are free; of others its first-order ones.
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W)
        What they show of the colour, for these ghosts to explain.
    channel : int
    steps : int
        At most.
    error : float
        Part of the light that the model may miss.
    tails : bool
        Pixels that are missed by much count less: there may be ghosts that are not known yet.
    likes : sequence of Shape or None
        Each ghost in the colour that tells most of it; empty: of none that is known.
    pool : executor, optional
        Runs the views; sums are taken in their order.

    Returns
    -------
    list of Shape
    """
    if not ghosts:
        return []
    sheets = [_sheet(ghosts, views[k], pixels[k], channel, k) for k in evenly(range(len(views)), _VIEWS)]
    frees = [_free(ghost, channel) for ghost in ghosts]
    search = _Search(sheets, frees, views[0].size_px[0], error, tails, pool, likes or [None] * len(ghosts))
    return search.descend([ghost.shapes[channel] for ghost in ghosts], steps)


def _free(ghost: Found, channel: int) -> Indices:
    """Return which numbers of a ghost are fitted: its brightness over the pupil is `joint.lit`'s to find.

    With that free too, a pupil stretched in its middle and thinned there would look the same, and ghosts stray.
    """
    fit, discs = ghost.fits[channel], ghost.shapes[channel].discs
    free = fit.free if fit is not None and fit.shape.discs == discs else free_numbers(1, discs, 0)
    return free[(free <= FIRST_I) | (free >= FIRST_DISC)]


@dataclass(frozen=True)
class _Sheet:
    """One view as all ghosts are fitted to it, and which of them it shows."""

    sigma: float
    frame: Floats
    pixels: Floats
    known: Floats
    shown: list[int]


def _sheet(ghosts: Sequence[Found], view: View, pixels: Pixels, channel: int, number: int) -> _Sheet:
    times = max(0, int(np.ceil(np.log2(view.size_px[0] / _WIDTH))))
    shown = [g for g, ghost in enumerate(ghosts) if ghost.first <= number <= ghost.last]
    variance = halved(view.variance[..., channel], times, variance=True).astype(np.float64)
    small = halved(pixels, times).astype(np.float64)
    return _Sheet(view.sigma, scaled(view.frame, times), small, 1.0 / variance, shown)


def _cautious(shape: Shape, free: Indices, step: Floats) -> float:
    """Return how much of a step leaves enough of a ghost's light and size.

    What two ghosts share is hardly known: a step may take all of it from one, and of a ghost without light or size
    nothing tells any more what it should be.
    """
    part = 1.0
    for number in (FIRST_G, FIRST_I):
        was, by = abs(shape.numbers[number]), np.sign(shape.numbers[number]) * step[free == number].sum()
        if by < (_STAYS - 1.0) * was:
            part = min(part, float((_STAYS - 1.0) * was / by))
    return part


@dataclass(frozen=True)
class _Missed:
    """How all shapes miss a sheet.

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


@dataclass(frozen=True)
class _State:
    """Where the search stands; see `fit`."""

    shapes: list[Shape]
    expected: Expectation
    cost: float
    missed: list[_Missed]


@dataclass(frozen=True)
class _Search:
    """Levenberg and Marquardt's search over the numbers of all ghosts, one ghost's after the other's."""

    sheets: Sequence[_Sheet]
    frees: Sequence[Indices]
    width: int
    error: float
    tails: bool
    pool: ThreadPoolExecutor | None
    likes: Sequence[Shape | None]

    def descend(self, shapes: list[Shape], steps: int) -> list[Shape]:
        """Go down step by step; return the last shapes."""
        last, _ = descend(
            self.look(shapes, None),
            steps,
            slopes=self.slopes,
            moved=self.moved,
            anew=self.anew,
            enough=_ENOUGH,
            damping=FAR,
        )
        return last.shapes

    def look(self, shapes: list[Shape], expected: Expectation | None) -> _State:
        """Return the state of some shapes."""
        missed = shared_out(lambda sheet: self.missed(shapes, sheet), self.sheets, pool=self.pool)
        return self.weighed(shapes, nothing(int(self.ends[-1])) if expected is None else expected, missed)

    def weighed(self, shapes: list[Shape], expected: Expectation, missed: list[_Missed]) -> _State:
        """Return a state with what is expected."""
        cost = sum(one.cost for one in missed) + expected.squares(self.numbers(shapes))
        return _State(shapes, expected, cost, missed)

    def anew(self, at: _State) -> _State:
        """Return a state with what its shapes and their misfit let expect."""
        count = int(self.ends[-1])
        doubt = witness(sum(one.cost for one in at.missed), sum(one.count for one in at.missed) - count)
        parts = [
            expected(shape, free, self.width, doubt, like)
            for shape, free, like in zip(at.shapes, self.frees, self.likes, strict=True)
        ]
        weights, toward = (np.concatenate([getattr(each, name) for each in parts]) for name in ("weights", "toward"))
        return self.weighed(at.shapes, Expectation(weights, toward), at.missed)

    def moved(self, at: _State, step: Floats) -> _State:
        """Return the state a step away."""
        parts = np.split(step, self.ends[1:-1])
        shapes = [
            stepped(shape, free, _cautious(shape, free, part) * part)
            for shape, free, part in zip(at.shapes, self.frees, parts, strict=True)
        ]
        return self.look(shapes, at.expected)

    def slopes(self, at: _State) -> tuple[Floats, Floats]:
        """Return normal matrix and right side."""
        side = -at.expected.weights * (self.numbers(at.shapes) - at.expected.toward)
        matrix = np.diag(at.expected.weights)
        # one at a time, for a matrix is large: they are added as they come
        work = (map if self.pool is None else self.pool.map)(
            lambda sheet, missed: self.equations(at.shapes, sheet, missed), self.sheets, at.missed
        )
        for more, beside in work:
            matrix += more
            side += beside
        return matrix, side

    def missed(self, shapes: Sequence[Shape], sheet: _Sheet) -> _Missed:
        """Draw all shapes on a sheet and weigh what they miss."""
        height, width = sheet.pixels.shape
        plane = _PLANES.zeros(height, width + 1)
        for g in sheet.shown:
            shape = shapes[g]
            left, top, w, h = window_of(shape.numbers, shape.discs, sheet.sigma, sheet.frame, width, height)
            if not w:
                continue
            # each alone, and then laid over the others: a soft one is spread with all that its plane holds
            own = _WINDOWS.zeros(h, w + 1)
            draw_with_changes(shape.numbers, shape.discs, sheet.sigma, _NONE, sheet.frame, left, top, own, _NO_CHANGES)
            plane[top : top + h, left : left + w] += own[:, :w]
        weight, residual = np.empty((height, width)), np.empty((height, width))
        cost, total, count = weigh_misfit(
            plane, sheet.pixels, sheet.known, self.error, OUTLIER if self.tails else np.inf, True, weight, residual
        )
        return _Missed(cost, total, count, weight, residual)

    def equations(self, shapes: Sequence[Shape], sheet: _Sheet, missed: _Missed) -> tuple[Floats, Floats]:
        """Return normal matrix and right side of one sheet, its even background solved for."""
        height, width = sheet.pixels.shape
        drawn, windows, start = [np.zeros(0)], [], 0
        for g in sheet.shown:
            shape, free = shapes[g], self.frees[g]
            left, top, w, h = window_of(shape.numbers, shape.discs, sheet.sigma, sheet.frame, width, height)
            if not w:
                continue
            own, changes = _WINDOWS.zeros(h, w + 1), np.zeros((h, w + 1, free.size))
            draw_with_changes(shape.numbers, shape.discs, sheet.sigma, free, sheet.frame, left, top, own, changes)
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
        """Where the numbers of each ghost begin, and where the last end."""
        return np.cumsum([0, *(free.size for free in self.frees)], dtype=np.int64)

    def numbers(self, shapes: Sequence[Shape]) -> Floats:
        """Return all free numbers."""
        return np.concatenate([shape.numbers[free] for shape, free in zip(shapes, self.frees, strict=True)])
