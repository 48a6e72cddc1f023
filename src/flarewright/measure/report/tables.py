"""Tables of the report: every parameter of a ghost as stored in the model's file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...io.images.html_page import html_page
from ...kernels.ghost_model.bezier import BORDER
from ...kernels.ghost_model.pupil_mesh import (
    BELOW,
    DISC_NUMBERS,
    FIRST_DISC,
    FIRST_G,
    FIRST_I,
    LATERAL,
    MOST_DISCS,
    SOFT,
)
from ...model.measurement.ghost_model import AberrationGhost, BezierGhost, Curves
from ...render.plots.chart import number, with_deviation
from ..core.parameter_vector import bezier_numbers, channel_deviation, channel_numbers

_TERMS = ("1", "u", "v", "w", "uu", "uv", "vv", "uw", "vw", "ww")
_DISC = ("centre by s", "centre by s w", "radius")
_LATERAL = ("f'", "g'", 'f"', 'g"', "f' by w", "g' by w")
_BEZIER = (
    "centre, to the light", "centre, across", "height", "extent away from the light", "extent to it",
    "control away, along", "control away, across", "control to it, along", "control to it, across", "falloff outside",
    "falloff inside", "exponent outside", "exponent inside", "border level, red", "border level, green",
    "border level, blue", "inner level, red", "inner level, green", "inner level, blue",
)  # fmt: skip


def numbers_table(ghost: AberrationGhost | BezierGhost) -> str:
    """Return all parameters of a ghost with their standard deviations, as HTML.

    Parameters
    ----------
    ghost : AberrationGhost or BezierGhost
        A Bezier ghost has its values in the middle of its range and the polynomials' coefficients.
    """
    tables: list[tuple[tuple[str, ...], list[tuple[str, ...]]]]
    if isinstance(ghost, BezierGhost):
        blades, tables = None, [(("", "midway", "coefficients, lowest order first"), list(_bezier_rows(ghost)))]
    else:
        blades, tables = ghost.blades, [
            (("nonzero numbers", "red", "green", "blue"), list(_channel_rows(ghost))),
            (("curves, at degrees", ""), list(_curve_rows(ghost.curves, ghost.visible_deg))),
        ]  # fmt: skip
    return html_page("measured/numbers", ghost=ghost, blades=blades, tables=tables)


def _labels() -> dict[int, str]:
    """Return the label of each number of a channel, by index."""
    found = {at + k: f"{name}, {term}" for at, name in ((0, "f"), (FIRST_G, "g"), (FIRST_I, "intensity"))
             for k, term in enumerate(_TERMS)}  # fmt: skip
    found |= {FIRST_DISC + DISC_NUMBERS * d + k: f"rim {d + 1}, {word}" for d in range(MOST_DISCS)
              for k, word in enumerate(_DISC)}  # fmt: skip
    found |= {SOFT: "softness, pixels"} | {LATERAL + k: f"lateral, {word}" for k, word in enumerate(_LATERAL)}
    return found | {BELOW: "below, b", BELOW + 1: "below, c"}


def _channel_rows(ghost: AberrationGhost) -> Iterator[tuple[str, ...]]:
    channels = ghost.red, ghost.green, ghost.blue
    values = np.array([channel_numbers(one, None) for one in channels])
    values[:, SOFT] = [one.soft_px for one in channels]
    deviations = np.array([channel_deviation(one) for one in channels])
    for at, label in _labels().items():
        if values[:, at].any() or deviations[:, at].any():
            # terms of one polynomial share the scale of their largest
            first = at - at % FIRST_G if at < FIRST_DISC else at
            most = float(np.abs(values[:, first : first + FIRST_G if at < FIRST_DISC else at + 1]).max())
            pairs = zip(values[:, at].tolist(), deviations[:, at].tolist(), strict=True)
            yield label, *(with_deviation(value, deviation, most) for value, deviation in pairs)


def _curve_rows(curves: Curves, visible_deg: tuple[float, float]) -> Iterator[tuple[str, ...]]:
    for name, label in (("brightness", "brightness"), ("along_px", "pixels to the light"), ("size", "size")):
        curve = getattr(curves, name)
        if curve is not None:
            knots = np.linspace(*visible_deg, len(curve.values)) if len(curve.values) > 1 else [np.mean(visible_deg)]
            for angle, value, error in zip(knots, curve.values, curve.error, strict=True):
                yield f"{label}, {angle:.2f}", with_deviation(value, error)


def _bezier_rows(ghost: BezierGhost) -> Iterator[tuple[str, ...]]:
    midway = bezier_numbers(ghost, 0.5 * sum(ghost.visible_deg))
    pairs = [*ghost.uncertainty, *[0.0] * (midway.size - len(ghost.uncertainty))]
    # scales: 1 for pixels and exponents, the largest level for levels
    matters = [1.0] * BORDER + [float(midway[BORDER:].max())] * (midway.size - BORDER)
    for label, value, deviation, least, row in zip(
        _BEZIER, midway.tolist(), pairs, matters, ghost.numbers, strict=True
    ):
        yield label, with_deviation(value, deviation, least), ", ".join(number(each) for each in row)
