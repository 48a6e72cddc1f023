"""The ghost table: flux, position, size and brightness of every path."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import ceil, sqrt
from typing import Literal

import numpy as np

from ...kernels.raster.bundle import draw_bundle, measure_bundle, node_densities
from ...kernels.raster.polygons import blank_plane, to_pixels
from ...kernels.tracing.sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y
from ...model import CoatingChoice, Iris, Lens
from ...typing import Floats, Indices, Mask, Progress
from ..lens.dispersion import D_LINE_NM
from ..lens.paraxial import FirstOrder, path_matrices
from ..lens.paths import LightPath, direct_path, ghost_paths
from ..pupil.iris import blade_edges
from .bundle import Bundle, Incidence, Refinement, incidence, trace_bundle, trace_grid, trace_points
from .pack import PackedLens, SensorMirror, facing, pack_lens, resolve_coatings
from .pupil_region import Region, find_region

Mirror = int | Literal["sensor"]

# pixels per rms radius for tracing
RESOLUTION = 100.0
# in stop radii: pixel of a grid that follows only the rim, and rms radius below which an image is a point
ROUGHEST, SHARPEST = 1e5, 1e-5
# side of the grid for the peak search, and its least pixel, mm: a sensor's pixels do not scale with the lens
PEAK_GRID, PEAK_PIXEL = 256, 0.01
# largest interpolation error of a ghost's flux, first and second moment
MOMENT_ERROR = 2e-3
# ray-by-ray integration of triangles: largest number of rays, halvings, and the change that refines further
MOST_RAYS = 300_000
LEAST_HALVINGS, MOST_HALVINGS = 2, 10
RAY_SHARE = 1e-5
# fraction of a ghost's flux that the moments ignore as the farthest light
FARTHEST = 1e-5


@dataclass(frozen=True)
class GhostQuery:
    """The light and the paths of a ghost analysis.

    Attributes
    ----------
    field_deg : tuple of float
        (X, Y) of the light, degrees.
    distance : float or None
        Distance of the light in front of the first vertex, mm along the axis; None: infinity.
    wavelength_nm : float
    paths : {"all", "same-side"}
        All ghost paths, or those whose mirrors lie on one side of the stop.
    sensor : SensorMirror or None
        The sensor as a mirror: adds the paths "sensor-i".
    orders : {2, 4}
        4 adds ghosts with four reflections (`render.analysis.find_ghosts`).
    order4_limit : float
        Keep only four-reflection paths with more than this part of all two-reflection light on the unbounded sensor
        plane.
    """

    field_deg: tuple[float, float]
    distance: float | None = None
    wavelength_nm: float = D_LINE_NM
    paths: str = "all"
    sensor: SensorMirror | None = None
    orders: int = 2
    order4_limit: float = 1e-4


@dataclass(frozen=True)
class GhostRow:
    """Analysis of one path; positions in the upright picture.

    Attributes
    ----------
    first_reflection, second_reflection : int or None
        Rows j, then i < j; None for the direct image. The sensor as a mirror is "sensor".
    throughput_mm2 : float
        Flux on the unbounded sensor plane for a light with irradiance 1 on a plane facing it; for a near light, at the
        middle of the entrance pupil.
    centroid_mm : tuple of float
    rms_radius_mm : float
        Root mean square distance from the centroid, weighted by flux. It diverges where a path's light leaves the last
        surface at grazing angles with some flux: such rays land arbitrarily far out on the plane. The farthest 1e-5 of
        the flux at such an edge is left out.
    peak_irradiance : float
        Largest irradiance averaged over a square of side `peak_patch_mm`, per flux of the direct image, 1/mm^2; 0 for a
        dark direct image.
    peak_patch_mm : float
        At least 0.01, about a pixel of a sensor.
    bounded_by : {"stop", "entrance"}
        The aperture that limits the ghost on the axis: the smaller of the two as projected to the entrance by matrices
        (docs/physics.md).
    focus_distance_mm : float or None
        Where the path focuses a distant light, mm behind the sensor (negative: in front); None for an afocal path.
    later_reflections : tuple
        Rows of the third and fourth mirror of a four-reflection path.
    """

    first_reflection: Mirror | None
    second_reflection: int | None
    throughput_mm2: float
    centroid_mm: tuple[float, float]
    rms_radius_mm: float
    peak_irradiance: float
    peak_patch_mm: float
    bounded_by: str
    focus_distance_mm: float | None
    later_reflections: tuple[Mirror, ...] = ()

    @property
    def name(self) -> str:
        """Name of the path, and of its layer in a render."""
        if self.first_reflection is None:
            return "direct"
        return "-".join(map(str, (self.first_reflection, self.second_reflection, *self.later_reflections)))


@dataclass(frozen=True)
class GhostTable:
    """The analysis of a lens for one light at one wavelength.

    Attributes
    ----------
    efl, bfl, f_number, entrance_pupil_diameter, stop_semi_diameter, sensor_distance : float
        First-order data at the wavelength, mm.
    wavelength_nm : float
    direct : GhostRow
    ghosts : tuple of GhostRow
        Every two-reflection path and the other requested ones, by descending throughput; paths that pass no light have
        throughput 0.
    """

    efl: float
    bfl: float
    f_number: float
    entrance_pupil_diameter: float
    stop_semi_diameter: float
    sensor_distance: float
    wavelength_nm: float
    direct: GhostRow
    ghosts: tuple[GhostRow, ...]


def pack_for_query(lens: Lens, order: FirstOrder, coating: CoatingChoice, query: GhostQuery) -> PackedLens:
    """Pack a complete lens at the wavelength of a query, with its sensor.

    Parameters
    ----------
    lens : Lens
        Complete (`render.scene.resolve.open_lens`).
    order : FirstOrder
        At the opening and focus to be used.
    coating : CoatingChoice
    query : GhostQuery
    """
    coatings = resolve_coatings(lens, coating)
    return pack_lens(lens, order, coatings, np.array([query.wavelength_nm]), sensor=query.sensor)


def ghost_table(
    lens: Lens,
    packed: PackedLens,
    query: GhostQuery,
    *,
    others: Sequence[LightPath] = (),
    threads: int | None = None,
    progress: Progress | None = None,
    measured: dict[str, GhostRow] | None = None,
) -> GhostTable:
    """Analyse all two-reflection ghosts of a lens for one light, and the given paths of four reflections.

    Parameters
    ----------
    lens : Lens
    packed : PackedLens
        The lens, packed for the query (`pack_for_query`).
    query : GhostQuery
    others : sequence of LightPath
        Paths of four reflections.
    threads : int, optional
        None: all cores; results do not depend on it.
    progress : callable, optional
        Called after each path with the finished fraction (0 to 1) and the path's name.
    measured : dict of str to GhostRow, optional
        Finished rows of an interrupted call with the same arguments, by name, their peaks per unit of light; the
        finished rows of this one are put in.

    Notes
    -----
    Rays are traced to the unbounded sensor plane. A ray counts when it passes every surface's semi-diameter and the
    round stop at each crossing; R and T are the means of s and p, multiplied along the path. `tests/physics` compares
    with a plain Monte Carlo tracer. Stop and sensor are placed at the d line for every wavelength.
    """
    order = packed.first_order
    light = incidence(query.field_deg, query.distance, order.entrance_pupil_z)
    packed = facing(packed, light.axes, light.nearness)
    todo = (direct_path(lens), *ghost_paths(lens, query.paths, sensor=query.sensor is not None), *others)
    known = {} if measured is None else measured
    missing = [path for path in todo if path.name not in known]
    pool = ThreadPoolExecutor(threads or os.cpu_count())
    try:
        rows_of_missing = pool.map(lambda path: _measure(lens, packed, path, light), missing)
        for left, row in zip(reversed(range(len(missing))), rows_of_missing, strict=True):
            known[row.name] = row
            if progress is not None:
                progress(1.0 - left / len(todo), row.name)
    finally:
        # an interruption drops the paths that are still waiting
        pool.shutdown(cancel_futures=True)
    rows = [known[path.name] for path in todo]
    direct = rows[0]
    # peaks are relative to the direct image's flux; without one they are 0
    unit = direct.throughput_mm2 if direct.throughput_mm2 > 0.0 else float("inf")
    rows = [replace(row, peak_irradiance=row.peak_irradiance / unit) for row in rows]
    ghosts = sorted(rows[1:], key=lambda row: -row.throughput_mm2)
    return GhostTable(
        efl=order.efl,
        bfl=order.bfl,
        f_number=order.f_number,
        entrance_pupil_diameter=order.entrance_pupil_diameter,
        stop_semi_diameter=order.stop_semi_diameter,
        sensor_distance=order.sensor_distance,
        wavelength_nm=query.wavelength_nm,
        direct=rows[0],
        ghosts=tuple(ghosts),
    )


def _measure(lens: Lens, packed: PackedLens, path: LightPath, light: Incidence) -> GhostRow:
    bounded_by, focus = _paraxial_facts(lens, packed, path, packed.nearness / light.tilt_cosine)
    blades = blade_edges(Iris(), packed.stop_semi)
    region = find_region(packed, path, light.tilt, packed.stop_semi)
    mirrors: list[Mirror] = ["sensor" if row == len(lens.rows) else row for row in path.mirrors]
    j, i = (mirrors[0], path.second_reflection) if mirrors else (None, None)
    later = tuple(mirrors[2:])
    dark_row = GhostRow(j, i, 0.0, (0.0, 0.0), 0.0, 0.0, 0.0, bounded_by, focus, later)
    if region is None:
        return dark_row
    bundle = _grid(packed, path, light, region, 1.0 / (ROUGHEST * packed.stop_semi))
    # first trace only the rim, for the size; then finely enough for that size
    rms = _rough_size(_sample(packed, bundle, light, bundle.pupil[bundle.triangles]), bundle.halves)
    bundle = _grid(packed, path, light, region, RESOLUTION / max(rms, SHARPEST * packed.stop_semi))
    data = trace_bundle(packed, 0, bundle, light.tilt)
    sums = _integrate(packed, bundle, data, light, blades)
    if sums[0] <= 0.0:
        return dark_row
    x, y = sums[1] / sums[0], sums[2] / sums[0]
    rms = sqrt(max(sums[3] / sums[0] - x * x - y * y, 0.0))
    # the whole ghost if it is compact, else the part near its centroid
    middle, reach = -0.5 * (sums[6] + sums[7]) * light.axes[1], _extent(sums)
    if reach > 4.0 * rms:
        middle, reach = np.array([x, y]), 4.0 * rms
    peak, patch = _peak(bundle, data, blades, light, (float(middle[0]), float(middle[1])), reach)
    flux = float(sums[0] * light.cosine)
    return GhostRow(j, i, flux, (float(x), float(y)), rms, peak, patch, bounded_by, focus, later)


def _grid(packed: PackedLens, path: LightPath, light: Incidence, region: Region, scale: float) -> Bundle:
    """Build the grid of a path for `scale` pixels per mm, behind the round stop."""
    stop = (packed.stop_semi, packed.stop_semi)
    return trace_grid(packed, path, light.tilt, stop, region, Refinement(scale))


def _rough_size(rays: Floats, halves: int) -> float:
    """Return the rms radius from a few rays (`_passing`) without the farthest; 0 when none passes."""
    flux = float(rays[:, 0].sum())
    if flux <= 0.0:
        return 0.0
    middle = _middle(rays, halves)
    return sqrt(float(_second_moments(rays, middle, _far_limit(rays, middle, 0.0)).sum()) / flux)


def _integrate(packed: PackedLens, bundle: Bundle, data: Floats, light: Incidence, blades: Floats) -> Floats:
    """Integrate a bundle like `measure_bundle`, but ray by ray in triangles that interpolate badly.

    Near the edge where rays leave the last surface at a grazing angle, positions on the unbounded plane vary like the
    inverse of the direction's z; there, and next to rays that fail, interpolation is impossible. These triangles carry
    little light, but they can dominate the ghost's size.
    """
    crossings = bundle.path.stop_crossings
    rest = (crossings, blades, light.axes, bundle.halves)
    sums: Floats = measure_bundle(data, bundle.pupil, bundle.triangles, *rest)
    torn, bent = _partly_failed(bundle, data), _badly_interpolated(packed, bundle, data, light)
    if bent.any():
        sums[:4] = measure_bundle(data, bundle.pupil, bundle.triangles[~bent], *rest)[:4]
    if torn.any() or bent.any():
        sums[:4] += _ray_by_ray(packed, bundle, bundle.triangles[torn | bent], light, sums)
    return sums


def _partly_failed(bundle: Bundle, data: Floats) -> Mask:
    """Return which triangles contain failed rays."""
    alive = data[bundle.triangles, ALIVE]
    return np.asarray((alive.min(axis=1) == 0.0) & (alive.max(axis=1) > 0.0))


def _badly_interpolated(packed: PackedLens, bundle: Bundle, data: Floats, light: Incidence) -> Mask:
    """Return which triangles would spoil the ghost's flux or size by interpolation.

    A ray through each centre measures the error of the triangle's flux and moments. All these rays together, without
    the farthest, give a rough estimate of the moments that does not depend on interpolation. The triangles of smallest
    error are interpolated as long as their errors add up to less than MOMENT_ERROR.
    """
    a, b, c = bundle.triangles.T
    clear = (data[:, ALIVE] > 0.0) & (data[:, REL] <= 1.0)
    whole = (data[a, ALIVE] > 0.0) & (data[b, ALIVE] > 0.0) & (data[c, ALIVE] > 0.0)
    seen = np.flatnonzero(whole & (clear[a] | clear[b] | clear[c]))
    bent = np.zeros(len(bundle.triangles), dtype=np.bool_)
    places = bundle.pupil[bundle.triangles[seen]]
    rays = trace_points(packed, 0, bundle.path, light.tilt, _centres(places))
    passing = _passing(packed, bundle, rays, places)
    total = float(passing[:, 0].sum())
    if total <= 0.0:
        return bent
    middle = _middle(passing, bundle.halves)
    second = max(float(_second_moments(passing, middle, _far_limit(passing, middle, 0.0)).sum()), 1e-300)
    weight, x, y = ((data[a[seen], m] + data[b[seen], m] + data[c[seen], m]) / 3.0 for m in (WEIGHT, X, Y))
    wrong = np.abs(_squares(rays[:, X], rays[:, Y], middle) - _squares(x, y, middle)) / second
    # across the meridional plane the two halves cancel
    off = np.abs(rays[:, Y] - y) if bundle.halves == 2 else np.hypot(rays[:, X] - x, rays[:, Y] - y)
    wrong += off / sqrt(second * total)
    # R and T can change fast near a critical angle
    wrong = wrong * weight + np.abs(rays[:, WEIGHT] - weight) / total
    wrong *= bundle.halves * _areas(places)
    wrong[rays[:, ALIVE] == 0.0] = np.inf
    # the usual case: all are accurate enough
    if float(wrong.sum()) > MOMENT_ERROR:
        order = np.argsort(wrong, kind="stable")
        bent[seen[order[np.cumsum(wrong[order]) > MOMENT_ERROR]]] = True
    return bent


def _centres(places: Floats) -> Floats:
    """Return the centres of triangles, (N, 3, 2) -> (N, 2)."""
    return np.asarray((places[:, 0] + places[:, 1] + places[:, 2]) / 3.0)


def _areas(places: Floats) -> Floats:
    """Return the areas of triangles in the pupil, (N, 3, 2) -> (N,)."""
    e1, e2 = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    return np.asarray(0.5 * np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]))


def _quarters(places: Floats) -> Floats:
    """Split triangles at the middles of their edges, (N, 3, 2) -> (4 N, 3, 2); the four parts are adjacent rows."""
    a, b, c = places[:, 0], places[:, 1], places[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab))]
    return np.stack(parts, axis=1).reshape(-1, 3, 2)


def _sample(packed: PackedLens, bundle: Bundle, light: Incidence, places: Floats) -> Floats:
    """Trace a ray through the centre of each triangle of the pupil; returns as `_passing`."""
    return _passing(packed, bundle, trace_points(packed, 0, bundle.path, light.tilt, _centres(places)), places)


def _passing(packed: PackedLens, bundle: Bundle, rays: Floats, places: Floats) -> Floats:
    """Return flux (all halves of the pupil), x and y of rays that represent triangles; 0 for blocked rays; (N, 3)."""
    passes = (rays[:, ALIVE] > 0.0) & (rays[:, REL] <= 1.0)
    for crossing in range(bundle.path.stop_crossings):
        at = STOP_X + 2 * crossing
        passes &= np.hypot(rays[:, at], rays[:, at + 1]) <= packed.stop_semi
    found = np.stack([bundle.halves * rays[:, WEIGHT] * _areas(places), rays[:, X], rays[:, Y]], axis=1)
    return np.where(passes[:, None], found, 0.0)


def _ray_by_ray(packed: PackedLens, bundle: Bundle, triangles: Indices, light: Incidence, sums: Floats) -> Floats:
    """Integrate over triangles by rays through their parts: flux times 1, x, y, x^2 + y^2 (upright).

    A triangle is quartered until its four rays and their parent agree about flux and second moment to RAY_SHARE of the
    whole (`sums` plus the result here), or until MOST_RAYS are traced. The second moment can diverge: the farthest
    rays, with at most FARTHEST of the ghost's light, are left out.
    """
    flux = float(sums[0])
    # the upright picture is the sensor turned by 180 degrees
    middle = -(light.axes @ sums[1:3]) / flux if flux > 0.0 else np.zeros(2)
    known = max(float(sums[3]) - flux * float(middle @ middle), 0.0)
    places = bundle.pupil[triangles]
    samples = _sample(packed, bundle, light, places)
    done: list[Floats] = []
    spent = len(samples)
    for level in range(MOST_HALVINGS):
        if len(places) == 0 or spent + 4 * len(places) > MOST_RAYS:
            break
        places = _quarters(places)
        found = _sample(packed, bundle, light, places)
        spent += len(found)
        rays = np.concatenate([*done, found])
        limit = _far_limit(rays, middle, flux)
        total = max(flux + float(rays[:, 0].sum()), 1e-300)
        moments = max(known + float(_second_moments(rays, middle, limit).sum()), 1e-300)
        doubt = np.abs(found[:, 0].reshape(-1, 4).sum(axis=1) - samples[:, 0]) / total
        change = _second_moments(found, middle, limit).reshape(-1, 4).sum(axis=1) - _second_moments(
            samples, middle, limit
        )
        doubt = np.maximum(doubt, np.abs(change) / moments)
        unsettled = np.repeat((doubt > RAY_SHARE) | (level < LEAST_HALVINGS), 4)
        done.append(found[~unsettled])
        places, samples = places[unsettled], found[unsettled]
    rays = np.concatenate([*done, samples])
    weight, x, y = rays[_distances(rays, middle) <= _far_limit(rays, middle, flux)].T
    # both halves of the pupil: across the meridional plane they cancel
    along, across = float((weight * y).sum()), 0.0 if bundle.halves == 2 else float((weight * x).sum())
    moment = float((weight * (x * x + y * y)).sum())
    upright = -(across * light.axes[0] + along * light.axes[1])
    return np.array([weight.sum(), upright[0], upright[1], moment])


def _middle(rays: Floats, halves: int) -> Floats:
    """Return the centroid of rays in the meridional frame, (2,); on the mirror plane when there are two halves."""
    x, y = rays[:, 0] @ rays[:, 1:] / rays[:, 0].sum()
    return np.array([0.0 if halves == 2 else x, y])


def _squares(x: Floats, y: Floats, middle: Floats) -> Floats:
    """Return squared distances from a ghost's centre."""
    return np.asarray((x - middle[0]) ** 2 + (y - middle[1]) ** 2)


def _distances(rays: Floats, middle: Floats) -> Floats:
    """Return distances of rays from a ghost's centre."""
    return np.asarray(np.sqrt(_squares(rays[:, 1], rays[:, 2], middle)))


def _second_moments(rays: Floats, middle: Floats, limit: float) -> Floats:
    """Return flux times squared distance from a ghost's centre; 0 for rays that are left out."""
    away = _distances(rays, middle)
    return np.asarray(np.where(away <= limit, rays[:, 0] * away**2, 0.0))


def _far_limit(rays: Floats, middle: Floats, flux: float) -> float:
    """Return the distance from a ghost's centre beyond which rays carry at most FARTHEST of all light."""
    lit = rays[rays[:, 0] > 0.0]
    away = _distances(lit, middle)
    order = np.argsort(-away, kind="stable")
    carried = np.cumsum(lit[order, 0])
    kept = np.flatnonzero(carried > FARTHEST * (flux + carried[-1])) if len(carried) else carried
    return float(away[order[kept[0]]]) if len(kept) else float("inf")


def _extent(sums: Floats) -> float:
    """Return half the larger side of a bundle's bounds on the sensor."""
    return float(max(sums[5], 0.5 * (sums[7] - sums[6])))


def _peak(
    bundle: Bundle, data: Floats, blades: Floats, light: Incidence, centre: tuple[float, float], reach: float
) -> tuple[float, float]:
    """Draw the bundle near a point; return the brightest pixel's irradiance per unit light, and its side."""
    patch = max(2.0 * reach / PEAK_GRID, PEAK_PIXEL)
    side = min(PEAK_GRID, max(4, ceil(2.0 * reach / patch) + 2))
    plane = blank_plane(side, side)
    view = np.array([side / 2 - centre[0] / patch, side / 2 + centre[1] / patch, 1.0 / patch, 1.0 / patch])
    densities = node_densities(data, bundle.pupil, bundle.triangles)
    draw_bundle(
        data, bundle.pupil, bundle.triangles, densities, bundle.path.stop_crossings, blades, None, light.axes,
        view, light.cosine, np.array([1.0, 0.0, 0.0]), plane, bundle.halves,
    )  # fmt: skip
    return float(to_pixels(plane, side)[:, :, 0].max()) / patch**2, patch


def bounding_edges(lens: Lens, order: FirstOrder, paths: Sequence[LightPath], nearness: float = 0.0) -> list[str]:
    """Return the limiting aperture of each path's ghost as in `ghost_table`, without tracing.

    Parameters
    ----------
    lens : Lens
        Complete.
    order : FirstOrder
        At the opening and focus to be used.
    paths : sequence of LightPath
    nearness : float
        Slope per height of the light's rays on the plane of the first vertex, 1/mm; 0: a distant light.

    Returns
    -------
    list of {"stop", "entrance"}
    """
    packed = pack_lens(lens, order, (None,) * len(lens.rows), np.array([D_LINE_NM]))
    return [_paraxial_facts(lens, packed, path, nearness)[0] for path in paths]


def _paraxial_facts(lens: Lens, packed: PackedLens, path: LightPath, nearness: float = 0.0) -> tuple[str, float | None]:
    """Return the limiting aperture of a ghost, and its focus (docs/physics.md, "Ray transfer matrices").

    `nearness` is the slope per height of the rays on the plane of the first vertex.
    """
    to_stop, total = path_matrices(lens, path, float(packed.wavelengths_nm[0]), packed.sensor_z)
    entrance = packed.semi[packed.first_surface]
    stop_height = min((packed.stop_semi / max(abs(Ma[0, 0] + nearness * Ma[0, 1]), 1e-12)) for Ma in to_stop)
    bounded_by = "stop" if stop_height < entrance else "entrance"
    height, slope = total[:, 0] + nearness * total[:, 1]
    if abs(slope) < 1e-12:
        return bounded_by, None
    return bounded_by, float(-height / slope)
