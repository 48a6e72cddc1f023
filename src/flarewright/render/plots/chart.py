"""Line charts for reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np
from numpy.typing import ArrayLike

from ...typing import Floats
from .svg import FAINT, INK, Area, Box, Chart, Line, Mark, Text

Place = Callable[[float, float], tuple[float, float]]

COLOURS = (
    "#1d5fa8", "#c8413b", "#2d8a5f", "#b06d10", "#7a4fb0", "#2b8f9c", "#8a3f6d", "#5d6b78", "#c9a400", "#e0559b",
    "#4fb3e8", "#7f8c1f",
)  # fmt: skip
_GRID = "#e3e8ed"
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 14.0, 34.0, 44.0
# height of a legend row
_ROW = 14.0
# opacity of bands; limits of their effect on the range of a chart: part of the curves' range, or a factor
_SHADE, _WIDER, _TIMES = 0.16, 0.5, 2.0
# largest number of decimals
_DIGITS = 6
# a smaller relative deviation is rounding error
_ROUNDING = 1e-5


@dataclass(frozen=True)
class Series:
    """One curve of a chart; NaN values leave gaps.

    Attributes
    ----------
    label : str
        Text in the legend; "" for none.
    x, y : array_like, shape (N,)
    colour : str
    width : float
        Of the line; 0 draws dots.
    deviation : array_like, shape (N,), or None
        Standard deviation of `y`, drawn as a band; no band where it is 0 or not finite. None: no band.
    """

    label: str
    x: ArrayLike
    y: ArrayLike
    colour: str = COLOURS[0]
    width: float = 1.8
    deviation: ArrayLike | None = None


def number(value: float) -> str:
    """Format a number with at most four significant digits."""
    if not np.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    size = abs(value)
    if 1e-3 <= size < 1e5:
        return f"{value:.4g}" if size < 9999.5 else f"{value:.0f}"
    digits, _, power = f"{value:.2e}".partition("e")
    return f"{float(digits):g}e{int(power)}"


def with_deviation(value: float, deviation: float, matters: float = 0.0) -> str:
    """Format a number with its standard deviation, in as many digits as that justifies.

    Parameters
    ----------
    value, deviation : float
        A deviation that is 0, or below 1e-5 of the value, is omitted.
    matters : float
        Scale for small values: a deviation below 1e-5 of this is omitted too.
    """
    if not (np.isfinite(value) and np.isfinite(deviation) and deviation > _ROUNDING * max(abs(value), matters)):
        return number(value)
    # two digits if the deviation begins with 1 or 2, else one
    digits = max(0, -floor(log10(deviation / 3.0)))
    if digits > _DIGITS:
        return f"{number(value)} ± {number(float(f'{deviation:.1g}'))}"
    # avoid -0
    return f"{round(value, digits) + 0.0:.{digits}f} ± {deviation:.{digits}f}"


def chart(
    title: str,
    series: Sequence[Series],
    *,
    x_label: str,
    y_label: str = "",
    logarithmic: bool = False,
    size: tuple[int, int] = (460, 270),
    bands: Sequence[float] = (),
    x_ticks: Sequence[tuple[float, str]] | None = None,
    decades: int = 4,
) -> Chart:
    """Draw curves over one axis.

    Parameters
    ----------
    title : str
    series : sequence of Series
    x_label, y_label : str
    logarithmic : bool
        Logarithmic vertical axis, at most `decades` below the largest value.
    size : tuple of int
        Pixels; a legend of several rows adds height.
    bands : sequence of float
        Values at which bins meet, drawn as horizontal lines.
    x_ticks : sequence of (float, str), optional
        Positions and labels; None: round numbers.
    decades : int
    """
    width, height = size
    named = [one for one in series if one.label]
    legend, rows = _legend(named, width) if len(named) > 1 else ([], 0)
    top = _TOP + (2.0 + _ROW * rows if rows else 0.0)
    height += round(_ROW * max(rows - 1, 0))
    box = (_LEFT, width - _RIGHT, top, height - _BOTTOM)
    x_range = _range([np.asarray(one.x, dtype=np.float64) for one in series])
    values = [np.asarray(one.y, dtype=np.float64) for one in series]
    edges = [_edges(one, y) for one, y in zip(series, values, strict=True)]
    shown = [*values, *_near(edges, values, logarithmic)]
    low, high = _log_range(shown, decades) if logarithmic else _range(shown, zero=True)
    marks: list[Mark] = [Text(_LEFT, 20.0, title, 13.0), Text(width - _RIGHT, 20.0, y_label, 10.0, FAINT, "end")]

    def place(x: float, y: float) -> tuple[float, float]:
        if logarithmic:
            y = log10(max(y, 10.0**low))
        across = (x - x_range[0]) / (x_range[1] - x_range[0])
        up = min(max((y - low) / (high - low), 0.0), 1.0)
        return box[0] + across * (box[1] - box[0]), box[3] - up * (box[3] - box[2])

    marks += _grid(place, box, x_range, (low, high), logarithmic, x_ticks)
    marks.append(Text(0.5 * (box[0] + box[1]), height - 10.0, x_label, 11.0, FAINT, "middle"))
    for edge in bands:
        level = place(x_range[0], edge)[1]
        marks.append(Line([(box[0], level), (box[1], level)], "#f0c27a", 0.8))
    for one, around in zip(series, edges, strict=True):
        marks += _around(np.asarray(one.x, dtype=np.float64), around, one.colour, place)
    for one, y in zip(series, values, strict=True):
        marks += _curve(np.asarray(one.x, dtype=np.float64), y, one, place)
    return Chart(width, height, title, (*marks, *legend))


def _edges(one: Series, y: Floats) -> Floats:
    """Return the lower and upper edge of a curve's band, shape (2, N); NaN where there is none."""
    if one.deviation is None:
        return np.full((2, y.size), np.nan)
    wide = np.asarray(one.deviation, dtype=np.float64)
    wide = np.where(np.isfinite(wide) & (wide > 0.0), wide, np.nan)
    return np.stack([y - wide, y + wide])


def _near(edges: Sequence[Floats], values: Sequence[Floats], logarithmic: bool) -> list[Floats]:
    """Clip the edges of bands to the range by which they can widen the chart."""
    whole = np.concatenate([*values, np.zeros(0)])
    whole = whole[np.isfinite(whole) & ((whole > 0.0) | (not logarithmic))]
    if whole.size == 0:
        return []
    low, high = float(whole.min()), float(whole.max())
    if logarithmic:
        return [np.clip(one, low / _TIMES, high * _TIMES) for one in edges]
    room = _WIDER * (max(high, 0.0) - min(low, 0.0)) or np.inf
    return [np.clip(one, low - room, high + room) for one in edges]


def _around(x: Floats, edges: Floats, colour: str, place: Place) -> list[Mark]:
    """Draw a band, one area per contiguous piece."""
    marks: list[Mark] = []
    known = np.flatnonzero(np.isfinite(edges).all(axis=0))
    for piece in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
        if piece.size > 1:
            below, above = ([place(float(x[k]), float(edge[k])) for k in piece] for edge in edges)
            marks.append(Area([*above, *reversed(below)], colour, _SHADE))
    return marks


def _curve(x: Floats, y: Floats, one: Series, place: Place) -> list[Mark]:
    marks: list[Mark] = []
    run: list[tuple[float, float]] = []
    for at, value in zip(x, y, strict=True):
        if np.isfinite(value):
            spot = place(float(at), float(value))
            if one.width == 0.0:
                marks.append(Box(spot[0] - 2.5, spot[1] - 2.5, 5.0, 5.0, one.colour))
            run.append(spot)
        if run and (not np.isfinite(value)):
            marks += [Line(run, one.colour, one.width)] if one.width > 0.0 and len(run) > 1 else []
            run = []
    if one.width > 0.0 and len(run) > 1:
        marks.append(Line(run, one.colour, one.width))
    return marks


def _range(arrays: Sequence[Floats], *, zero: bool = False) -> tuple[float, float]:
    whole = np.concatenate([one[np.isfinite(one)] for one in arrays]) if arrays else np.zeros(0)
    if whole.size == 0:
        return 0.0, 1.0
    low, high = float(whole.min()), float(whole.max())
    if zero:
        low, high = min(low, 0.0), high + 0.04 * max(high - min(low, 0.0), 0.0)
    return (low, high) if high > low else (low, low + 1.0)


def _log_range(arrays: Sequence[Floats], decades: int) -> tuple[float, float]:
    whole = np.concatenate([one[np.isfinite(one) & (one > 0.0)] for one in arrays]) if arrays else np.zeros(0)
    if whole.size == 0:
        return -3.0, 0.0
    high = ceil(log10(float(whole.max())) - 1e-9)
    low = max(floor(log10(float(whole.min())) + 1e-9), high - decades)
    return (float(low), float(high)) if high > low else (float(low - 1), float(high))


def _grid(
    place: Place, box: tuple[float, float, float, float], x_range: tuple[float, float], y_range: tuple[float, float],
    logarithmic: bool, x_ticks: Sequence[tuple[float, str]] | None,
) -> list[Mark]:  # fmt: skip
    marks: list[Mark] = []
    ticks = x_ticks if x_ticks is not None else [(tick, number(tick)) for tick in _round_ticks(*x_range)]
    for tick, words in ticks:
        x = place(tick, y_range[0])[0]
        marks.append(Line([(x, box[2]), (x, box[3])], _GRID))
        marks.append(Text(x, box[3] + 15.0, words, 10.0, INK, "middle"))
    levels = range(int(y_range[0]), int(y_range[1]) + 1) if logarithmic else _round_ticks(*y_range, count=5)
    for level in levels:
        value = 10.0**level if logarithmic else level
        y = place(x_range[0], value)[1]
        marks.append(Line([(box[0], y), (box[1], y)], _GRID))
        marks.append(Text(box[0] - 6.0, y + 3.5, number(value), 10.0, INK, "end"))
    marks.append(Line([(box[0], box[2]), (box[0], box[3]), (box[1], box[3])], FAINT))
    return marks


def _round_ticks(low: float, high: float, count: int = 7) -> list[float]:
    step = 10.0 ** floor(log10((high - low) / count))
    step *= next(times for times in (1.0, 2.0, 5.0, 10.0) if (high - low) / (times * step) <= count)
    first = ceil(low / step - 1e-9)
    return [round(k * step, 12) for k in range(first, floor(high / step + 1e-9) + 1)]


def _legend(named: Sequence[Series], width: int) -> tuple[list[Mark], int]:
    """Return the marks of the legend and its number of rows."""
    marks: list[Mark] = []
    x, row = _LEFT, 0
    for one in named:
        wide = 30.0 + 5.6 * len(one.label)
        if x > _LEFT and x + wide > width:
            x, row = _LEFT, row + 1
        y = _TOP + _ROW * row
        marks += [Line([(x, y), (x + 14.0, y)], one.colour, 2.0), Text(x + 18.0, y + 4.0, one.label, 10.0)]
        x += wide
    return marks, row + 1
