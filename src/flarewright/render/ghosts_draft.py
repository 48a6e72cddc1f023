"""Ghosts, draft quality: paraxial matrices (Lee and Eisemann 2013; Van Acoleyen 2025, chapter 4).

The same paths, wavelengths, iris and units as final quality, in milliseconds: every ghost is the image of the entrance
cut by the iris, evenly lit, its colour from one ray.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.matrix import draw_matrix_ghosts, path_matrices
from ..kernels.raster import sum_rows
from ..optics.paths import LightPath
from .art import Frame, PathArt
from .grade import finish
from .shot import Shot

Floats = NDArray[np.float64]


def draw_draft(
    shot: Shot,
    paths: Sequence[LightPath],
    differences: Floats,
    rgb: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> None:
    """Mark the paraxial ghosts of some paths.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    differences : ndarray, shape (3, H, W), float64
        Added to; `kernels.raster.sum_rows` turns it into flux per pixel.
    rgb : tuple of float
        Multiplies their colour.
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
        shot.weights(packed.wavelengths_nm) * rgb, differences, np.empty(0, dtype=np.float32),
    )  # fmt: skip


def draw_draft_by_hand(shot: Shot, path: LightPath, art: PathArt, differences: Floats) -> None:
    """Mark one path with a gain, an offset or a scale; one with a ramp or a blur needs `draft_alone`.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt
    differences : ndarray, shape (3, H, W), float64
        As in `draw_draft`.
    """
    placed = art.place(shot.to_pixels, _frame(shot, path) if art.framed else None)
    draw_draft(replace(shot, to_pixels=placed), [path], differences, art.rgb)


def draft_alone(shot: Shot, path: LightPath, art: PathArt) -> Floats:
    """Draw one path on a plane of its own, ramped and blurred.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt

    Returns
    -------
    ndarray, shape (3, H, W)
        Flux per pixel.
    """
    (width, height), (mx, my) = shot.size_px, art.margin(shot.to_pixels)
    frame = _frame(shot, path) if art.framed else None
    placed = art.place(shot.to_pixels, frame)
    sheet = np.zeros((3, height + 2 * my, width + 2 * mx))
    moved = replace(shot, to_pixels=placed + np.array([mx, my, 0.0, 0.0]))
    draw_draft(moved, [path], sheet, art.rgb)
    sum_rows(sheet)
    return np.asarray(finish(sheet, art, frame, placed, shot.to_pixels), dtype=np.float64)


def _frame(shot: Shot, path: LightPath) -> Frame:
    """Compute a ghost's centre and size at the middle wavelength by matrices."""
    packed = shot.packed
    to_stop = np.empty((path.stop_crossings, 2, 2))
    middle = len(packed.wavelengths_nm) // 2
    a, b, _, _ = path_matrices(
        path.rows, path.actions, packed.curvature, packed.z_vertex, packed.n_gap[middle], packed.sensor_z, to_stop
    )
    slope = float(np.tan(shot.incidence.tilt))
    # the entrance, or the iris as seen from the front, whichever is smaller
    centre, radius = 0.0, float(packed.semi[packed.first_surface])
    for ma, mb in to_stop[:, 0]:
        if shot.opening.radius < radius * abs(ma):
            centre, radius = -mb * slope / ma, shot.opening.radius / abs(ma)
    place = -(a * centre + b * slope) * shot.incidence.axes[1]
    return Frame((float(place[0]), float(place[1])), abs(a) * radius)
