"""The part of a measurement's report about a model's numbers over the constellation, and how well they are known."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..kernels.measure_bezier import BORDER, INNER
from ..model.ghost_model import AberrationGhost, BezierGhost, GhostModel
from ..render.chart import Series, chart, with_deviation
from ..render.figure import Figure
from ..render.page import figures, folded, paragraph, section, table
from .found import CHANNELS
from .middles import PLACE, RADIANCE, SIZE, Known, Middles, middles_of
from .numbers import Floats, bezier_numbers
from .report_numbers import numbers_table

# constellations of a curve
_STEPS = 41
_RED, _GREEN, _BLUE = range(CHANNELS)
# a colour is drawn as far off green as so many times what this part of all places is off at most
_USUAL, _OFF = 0.9, 3.0
# of a Bezier ghost's numbers
_CENTRE, _HEIGHT, _AWAY, _TOWARDS = 0, 2, 3, 4

_WORDS = (
    "Curves are the model's own numbers, in green. Of a ghost by its aberrations they are of the middle of its pupil, "
    "whether or not a rim leaves that open: where it lands, how large a radius of the pupil is there, at right angles "
    "to the light's line, and how bright it is. Of a Bezier ghost they are its centre, height and inner level."
)
_DOUBTS = (
    "Bands, cut where the chart ends, are one standard deviation to each side, to first order by what the model tells "
    "of each number. How numbers go together it does not tell, so that is left out: where one makes up for another, "
    "less is in doubt. A Bezier ghost's are how far its numbers scatter about their polynomials. No band: nothing is "
    "told. Where a colour is much farther off green than all others, it is left out."
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
    rows = [_row(_followed(ghost, model, 1)) for ghost in model.ghosts]
    head = ("ghost, at degrees", "place, pixels from the axis", "size, pixels", "radiance, red", "green", "blue",
            "red, pixels off green", "blue")  # fmt: skip
    every = [folded(f"Ghost {ghost.name}", numbers_table(ghost)) for ghost in model.ghosts]
    return section(
        "The model's numbers",
        paragraph(_WORDS),
        paragraph(_DOUBTS),
        figures(*_charts(shown, colours)),
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
    told = [*ghost.uncertainty, *[0.0] * (len(values) - len(ghost.uncertainty))]
    return _Followed(ghost, angles, None, [Known(a, np.full(a.size, d)) for a, d in zip(values, told, strict=True)])


def _charts(shown: Sequence[_Followed], colours: Mapping[str, str]) -> list[Figure]:
    """Draw what ghosts of both kinds have, and what those of one kind have, where there are any."""
    meshes = [one for one in shown if one.middles is not None]
    curves = [one for one in shown if one.middles is None]

    def drawn(
        title: str, ghosts: Sequence[_Followed], known: Callable[[_Followed], Known], y_label: str, rises: bool = False
    ) -> Figure:
        lines = [_series(one, known(one), colours) for one in ghosts]
        # one curve alone has no legend
        whose = f": ghost {lines[0].label}" if len(lines) == 1 else ""
        return chart(title + whose, lines, x_label="constellation, degrees", y_label=y_label, logarithmic=rises)

    charts = [
        drawn("Place along the light's line", shown, lambda one: _one(one, PLACE), "pixels from the axis"),
        drawn("Size", shown, lambda one: _one(one, SIZE), "pixels"),
        drawn("Brightness of the middle", shown, lambda one: _one(one, RADIANCE), "radiance", rises=True),
    ]
    if meshes:
        for word, colour in (("Red", _RED), ("Blue", _BLUE)):
            off = np.abs(np.concatenate([_apart(one, colour).value for one in meshes]))
            most = _OFF * float(np.quantile(off, _USUAL))
            charts.append(
                drawn(f"{word}'s place", meshes, partial(_apart, colour=colour, most=most), "pixels off green's")
            )
    if curves:
        charts += [
            drawn("Bezier ghosts' extent to the light", curves, lambda one: one.numbers[_TOWARDS], "pixels"),
            drawn("Bezier ghosts' extent away from it", curves, lambda one: one.numbers[_AWAY], "pixels"),
            drawn("Bezier ghosts' border level", curves, lambda one: one.numbers[BORDER + _GREEN], "radiance"),
        ]
    return charts


def _series(one: _Followed, known: Known, colours: Mapping[str, str]) -> Series:
    name = one.ghost.name
    return Series(name, one.constellation_deg, known.value, colours[name], deviation=known.deviation)


def _one(one: _Followed, quantity: int, colour: int = _GREEN) -> Known:
    """Return what a ghost of either kind has."""
    if one.middles is not None:
        return one.middles.known(quantity, colour)
    return one.numbers[{PLACE: _CENTRE, SIZE: _HEIGHT, RADIANCE: INNER + colour}[quantity]]


def _apart(one: _Followed, colour: int, most: float = np.inf) -> Known:
    """Return how far off green's place another colour's is, not a number where that is more than `most`."""
    if one.middles is None:
        # its colours have one shape
        return Known(np.zeros(one.constellation_deg.size), np.zeros(one.constellation_deg.size))
    apart = one.middles.apart(PLACE, colour, _GREEN)
    return replace(apart, value=np.where(np.abs(apart.value) > most, np.nan, apart.value))


def _row(one: _Followed) -> tuple[str, ...]:
    """Return a table's row about the middle of a ghost's life."""
    cells: Iterable[Known] = (
        _one(one, PLACE), _one(one, SIZE), *(_one(one, RADIANCE, m) for m in range(CHANNELS)), _apart(one, _RED),
        _apart(one, _BLUE),
    )  # fmt: skip
    told = (with_deviation(float(known.value[0]), float(known.deviation[0])) for known in cells)
    return f"{one.ghost.name}, at {one.constellation_deg[0]:.1f}", *told
