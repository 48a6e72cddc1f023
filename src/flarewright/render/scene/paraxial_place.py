"""Position and size of a ghost from matrices."""

from __future__ import annotations

import numpy as np

from ...kernels.paraxial.ghosts import path_matrices
from ...optics.lens.paths import LightPath
from ...typing import Floats
from .art_rules import Frame
from .shot import Shot


def draft_centre(shot: Shot, path: LightPath) -> Floats:
    """Return the centre of a ghost from matrices, upright, mm, shape (2,)."""
    return np.array(ghost_frame(shot, path).centre)


def ghost_frame(shot: Shot, path: LightPath) -> Frame:
    """Return centre and size of a ghost at the middle wavelength from matrices; for an oval the larger size."""
    packed, axes = shot.packed, shot.incidence.axes
    slope = float(np.tan(shot.incidence.tilt))
    if packed.curvature_x is None:
        place, size = _meridian(shot, path, packed.curvature, slope)
        centre = -place * axes[1]
        return Frame((float(centre[0]), float(centre[1])), size)
    x, across = _meridian(shot, path, packed.curvature_x, float(axes[1, 0]) * slope)
    y, along = _meridian(shot, path, packed.curvature, float(axes[1, 1]) * slope)
    return Frame((-x, -y), max(across, along))


def _meridian(shot: Shot, path: LightPath, curvature: Floats, slope: float) -> tuple[float, float]:
    """Return the ghost's centre in one meridional plane, and its radius there."""
    packed = shot.packed
    to_stop = np.empty((path.stop_crossings, 2, 2))
    middle = len(packed.wavelengths_nm) // 2
    a, b, _, _ = path_matrices(
        path.rows, path.actions, curvature, packed.z_vertex, packed.n_gap[middle], packed.sensor_z, to_stop
    )
    # rays of a near light diverge: their slope grows with their height
    nearness = packed.nearness / shot.incidence.tilt_cosine
    a += nearness * b
    to_stop[:, :, 0] += nearness * to_stop[:, :, 1]
    # the smaller of the entrance and the iris as seen from the front
    centre, radius = 0.0, float(packed.semi[packed.first_surface])
    for ma, mb in to_stop[:, 0]:
        if shot.opening.radius < radius * abs(ma):
            centre, radius = -mb * slope / ma, shot.opening.radius / abs(ma)
    return float(a * centre + b * slope), float(abs(a) * radius)
