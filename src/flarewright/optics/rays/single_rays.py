"""Trace single rays, with the hit at every surface."""

from __future__ import annotations

import numpy as np

from ...kernels.tracing.sequential import trace_hits
from ...model import Lens
from ...typing import Floats
from ..lens.dispersion import D_LINE_NM
from ..lens.paraxial import first_order, gap_indices, vertex_positions
from ..lens.paths import direct_path, ghost_path, sensor_path
from ..lens.surface_shape import shape_table


def trace_polylines(
    lens: Lens,
    ghost: tuple[int, int] | None,
    x: Floats,
    y: Floats,
    tilt: float,
    *,
    sensor_distance: float | None = None,
    wavelength_nm: float = D_LINE_NM,
) -> Floats:
    """Trace rays and record every hit; rays run in the lens' y-z plane, or skew to it where x is not 0.

    Parameters
    ----------
    lens : Lens
        Semi-diameters are not needed; rims do not block these rays.
    ghost : tuple of int or None
        Rows (j, i) of a ghost path's mirrors, j = len(lens.rows) for the sensor; None for the direct path.
    x, y : ndarray, shape (N,)
        Start on the plane of the first vertex, mm.
    tilt : float
        Rays run along (0, sin tilt, cos tilt), rad.
    sensor_distance : float, optional
        Last vertex to the plane where rays end, mm; None: the sensor's.
    wavelength_nm : float

    Returns
    -------
    ndarray, shape (N, S + 2, 3)
        Start, one hit per step of the path, end on the sensor; NaN after the point where a ray fails.
    """
    by_sensor = ghost is not None and ghost[0] == len(lens.rows)
    path = (
        direct_path(lens) if ghost is None else sensor_path(lens, ghost[1]) if by_sensor else ghost_path(lens, *ghost)
    )
    z = vertex_positions(lens)
    distance = first_order(lens).sensor_distance if sensor_distance is None else sensor_distance
    # a stop refracts nothing, so its curvature of 0 only fills the array
    curvature = np.array([getattr(row, "curvature", 0.0) for row in lens.rows])
    shapes = shape_table(lens)
    conic = np.array([getattr(row, "conic", 0.0) for row in lens.rows]) if shapes is None else shapes
    hits = np.empty((len(x), len(path.rows) + 2, 3))
    n = gap_indices(lens, wavelength_nm)
    if by_sensor:
        # the sensor is a plane between air and air; a row of zeros is a centred plane
        z, distance = np.append(z, z[-1] + distance), 0.0
        curvature, n = np.append(curvature, 0.0), np.append(n, 1.0)
        conic = np.append(conic, np.zeros_like(conic[:1]), axis=0)
    start_x, start_y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    trace_hits(
        path.rows, path.actions, curvature, conic, z, n, float(z[-1] + distance), tilt, 0.0, start_x, start_y, hits
    )
    return hits
