"""Semi-diameters that a designed lens needs for its ghosts, and the largest that fit."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np

from ...kernels.design import ghosts as columns
from ...kernels.design.edge_thickness import beam_of
from ...kernels.design.ghosts import WORK_ROWS
from ...typing import Floats
from .ghosts import evaluate
from .prescription import Structure

# largest semi-diameter of a surface as a fraction of its radius of curvature
STEEPEST = 0.9
# smallest semi-diameter, part of the stop's diameter
LEAST = 0.1


def clear_radii(structure: Structure, vector: Floats, slopes: Floats, entrance: float, *, edge: float = 0.1) -> Floats:
    """Choose semi-diameters that pass the axial beam and, where surfaces stay apart, the ghosts.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slopes : ndarray, shape (L,)
        Of the light sources.
    entrance : float
        Largest entrance diameter, mm.
    edge : float
        Thinnest edge, mm; where the gap is less than twice that, half the gap.

    Returns
    -------
    ndarray, shape (K,)
        mm; at the stop, the largest ray height.

    Notes
    -----
    Heights are paraxial: the two edge rays of every ghost bounded by the stop, along its whole path.
    """
    rows = structure.rows
    c = vector[1 + rows : 1 + 2 * rows]
    wanted = np.maximum(beam_heights(structure, vector, entrance), LEAST * vector[0])
    values = evaluate(structure, vector[None], entrance)[0]
    for slope in slopes:
        for pair, value in zip(structure.pairs, values, strict=True):
            if slope <= value[columns.REACH]:
                wanted = np.maximum(wanted, _heights(structure, vector, pair, float(slope), entrance))
    with np.errstate(divide="ignore"):
        closes = np.where(c == 0.0, np.inf, STEEPEST / np.abs(c))
    radii = np.minimum(np.minimum(wanted, 0.5 * entrance), closes)
    d = vector[1 : 1 + rows]
    for k, m in _neighbours(structure):
        common = min(radii[k], radii[m])
        gap = float(d[k:m].sum())
        limit = _apart(c[k], c[m], gap, common, min(edge, 0.5 * gap))
        if limit < common:
            radii[k], radii[m] = min(radii[k], limit), min(radii[m], limit)
    return np.asarray(radii, dtype=np.float64)


def beam_heights(structure: Structure, vector: Floats, entrance: float) -> Floats:
    """Return the height of the axial beam's edge on every row.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    entrance : float
        Largest diameter of the beam in front of the lens, mm.

    Returns
    -------
    ndarray, shape (K,)
        mm; to first order.
    """
    rows = structure.rows
    work, beam = np.empty((WORK_ROWS, rows)), np.empty(rows + 2)
    beam_of(vector, structure.stop, float(entrance), work, beam)
    return np.asarray(np.abs(beam[:rows] * beam[rows]), dtype=np.float64)


def _neighbours(structure: Structure) -> list[tuple[int, int]]:
    """List pairs of rows whose surfaces face each other, skipping the stop."""
    surfaces = [k for k in range(structure.rows) if k != structure.stop]
    return list(pairwise(surfaces))


def _heights(structure: Structure, vector: Floats, pair: tuple[int, int], slope: float, entrance: float) -> Floats:
    """Return the largest height on every row of the rays that bound a ghost."""
    rows, (j, i) = structure.rows, pair
    d, c = vector[1 : 1 + rows], vector[1 + rows : 1 + 2 * rows]
    n = np.concatenate([[1.0], vector[1 + 2 * rows :]])
    legs = [(k, 0) for k in range(j)] + [(j, 1)] + [(k, 2) for k in range(j - 1, i, -1)] + [(i, 3)]
    legs += [(k, 0) for k in range(i + 1, rows)]
    # three rays: two that span the entrance plane, and their values at the stop
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


def _apart(front: float, back: float, gap: float, common: float, least: float) -> float:
    """Return the largest radius, up to a common one, at which two surfaces stay apart."""

    def edge(r: float) -> float:
        return gap + _sag(back, r) - _sag(front, r)

    if edge(common) >= least:
        return common
    # the gap decreases with the radius, and at the middle it is wide enough: bisect
    inside, outside = 0.0, common
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        if edge(middle) >= least:
            inside = middle
        else:
            outside = middle
    return inside


def _sag(c: float, r: float) -> float:
    return c * r * r / (1.0 + sqrt(max(1.0 - c * c * r * r, 0.0)))
