"""The part of a measurement's report that hides nothing: every number of a ghost as the model's file has it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..kernels.measure_bezier import BORDER
from ..kernels.measure_pupil import BELOW, DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, MOST_DISCS, SOFT
from ..model.ghost_model import AberrationGhost, BezierGhost, Curves
from ..render.chart import number, with_deviation
from ..render.page import paragraph, table
from .numbers import bezier_numbers, channel_deviation, channel_numbers

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
    """Return all numbers of a ghost with their standard deviations, as HTML.

    Parameters
    ----------
    ghost : AberrationGhost or BezierGhost
        Of a Bezier ghost the numbers are those midway, with the polynomials' coefficients beside them.
    """
    if isinstance(ghost, BezierGhost):
        return paragraph(_life(ghost)) + table(("", "midway", "coefficients, lowest order first"), _bezier_rows(ghost))
    told = _life(ghost)
    if ghost.blades is not None:
        told += f"; {ghost.blades.count} blades, a side at {ghost.blades.first_deg:g} degrees"
    curves = list(_curve_rows(ghost.curves, ghost.visible_deg))
    return (
        paragraph(told)
        + table(("what is not 0", "red", "green", "blue"), _channel_rows(ghost))
        + (table(("curves, at degrees", ""), curves) if curves else "")
    )


def _life(ghost: AberrationGhost | BezierGhost) -> str:
    (low, high), (rise, fall) = ghost.visible_deg, ghost.fade_deg
    return f"There from {low:g} to {high:g} degrees, comes over {rise:g} and goes over {fall:g}"


def _labels() -> dict[int, str]:
    """Return what the numbers of a channel are, by where they stand."""
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
            # terms of one polynomial stand for each other
            first = at - at % FIRST_G if at < FIRST_DISC else at
            most = float(np.abs(values[:, first : first + FIRST_G if at < FIRST_DISC else at + 1]).max())
            told = zip(values[:, at].tolist(), deviations[:, at].tolist(), strict=True)
            yield label, *(with_deviation(value, deviation, most) for value, deviation in told)


def _curve_rows(curves: Curves, visible_deg: tuple[float, float]) -> Iterator[tuple[str, str]]:
    for name, label in (("brightness", "brightness"), ("along_px", "pixels to the light"), ("size", "size")):
        curve = getattr(curves, name)
        if curve is not None:
            knots = np.linspace(*visible_deg, len(curve.values)) if len(curve.values) > 1 else [np.mean(visible_deg)]
            for angle, value, error in zip(knots, curve.values, curve.error, strict=True):
                yield f"{label}, {angle:.2f}", with_deviation(value, error)


def _bezier_rows(ghost: BezierGhost) -> Iterator[tuple[str, ...]]:
    midway = bezier_numbers(ghost, 0.5 * sum(ghost.visible_deg))
    told = [*ghost.uncertainty, *[0.0] * (midway.size - len(ghost.uncertainty))]
    # pixels and exponents, then levels
    matters = [1.0] * BORDER + [float(midway[BORDER:].max())] * (midway.size - BORDER)
    for label, value, deviation, least, row in zip(_BEZIER, midway.tolist(), told, matters, ghost.numbers, strict=True):
        yield label, with_deviation(value, deviation, least), ", ".join(number(each) for each in row)
