"""Single rays: where they go, surface by surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.trace import trace_hits
from ..model import Lens
from .bundle import incidence, trace_points
from .pack import PackedLens, facing
from .paraxial import D_LINE_NM, first_order, gap_indices, vertex_positions
from .paths import LightPath, direct_path, ghost_path, sensor_path
from .shape import shape_table

Floats = NDArray[np.float64]


def trace_rays(
    packed: PackedLens, path: LightPath, x: Floats, y: Floats, field_deg: tuple[float, float], w: int = 0
) -> dict[str, Floats]:
    """Trace rays of a distant light to the sensor.

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    x, y : ndarray, shape (N,)
        Where the rays cross the plane of the first vertex: x right, y up as seen from behind the camera, mm.
    field_deg : tuple of float
        Field angles of the light.
    w : int
        Which of the packed wavelengths.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        `x`, `y` on the sensor in the lens' frame (the upright picture is (-x, -y)), `weight` (product of R and T),
        `rel_radius` (largest r / semi-diameter met), `status` (1 alive, 0 ended), `stop_x`, `stop_y` at the last
        crossing.
    """
    light = incidence(field_deg)
    packed = facing(packed, light.axes)
    data = trace_points(packed, w, path, light.tilt, np.stack([x, y], axis=1) @ light.axes.T)
    with np.errstate(invalid="ignore"):  # rays that ended hold whatever their last step left
        on_sensor, at_stop = data[:, 0:2] @ light.axes, data[:, -2:] @ light.axes
    return {
        "x": on_sensor[:, 0],
        "y": on_sensor[:, 1],
        "weight": data[:, 2],
        "rel_radius": data[:, 3],
        "status": data[:, 4],
        "stop_x": at_stop[:, 0],
        "stop_y": at_stop[:, 1],
    }


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
    """Trace rays and keep every hit; the rays run in the lens' y-z plane, or askew to it where x is not 0.

    Parameters
    ----------
    lens : Lens
        Semi-diameters are not needed; rims do not stop these rays.
    ghost : tuple of int or None
        Rows (j, i) of a ghost path's mirrors, j = len(lens.rows) for the sensor; None for the direct path.
    x, y : ndarray, shape (N,)
        Start on the plane of the first vertex, mm.
    tilt : float
        Rays run along (0, sin tilt, cos tilt), rad.
    sensor_distance : float, optional
        Last vertex to the plane where rays end, mm; None: the sensor.
    wavelength_nm : float

    Returns
    -------
    ndarray, shape (N, S + 2, 3)
        Start, a hit for each step of the path, end on the sensor; NaN behind the point where a ray ends.
    """
    by_sensor = ghost is not None and ghost[0] == len(lens.rows)
    path = (
        direct_path(lens) if ghost is None else sensor_path(lens, ghost[1]) if by_sensor else ghost_path(lens, *ghost)
    )
    z = vertex_positions(lens)
    distance = first_order(lens).sensor_distance if sensor_distance is None else sensor_distance
    # a stop neither bends nor shifts anything, so its curvature 0 is only a place holder in the arrays
    curvature = np.array([getattr(row, "curvature", 0.0) for row in lens.rows])
    shapes = shape_table(lens)
    conic = np.array([getattr(row, "conic", 0.0) for row in lens.rows]) if shapes is None else shapes
    hits = np.empty((len(x), len(path.rows) + 2, 3))
    n = gap_indices(lens, wavelength_nm)
    if by_sensor:
        # a plane between air and air; a row of zeros is a centred plane
        z, distance = np.append(z, z[-1] + distance), 0.0
        curvature, n = np.append(curvature, 0.0), np.append(n, 1.0)
        conic = np.append(conic, np.zeros_like(conic[:1]), axis=0)
    start_x, start_y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    trace_hits(
        path.rows, path.actions, curvature, conic, z, n, float(z[-1] + distance), tilt, 0.0, start_x, start_y, hits
    )
    return hits
