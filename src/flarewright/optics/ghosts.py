"""The ghost analysis: what every two-reflection path carries, where it lands, how large and how bright it is."""

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
from .bundle import Bundle, Incidence, find_region, incidence, trace_bundle, trace_grid, trace_points
from .iris import blade_edges
from .pack import PackedLens, SensorMirror, facing, pack_lens, resolve_coatings
from .paraxial import D_LINE_NM, FirstOrder, first_order, path_matrices
from .paths import LightPath, direct_path, ghost_paths

Floats = NDArray[np.float64]

# pixels per rms radius for tracing, and the side of the grid on which a peak is looked for
RESOLUTION = 100.0
PEAK_GRID = 256
# rays spent on the torn edge of a bundle
MOST_FRAYED = 300_000
# part of a ghost's flux whose place is not asked for
FARTHEST = 1e-5


@dataclass(frozen=True)
class GhostRow:
    """One path of the analysis; positions in the upright picture.

    Attributes
    ----------
    first_reflection, second_reflection : int or None
        Rows j, then i < j; None for the direct image. The sensor as the first mirror is "sensor".
    throughput_mm2 : float
        Flux on the unbounded sensor plane when the light gives irradiance 1 on a plane facing it.
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
    """

    first_reflection: int | Literal["sensor"] | None
    second_reflection: int | None
    throughput_mm2: float
    centroid_mm: tuple[float, float]
    rms_radius_mm: float
    peak_irradiance: float
    peak_patch_mm: float
    bounded_by: str
    focus_distance_mm: float | None


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
        Every path, brightest (by throughput) first; paths that pass no light have throughput 0.
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
    threads: int | None = None,
) -> GhostTable:
    """Analyse every ghost of a lens for one distant light.

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
    light = incidence(field_deg)
    packed = facing(packed, light.axes)
    todo = (direct_path(lens), *ghost_paths(lens, paths, sensor=sensor is not None))
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
    bounded_by, focus = _paraxial_facts(lens, packed, path)
    blades = blade_edges(Iris(), packed.stop_semi)
    region = find_region(packed, path, light.tilt, packed.stop_semi)
    j: int | Literal["sensor"] | None = "sensor" if path.sensor else path.first_reflection
    i = path.second_reflection
    nothing = GhostRow(j, i, 0.0, (0.0, 0.0), 0.0, 0.0, 0.0, bounded_by, focus)
    if region is None:
        return nothing
    scale = 1e-6
    # first only the rim, to learn the size; then fine enough for that size
    for _ in range(2):
        bundle = trace_grid(
            packed, path, light.tilt, (packed.stop_semi, packed.stop_semi), region, tolerance=0.25, scale=scale
        )
        data = trace_bundle(packed, 0, bundle, light.tilt)
        sums = measure_bundle(
            data, bundle.pupil, bundle.triangles, path.stop_crossings, blades, light.axes, bundle.halves
        )
        sums[:4] += _frayed(packed, bundle, data, light, float(sums[0]))
        if sums[0] <= 0.0:
            return nothing
        x, y = sums[1] / sums[0], sums[2] / sums[0]
        rms = sqrt(max(sums[3] / sums[0] - x * x - y * y, 0.0))
        scale = RESOLUTION / max(rms, 1e-4)
    # the whole ghost if it is compact, else the part around its centroid
    middle, reach = -0.5 * (sums[6] + sums[7]) * light.axes[1], _extent(sums)
    if reach > 4.0 * rms:
        middle, reach = np.array([x, y]), 4.0 * rms
    peak, patch = _peak(bundle, data, blades, light, (float(middle[0]), float(middle[1])), reach)
    flux = float(sums[0] * light.cosine)
    return GhostRow(j, i, flux, (float(x), float(y)), rms, peak, patch, bounded_by, focus)


def _frayed(packed: PackedLens, bundle: Bundle, data: Floats, light: Incidence, flux: float) -> Floats:
    """Integrate over the triangles in which some rays end, ray by ray: weight times 1, x, y, x^2 + y^2.

    They carry little light, but where rays leave the last surface at a grazing angle it lands so far out that it
    decides the ghost's size.
    """
    alive = data[bundle.triangles, ALIVE]
    torn = bundle.triangles[(alive.min(axis=1) == 0.0) & (alive.max(axis=1) > 0.0)]
    if len(torn) == 0:
        return np.zeros(4)
    n = int(np.clip(sqrt(MOST_FRAYED / len(torn)), 2, 16))
    # the centres of the n^2 parts of each triangle, in barycentric coordinates
    a, b = (grid.ravel() for grid in np.meshgrid(np.arange(n), np.arange(n)))
    up, down = a + b < n, a + b < n - 1
    s = np.concatenate([a[up] + 1.0 / 3.0, a[down] + 2.0 / 3.0]) / n
    t = np.concatenate([b[up] + 1.0 / 3.0, b[down] + 2.0 / 3.0]) / n
    p0, p1, p2 = (bundle.pupil[torn[:, m], None, :] for m in range(3))
    points = p0 + s[:, None] * (p1 - p0) + t[:, None] * (p2 - p0)
    e1, e2 = p1[:, 0] - p0[:, 0], p2[:, 0] - p0[:, 0]
    area = 0.5 * np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]) / len(s)
    rays = trace_points(packed, 0, bundle.path, light.tilt, points.reshape(-1, 2))
    passes = (rays[:, ALIVE] > 0.0) & (rays[:, REL] <= 1.0)
    for crossing in range(bundle.path.stop_crossings):
        at = STOP_X + 2 * crossing
        passes &= np.hypot(rays[:, at], rays[:, at + 1]) <= packed.stop_semi
    # both halves of the pupil: across the meridional plane they cancel
    weight = np.where(passes, bundle.halves * rays[:, WEIGHT], 0.0) * np.repeat(area, len(s))
    x, y = np.where(passes, rays[:, X], 0.0), np.where(passes, rays[:, Y], 0.0)
    # the second moment need not exist: the farthest rays are left out, as long as they carry next to nothing
    far = np.argsort(-np.hypot(x, y), kind="stable")
    weight[far[np.cumsum(weight[far]) <= FARTHEST * (flux + weight.sum())]] = 0.0
    along, across = float((weight * y).sum()), 0.0 if bundle.halves == 2 else float((weight * x).sum())
    moment = float((weight * (x * x + y * y)).sum())
    upright = -(across * light.axes[0] + along * light.axes[1])
    return np.array([weight.sum(), upright[0], upright[1], moment])


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
        data, bundle.pupil, bundle.triangles, densities, bundle.path.stop_crossings, blades, None, 1.0, light.axes,
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


def _paraxial_facts(lens: Lens, packed: PackedLens, path: LightPath) -> tuple[str, float | None]:
    """Tell which edge bounds a ghost, and where the path focuses (docs/physics.md, "Ray transfer matrices")."""
    to_stop, total = path_matrices(lens, path, float(packed.wavelengths_nm[0]), packed.sensor_z)
    entrance = packed.semi[packed.first_surface]
    stop_height = min((packed.stop_semi / max(abs(Ma[0, 0]), 1e-12)) for Ma in to_stop)
    bounded_by = "stop" if stop_height < entrance else "entrance"
    if abs(total[1, 0]) < 1e-12:
        return bounded_by, None
    return bounded_by, float(-total[0, 0] / total[1, 0])
