"""The direct beam inside the lens: origin, direction and density of its light on every surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.scattering.single_scatter import FLUX, REL, STOP_X, STOP_Y, TX, TY
from ...kernels.tracing.incident_light import IncidentLight
from ...kernels.tracing.intersect import ORIGIN
from ...kernels.tracing.path_steps import PathSteps
from ...kernels.tracing.sequential import REL as NODE_REL
from ...kernels.tracing.sequential import STOP_X as NODE_STOP_X
from ...kernels.tracing.sequential import WEIGHT, trace_hits, trace_nodes
from ...typing import Floats
from ..lens.paths import LightPath
from ..rays.pack import PackedLens
from ..rays.pupil_region import front_box

# nodes per side of a surface's table; scout rays per side that locate the beam
NODES, SCOUTS = 33, 21
# Newton's method: iterations, step of the numerical derivative, tolerance, mm
STEPS, DERIVATIVE_STEP_MM, TOLERANCE_MM = 6, 1e-3, 1e-5
# degree of the start polynomial, and least number of rays for its fit
DEGREE, FEWEST = 4, 40
# size of the tabulated area relative to the rim
ROOM = 1.06


@dataclass(frozen=True)
class Beams:
    """The direct beam of one light at one wavelength on every row.

    Attributes
    ----------
    nodes : ndarray, shape (K, NODES, NODES, 6)
        At even positions in a surface's box: x, y of the direction behind it; area of the front per area of the plane
        times the transmittance so far (0 where no ray was found); the largest r / semi-diameter on the way; x, y in the
        stop.
    boxes : ndarray, shape (K, 4)
        x0, y0 of the first node and nodes per mm, in the light's meridional frame.
    domains : ndarray, shape (K, 4)
        Centre x, y, half width and height of the beam's area: that of the rim in front of the stop, of the iris' image
        behind it, of the iris at the stop.
    """

    nodes: Floats
    boxes: Floats
    domains: Floats


def trace_beams(
    packed: PackedLens, w: int, path: LightPath, tilt: float, stop_row: int, iris_radius: float, rows: list[int]
) -> Beams:
    """Tabulate the direct beam on some rows.

    Parameters
    ----------
    packed : PackedLens
    w : int
        Index of a packed wavelength.
    path : LightPath
        The direct path.
    tilt : float
        From `incidence`.
    stop_row : int
    iris_radius : float
        Radius of a circle around the iris, mm.
    rows : list of int
        Surfaces.

    Returns
    -------
    Beams
        Rows that the light does not reach, or only through a fold of the beam that Newton's method misses, stay 0.
    """
    count = len(packed.curvature)
    found = Beams(np.zeros((count, NODES, NODES, 6)), np.ones((count, 4)), np.ones((count, 4)))
    scouts = _scouts(packed, tilt)
    found.domains[stop_row] = (0.0, 0.0, iris_radius, iris_radius)
    at_stop = None
    for k in rows:
        if k < stop_row:
            semi, middle = packed.semi[k], _vertex(packed, k)
            found.domains[k] = (*middle, semi, semi)
        else:
            if at_stop is None:
                span = np.linspace(-iris_radius, iris_radius, 17)
                x, y = (g.ravel() for g in np.meshgrid(span, span))
                round_ones = np.hypot(x, y) <= iris_radius * (1.0 + 1e-9)
                places = np.stack([x, y], axis=1)[round_ones]
                at_stop = _solve_front(packed, w, path, stop_row, tilt, places, scouts)[0]
            hits, _ = _trace(packed, w, path, k, tilt, at_stop)
            hits = hits[np.isfinite(hits).all(axis=1)]
            if len(hits) < 9:
                continue
            low, high = hits.min(axis=0), hits.max(axis=0)
            found.domains[k] = (*(0.5 * (low + high)), *np.maximum(0.5 * (high - low), 1e-6))
        _tabulate(packed, w, path, k, tilt, scouts, found, k > stop_row)
    return found


def _vertex(packed: PackedLens, k: int) -> tuple[float, float]:
    form = packed.form
    return (float(form[k, ORIGIN]), float(form[k, ORIGIN + 1])) if form.ndim == 2 else (0.0, 0.0)


def _scouts(packed: PackedLens, tilt: float) -> Floats:
    x0, x1, y0, y1 = front_box(packed, tilt)
    x0 = -x1 if packed.symmetric else x0
    x, y = np.meshgrid(np.linspace(x0, x1, SCOUTS), np.linspace(y0, y1, SCOUTS))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def _trace(packed: PackedLens, w: int, path: LightPath, k: int, tilt: float, front: Floats) -> tuple[Floats, Floats]:
    """Return hits on row k, shape (N, 2), and directions behind it, shape (N, 3); NaN where a ray fails earlier."""
    hits = np.empty((len(front), k + 3, 3))
    beyond = float(packed.z_vertex[k]) + 1e3
    x, y = np.ascontiguousarray(front[:, 0]), np.ascontiguousarray(front[:, 1])
    trace_hits(
        path.rows[: k + 1], path.actions[: k + 1], packed.curvature, packed.form, packed.z_vertex, packed.n_gap[w],
        beyond, tilt, packed.nearness, x, y, hits,
    )  # fmt: skip
    leg = hits[:, k + 2] - hits[:, k + 1]
    with np.errstate(invalid="ignore"):
        return hits[:, k + 1, :2], leg / np.sqrt((leg**2).sum(axis=1, keepdims=True))


def _solve_front(
    packed: PackedLens, w: int, path: LightPath, k: int, tilt: float, places: Floats, scouts: Floats
) -> tuple[Floats, Floats]:
    """Return front points whose rays meet row k at given positions, and the area there per area of the front.

    Newton's method starts from a polynomial fit to scout rays. NaN where it does not converge.
    """
    unsolved = np.full(places.shape, np.nan), np.full(len(places), np.nan)
    hits, _ = _trace(packed, w, path, k, tilt, scouts)
    arrived = np.isfinite(hits).all(axis=1)
    if arrived.sum() < FEWEST:
        return unsolved
    hits, scouts = hits[arrived], scouts[arrived]
    # scouts around the positions; where these are few, the nearest ones at any distance
    middle, half = 0.5 * (places.max(axis=0) + places.min(axis=0)), 0.5 * float(np.ptp(places, axis=0).max())
    away = np.abs(hits - middle).max(axis=1)
    reach = max(1.5 * half, float(np.partition(away, FEWEST - 1)[FEWEST - 1]))
    useful = away <= reach
    weights, *_ = np.linalg.lstsq(_powers((hits[useful] - middle) / reach), scouts[useful], rcond=1e-10)
    front = _powers((places - middle) / reach) @ weights
    area = np.full(len(places), np.nan)
    steps = np.array([[0.0, 0.0], [DERIVATIVE_STEP_MM, 0.0], [0.0, DERIVATIVE_STEP_MM]])
    with np.errstate(invalid="ignore", divide="ignore"):
        for _ in range(STEPS):
            tried = (front[None] + steps[:, None]).reshape(-1, 2)
            met = _trace(packed, w, path, k, tilt, tried)[0].reshape(3, -1, 2)
            along_x, along_y = (met[1] - met[0]) / DERIVATIVE_STEP_MM, (met[2] - met[0]) / DERIVATIVE_STEP_MM
            area = along_x[:, 0] * along_y[:, 1] - along_x[:, 1] * along_y[:, 0]
            miss = places - met[0]
            change = np.stack(
                [
                    (along_y[:, 1] * miss[:, 0] - along_y[:, 0] * miss[:, 1]) / area,
                    (along_x[:, 0] * miss[:, 1] - along_x[:, 1] * miss[:, 0]) / area,
                ],
                axis=1,
            )
            settled = np.abs(miss).max(axis=1) < TOLERANCE_MM
            front = np.where(settled[:, None], front, front + change)
        front = np.where(settled[:, None], front, np.nan)
    return front, np.abs(area)


def _powers(places: Floats) -> Floats:
    """Return all products of powers of x and y up to DEGREE, one row per position."""
    x, y = places[:, 0], places[:, 1]
    return np.stack([x**i * y**j for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)], axis=1)


def _tabulate(
    packed: PackedLens, w: int, path: LightPath, k: int, tilt: float, scouts: Floats, found: Beams, behind: bool
) -> None:
    """Fill the table of one row."""
    x, y, half_x, half_y = found.domains[k]
    half_x, half_y = ROOM * half_x, ROOM * half_y
    found.boxes[k] = (x - half_x, y - half_y, 0.5 * (NODES - 1) / half_x, 0.5 * (NODES - 1) / half_y)
    along, across = np.linspace(x - half_x, x + half_x, NODES), np.linspace(y - half_y, y + half_y, NODES)
    places = np.stack([g.ravel() for g in np.meshgrid(along, across, indexing="ij")], axis=1)
    front, area = _solve_front(packed, w, path, k, tilt, places, scouts)
    good = np.isfinite(front).all(axis=1) & np.isfinite(area) & (area > 1e-9)
    if not good.any():
        return
    front = np.where(good[:, None], front, 0.0)
    _, direction = _trace(packed, w, path, k, tilt, front)
    rays = np.empty((len(front), NODE_STOP_X + 2))
    steps = PathSteps(path.rows[: k + 1], path.actions[: k + 1])
    arrays = packed.arrays(packed.n_gap[w], packed.reflectance[w], float(packed.z_vertex[k]) + 1e3)
    x, y = np.ascontiguousarray(front[:, 0]), np.ascontiguousarray(front[:, 1])
    trace_nodes(steps, arrays, IncidentLight(tilt, packed.nearness), x, y, rays)
    good &= np.isfinite(direction).all(axis=1) & (direction[:, 2] > 0.0) & (rays[:, WEIGHT] > 0.0)
    table = np.zeros((len(front), 6))
    table[good, TX], table[good, TY] = direction[good, 0], direction[good, 1]
    table[good, FLUX] = rays[good, WEIGHT] / area[good]
    table[good, REL] = rays[good, NODE_REL]
    if behind:
        table[good, STOP_X], table[good, STOP_Y] = rays[good, NODE_STOP_X], rays[good, NODE_STOP_X + 1]
    found.nodes[k] = table.reshape(NODES, NODES, 6)
