"""What paraxial matrices say of a ghost's light: its flux in the picture and its brightness, without drawing it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...kernels.paraxial.arguments import EntranceLight, MeridianLens, PathList, SensorFrame, StopOutline
from ...kernels.paraxial.ghosts import RIM, measure_matrix_ghosts
from ...optics.colour.rgb import luminance_weights
from ...optics.lens.paths import LightPath
from ...optics.rays.path_reflectance import joined_steps
from ...typing import Floats, Indices
from ..scene.shot import Shot

# an offset larger than the distance of any ghost from the picture, pixels
FAR_PX = 10**7
# straight edges of the round entrance for comparing fluxes
ENTRANCE_SIDES = 16


def matrix_fluxes(
    shot: Shot, paths: Sequence[LightPath], n_gap: Floats, reflectance: Floats, near: Indices | None = None,
    sides: int = ENTRANCE_SIDES,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Compute the flux of each ghost in the picture at some wavelengths, and the angles of one ray.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    n_gap : ndarray, shape (M, K + 1)
    reflectance : ndarray, shape (W, K, S)
    near : ndarray of int, shape (M,), optional
        Which of the W belong to each of the M; None: they are the same.
    sides : int
        Edges of the round entrance.

    Returns
    -------
    flux : ndarray, shape (P, M)
        Per unit irradiance. For an area light it counts everywhere, because its spread brings light from beside the
        picture into it.
    angles : ndarray, shape (M, steps)
        Squared sines on the side of the lower index.
    """
    bent, light, axes = matrix_arguments(shot)
    joined, iris = joined_paths(tuple(paths)), stop_outline(shot)
    to_pixels, (width, height) = shot.to_pixels, shot.size_px
    if shot.border is not None:
        to_pixels = to_pixels + np.array([FAR_PX, FAR_PX, 0.0, 0.0])
        width, height = 2 * FAR_PX, 2 * FAR_PX
    own = bent._replace(n_gap=n_gap, reflectance=reflectance)
    found, angles = np.empty((len(paths), len(n_gap), 6)), np.empty((len(n_gap), len(joined.rows)))
    measure_matrix_ghosts(
        joined, own, np.arange(len(n_gap)) if near is None else near, shot.packed.curvature_x, light, iris,
        SensorFrame(axes, to_pixels, 1.0), float(width), float(height), sides, found, angles,
    )  # fmt: skip
    return found[:, :, 0], angles


def weigh_drafts(shot: Shot, paths: Sequence[LightPath], colors: Floats) -> Floats:
    """Return the brightness of the ghosts of `draw_draft`, computed at the middle wavelength.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    colors : ndarray, shape (len(paths), W, 3)
        As in `draw_draft`.

    Returns
    -------
    ndarray, shape (len(paths), 2)
        Luminance of the light in the picture, and of one pixel of the ghost; 0 for a ghost that misses the picture.
    """
    middle = len(shot.packed.n_gap) // 2
    seen = _measured(shot, paths, [middle])[:, 0, :2]
    light: Floats = colors.sum(axis=1) @ luminance_weights(shot.colorspace)
    return seen * light[:, None]


def draft_window(shots: Sequence[Shot], path: LightPath) -> tuple[int, int, int, int]:
    """Return the part of a picture that one path's ghosts of `draw_draft` cover.

    Parameters
    ----------
    shots : sequence of Shot
        Of points.
    path : LightPath

    Returns
    -------
    tuple of int
        Left, top, right, bottom; the first two are a pixel of the picture. right <= left or bottom <= top if no ghost
        is in it.
    """
    # lights of few lines have fewer wavelengths than others
    bounds = np.concatenate([_measured(shot, [path], range(len(shot.packed.n_gap)))[0, :, 2:] for shot in shots])
    sides = np.array(shots[0].size_px)
    first = np.clip(bounds[:, :2].min(axis=0), 0, sides - 1)
    end = np.clip(np.ceil(bounds[:, 2:].max(axis=0)), 0, sides)
    return int(first[0]), int(first[1]), int(end[0]), int(end[1])


def _measured(shot: Shot, paths: Sequence[LightPath], waves: Sequence[int]) -> Floats:
    """Measure the ghosts of `draw_draft` at some wavelengths (`measure_matrix_ghosts`), shape (P, M, 6)."""
    chosen = np.array(waves)
    bent, incoming, axes = matrix_arguments(shot)
    joined, frame = joined_paths(tuple(paths)), SensorFrame(axes, shot.to_pixels, shot.gain)
    width, height = shot.size_px
    found, angles = np.empty((len(paths), len(chosen), 6)), np.empty((len(chosen), len(joined.rows)))
    measure_matrix_ghosts(
        joined, bent._replace(n_gap=bent.n_gap[chosen]), chosen, shot.packed.curvature_x, incoming,
        stop_outline(shot), frame, float(width), float(height), RIM, found, angles,
    )  # fmt: skip
    return found


def matrix_arguments(shot: Shot) -> tuple[MeridianLens, EntranceLight, Floats]:
    """Return a shot's lens at all wavelengths and its incoming light as the kernels take them, and the axes."""
    packed = shot.packed
    slope, axes = float(np.tan(shot.incidence.tilt)), shot.incidence.axes
    slope_x, nearness = 0.0, packed.nearness / shot.incidence.tilt_cosine
    if packed.curvature_x is not None:
        # the two meridians are those of the lens, not of the light
        slope_x, slope = float(axes[1, 0]) * slope, float(axes[1, 1]) * slope
        axes = np.eye(2)
    lens = MeridianLens(packed.curvature, packed.z_vertex, packed.n_gap, packed.reflectance, packed.sensor_z)
    return lens, EntranceLight(float(packed.semi[packed.first_surface]), slope, slope_x, nearness), axes


def stop_outline(shot: Shot) -> StopOutline:
    """Return the opening of a shot's iris as the kernels take it."""
    return StopOutline(shot.opening.edges, shot.opening.radius)


# drags repeat the same paths
@lru_cache(maxsize=64)
def joined_paths(paths: tuple[LightPath, ...]) -> PathList:
    """Join the steps of paths."""
    return PathList(*joined_steps(paths), np.array([path.stop_crossings for path in paths]))
