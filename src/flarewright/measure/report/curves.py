"""Report section about a model's parameters over the constellation, with their standard deviations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from ...io.images.html_page import html_page
from ...kernels.ghost_model.bezier import BORDER, INNER
from ...model.measurement.ghost_model import AberrationGhost, BezierGhost, GhostModel
from ...render.plots.chart import Series, chart, with_deviation
from ...render.plots.svg import Chart
from ...typing import Floats, Mask
from ..core.parameter_vector import bezier_numbers
from ..fitting.detected_ghost import CHANNELS
from ..tracking.pupil_centre import PLACE, RADIANCE, SIZE, Known, Middles, middles_of, side_of
from .tables import numbers_table

# constellations per curve
_SAMPLES = 41
_RED, _GREEN, _BLUE = range(CHANNELS)
# charts drop places beyond this many times the quantile of all distances
_OUTLIER_QUANTILE, _OUTLIER = 0.9, 3.0
# charts of brightness span this many decades below the brightest
_DECADES = 4
# indices of a Bezier ghost's numbers
_CENTRE, _HEIGHT, _AWAY, _TOWARDS = 0, 2, 3, 4


@dataclass(frozen=True)
class _Followed:
    """A ghost over the constellations at which it is visible.

    Attributes
    ----------
    ghost : AberrationGhost or BezierGhost
    constellation_deg : ndarray, shape (K,)
    middles : Middles or None
        Of an `AberrationGhost`, otherwise None.
    numbers : sequence of Known
        The 19 numbers of a Bezier ghost.
    """

    ghost: AberrationGhost | BezierGhost
    constellation_deg: Floats
    middles: Middles | None
    numbers: Sequence[Known] = ()


def curves_section(model: GhostModel, colours: Mapping[str, str]) -> str:
    """Return the report's section about a model's parameters over the constellation, as HTML.

    Parameters
    ----------
    model : GhostModel
    colours : mapping of str to str
        Colour of each ghost in the charts, by name; tables list all ghosts.

    Returns
    -------
    str
        "" when the model has no ghosts.
    """
    if not model.ghosts:
        return ""
    shown = [_followed(ghost, model, _SAMPLES) for ghost in model.ghosts if ghost.name in colours]
    pupils = any(isinstance(ghost, AberrationGhost) for ghost in model.ghosts)
    beziers = any(isinstance(ghost, BezierGhost) for ghost in model.ghosts)
    rows = [_row(_followed(ghost, model, 1), pupils) for ghost in model.ghosts]
    corner = hypot(*(max(at, size - at) for at, size in zip(model.axis_px, model.size_px, strict=True)))
    return html_page(
        "measured/curves", pupils=pupils, beziers=beziers, decades=_DECADES, outlier=_OUTLIER,
        quantile=_OUTLIER_QUANTILE, charts=_charts(shown, colours, corner), rows=rows,
        every=[(ghost.name, numbers_table(ghost)) for ghost in model.ghosts],
    )  # fmt: skip


def _followed(ghost: AberrationGhost | BezierGhost, model: GhostModel, steps: int) -> _Followed:
    """Sample a ghost over the visible and measured range; with one step at its middle."""
    (low, high), (first, last) = ghost.visible_deg, model.constellation_deg
    ends = min(max(low, first), last), max(min(high, last), first)
    angles = np.linspace(*ends, steps) if steps > 1 else np.array([0.5 * (ends[0] + ends[1])])
    if isinstance(ghost, AberrationGhost):
        return _Followed(ghost, angles, middles_of(ghost, angles, model.largest_deg))
    values = np.array([bezier_numbers(ghost, angle) for angle in angles.tolist()]).T
    values[_CENTRE] *= side_of(angles)
    deviations = [*ghost.uncertainty, *[0.0] * (len(values) - len(ghost.uncertainty))]
    return _Followed(
        ghost, angles, None, [Known(a, np.full(a.size, d)) for a, d in zip(values, deviations, strict=True)]
    )


def _charts(shown: Sequence[_Followed], colours: Mapping[str, str], corner_px: float) -> list[Chart]:
    """Draw the charts common to both kinds of ghosts, and those of each kind that is present."""
    meshes = [one for one in shown if one.middles is not None]
    curves = [one for one in shown if one.middles is None]

    def drawn(
        title: str, ghosts: Sequence[_Followed], quantities: Iterable[Known], y_label: str, rises: bool = False
    ) -> Chart:
        lines = [_series(one, known, colours) for one, known in zip(ghosts, quantities, strict=True)]
        # a single curve has no legend, so the title names its ghost
        whose = f": ghost {lines[0].label}" if len(lines) == 1 else ""
        # one decade more than the data, so that no curve runs along the bottom
        return chart(title + whose, lines, x_label="constellation, degrees", y_label=y_label, logarithmic=rises,
                     decades=_DECADES + 1)  # fmt: skip

    turned = ", below 0 inverted" if meshes else ""
    charts = [
        drawn("Place along the light's line", shown, _places(shown, _GREEN, corner_px), "pixels from the axis"),
        drawn("Size", shown, (_quantity(one, SIZE) for one in shown), f"pixels{turned}"),
        drawn("Brightness of the middle", shown, _brightnesses(shown), "radiance", rises=True),
    ]
    if meshes:
        charts += [
            drawn(f"{word}'s place", meshes, _places(meshes, colour, corner_px), "pixels off green's")
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


def _places(ghosts: Sequence[_Followed], colour: int, corner_px: float) -> list[Known]:
    """Return the places of green, or the shift of another colour from green, restricted to those that are drawn."""
    places = [_quantity(one, PLACE) if colour == _GREEN else _shift(one, colour) for one in ghosts]
    inside = [
        np.maximum(np.abs(_quantity(one, PLACE).value), np.abs(_quantity(one, PLACE, colour).value)) <= corner_px
        for one in ghosts
    ]
    both = list(zip(places, inside, strict=True))
    off = np.abs(np.concatenate([np.zeros(0), *(known.value[there] for known, there in both)]))
    most = _OUTLIER * float(np.quantile(off, _OUTLIER_QUANTILE)) if off.size else 0.0
    return [_masked(known, there & (np.abs(known.value) <= most)) for known, there in both]


def _brightnesses(ghosts: Sequence[_Followed]) -> list[Known]:
    """Return the brightnesses, restricted to the decades of the chart."""
    levels = [_quantity(one, RADIANCE) for one in ghosts]
    whole = np.concatenate([np.zeros(0), *(known.value for known in levels)])
    least = float(whole[np.isfinite(whole)].max(initial=0.0)) * 10.0**-_DECADES
    return [_masked(known, known.value > max(least, 0.0)) for known in levels]


def _masked(known: Known, drawn: Mask) -> Known:
    return replace(known, value=np.where(drawn, known.value, np.nan))


def _quantity(one: _Followed, quantity: int, colour: int = _GREEN) -> Known:
    """Return a quantity that both kinds of ghosts have."""
    if one.middles is not None:
        return one.middles.known(quantity, colour)
    return one.numbers[{PLACE: _CENTRE, SIZE: _HEIGHT, RADIANCE: INNER + colour}[quantity]]


def _shift(one: _Followed, colour: int) -> Known:
    """Return the shift of a colour's place from green's."""
    if one.middles is None:
        # all colours of a Bezier ghost share one shape
        return Known(np.zeros(one.constellation_deg.size), np.zeros(one.constellation_deg.size))
    return one.middles.apart(PLACE, colour, _GREEN)


def _row(one: _Followed, colours: bool) -> tuple[str, ...]:
    """Return the table row of the middle of a ghost's visible range, optionally with the shifts of red and blue."""
    light = [_quantity(one, RADIANCE, m) for m in range(CHANNELS)]
    # a ghost without light has no deviations to show
    brightest = max(float(np.nan_to_num(known.value[0])) for known in light) or np.inf
    cells = [(_quantity(one, PLACE), 1.0), (_quantity(one, SIZE), 1.0), *((known, brightest) for known in light)]
    if colours:
        cells += [(_shift(one, _RED), 1.0), (_shift(one, _BLUE), 1.0)]
    words = (with_deviation(float(known.value[0]), float(known.deviation[0]), least) for known, least in cells)
    return f"{one.ghost.name}, at {one.constellation_deg[0]:.1f}", *words
