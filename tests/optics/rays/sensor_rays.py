"""Single rays to the sensor, by the tracer of bundles."""

from __future__ import annotations

import numpy as np

from flarewright.optics.lens.paths import LightPath
from flarewright.optics.rays.bundle import incidence, trace_points
from flarewright.optics.rays.pack import PackedLens, facing


def trace_rays(
    packed: PackedLens, path: LightPath, x: np.ndarray, y: np.ndarray, field_deg: tuple[float, float], w: int = 0
) -> dict[str, np.ndarray]:
    """Trace rays of a distant light to the sensor.

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    x, y : ndarray, shape (N,)
        Positions on the plane of the first vertex: x right, y up as seen from behind the camera, mm.
    field_deg : tuple of float
        Field angles of the light.
    w : int
        Index of a packed wavelength.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        `x`, `y` on the sensor in the lens' frame (the upright picture is (-x, -y)), `weight` (product of R and T),
        `rel_radius` (largest r / semi-diameter met), `status` (1 alive, 0 failed), `stop_x`, `stop_y` at the last
        crossing.
    """
    light = incidence(field_deg)
    packed = facing(packed, light.axes)
    data = trace_points(packed, w, path, light.tilt, np.stack([x, y], axis=1) @ light.axes.T)
    with np.errstate(invalid="ignore"):  # failed rays contain the values of their last step
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
