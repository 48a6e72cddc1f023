"""The part of a measurement's report about a model's numbers over the constellation, and how well they are known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_bezier import BORDER, INNER
from ..model.ghost_model import AberrationGhost, BezierGhost, GhostModel
from ..render.chart import Series, chart, with_deviation
from ..render.figure import Figure
from ..render.page import figures, folded, paragraph, section, table
from .found import CHANNELS
from .middles import PLACE, RADIANCE, SIZE, Known, Middles, middles_of, side_of
from .numbers import Floats, bezier_numbers
from .report_numbers import numbers_table

# constellations of a curve
_STEPS = 41
_RED, _GREEN, _BLUE = range(CHANNELS)
# places are drawn that are as far off as so many times what this part of all is at most
_USUAL, _OFF = 0.9, 3.0
# so far below the brightest middle a chart shows others
_DECADES = 4
# of a Bezier ghost's numbers
_CENTRE, _HEIGHT, _AWAY, _TOWARDS = 0, 2, 3, 4

_CURVES = (
    "Curves are the model's own numbers, in green. Places are counted to the side where the light is at positive "
    "constellations."
)
_PUPILS = (
    "Of a ghost by its aberrations they are of the middle of its pupil, whether or not a rim leaves that open: where "
    "it lands, how large a radius of the pupil is there, at right angles to the light's line, and how bright it is. A "
    "size below 0 is a ghost turned over: what enters on one side of that line lands on the other."
)
_BEZIERS = "Of a Bezier ghost they are its centre, height and inner level."
_LEFT_OUT = (
    f"Charts leave out middles that are dark or a factor of {10**_DECADES:,} below the brightest, and places that are "
    f"farther from the axis than every corner of the picture or more than {_OFF:g} times as far off as "
    f"{_USUAL:.0%} of all; tables leave out nothing."
)
_BANDS = "Bands, cut where the chart ends, are one standard deviation to each side; no band: nothing is told."
_FIRST_ORDER = (
    "They follow to first order from what the model tells of each number of the aberrations. How numbers go together "
    "it does not tell, so that is left out: where one makes up for another, less is in doubt."
)
_SCATTER = (
    "A Bezier ghost's are how far its numbers scatter about their polynomials; nothing is told where a polynomial goes "
    "through all of them."
)


@dataclass(frozen=True)
class _Followed:
    """A ghost over the constellations at which it is there.

    Attributes
    ----------
    ghost : AberrationGhost or BezierGhost
    constellation_deg : ndarray, shape (K,)
    middles : Middles or None
        Of a ghost by its aberrations.
    numbers : sequence of Known
        The 19 of a Bezier ghost.
    """

    ghost: AberrationGhost | BezierGhost
    constellation_deg: Floats
    middles: Middles | None
    numbers: Sequence[Known] = ()


def curves_section(model: GhostModel, colours: Mapping[str, str]) -> str:
    """Return a report's section about a model's numbers over the constellation, as HTML.

    Parameters
    ----------
    model : GhostModel
    colours : mapping of str to str
        Of the ghosts that are drawn, by name; tables have all.

    Returns
    -------
    str
        "" of a model without ghosts.
    """
    if not model.ghosts:
        return ""
    shown = [_followed(ghost, model, _STEPS) for ghost in model.ghosts if ghost.name in colours]
    pupils = any(isinstance(ghost, AberrationGhost) for ghost in model.ghosts)
    beziers = any(isinstance(ghost, BezierGhost) for ghost in model.ghosts)
    rows = [_row(_followed(ghost, model, 1), pupils) for ghost in model.ghosts]
    head = ("ghost, at degrees", "place, pixels from the axis", "size, pixels", "radiance, red", "green", "blue",
            *(("red, pixels off green", "blue") if pupils else ()))  # fmt: skip
    every = [folded(f"Ghost {ghost.name}", numbers_table(ghost)) for ghost in model.ghosts]
    words = [_CURVES, *[_PUPILS] * pupils, *[_BEZIERS] * beziers, _LEFT_OUT]
    doubts = [_BANDS, *[_FIRST_ORDER] * pupils, *[_SCATTER] * beziers]
    corner = hypot(*(max(at, size - at) for at, size in zip(model.axis_px, model.size_px, strict=True)))
    return section(
        "The model's numbers",
        paragraph(" ".join(words)),
        paragraph(" ".join(doubts)),
        figures(*_charts(shown, colours, corner)),
        paragraph("The same in the middle of each ghost's life:"),
        table(head, rows),
        folded("Every number of every ghost", *every),
    )


def _followed(ghost: AberrationGhost | BezierGhost, model: GhostModel, steps: int) -> _Followed:
    """Follow a ghost as far as it is there and was measured; in one step: midway."""
    (low, high), (first, last) = ghost.visible_deg, model.constellation_deg
    ends = min(max(low, first), last), max(min(high, last), first)
    angles = np.linspace(*ends, steps) if steps > 1 else np.array([0.5 * (ends[0] + ends[1])])
    if isinstance(ghost, AberrationGhost):
        return _Followed(ghost, angles, middles_of(ghost, angles, model.largest_deg))
    values = np.array([bezier_numbers(ghost, angle) for angle in angles.tolist()]).T
    values[_CENTRE] *= side_of(angles)
    told = [*ghost.uncertainty, *[0.0] * (len(values) - len(ghost.uncertainty))]
    return _Followed(ghost, angles, None, [Known(a, np.full(a.size, d)) for a, d in zip(values, told, strict=True)])


def _charts(shown: Sequence[_Followed], colours: Mapping[str, str], corner_px: float) -> list[Figure]:
    """Draw what ghosts of both kinds have, and what those of one kind have, where there are any."""
    meshes = [one for one in shown if one.middles is not None]
    curves = [one for one in shown if one.middles is None]

    def drawn(
        title: str, ghosts: Sequence[_Followed], told: Iterable[Known], y_label: str, rises: bool = False
    ) -> Figure:
        lines = [_series(one, known, colours) for one, known in zip(ghosts, told, strict=True)]
        # one curve alone has no legend
        whose = f": ghost {lines[0].label}" if len(lines) == 1 else ""
        # a decade more than is left in, so that none runs along the bottom
        return chart(title + whose, lines, x_label="constellation, degrees", y_label=y_label, logarithmic=rises,
                     decades=_DECADES + 1)  # fmt: skip

    turned = ", below 0 turned over" if meshes else ""
    charts = [
        drawn("Place along the light's line", shown, _near(shown, _GREEN, corner_px), "pixels from the axis"),
        drawn("Size", shown, (_one(one, SIZE) for one in shown), f"pixels{turned}"),
        drawn("Brightness of the middle", shown, _lit(shown), "radiance", rises=True),
    ]
    if meshes:
        charts += [
            drawn(f"{word}'s place", meshes, _near(meshes, colour, corner_px), "pixels off green's")
            for word, colour in (("Red", _RED), ("Blue", _BLUE))
        ]
    if curves:
        charts += [
            drawn("Bezier ghosts' extent to the light", curves, (one.numbers[_TOWARDS] for one in curves), "pixels"),
            drawn("Bezier ghosts' extent away from it", curves, (one.numbers[_AWAY] for one in curves), "pixels"),
            drawn("Bezier ghosts' border level", curves, (one.numbers[BORDER + _GREEN] for one in curves), "radiance"),
        ]
    return charts


def _series(one: _Followed, known: Known, colours: Mapping[str, str]) -> Series:
    name = one.ghost.name
    return Series(name, one.constellation_deg, known.value, colours[name], deviation=known.deviation)


def _near(ghosts: Sequence[_Followed], colour: int, corner_px: float) -> list[Known]:
    """Return green's places, or how far off these another colour's are, as far as they are drawn."""
    told = [_one(one, PLACE) if colour == _GREEN else _apart(one, colour) for one in ghosts]
    inside = [
        np.maximum(np.abs(_one(one, PLACE).value), np.abs(_one(one, PLACE, colour).value)) <= corner_px
        for one in ghosts
    ]
    both = list(zip(told, inside, strict=True))
    off = np.abs(np.concatenate([np.zeros(0), *(known.value[there] for known, there in both)]))
    most = _OFF * float(np.quantile(off, _USUAL)) if off.size else 0.0
    return [_where(known, there & (np.abs(known.value) <= most)) for known, there in both]


def _lit(ghosts: Sequence[_Followed]) -> list[Known]:
    """Return brightnesses, without those that a chart of this many decades cannot hold."""
    told = [_one(one, RADIANCE) for one in ghosts]
    whole = np.concatenate([np.zeros(0), *(known.value for known in told)])
    least = float(whole[np.isfinite(whole)].max(initial=0.0)) * 10.0**-_DECADES
    return [_where(known, known.value > max(least, 0.0)) for known in told]


def _where(known: Known, drawn: NDArray[np.bool_]) -> Known:
    return replace(known, value=np.where(drawn, known.value, np.nan))


def _one(one: _Followed, quantity: int, colour: int = _GREEN) -> Known:
    """Return what a ghost of either kind has."""
    if one.middles is not None:
        return one.middles.known(quantity, colour)
    return one.numbers[{PLACE: _CENTRE, SIZE: _HEIGHT, RADIANCE: INNER + colour}[quantity]]


def _apart(one: _Followed, colour: int) -> Known:
    """Return how far off green's place another colour's is."""
    if one.middles is None:
        # its colours have one shape
        return Known(np.zeros(one.constellation_deg.size), np.zeros(one.constellation_deg.size))
    return one.middles.apart(PLACE, colour, _GREEN)


def _row(one: _Followed, colours: bool) -> tuple[str, ...]:
    """Return a table's row about the middle of a ghost's life, with how far its colours are apart or without."""
    light = [_one(one, RADIANCE, m) for m in range(CHANNELS)]
    # of a ghost without any light nothing is in doubt
    brightest = max(float(np.nan_to_num(known.value[0])) for known in light) or np.inf
    cells = [(_one(one, PLACE), 1.0), (_one(one, SIZE), 1.0), *((known, brightest) for known in light)]
    if colours:
        cells += [(_apart(one, _RED), 1.0), (_apart(one, _BLUE), 1.0)]
    told = (with_deviation(float(known.value[0]), float(known.deviation[0]), least) for known, least in cells)
    return f"{one.ghost.name}, at {one.constellation_deg[0]:.1f}", *told
