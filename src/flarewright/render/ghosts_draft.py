"""Ghosts, draft quality: paraxial matrices (Lee and Eisemann 2013; Van Acoleyen 2025, chapter 4).

The same paths, wavelengths, iris and units as final quality, in milliseconds: every ghost is the image of the entrance
cut by the iris, evenly lit, its colour from one ray.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.matrix import draw_matrix_ghosts
from ..optics.paths import LightPath
from .shot import Shot


def draw_draft(shot: Shot, paths: Sequence[LightPath], differences: NDArray[np.float64]) -> None:
    """Mark the paraxial ghosts of some paths.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    differences : ndarray, shape (3, H, W), float64
        Added to; `kernels.raster.sum_rows` turns it into flux per pixel.
    """
    if not paths:
        return
    packed, opening = shot.packed, shot.opening
    starts = np.cumsum([0, *(len(path.rows) for path in paths)])
    first = packed.first_surface
    draw_matrix_ghosts(
        np.concatenate([path.rows for path in paths]), np.concatenate([path.actions for path in paths]), starts,
        np.array([path.stop_crossings for path in paths]), packed.curvature, packed.z_vertex, packed.n_gap,
        packed.reflectance, packed.sensor_z, float(packed.semi[first]), float(np.tan(shot.incidence.tilt)),
        opening.edges, opening.radius, opening.mask, opening.half, shot.incidence.axes, shot.to_pixels, shot.gain,
        shot.weights(packed.wavelengths_nm), differences, np.empty(0, dtype=np.float32),
    )  # fmt: skip
