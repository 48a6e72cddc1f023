"""The ray bundle of one path: direction of the incident light, adaptive grid, traced rays."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, radians, sin, sqrt, tan

import numpy as np

from ...kernels.tracing.adaptive_grid import build_mesh
from ...kernels.tracing.grid_limits import GridLimits
from ...kernels.tracing.sequential import ALIVE, REL, STOP_X, X, Y, trace_nodes
from ...typing import Floats, Indices, Mask
from ..lens.paths import LightPath
from .pack import PackedLens, wavelengths_fitted
from .pupil_region import Region, cells_across, cells_as_dense, front_box, tracing_arguments, widened_box

# coarsest cells of a bundle's grid over half its region, and limit of halvings per cell; a whole region has twice as
# many cells across
GRID = (4, 8)
# the same for a ghost of a screen preview
COARSE_GRID = (3, 6)
MAX_LEVEL = 6
# one halving more in a region of which less than this part is lit, in full detail
NARROW = 0.05
# least number of halvings of cells that the rim crosses, one less where the rim may be rough
RIM_LEVEL = 2
# largest relative flux error from the rim
FLUX_TOLERANCE = 3e-4
# a region of which less than ARC is lit is widened by WIDER of its size where light comes to its side, at most
# MOST_WIDENED times
ARC, WIDER, MOST_WIDENED = 0.25, 0.25, 8
# limits of a cell's smoothness (`kernels.tracing.grid_limits`)
INNER_BEND, AREA_RATIO, WEIGHT_BEND, FOLD_PX, AREA_PX = 0.005, 0.5, 0.002, 1.0, 5.0


@dataclass(frozen=True)
class Incidence:
    """Direction and distance of a light.

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
        Irradiance at the first vertex relative to the entrance pupil, both on planes that face the light; 1 for a
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
        """Irradiance at the first vertex on its plane for a light of 1; the cosine of its angle for a distant light."""
        return cos(self.tilt) * self.falloff


def incidence(field_deg: tuple[float, float], distance: float | None = None, pupil_z: float = 0.0) -> Incidence:
    """Return the incidence of a light from its field angles and distance.

    Parameters
    ----------
    field_deg : tuple of float
        (X, Y): the rays run along (-tan X, -tan Y, 1), so the direct image lies near (+efl tan X, +efl tan Y) in the
        upright picture. For a near light they are seen from the centre of the entrance pupil, so that its image stays
        at about the same place at any distance.
    distance : float, optional
        Distance of the light in front of the first vertex, mm along the axis; None: infinity.
    pupil_z : float
        Entrance pupil, mm from the first vertex; used only for a near light.

    Raises
    ------
    ValueError
        When a near light lies at or behind the plane of the first vertex or the entrance pupil.
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
    # the field angle at the pupil sets the light's height, which sets the slope at the vertex
    height = to_pupil * slope
    from_vertex, from_pupil = hypot(height, distance), hypot(height, to_pupil)
    return Incidence(-atan(height / distance), axes, 1.0 / from_vertex, (from_pupil / from_vertex) ** 2)


def least_distance(packed: PackedLens) -> float:
    """Return the least distance of a light in front of the first vertex at which it is outside the lens, mm.

    Returns
    -------
    float
        In front of the entrance pupil, and of the rim of a concave front, which protrudes from its vertex.
    """
    first = packed.first_surface
    semi, c = float(packed.semi[first]), float(packed.curvature[first])
    sag = c * semi**2 / (1.0 + sqrt(max(1.0 - (c * semi) ** 2, 0.0)))
    return max(0.0, -packed.first_order.entrance_pupil_z, -float(packed.z_vertex[first]) - min(sag, 0.0))


@dataclass(frozen=True)
class Bundle:
    """The ray grid of one path.

    Attributes
    ----------
    path : LightPath
    pupil : ndarray, shape (N, 2)
        Nodes on the plane of the first vertex in the meridional frame, mm; x >= 0 where there are two halves.
    triangles : ndarray, shape (T, 3)
    traced : dict of int to ndarray, shape (N, 5 + 2 C)
        Nodes traced at the wavelengths that shaped the grid (`trace_points`).
    halves : int
        2: the light is the bundle plus its mirror image; 1: the bundle alone.
    halved : ndarray, shape (10,), or None
        Number of cells that were halved for each of `kernels.tracing.adaptive_grid.REASONS`.
    """

    path: LightPath
    pupil: Floats
    triangles: Indices
    traced: dict[int, Floats]
    halves: int = 2
    halved: Indices | None = None


@dataclass(frozen=True)
class Refinement:
    """How finely a grid follows the light of a path.

    Attributes
    ----------
    scale : float
        Pixels per mm.
    tolerance : float
        Largest interpolation error, pixels.
    view_radius : float
        Light farther from the axis on the sensor, mm, is not refined.
    flux_tolerance : float
        Largest relative flux error from the rim.
    rough : int
        How often that tolerance may be doubled for a ghost drawn in less detail; from 1 on, cells whose rim looks
        straight stay larger.
    fringe_px : float
        Largest error between the circles around and within the iris, pixels, where light fades in fringes; 0 for blades
        with sharp edges.
    faint_radius : float
        With fringes, rays that cross the stop farther out, mm, are not refined.
    one_color : bool
        Fit only the middle wavelength.
    coarse : bool
        Start with fewer cells, and halve those with a rim only where the error requires it.
    """

    scale: float
    tolerance: float = 0.25
    view_radius: float = float("inf")
    flux_tolerance: float = FLUX_TOLERANCE
    rough: int = 0
    fringe_px: float = 0.0
    faint_radius: float = float("inf")
    one_color: bool = False
    coarse: bool = False


def trace_grid(
    packed: PackedLens, path: LightPath, tilt: float, iris: tuple[float, float], region: Region, fine: Refinement
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
    fine : Refinement

    Notes
    -----
    The pre-pass may lose the narrow end of an arc. The grid is finer than its samples: where a node on a side of the
    region passes, the region is widened there, and the grid built again.
    """
    fitted = sorted(wavelengths_fitted(packed)[: 1 if fine.one_color else None])
    # errors accumulate along the rim of the light, which can be a small part of the box
    rim_tolerance = fine.flux_tolerance * 2.0**fine.rough * sqrt(region.share)
    rim_level = 0 if fine.coarse else RIM_LEVEL - 1 if fine.rough else RIM_LEVEL
    max_level = MAX_LEVEL + int(region.share < NARROW and not (fine.rough or fine.coarse))
    limits = GridLimits(
        rim_level, max_level, fine.tolerance, rim_tolerance, fine.fringe_px, fine.faint_radius, fine.scale,
        fine.view_radius, int(region.slivers), INNER_BEND, AREA_RATIO, WEIGHT_BEND, FOLD_PX, AREA_PX,
    )  # fmt: skip
    arguments = tracing_arguments(packed, fitted, path, tilt)
    box, cells = region.box, cells_across(packed, COARSE_GRID if fine.coarse else GRID)
    may_widen = 0 if fine.coarse or region.share > ARC else MOST_WIDENED
    limit = (path.stop_crossings, min(iris[0], fine.faint_radius))
    for widened in range(may_widen + 1):
        pupil, data, triangles, halved = build_mesh(*arguments, path.stop_crossings, iris, box, cells, limits)
        if widened == may_widen:
            break
        front = front_box(packed, tilt)
        sides = _lit_sides(pupil, data, box, box != front, limit, fine.view_radius)
        if not sides.any():
            break
        wide = np.where(sides, widened_box(box, front, WIDER), box)
        box, cells = wide, cells_as_dense(cells, box, wide)
    return Bundle(path, pupil, triangles, dict(zip(fitted, data, strict=True)), packed.halves, halved)


def _lit_sides(
    pupil: Floats, data: Floats, box: Floats, inner: Mask, stop: tuple[int, float], view_radius: float
) -> Mask:
    """Return on which `inner` sides of its box a grid has nodes that pass and land in the picture, shape (4,).

    `stop` holds the number of crossings and the radius.
    """
    lit = np.zeros(4, dtype=np.bool_)
    for side in np.flatnonzero(inner):
        places = pupil[:, side // 2]
        slack = 1e-9 * (box[side | 1] - box[side & 2])
        nodes = np.flatnonzero(places >= box[side] - slack if side % 2 else places <= box[side] + slack)
        rays = data[:, nodes]
        passing = (rays[:, :, ALIVE] > 0.0) & (rays[:, :, REL] <= 1.0)
        if not passing.any():
            continue
        rays = rays[passing]
        seen = np.hypot(rays[:, X], rays[:, Y]) <= view_radius
        for at in range(STOP_X, STOP_X + 2 * stop[0], 2):
            seen &= np.hypot(rays[:, at], rays[:, at + 1]) <= stop[1]
        lit[side] = seen.any()
    return lit


def trace_bundle(packed: PackedLens, w: int, bundle: Bundle, tilt: float) -> Floats:
    """Return a bundle's nodes at one wavelength; traces them unless the grid already has them.

    Returns
    -------
    ndarray, shape (N, 5 + 2 C)
        As in `trace_points`.
    """
    held = bundle.traced.get(w)
    return trace_points(packed, w, bundle.path, tilt, bundle.pupil) if held is None else held


def trace_points(packed: PackedLens, w: int, path: LightPath, tilt: float, points: Floats) -> Floats:
    """Trace rays through given points of the pupil.

    Parameters
    ----------
    packed : PackedLens
    w : int
        Index of a packed wavelength.
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
