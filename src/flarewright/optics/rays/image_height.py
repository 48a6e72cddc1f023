"""Image height of a distant light, with distortion: the height of its chief ray on the sensor."""

from __future__ import annotations

import numpy as np

from ...model import Lens
from ...typing import Floats
from ..lens.paraxial import FirstOrder
from ..lens.surface_shape import has_rotational_symmetry
from .single_rays import trace_polylines

_RAYS = 81


def image_heights(lens: Lens, order: FirstOrder, angles_deg: Floats) -> Floats:
    """Return the image heights of distant lights by tracing their chief rays.

    Parameters
    ----------
    lens : Lens
        Complete.
    order : FirstOrder
        Of the focused lens.
    angles_deg : ndarray, shape (N,)
        Field angles.

    Returns
    -------
    ndarray, shape (N,)
        Distance from the axis on the sensor, mm; NaN without a chief ray, and for lenses without rotational symmetry.

    Notes
    -----
    The paraxial height is efl tan(angle), the limit for small angles (tests/optics/rays/test_image_height.py); the
    difference is the lens' distortion.
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    if not has_rotational_symmetry(lens):
        return np.full(angles.shape, np.nan)
    return np.array([_height(lens, order, float(angle)) for angle in angles])


def _height(lens: Lens, order: FirstOrder, angle_deg: float) -> float:
    tilt = np.radians(angle_deg)
    first = lens.rows[0]
    semi = getattr(first, "semi_diameter", None) or order.entrance_pupil_diameter
    reach = semi + abs(order.entrance_pupil_z) * abs(np.tan(tilt))
    low, high = -reach, reach
    at_stop, on_sensor = np.zeros(2), np.zeros(2)
    # the second round samples finely where the first one located the stop's centre
    for _ in range(2):
        y = np.linspace(low, high, _RAYS)
        hits = trace_polylines(lens, None, np.zeros_like(y), y, -tilt, sensor_distance=order.sensor_distance)
        # the start precedes the hits
        stop, sensor = hits[:, lens.stop_row + 1, 1], hits[:, -1, 1]
        whole = np.isfinite(stop) & np.isfinite(sensor)
        crossing = np.flatnonzero(whole[:-1] & whole[1:] & (stop[:-1] * stop[1:] <= 0.0))
        if not len(crossing):
            return float("nan")
        # a strongly curved front can have several solutions: use the one nearest to the axis
        k = min(crossing, key=lambda each: abs(y[each]))
        (low, high), at_stop, on_sensor = y[k : k + 2], stop[k : k + 2], sensor[k : k + 2]
    part = at_stop[0] / (at_stop[0] - at_stop[1]) if at_stop[0] != at_stop[1] else 0.0
    return float(abs(on_sensor[0] + part * (on_sensor[1] - on_sensor[0])))
