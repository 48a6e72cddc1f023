"""Places and sizes that ghosts of lenses within bounds can have, by interval arithmetic: rigorous, not tight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...typing import Floats, Mask
from .problem import Problem

# number of boxes for the bounds of a single structure, and the largest number of free variables for which boxes help
BOXES, FEW_FREE = 256, 10
# with more structures than this nothing is proven, to save time
MOST_STRUCTURES = 400


@dataclass(frozen=True)
class _Interval:
    """An interval, elementwise, shape (B,)."""

    low: Floats
    high: Floats

    def __add__(self, other: _Interval) -> _Interval:
        return _Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: _Interval) -> _Interval:
        return _Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: _Interval) -> _Interval:
        ends = np.stack([self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high])
        return _Interval(ends.min(axis=0), ends.max(axis=0))

    def times(self, factor: float) -> _Interval:
        ends = (self.low * factor, self.high * factor)
        return _Interval(*(ends if factor >= 0.0 else ends[::-1]))

    def inverse(self) -> _Interval:
        """Return 1 / x of an interval that does not contain 0."""
        return _Interval(1.0 / self.high, 1.0 / self.low)


@dataclass(frozen=True)
class _Rows:
    """Powers, reduced gaps and mirrors of every row, as in `kernels.design.ghosts`."""

    power: list[_Interval]
    gap: list[_Interval]
    front: list[_Interval]
    back: list[_Interval]


def least_distances(problem: Problem) -> Floats:
    """Return for each target a lower bound of its distance to every ghost of every lens within the bounds.

    Returns
    -------
    ndarray, shape (N,)
        The larger of the errors of place and radius, mm; 0 where nothing is proven.

    Notes
    -----
    Moore 1966. A ghost is bounded by the stop where |Ma00| is at least stop over entrance, else by the entrance. The
    bounds of a single structure with few free variables are cut into boxes, which tightens the enclosure.
    """
    aim = problem.objective
    least = np.full(len(aim.targets), np.inf)
    if len(problem.structures) > MOST_STRUCTURES:
        return np.zeros(len(aim.targets))
    for stop in sorted({structure.stop for structure in problem.structures}):
        alike = [structure for structure in problem.structures if structure.stop == stop]
        low, high = _boxes(problem, stop)
        rows = _rows(low, high)
        for j, i in {pair for structure in alike for pair in structure.pairs}:
            for place, radius in _ghost(rows, stop, (j, i), _Interval(low[:, 0], high[:, 0]), aim.entrance):
                np.minimum(least, _distances(problem, place, radius), out=least)
    least[~(aim.weights[:, :2].max(axis=1) > 0.0)] = 0.0
    return np.where(least > 1e-6, least, 0.0)


@dataclass(frozen=True)
class BrokenLimit:
    """A hard limit that every lens within the bounds breaks.

    Attributes
    ----------
    names : tuple of str
        "focal_length", "f_number", "length"; several where each alone can be met, but not all by one lens.
    nearest : float or None
        For a single limit, the value nearest to it within the bounds: mm, or the f-number.
    """

    names: tuple[str, ...]
    nearest: float | None


def broken_limits(problem: Problem) -> tuple[BrokenLimit, ...]:
    """Return the hard limits that no lens within the bounds can meet.

    Returns
    -------
    tuple of BrokenLimit
        Empty when nothing is proven.

    Notes
    -----
    As in `least_distances`: 1/efl, 1/f-number and length by interval arithmetic over every structure, or over the boxes
    of a single one with few free variables. A box in which every lens breaks some limit holds no solution; if this is
    so for all boxes, the limits cannot be met.
    """
    named = [(m, name) for m, name in enumerate(("focal_length", "f_number", "length")) if name in problem.bounds.hard]
    if not named or len(problem.structures) > MOST_STRUCTURES:
        return ()
    low, high = (problem.objective.limits[:3, side] for side in (0, 1))
    enclosed: list[list[_Interval]] = [[], [], []]
    for stop in sorted({structure.stop for structure in problem.structures}):
        for m, one in enumerate(_limited(problem, stop)):
            enclosed[m].append(one)
    whole = [_Interval(*(np.concatenate([getattr(one, side) for one in each]) for side in ("low", "high")))
             for each in enclosed]  # fmt: skip
    # tolerance for rounding
    off = {m: np.maximum(whole[m].low - high[m], low[m] - whole[m].high) > 1e-9 * (low[m] + high[m]) for m, _ in named}
    single = [BrokenLimit((name,), _nearest(m, whole[m], float(high[m]))) for m, name in named if off[m].all()]
    if single:
        return tuple(single)
    together = len(named) > 1 and bool(np.any([off[m] for m, _ in named], axis=0).all())
    return (BrokenLimit(tuple(name for _, name in named), None),) if together else ()


def _limited(problem: Problem, stop: int) -> tuple[_Interval, _Interval, _Interval]:
    """Enclose 1/efl, 1/f-number and length of the lenses in every box, for one stop row."""
    low, high = _boxes(problem, stop)
    rows = _rows(low, high)
    last = len(rows.power)
    _, slope = _ray(rows, 0, last, 1.0, 0.0, None)
    a, _ = _ray(rows, 0, stop, 1.0, 0.0, None)
    power = slope.times(-1.0)
    size = _Interval(np.where((a.low <= 0.0) & (a.high >= 0.0), 0.0, np.minimum(np.abs(a.low), np.abs(a.high))),
                     np.maximum(np.abs(a.low), np.abs(a.high)))  # fmt: skip
    with np.errstate(divide="ignore"):
        opened = _Interval(low[:, 0], high[:, 0]) * _Interval(1.0 / size.high, np.minimum(1.0 / size.low, 1e12))
    length = _Interval(low[:, 1:last].sum(axis=1), high[:, 1:last].sum(axis=1))
    return power, power * opened, length


def _nearest(m: int, whole: _Interval, high: float) -> float:
    """Return the attainable value nearest to a limit; for inverses, the number itself."""
    least, most = float(whole.low.min()), float(whole.high.max())
    value = least if least > high else most
    return value if m == 2 else (1.0 / value if value != 0.0 else np.inf)


def _boxes(problem: Problem, stop: int) -> tuple[Floats, Floats]:
    """Return bounds of prescriptions, shape (B, 1 + 3 K): one box per structure, or many boxes of a single one."""
    known = [problem.variables(structure) for structure in problem.structures if structure.stop == stop]
    logs = 1 + known[0].structure.rows
    low = np.array([np.concatenate([one.shortest, one.low[logs:]]) for one in known])
    high = np.array([np.concatenate([one.largest, one.high[logs:]]) for one in known])
    if len(known) > 1 or known[0].free.size > FEW_FREE:
        return low, high
    span = high[0] - low[0]
    while len(low) < BOXES and span.max() > 0.0:
        part = np.where(span > 0.0, (high[0] - low[0]) / np.where(span > 0.0, span, 1.0), 0.0)
        widest = int(np.argmax(part))
        middle = 0.5 * (low[:, widest] + high[:, widest])
        lower, upper = high.copy(), low.copy()
        lower[:, widest], upper[:, widest] = middle, middle
        low, high = np.concatenate([low, upper]), np.concatenate([lower, high])
    return low, high


def _rows(low: Floats, high: Floats) -> _Rows:
    count = (low.shape[1] - 1) // 3
    before = _Interval(np.ones(len(low)), np.ones(len(low)))
    out = _Rows([], [], [], [])
    for k in range(count):
        d, c, n = (_Interval(low[:, v], high[:, v]) for v in (1 + k, 1 + count + k, 1 + 2 * count + k))
        out.power.append((n - before) * c)
        out.gap.append(d * n.inverse())
        out.front.append((before * c).times(2.0))
        out.back.append((n * c).times(-2.0))
        before = n
    return out


def _ray(rows: _Rows, first: int, last: int, y: float, w: float, mirrors: tuple[int, int] | None
         ) -> tuple[_Interval, _Interval]:  # fmt: skip
    """Trace a ray from row `first` to row `last`, or to the sensor behind the last row, along two mirrors if given."""
    ones = np.ones_like(rows.power[0].low)
    height, slope = _Interval(y * ones, y * ones), _Interval(w * ones, w * ones)
    j, i = mirrors or (last, last)
    for k in range(first, j):
        slope = slope - rows.power[k] * height
        height = height + rows.gap[k] * slope
    if mirrors is None:
        return height, slope
    slope = slope + rows.front[j] * height
    for k in range(j - 1, i, -1):
        height = height + rows.gap[k] * slope
        slope = slope - rows.power[k] * height
    height = height + rows.gap[i] * slope
    slope = slope + rows.back[i] * height
    height = height + rows.gap[i] * slope
    for k in range(i + 1, last):
        slope = slope - rows.power[k] * height
        height = height + rows.gap[k] * slope
    return height, slope


def _ghost(
    rows: _Rows, stop: int, pair: tuple[int, int], diameter: _Interval, entrance: float
) -> list[tuple[_Interval, _Interval]]:
    """Enclose place per slope and radius: bounded by the stop with Ma00 above 0 and below 0, then by the entrance.

    A case that does not occur in a box is an empty interval there, from infinity to minus infinity.
    """
    last = len(rows.power)
    front, rear = (pair, None) if pair[0] < stop else (None, pair)
    (a, c), (b, d) = (_ray(rows, 0, stop, y, 1.0 - y, front) for y in (1.0, 0.0))
    (e, _), (f, _) = (_ray(rows, stop, last, y, 1.0 - y, rear) for y in (1.0, 0.0))
    least = diameter.low / entrance
    found = []
    for sign in (1.0, -1.0):
        part = a if sign > 0.0 else a.times(-1.0)
        there = part.high >= least
        held = _Interval(np.maximum(part.low, least), np.maximum(part.high, least))
        inverse = held.inverse().times(sign)
        place, radius = f * inverse, (diameter * (e + f * (c * inverse))).times(0.5)
        found.append((_only(place, there), _only(radius, there)))
    smallest = np.where((a.low <= 0.0) & (a.high >= 0.0), 0.0, np.minimum(np.abs(a.low), np.abs(a.high)))
    there = smallest * entrance < diameter.high
    found.append((_only(e * b + f * d, there), _only((e * a + f * c).times(0.5 * entrance), there)))
    return found


def _only(interval: _Interval, there: Mask) -> _Interval:
    return _Interval(np.where(there, interval.low, np.inf), np.where(there, interval.high, -np.inf))


def _distances(problem: Problem, place: _Interval, radius: _Interval) -> Floats:
    """Return the distance of each target from a ghost's enclosure, least over the boxes, shape (N,)."""
    aim = problem.objective
    slopes = np.repeat(aim.slopes, np.diff(aim.spans))
    wanted = aim.targets[:, 0] / slopes
    along = slopes[:, None] * np.maximum(place.low - wanted[:, None], wanted[:, None] - place.high)
    size = np.full_like(along, np.inf)
    for sign in (1.0,) if aim.signed else (1.0, -1.0):
        target = sign * aim.targets[:, 1, None]
        size = np.minimum(size, np.maximum(radius.low - target, target - radius.high))
    on = aim.weights[:, :2] > 0.0
    off = np.maximum(np.where(on[:, 0, None], along, 0.0), np.where(on[:, 1, None], size, 0.0))
    return np.asarray(np.maximum(off, 0.0).min(axis=1), dtype=np.float64)
