"""Place and size of ghosts by traced rays, as in final quality, beyond first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.design import ghosts as columns
from ...kernels.tracing.sequential import STOP, trace_hits
from ...optics.lens.paths import LightPath, steps_between
from ...typing import Floats
from ..problem.ghosts import evaluate
from ..problem.prescription import Structure

# half of the disc, the other half is its mirror image: places of equal weight
_RINGS, _TURNS = np.sqrt((np.arange(3) + 0.5) / 3.0), np.radians([22.5, 67.5, 112.5, 157.5])
PATTERN = np.stack([np.outer(_RINGS, part(_TURNS)).ravel() for part in (np.sin, np.cos)], axis=1)
# tolerance of aiming a ray, as a fraction of the stop's radius, and number of steps
AIMED, NEWTON = 1e-10, 12
# a ghost with less than this part of its rays reaching the sensor is lost
ARRIVING = 0.6


@dataclass(frozen=True)
class _Case:
    """One path through one prescription."""

    path: LightPath
    curvature: Floats
    z: Floats
    n: Floats
    sensor_z: float
    tilt: float

    def trace(self, starts: Floats) -> tuple[Floats, Floats]:
        """Trace rays from (x, y) at the first vertex; return where they cross the stop and the sensor, each (N, 2)."""
        hits = np.empty((len(starts), len(self.path.rows) + 2, 3))
        x, y = (np.ascontiguousarray(starts[:, axis]) for axis in (0, 1))
        trace_hits(
            self.path.rows, self.path.actions, self.curvature, np.zeros_like(self.curvature), self.z, self.n,
            self.sensor_z, self.tilt, 0.0, x, y, hits,
        )  # fmt: skip
        stop = int(np.argmax(self.path.actions == STOP))
        return hits[:, stop + 1, :2], hits[:, -1, :2]


def traced_ghosts(
    structure: Structure, vector: Floats, slope: float, entrance: float, pairs: Sequence[tuple[int, int]] | None = None
) -> Floats:
    """Trace the ghosts of a prescription.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slope : float
        Tangent of the light's field angle.
    entrance : float
        Diameter of the entrance at the first vertex, mm.
    pairs : sequence of (int, int), optional
        Ghosts to trace; None: all of the structure.

    Returns
    -------
    ndarray, shape (G, 2)
        Place on the line and signed radius, mm; NaN where too few rays reach the sensor.

    Notes
    -----
    Rays fill the edge that bounds the ghost to first order, the stop or the entrance. A least-squares fit of
    place + radius p to them, p in the unit disc, gives the disc equivalent to the aberrated ghost. Rims do not stop
    rays. In the limit of small stops and angles this is first order (tests/design/finishing/test_traced.py).
    """
    rows = structure.rows
    first_order = evaluate(structure, vector[None], entrance)[0]
    z = np.concatenate([[0.0], np.cumsum(vector[1:rows])])
    n = np.concatenate([[1.0], vector[1 + 2 * rows :]])
    curvature = np.ascontiguousarray(vector[1 + rows : 1 + 2 * rows])
    values = []
    for j, i in structure.pairs if pairs is None else pairs:
        case = _Case(
            steps_between(rows, structure.stop, (j, i)), curvature, z, n, float(z[-1] + vector[rows]),
            float(np.arctan(slope)),
        )  # fmt: skip
        by_stop = first_order[structure.number_of[j, i], columns.BOUND] == 0.0
        values.append(
            _disc(case, _aimed(case, 0.5 * float(vector[0]) * PATTERN) if by_stop else 0.5 * entrance * PATTERN)
        )
    return np.array(values).reshape(-1, 2)


def _disc(case: _Case, starts: Floats | None) -> tuple[float, float]:
    """Fit the disc onto which rays are mapped; the pattern's mirror image cancels terms odd across the line."""
    if starts is None:
        return np.nan, np.nan
    _, landed = case.trace(starts)
    here = np.isfinite(landed).all(axis=1)
    if here.mean() < ARRIVING:
        return np.nan, np.nan
    p, landed = PATTERN[here], landed[here]
    # unknowns: place, radius; x = radius p_x, y = place + radius p_y
    squares, across, up = float((p**2).sum()), float(p[:, 1].sum()), float(landed[:, 1].sum())
    both = float((p * landed).sum())
    system = np.array([[len(p), across], [across, squares]])
    place, radius = np.linalg.solve(system, [up, both])
    return float(place), float(radius)


def _aimed(case: _Case, wanted: Floats) -> Floats | None:
    """Aim rays at places in the stop, by Newton's method; None if it fails for too many of them."""
    radius = float(np.abs(wanted).max())
    starts = _first_starts(case, wanted)
    if starts is None:
        return None
    missed, step = np.full_like(wanted, np.nan), 1e-4 * max(radius, 1e-3)
    for _ in range(NEWTON):
        moved = (starts + step * np.array(way) for way in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
        here, right, above = np.split(case.trace(np.concatenate(list(moved)))[0], 3)
        missed = wanted - here
        if np.nanmax(np.abs(missed), initial=0.0) < AIMED * radius:
            break
        slopes = np.stack([right - here, above - here], axis=2) / step
        answers = np.full_like(slopes, np.nan)
        # drop a ray that was stopped or that does not respond
        ended = ~np.isfinite(slopes).all(axis=(1, 2))
        slopes[ended] = 0.0
        sound = np.abs(np.linalg.det(slopes)) > 1e-12
        answers[sound] = np.linalg.inv(slopes[sound])
        starts = starts + np.einsum("nij,nj->ni", answers, missed)
    arrived = np.abs(missed).max(axis=1) < 1e4 * AIMED * radius
    return np.where(arrived[:, None], starts, np.nan) if arrived.mean() >= ARRIVING else None


def _first_starts(case: _Case, wanted: Floats) -> Floats | None:
    """Return first-order start points of rays about the axis."""
    height, straight = 1e-3, _Case(case.path, case.curvature, case.z, case.n, case.sensor_z, 0.0)
    scale = float(straight.trace(np.array([[0.0, height]]))[0][0, 1]) / height
    small = _Case(case.path, case.curvature, case.z, case.n, case.sensor_z, 1e-4)
    shift = float(small.trace(np.zeros((1, 2)))[0][0, 1]) * float(np.tan(case.tilt)) / 1e-4
    if not (np.isfinite(shift) and abs(scale) > 1e-9):
        return None
    return np.asarray((wanted - [0.0, shift]) / scale, dtype=np.float64)
