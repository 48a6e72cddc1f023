"""The ghost analysis: what every path carries, where it lands, how large and how bright it is."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import draw_bundle, measure_bundle, node_densities
from ..kernels.raster import blank_plane, to_pixels
from ..kernels.trace import ALIVE, REL, STOP_X, WEIGHT, X, Y
from ..model import AsLens, CoatingChoice, Iris, Lens
from .bundle import Bundle, Incidence, incidence, trace_bundle, trace_grid, trace_points
from .iris import blade_edges
from .pack import PackedLens, SensorMirror, facing, pack_lens, resolve_coatings
from .paraxial import D_LINE_NM, FirstOrder, first_order, path_matrices
from .paths import LightPath, direct_path, ghost_paths
from .region import Region, find_region

Floats = NDArray[np.float64]
Mirror = int | Literal["sensor"]

# pixels per rms radius for tracing, and the side of the grid on which a peak is looked for
RESOLUTION = 100.0
PEAK_GRID = 256
# largest part of a ghost's flux, first and second moment that interpolation may get wrong
MOMENT_ERROR = 2e-3
# triangles integrated ray by ray: rays at most, how often they are halved, and the change that asks for more
MOST_RAYS = 300_000
LEAST_HALVINGS, MOST_HALVINGS = 2, 10
RAY_SHARE = 1e-5
# part of a ghost's flux whose place is not asked for
FARTHEST = 1e-5


@dataclass(frozen=True)
class GhostRow:
    """One path of the analysis; positions in the upright picture.

    Attributes
    ----------
    first_reflection, second_reflection : int or None
        Rows j, then i < j; None for the direct image. The sensor as a mirror is "sensor".
    throughput_mm2 : float
        Flux on the unbounded sensor plane when the light gives irradiance 1 on a plane facing it; a near light gives it
        at the middle of the entrance pupil.
    centroid_mm : tuple of float
    rms_radius_mm : float
        Root mean square distance from the centroid, weighted by flux. It has no limit where a path's light leaves the
        last surface at grazing angles without losing all its flux: such rays land arbitrarily far out on the plane. The
        farthest 1e-5 of the flux at such an edge is left out.
    peak_irradiance : float
        Largest irradiance, averaged over a square of side `peak_patch_mm`, per flux of the direct image, 1/mm^2; 0 when
        the direct image is dark.
    peak_patch_mm : float
    bounded_by : {"stop", "entrance"}
        Which edge shapes the ghost on the axis: the smaller of the two as projected to the entrance by matrices
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
        """Name of the path, as that of its layer in a render."""
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
        Every two-reflection path and the others asked for, brightest (by throughput) first; paths that pass no light
        have throughput 0.
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


def ghost_table(
    lens: Lens,
    field_deg: tuple[float, float],
    *,
    f_number: float | None = None,
    coating: CoatingChoice | None = None,
    wavelength_nm: float = D_LINE_NM,
    paths: str = "all",
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
    sensor: SensorMirror | None = None,
    others: Sequence[LightPath] = (),
    distance: float | None = None,
    threads: int | None = None,
) -> GhostTable:
    """Analyse every ghost of a lens for one light.

    Parameters
    ----------
    lens : Lens
        Complete (`render.prepare.load_lens`).
    field_deg : tuple of float
        (X, Y) of the light.
    f_number : float, optional
        None: wide open.
    coating : CoatingChoice, optional
        None: as the lens file says.
    wavelength_nm : float
    paths : {"all", "same-side"}
    sensor_distance, focus_distance : float, optional
        Override the lens file's, mm.
    sensor : SensorMirror, optional
        The sensor reflects too: adds the paths "sensor-i".
    others : sequence of LightPath
        Further paths to analyse, of four reflections.
    distance : float, optional
        How far in front of the first vertex the light stands, mm along the axis; None: distant.
    threads : int, optional
        None: all cores; the numbers do not depend on it.

    Returns
    -------
    GhostTable

    Notes
    -----
    Traced on the unbounded sensor plane. A ray counts when it passes every surface's semi-diameter and the round stop
    at each crossing; R and T are the means of s and p, multiplied along the path. Judged by a plain Monte Carlo tracer
    in `tests/physics`. The stop and the sensor are placed at the d line whatever the wavelength.
    """
    order = first_order(lens, f_number, sensor_distance=sensor_distance, focus_distance=focus_distance)
    coatings = resolve_coatings(lens, AsLens() if coating is None else coating)
    packed = pack_lens(lens, order, coatings, np.array([wavelength_nm]), sensor=sensor)
    light = incidence(field_deg, distance, order.entrance_pupil_z)
    packed = facing(packed, light.axes, light.nearness)
    todo = (direct_path(lens), *ghost_paths(lens, paths, sensor=sensor is not None), *others)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        measured = list(pool.map(lambda path: _measure(lens, packed, path, light), todo))
    direct = measured[0]
    # a peak is told relative to the direct image's flux, and not at all when that is dark
    unit = direct.throughput_mm2 if direct.throughput_mm2 > 0.0 else float("inf")
    rows = [_relative(row, unit) for row in measured]
    ghosts = sorted(rows[1:], key=lambda row: -row.throughput_mm2)
    return GhostTable(
        efl=order.efl,
        bfl=order.bfl,
        f_number=order.f_number,
        entrance_pupil_diameter=order.entrance_pupil_diameter,
        stop_semi_diameter=order.stop_semi_diameter,
        sensor_distance=order.sensor_distance,
        wavelength_nm=wavelength_nm,
        direct=rows[0],
        ghosts=tuple(ghosts),
    )


def _relative(row: GhostRow, unit: float) -> GhostRow:
    return GhostRow(**{**row.__dict__, "peak_irradiance": row.peak_irradiance / unit})


def _measure(lens: Lens, packed: PackedLens, path: LightPath, light: Incidence) -> GhostRow:
    bounded_by, focus = _paraxial_facts(lens, packed, path, packed.nearness / light.tilt_cosine)
    blades = blade_edges(Iris(), packed.stop_semi)
    region = find_region(packed, path, light.tilt, packed.stop_semi)
    mirrors: list[Mirror] = ["sensor" if row == len(lens.rows) else row for row in path.mirrors]
    j, i = (mirrors[0], path.second_reflection) if mirrors else (None, None)
    later = tuple(mirrors[2:])
    nothing = GhostRow(j, i, 0.0, (0.0, 0.0), 0.0, 0.0, 0.0, bounded_by, focus, later)
    if region is None:
        return nothing
    bundle = _grid(packed, path, light, region, 1e-6)
    # first only the rim, to learn the size; then fine enough for that size
    rms = _rough_size(_sample(packed, bundle, light, bundle.pupil[bundle.triangles]), bundle.halves)
    bundle = _grid(packed, path, light, region, RESOLUTION / max(rms, 1e-4))
    data = trace_bundle(packed, 0, bundle, light.tilt)
    sums = _integrate(packed, bundle, data, light, blades)
    if sums[0] <= 0.0:
        return nothing
    x, y = sums[1] / sums[0], sums[2] / sums[0]
    rms = sqrt(max(sums[3] / sums[0] - x * x - y * y, 0.0))
    # the whole ghost if it is compact, else the part around its centroid
    middle, reach = -0.5 * (sums[6] + sums[7]) * light.axes[1], _extent(sums)
    if reach > 4.0 * rms:
        middle, reach = np.array([x, y]), 4.0 * rms
    peak, patch = _peak(bundle, data, blades, light, (float(middle[0]), float(middle[1])), reach)
    flux = float(sums[0] * light.cosine)
    return GhostRow(j, i, flux, (float(x), float(y)), rms, peak, patch, bounded_by, focus, later)


def _grid(packed: PackedLens, path: LightPath, light: Incidence, region: Region, scale: float) -> Bundle:
    """Build the grid of a path for so many pixels a mm, behind the round stop."""
    stop = (packed.stop_semi, packed.stop_semi)
    return trace_grid(packed, path, light.tilt, stop, region, tolerance=0.25, scale=scale)


def _rough_size(rays: Floats, halves: int) -> float:
    """Root mean square radius by a few rays (`_passing`), the farthest left out; 0 when none passes."""
    flux = float(rays[:, 0].sum())
    if flux <= 0.0:
        return 0.0
    middle = _middle(rays, halves)
    return sqrt(float(_second(rays, middle, _far(rays, middle, 0.0)).sum()) / flux)


def _integrate(packed: PackedLens, bundle: Bundle, data: Floats, light: Incidence, blades: Floats) -> Floats:
    """Integrate a bundle like `measure_bundle`, but ray by ray where a triangle's rays are no plane's.

    Near the edge where rays leave the last surface at a grazing angle, positions on the unbounded plane go like the
    inverse of the direction's z: between such rays, and beside rays that end, nothing can be interpolated. Those
    triangles carry little light, but they may decide the ghost's size.
    """
    crossings = bundle.path.stop_crossings
    rest = (crossings, blades, light.axes, bundle.halves)
    sums: Floats = measure_bundle(data, bundle.pupil, bundle.triangles, *rest)
    torn, bent = _torn(bundle, data), _bent(packed, bundle, data, light)
    if bent.any():
        sums[:4] = measure_bundle(data, bundle.pupil, bundle.triangles[~bent], *rest)[:4]
    if torn.any() or bent.any():
        sums[:4] += _ray_by_ray(packed, bundle, bundle.triangles[torn | bent], light, sums)
    return sums


def _torn(bundle: Bundle, data: Floats) -> NDArray[np.bool_]:
    """Mark the triangles in which some rays end."""
    alive = data[bundle.triangles, ALIVE]
    return np.asarray((alive.min(axis=1) == 0.0) & (alive.max(axis=1) > 0.0))


def _bent(packed: PackedLens, bundle: Bundle, data: Floats, light: Incidence) -> NDArray[np.bool_]:
    """Mark the triangles whose rays would spoil the ghost's flux or size if they were interpolated.

    A ray through each centre tells by how much the triangle's part of the flux and its moments is wrong, and all these
    rays together, without the farthest, tell the moments roughly: no triangle excuses itself by a size that
    interpolation alone makes. The best are kept as long as their errors add up to less than MOMENT_ERROR.
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
    second = max(float(_second(passing, middle, _far(passing, middle, 0.0)).sum()), 1e-300)
    weight, x, y = ((data[a[seen], m] + data[b[seen], m] + data[c[seen], m]) / 3.0 for m in (WEIGHT, X, Y))
    wrong = np.abs(_squares(rays[:, X], rays[:, Y], middle) - _squares(x, y, middle)) / second
    # across the meridional plane two halves cancel
    off = np.abs(rays[:, Y] - y) if bundle.halves == 2 else np.hypot(rays[:, X] - x, rays[:, Y] - y)
    wrong += off / sqrt(second * total)
    # R and T may change fast beside a critical angle
    wrong = wrong * weight + np.abs(rays[:, WEIGHT] - weight) / total
    wrong *= bundle.halves * _areas(places)
    wrong[rays[:, ALIVE] == 0.0] = np.inf
    # most often all are good enough
    if float(wrong.sum()) > MOMENT_ERROR:
        order = np.argsort(wrong, kind="stable")
        bent[seen[order[np.cumsum(wrong[order]) > MOMENT_ERROR]]] = True
    return bent


def _centres(places: Floats) -> Floats:
    """Centres of triangles, (N, 3, 2) -> (N, 2)."""
    return np.asarray((places[:, 0] + places[:, 1] + places[:, 2]) / 3.0)


def _areas(places: Floats) -> Floats:
    """Areas of triangles in the pupil, (N, 3, 2) -> (N,)."""
    e1, e2 = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    return np.asarray(0.5 * np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]))


def _quarters(places: Floats) -> Floats:
    """Cut triangles at the middles of their edges, (N, 3, 2) -> (4 N, 3, 2); the four parts stand side by side."""
    a, b, c = places[:, 0], places[:, 1], places[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab))]
    return np.stack(parts, axis=1).reshape(-1, 3, 2)


def _sample(packed: PackedLens, bundle: Bundle, light: Incidence, places: Floats) -> Floats:
    """Send a ray through the centre of each triangle of the pupil; as `_passing`."""
    return _passing(packed, bundle, trace_points(packed, 0, bundle.path, light.tilt, _centres(places)), places)


def _passing(packed: PackedLens, bundle: Bundle, rays: Floats, places: Floats) -> Floats:
    """Let rays stand for their triangles: flux of all halves of the pupil, x, y; zeros where one is cut; (N, 3)."""
    passes = (rays[:, ALIVE] > 0.0) & (rays[:, REL] <= 1.0)
    for crossing in range(bundle.path.stop_crossings):
        at = STOP_X + 2 * crossing
        passes &= np.hypot(rays[:, at], rays[:, at + 1]) <= packed.stop_semi
    found = np.stack([bundle.halves * rays[:, WEIGHT] * _areas(places), rays[:, X], rays[:, Y]], axis=1)
    return np.where(passes[:, None], found, 0.0)


def _ray_by_ray(
    packed: PackedLens, bundle: Bundle, triangles: NDArray[np.int64], light: Incidence, sums: Floats
) -> Floats:
    """Integrate over triangles by rays through their parts: flux times 1, x, y, x^2 + y^2 (upright).

    Each is quartered until its four rays and their parent's agree about flux and second moment to RAY_SHARE of the
    whole, which is `sums` and what is found here, or MOST_RAYS are spent. The second moment need not exist: the
    farthest rays are left out, as long as they carry no more than FARTHEST of the ghost's light.
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
        limit = _far(rays, middle, flux)
        total = max(flux + float(rays[:, 0].sum()), 1e-300)
        moments = max(known + float(_second(rays, middle, limit).sum()), 1e-300)
        doubt = np.abs(found[:, 0].reshape(-1, 4).sum(axis=1) - samples[:, 0]) / total
        change = _second(found, middle, limit).reshape(-1, 4).sum(axis=1) - _second(samples, middle, limit)
        doubt = np.maximum(doubt, np.abs(change) / moments)
        unsettled = np.repeat((doubt > RAY_SHARE) | (level < LEAST_HALVINGS), 4)
        done.append(found[~unsettled])
        places, samples = places[unsettled], found[unsettled]
    rays = np.concatenate([*done, samples])
    weight, x, y = rays[_away(rays, middle) <= _far(rays, middle, flux)].T
    # both halves of the pupil: across the meridional plane they cancel
    along, across = float((weight * y).sum()), 0.0 if bundle.halves == 2 else float((weight * x).sum())
    moment = float((weight * (x * x + y * y)).sum())
    upright = -(across * light.axes[0] + along * light.axes[1])
    return np.array([weight.sum(), upright[0], upright[1], moment])


def _middle(rays: Floats, halves: int) -> Floats:
    """Return the centroid of rays in the meridional frame, (2,); on the mirror plane where two halves count."""
    x, y = rays[:, 0] @ rays[:, 1:] / rays[:, 0].sum()
    return np.array([0.0 if halves == 2 else x, y])


def _squares(x: Floats, y: Floats, middle: Floats) -> Floats:
    """Squared distance from a ghost's middle."""
    return np.asarray((x - middle[0]) ** 2 + (y - middle[1]) ** 2)


def _away(rays: Floats, middle: Floats) -> Floats:
    """Distance of rays from a ghost's middle."""
    return np.asarray(np.sqrt(_squares(rays[:, 1], rays[:, 2], middle)))


def _second(rays: Floats, middle: Floats, limit: float) -> Floats:
    """Flux times squared distance from a ghost's middle; 0 for rays that are left out."""
    away = _away(rays, middle)
    return np.asarray(np.where(away <= limit, rays[:, 0] * away**2, 0.0))


def _far(rays: Floats, middle: Floats, flux: float) -> float:
    """Return the distance from a ghost's middle beyond which rays carry FARTHEST of all light at most."""
    lit = rays[rays[:, 0] > 0.0]
    away = _away(lit, middle)
    order = np.argsort(-away, kind="stable")
    carried = np.cumsum(lit[order, 0])
    kept = np.flatnonzero(carried > FARTHEST * (flux + carried[-1])) if len(carried) else carried
    return float(away[order[kept[0]]]) if len(kept) else float("inf")


def _extent(sums: Floats) -> float:
    """Half the larger side of a bundle's bounds on the sensor."""
    return float(max(sums[5], 0.5 * (sums[7] - sums[6])))


def _peak(
    bundle: Bundle, data: Floats, blades: Floats, light: Incidence, centre: tuple[float, float], reach: float
) -> tuple[float, float]:
    """Draw the bundle around a place; return the brightest pixel's irradiance per unit light, and its side."""
    patch = max(2.0 * reach / PEAK_GRID, 0.01)
    side = min(PEAK_GRID, max(4, ceil(2.0 * reach / patch) + 2))
    plane = blank_plane(side, side)
    view = np.array([side / 2 - centre[0] / patch, side / 2 + centre[1] / patch, 1.0 / patch, 1.0 / patch])
    densities = node_densities(data, bundle.pupil, bundle.triangles)
    draw_bundle(
        data, bundle.pupil, bundle.triangles, densities, bundle.path.stop_crossings, blades, None, light.axes,
        view, light.cosine, np.array([1.0, 0.0, 0.0]), plane, bundle.halves,
    )  # fmt: skip
    return float(to_pixels(plane, side)[:, :, 0].max()) / patch**2, patch


def bounding_edges(lens: Lens, order: FirstOrder, paths: Sequence[LightPath]) -> list[str]:
    """Tell for paths which edge bounds their ghosts, as `ghost_table` does, without tracing.

    Parameters
    ----------
    lens : Lens
        Complete.
    order : FirstOrder
        At the opening and focus to be used.
    paths : sequence of LightPath

    Returns
    -------
    list of {"stop", "entrance"}
    """
    packed = pack_lens(lens, order, (None,) * len(lens.rows), np.array([D_LINE_NM]))
    return [_paraxial_facts(lens, packed, path)[0] for path in paths]


def _paraxial_facts(lens: Lens, packed: PackedLens, path: LightPath, nearness: float = 0.0) -> tuple[str, float | None]:
    """Tell which edge bounds a ghost, and where the path focuses (docs/physics.md, "Ray transfer matrices").

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
