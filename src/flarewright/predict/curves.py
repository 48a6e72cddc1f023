"""Statistics over the constellation, sampled adaptively (Walch 2017, chapter 9)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..typing import Floats, Indices, Progress
from .flare import Flare, luminance
from .pictures import Memory, Spread, draw_all, in_colour
from .statistics import NAMES, Statistics, measure
from .table import FlareTable

# number of initial constellations, and least distance between two, degrees
FIRST, LEAST_DEG = 13, 0.2
# values below this part of a curve's maximum are followed less closely
FAINT = 1e-3
# ratio of adjacent samples that counts as a discontinuity
CLIFF = 30.0


@dataclass(frozen=True)
class Curves:
    """Statistics over the constellation.

    Attributes
    ----------
    constellation_deg : ndarray, shape (N,)
        Rising.
    values : ndarray, shape (N, 5)
        Columns in the order of `statistics.NAMES`.
    roll_deg : float
    worst_step : float
        Largest expected interpolation error between two samples at the end of sampling; defined as `tolerance`.
    """

    constellation_deg: Floats
    values: Floats
    roll_deg: float
    worst_step: float

    def column(self, name: str) -> Floats:
        """Return one statistic over the constellation, shape (N,)."""
        return self.values[:, NAMES.index(name)]

    def at(self, constellation_deg: float) -> Statistics:
        """Return `interpolated_statistics`; outside the samples those of the first or last one."""
        angles = self.constellation_deg
        k = int(np.clip(np.searchsorted(angles, constellation_deg) - 1, 0, max(len(angles) - 2, 0)))
        if len(angles) == 1:
            return Statistics(*map(float, self.values[0]))
        part = float(np.clip((constellation_deg - angles[k]) / (angles[k + 1] - angles[k]), 0.0, 1.0))
        return Statistics(*map(float, interpolated_statistics(self.values[k], self.values[k + 1], part)))


@dataclass(frozen=True)
class Check:
    """Curves compared with separate renders at constellations between the samples.

    Attributes
    ----------
    constellation_deg : ndarray, shape (M,)
    predicted, rendered : ndarray, shape (M, 5)
    """

    constellation_deg: Floats
    predicted: Floats
    rendered: Floats


def interpolated_statistics(a: Floats, b: Floats, part: float) -> Floats:
    """Interpolate statistics linearly in their logarithms, and linearly in the values at discontinuities.

    Parameters
    ----------
    a, b : ndarray, shape (5,)
    part : float
        0: at a, 1: at b.

    Notes
    -----
    Towards the edge of the field flare falls by decades, where linear interpolation of the values is too high. Where a
    value falls more than `CLIFF` times between two samples, a ghost has left the frame at an unknown constellation.
    """
    slope = np.maximum(a, b) < CLIFF * np.minimum(a, b)
    logs = np.log(np.where(slope, a, 1.0)) * (1.0 - part) + np.log(np.where(slope, b, 1.0)) * part
    return np.asarray(np.where(slope, np.exp(logs), a * (1.0 - part) + b * part))


def sample_curves(
    table: FlareTable,
    *,
    to_deg: float | None = None,
    roll_deg: float = 0.0,
    tolerance: float = 0.03,
    most: int = 64,
    progress: Progress | None = None,
    spread: Spread | None = None,
) -> Curves:
    """Sample the flare at constellations at which interpolation (`interpolated_statistics`) reaches a tolerance.

    Parameters
    ----------
    table : FlareTable
    to_deg : float, optional
        The largest constellation; None: the flare's reach.
    roll_deg : float
    tolerance : float
        Largest interpolation error of sum, mean, maximum and log-average, relative to the geometric mean of the value
        and the curve's maximum: a value of a tenth of the maximum can have three times the relative error.
    most : int
        Largest number of constellations; `worst_step` shows the error if sampling ends there.
    progress : callable, optional
        Called with the finished part and a description.
    spread : callable, optional
        Draws several constellations at a time, ahead of their turn; the curves do not depend on it.

    Notes
    -----
    The interval with the largest error at its last halving is halved next. The `FIRST` initial constellations are
    evenly spaced, so a narrow peak between two of them can be missed; `check_curves` renders at others.
    """
    end = table.flare.reach_deg if to_deg is None else to_deg
    known: dict[float, Floats] = {}

    def ahead(angles: Sequence[float]) -> None:
        views = [at for at, _, _ in table.views(roll_deg)]
        draw_all([table.request(angle, at) for angle in angles for at in views], spread)

    def draw(angle: float) -> Floats:
        if angle not in known:
            known[angle] = table.at(angle, roll_deg).values
            if progress is not None:
                progress(min(len(known) / most, 1.0), f"{angle:.2f} degrees")
        return known[angle]

    first = [float(angle) for angle in np.linspace(table.flare.least_deg, end, min(FIRST, most))]
    if spread is not None:
        ahead(first)
    for angle in first:
        draw(angle)
    # (error found when the interval was created, start, end)
    waiting = [(np.inf, a, b) for a, b in pairwise(first)]
    while len(known) < most:
        waiting.sort(key=lambda one: (-one[0], one[1]))
        error, a, b = waiting[0] if waiting else (0.0, 0.0, 0.0)
        if error <= tolerance:
            break
        middle = 0.5 * (a + b)
        if spread is not None and any(table.request(middle, at).missing for at, _, _ in table.views(roll_deg)):
            # intervals above the tolerance are all halved, in whatever order, unless `most` ends the sampling
            ahead([0.5 * (low + high) for off, low, high in waiting[: most - len(known)] if off > tolerance])
        before = waiting.pop(0)[0]
        found = draw(middle)
        peak = np.max(list(known.values()), axis=0)
        line = interpolated_statistics(known[a], known[b], 0.5)
        off = np.abs(found - line) / np.maximum(np.sqrt(np.maximum(found, FAINT * peak) * peak), 1e-30)
        error = float(off[_FOLLOWED].max())
        if b - a > 2.0 * LEAST_DEG:
            # halving a smooth interval divides its error by four; keep part of the previous error against chance hits
            left = 0.25 * max(error, 0.25 * before if before < np.inf else 0.0)
            waiting += [(left, a, middle), (left, middle, b)]
    angles = np.array(sorted(known))
    worst = max((one[0] for one in waiting), default=0.0)
    return Curves(angles, np.array([known[angle] for angle in angles]), roll_deg, float(worst))


# the minimum of a picture is mostly 0, so it is recorded but does not control sampling
_FOLLOWED = [NAMES.index(name) for name in ("sum_mm2", "mean", "maximum", "log_average")]


def check_curves(
    curves: Curves,
    judge: Flare,
    count: int,
    progress: Progress | None = None,
    memory: Memory | None = None,
    spread: Spread | None = None,
) -> Check:
    """Compare the curves with renders at constellations between the samples.

    Parameters
    ----------
    curves : Curves
    judge : Flare
        Flare in better quality, over the frame itself, with pixels of the same size.
    count : int
    progress : callable, optional
    memory : dict, optional
        Pictures drawn before; new ones are added.
    spread : callable, optional
        Draws pictures by other processes.

    Returns
    -------
    Check
        At the midpoints between samples that are nearest to an even spacing.
    """
    at = curves.constellation_deg
    middles = 0.5 * (at[1:] + at[:-1])
    wanted = np.linspace(at[0], at[-1], count + 2)[1:-1]
    chosen = sorted({float(middles[int(np.argmin(np.abs(middles - angle)))]) for angle in wanted})
    known: Memory = {} if memory is None else memory
    pictures = draw_all([in_colour(judge, known, angle, curves.roll_deg) for angle in chosen], spread, progress)
    lights = [luminance(picture) for picture in pictures]
    rendered = [measure(light, np.ones_like(light), judge.sensor.area).values for light in lights]
    predicted = [curves.at(angle).values for angle in chosen]
    return Check(np.array(chosen), np.array(predicted).reshape(-1, len(NAMES)), np.array(rendered).reshape(-1, 5))


def bins_of(values: Floats, count: int) -> tuple[Floats, Indices]:
    """Divide the range between the extremes of a curve into equal bins.

    Parameters
    ----------
    values : ndarray, shape (N,)
    count : int
        Number of bins.

    Returns
    -------
    edges : ndarray, shape (count + 1,)
    bins : ndarray, shape (N,)
        1 (least flare) to `count` (most); all 1 for a constant curve.

    Notes
    -----
    Walch 2017, section 9.2: a rating of each constellation relative to all others.
    """
    low, high = float(values.min()), float(values.max())
    edges = np.linspace(low, high, count + 1)
    if high <= low:
        return edges, np.ones(len(values), dtype=np.int64)
    part = (values - low) / (high - low)
    return edges, np.minimum(np.floor(part * count).astype(np.int64) + 1, count)
