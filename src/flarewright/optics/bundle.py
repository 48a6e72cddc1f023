"""The ray bundle of one path: where its light comes from, its grid, its rays."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, radians, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from ..kernels.mesh import build_mesh
from ..kernels.trace import STOP_X, trace_nodes
from .pack import PackedLens, wavelengths_fitted
from .paths import LightPath
from .region import Region, cells_across, tracing_arguments

Floats = NDArray[np.float64]

# coarsest cells of a bundle's grid over half its region, and how often each may be halved; of a whole region twice as
# many stand side by side
GRID = (4, 8)
# and of a ghost that is drawn for a screen
COARSE_GRID = (3, 6)
MAX_LEVEL = 6
# cells that the rim crosses are halved at least this often, and once less where it may be rough
RIM_LEVEL = 2
# largest relative error of a bundle's flux from its rim
FLUX_TOLERANCE = 3e-4


@dataclass(frozen=True)
class Incidence:
    """Where a light stands.

    Attributes
    ----------
    tilt : float
        Angle of the ray through the first vertex in the meridional frame, rad: it runs along (0, sin tilt, cos tilt);
        never positive.
    axes : ndarray, shape (2, 2)
        Upright (x, y) of the meridional x axis (the mirror axis' normal) and y axis (towards the light).
    nearness : float
        1 / distance from the light to the first vertex, 1/mm; 0 for a distant light, whose rays are parallel.
    falloff : float
        Irradiance at the first vertex over that at the entrance pupil, both on planes that face the light; 1 for a
        distant light.
    """

    tilt: float
    axes: Floats
    nearness: float = 0.0
    falloff: float = 1.0

    @property
    def tilt_cosine(self) -> float:
        """Cosine of the tilt."""
        return cos(self.tilt)

    @property
    def cosine(self) -> float:
        """Irradiance at the first vertex on its plane, of a light of 1; of a distant light the cosine of its angle."""
        return cos(self.tilt) * self.falloff


def incidence(field_deg: tuple[float, float], distance: float | None = None, pupil_z: float = 0.0) -> Incidence:
    """Turn field angles, and the distance of a near light, into the rays' direction.

    Parameters
    ----------
    field_deg : tuple of float
        (X, Y): the rays run along (-tan X, -tan Y, 1), so the direct image lies near (+efl tan X, +efl tan Y) in the
        upright picture. Those of a near light are seen from the middle of the entrance pupil, which is where a lens
        looks from: near or far, the image stays about where it is.
    distance : float, optional
        How far in front of the first vertex the light stands, mm along the axis; None: a distant light.
    pupil_z : float
        The entrance pupil, mm from the first vertex; only a near light asks.

    Returns
    -------
    Incidence

    Raises
    ------
    ValueError
        When a near light stands at or behind the plane of the first vertex or the entrance pupil.
    """
    slope_x, slope_y = tan(radians(field_deg[0])), tan(radians(field_deg[1]))
    azimuth = atan2(slope_y, slope_x)
    axes = np.array([[-sin(azimuth), cos(azimuth)], [cos(azimuth), sin(azimuth)]])
    slope = hypot(slope_x, slope_y)
    if distance is None:
        return Incidence(-atan(slope), axes)
    to_pupil = distance + pupil_z
    if not (distance > 0.0 and to_pupil > 0.0):
        raise ValueError(f"a light at {distance:g} mm is not in front of the lens and its entrance pupil")
    # the height of the light is the pupil's to see, the slope the vertex'
    height = to_pupil * slope
    from_vertex, from_pupil = hypot(height, distance), hypot(height, to_pupil)
    return Incidence(-atan(height / distance), axes, 1.0 / from_vertex, (from_pupil / from_vertex) ** 2)


def least_distance(packed: PackedLens) -> float:
    """Return how far in front of the first vertex a light must stand not to stand in the lens, mm.

    Parameters
    ----------
    packed : PackedLens

    Returns
    -------
    float
        In front of the entrance pupil, and of the rim of a concave front, which stands before its vertex.
    """
    first = packed.first_surface
    semi, c = float(packed.semi[first]), float(packed.curvature[first])
    sag = c * semi**2 / (1.0 + sqrt(max(1.0 - (c * semi) ** 2, 0.0)))
    return max(0.0, -packed.first_order.entrance_pupil_z, -float(packed.z_vertex[first]) - min(sag, 0.0))


@dataclass(frozen=True)
class Bundle:
    """The grid of one path's rays.

    Attributes
    ----------
    path : LightPath
    pupil : ndarray, shape (N, 2)
        Nodes on the plane of the first vertex in the meridional frame, mm; x >= 0 where there are two halves.
    triangles : ndarray, shape (T, 3)
    traced : dict of int to ndarray, shape (N, 5 + 2 C)
        The nodes as traced at the wavelengths that shaped the grid (`trace_points`).
    halves : int
        2: the bundle and its mirror image are the light; 1: the bundle is all of it.
    """

    path: LightPath
    pupil: Floats
    triangles: NDArray[np.int64]
    traced: dict[int, Floats]
    halves: int = 2


def trace_grid(
    packed: PackedLens,
    path: LightPath,
    tilt: float,
    iris: tuple[float, float],
    region: Region,
    *,
    tolerance: float,
    scale: float,
    view_radius: float = float("inf"),
    flux_tolerance: float = FLUX_TOLERANCE,
    rough: int = 0,
    fringe_px: float = 0.0,
    faint_radius: float = float("inf"),
    one_color: bool = False,
    coarse: bool = False,
) -> Bundle:
    """Build the adaptive grid of a path.

    Parameters
    ----------
    packed, path, tilt
        As in `find_region`; the grid fits the first, middle and last wavelength.
    iris : tuple of float
        Radii of the circles around and within the iris, mm.
    region : Region
        From `find_region`.
    tolerance : float
        Largest interpolation error, pixels.
    scale : float
        Pixels per mm.
    view_radius : float
        What lies farther from the axis on the sensor, mm, is not refined.
    flux_tolerance : float
        Largest relative error of the bundle's flux from its rim.
    rough : int
        How often that may be doubled, of a ghost drawn in less detail; from once on, cells with a rim that looks
        straight stay larger.
    fringe_px : float
        Largest error between the circles around and within the iris, pixels, where light fades there in fringes; 0
        where blades cut it.
    faint_radius : float
        What crosses the stop farther out, mm, is not refined where there are fringes.
    one_color : bool
        Fit the middle wavelength alone.
    coarse : bool
        Begin with fewer cells, and halve those with a rim only where their errors ask for it.

    Returns
    -------
    Bundle
    """
    fitted = sorted(wavelengths_fitted(packed)[: 1 if one_color else None])
    # the rim's error adds up along the rim of what passes, which may be little of the box
    rim_tolerance = flux_tolerance * 2.0**rough * sqrt(region.share)
    rim_level = 0 if coarse else RIM_LEVEL - 1 if rough else RIM_LEVEL
    cells = cells_across(packed, COARSE_GRID if coarse else GRID)
    pupil, data, triangles = build_mesh(
        *tracing_arguments(packed, fitted, path, tilt), path.stop_crossings, *iris,
        region.box, *cells, rim_level, MAX_LEVEL, tolerance, rim_tolerance, fringe_px, faint_radius, scale,
        view_radius, int(region.slivers),
    )  # fmt: skip
    return Bundle(path, pupil, triangles, dict(zip(fitted, data, strict=True)), packed.halves)


def trace_bundle(packed: PackedLens, w: int, bundle: Bundle, tilt: float) -> Floats:
    """Trace a bundle's nodes at one wavelength, unless its grid already holds them.

    Parameters
    ----------
    packed : PackedLens
    w : int
    bundle : Bundle
    tilt : float

    Returns
    -------
    ndarray, shape (N, 5 + 2 C)
        As `trace_points`.
    """
    held = bundle.traced.get(w)
    return trace_points(packed, w, bundle.path, tilt, bundle.pupil) if held is None else held


def trace_points(packed: PackedLens, w: int, path: LightPath, tilt: float, points: Floats) -> Floats:
    """Trace rays through given points of the pupil.

    Parameters
    ----------
    packed : PackedLens
    w : int
        Which of its wavelengths.
    path : LightPath
    tilt : float
        From `incidence`.
    points : ndarray, shape (N, 2)
        Meridional frame, mm, on the plane of the first vertex.

    Returns
    -------
    ndarray, shape (N, 5 + 2 C)
        x, y on the sensor (meridional frame), product of R and T, largest r / semi-diameter, alive, and x, y at each of
        the C crossings of the stop.
    """
    data = np.empty((len(points), STOP_X + 2 * path.stop_crossings))
    x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    trace_nodes(*tracing_arguments(packed, w, path, tilt), x, y, data)
    return data
