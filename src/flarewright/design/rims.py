"""How wide a designed lens must be for its ghosts, and how wide it can be."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ..kernels import design_ghosts as columns
from .ghosts import evaluate
from .prescription import Structure

Floats = NDArray[np.float64]

# part of its radius of curvature to which a surface may reach, and the thinnest edge, mm
STEEPEST = 0.9
EDGE = 0.1
# narrowest rim, mm
LEAST = 0.5


def clear_radii(structure: Structure, vector: Floats, slopes: Floats, entrance: float) -> Floats:
    """Choose semi-diameters that pass the ghosts as far as surfaces neither close up nor cross.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slopes : ndarray, shape (L,)
        Of the lights.
    entrance : float
        Largest diameter, mm.

    Returns
    -------
    ndarray, shape (K,)
        mm; that of the stop is what crosses it.

    Notes
    -----
    Heights are paraxial: the two edge rays of every ghost that the stop bounds, along its whole path.
    """
    rows = structure.rows
    c = vector[1 + rows : 1 + 2 * rows]
    wanted = np.full(rows, LEAST)
    values = evaluate(structure, vector[None], entrance)[0]
    for slope in slopes:
        for pair, value in zip(structure.pairs, values, strict=True):
            if slope <= value[columns.REACH]:
                wanted = np.maximum(wanted, _heights(structure, vector, pair, float(slope), entrance))
    with np.errstate(divide="ignore"):
        closes = np.where(c == 0.0, np.inf, STEEPEST / np.abs(c))
    radii = np.minimum(np.minimum(wanted, 0.5 * entrance), closes)
    for k in range(rows - 1):
        if structure.stop in (k, k + 1):
            continue
        common = min(radii[k], radii[k + 1])
        limit = _apart(c[k], c[k + 1], float(vector[1 + k]), common)
        if limit < common:
            radii[k], radii[k + 1] = min(radii[k], limit), min(radii[k + 1], limit)
    return np.asarray(radii, dtype=np.float64)


def _heights(structure: Structure, vector: Floats, pair: tuple[int, int], slope: float, entrance: float) -> Floats:
    """Largest height on every row of the rays that bound a ghost."""
    rows, (j, i) = structure.rows, pair
    d, c = vector[1 : 1 + rows], vector[1 + rows : 1 + 2 * rows]
    n = np.concatenate([[1.0], vector[1 + 2 * rows :]])
    legs = [(k, 0) for k in range(j)] + [(j, 1)] + [(k, 2) for k in range(j - 1, i, -1)] + [(i, 3)]
    legs += [(k, 0) for k in range(i + 1, rows)]
    # three rays: two that span the entrance plane, and what they are at the stop
    y, w = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    seen: list[tuple[int, Floats]] = []
    at_stop = None
    for step, (k, kind) in enumerate(legs):
        if step:
            gap = min(k, legs[step - 1][0])
            y = y + d[gap] / n[gap + 1] * w
        seen.append((k, y))
        if k == structure.stop and at_stop is None:
            at_stop = y
        if kind == 1:
            w = w + 2.0 * n[k] * c[k] * y
        elif kind == 3:
            w = w - 2.0 * n[k + 1] * c[k] * y
        else:
            w = w - (n[k + 1] - n[k]) * c[k] * y
    assert at_stop is not None
    a, b = float(at_stop[0]), float(at_stop[1])
    if vector[0] > entrance * abs(a):
        edges = (-0.5 * entrance, 0.5 * entrance)
    else:
        edges = ((-0.5 * vector[0] - b * slope) / a, (0.5 * vector[0] - b * slope) / a)
    out = np.zeros(rows)
    for k, base in seen:
        out[k] = max(out[k], *(abs(float(base[0]) * edge + float(base[1]) * slope) for edge in edges))
    return out


def _apart(front: float, back: float, gap: float, common: float) -> float:
    """Largest radius, up to a common one, at which two surfaces stay apart."""

    def edge(r: float) -> float:
        return gap + _sag(back, r) - _sag(front, r)

    least = min(EDGE, 0.5 * gap)
    limit = common
    while limit > LEAST and edge(limit) < least:
        limit *= 0.97
    return limit


def _sag(c: float, r: float) -> float:
    return c * r * r / (1.0 + sqrt(max(1.0 - c * c * r * r, 0.0)))
