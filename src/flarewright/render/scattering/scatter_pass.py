"""The scatter pass: light scattered once by each surface, straight on to the sensor, as a smooth layer."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from math import ceil, log, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...kernels.raster.iris_mask import StopArrays
from ...kernels.raster.plane_memory import black_picture
from ...kernels.scattering.single_scatter import (
    FLUX,
    DirectBeam,
    ScatterRows,
    ScatterTarget,
    gather_scatter,
    spread_polar,
)
from ...model import Layer, Lens
from ...model.lens.scatter import Scatter
from ...optics.lens.paths import direct_path
from ...optics.lens.plane_plates import FILTER_ROWS
from ...optics.rays.pack import PackedLens, pack_lens
from ...optics.scattering.brdf import ScatterTables, scatter_tables
from ...optics.scattering.internal_beams import Beams, trace_beams
from ...typing import Floats, Pixels, Progress
from ..scene.direct_image import DirectImage
from ..scene.path_color import direct_spectrum
from ..scene.resolve import ResolvedProject
from ..scene.shot import Shot

# largest number of wavelengths at which light is gathered, because it varies slowly with wavelength
MOST_WAVELENGTHS = 3
# radius of the first circle at most, pixels and mm: light within large pixels falls as steeply as over small ones
FIRST_RING, FIRST_RING_MM = 0.25, 0.007
# share of scattered light from which a remark reports that ghosts are drawn without that loss
REPORTED_SHARE = 2e-3
# wavelength with the most scatter
SHORTEST_NM = 400.0


class Sampling(NamedTuple):
    """Where scattered light is gathered.

    Attributes
    ----------
    rays : int
        `rays` squared from each point of the sensor, over the aperture of a surface or over the iris.
    rings : int
        Circles of points around the direct image, from a quarter of a pixel on.
    spokes, fan : int
        Points of a circle: all around, and over a picture beside the direct image.
    """

    rays: int
    rings: int
    spokes: int
    fan: int


FINE = Sampling(16, 52, 24, 18)
# a quarter of the time (docs/scatter.md)
COARSE = Sampling(8, 36, 16, 12)


def chosen_scatter(settled: ResolvedProject) -> Scatter | None:
    """Return the scatter settings of the project, or else of the lens file; None if nothing scatters."""
    wanted = settled.project.scatter
    chosen = settled.lens.scatter if wanted is None else wanted
    if chosen is None or chosen.model == "none":
        return None
    if wanted is None and settled.project.filter is not None and chosen.rows:
        # the lens file numbers its rows without those of the filter
        moved = tuple(exception.replace(row=exception.row + FILTER_ROWS) for exception in chosen.rows)
        return chosen.replace(rows=moved)
    return chosen


def scatter_of(settled: ResolvedProject, shots: Sequence[Shot]) -> tuple[ScatterTables, ...] | None:
    """Tabulate the scatter of all surfaces, for every light.

    Returns
    -------
    tuple of ScatterTables or None
        At the shots' packed wavelengths; None if nothing scatters.

    Raises
    ------
    ProjectError
        As in `optics.scattering.brdf.scatter_tables`.
    """
    scatter = chosen_scatter(settled)
    if scatter is None:
        return None
    made: dict[tuple[float, ...], ScatterTables] = {}
    for shot in shots:
        key = tuple(shot.packed.wavelengths_nm)
        if key not in made:
            made[key] = scatter_tables(settled.lens, shot.packed, scatter)
    return tuple(made[tuple(shot.packed.wavelengths_nm)] for shot in shots)


def check_scatter(settled: ResolvedProject) -> None:
    """Check the scatter settings without drawing.

    Raises
    ------
    ProjectError
        As in `optics.scattering.brdf.scatter_tables`.
    """
    scatter = chosen_scatter(settled)
    if scatter is not None:
        bare = (None,) * len(settled.lens.rows)
        scatter_tables(settled.lens, pack_lens(settled.lens, settled.order, bare, np.array([SHORTEST_NM])), scatter)


def without_scattered(images: Sequence[DirectImage], tables: Sequence[ScatterTables]) -> list[DirectImage]:
    """Subtract scattered light from direct images.

    Parameters
    ----------
    images, tables : sequence
        One per light.
    """
    return [
        replace(
            image,
            throughput_mm2=image.throughput_mm2 * table.kept,
            transmittance=image.transmittance * float(table.kept[(len(table.kept) - 1) // 2]),
        )
        for image, table in zip(images, tables, strict=True)
    ]


def scatter_facts(settled: ResolvedProject, tables: Sequence[ScatterTables]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return facts about scatter for the summary, and remarks."""
    scatter = chosen_scatter(settled)
    assert scatter is not None, "there are tables only where something scatters"
    lost = 1.0 - float(min(table.kept.min() for table in tables))
    middle = (len(tables[0].kept) - 1) // 2
    facts = {
        "model": scatter.model,
        "share_by_row": [float(share) for share in tables[0].shares[middle]],
        "direct_kept": float(tables[0].kept[middle]),
    }
    remark = f"surfaces scatter up to {lost:.2%} of the direct light; ghosts are drawn as if they lost nothing by it"
    final = settled.project.quality.mode != "reference"
    return facts, (remark,) if final and lost > REPORTED_SHARE else ()


def render_scatter(
    settled: ResolvedProject,
    shots: Sequence[Shot],
    images: Sequence[DirectImage],
    tables: Sequence[ScatterTables],
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Layer:
    """Draw the light that surfaces scatter, for every light.

    Parameters
    ----------
    settled : ResolvedProject
    shots, images, tables : sequence
        One per light.
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called after each light with the finished part (0 to 1) and the name of the step.

    Returns
    -------
    Layer
        Named "scatter".

    Notes
    -----
    Each surface scatters the direct beam once, towards the sensor through the surfaces behind it. Light that is
    reflected before or after, or scattered twice or from a reflection, is ignored.
    """
    width, height = shots[0].size_px
    total = black_picture(width, height)
    sampling = COARSE if settled.project.quality.mode == "draft" else FINE
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for done, (shot, image, table) in enumerate(zip(shots, images, tables, strict=True)):
            if progress is not None:
                progress(done / len(shots), "scattered light")
            total += _one_light(settled.lens, shot, image, table, sampling, pool)
    return Layer("scatter", total, (0, 0, width, height))


def _one_light(
    lens: Lens, shot: Shot, image: DirectImage, tables: ScatterTables, sampling: Sampling, pool: ThreadPoolExecutor
) -> Pixels:
    """Gather light at nodes on circles around the direct image, and interpolate it to the picture."""
    centre = np.array(image.position_mm)
    radii, angles, round_about = _nodes(shot, centre, sampling)
    first = log(radii[0]), (len(radii) - 1) / log(radii[-1] / radii[0])
    place = centre + radii[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # the upright picture is the lens' frame, rotated by half a turn
    axes = shot.incidence.axes
    points = np.ascontiguousarray(-place.reshape(-1, 2) @ axes.T)
    count = len(shot.packed.wavelengths_nm)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_WAVELENGTHS)).round().astype(int))
    found = gather(lens, shot, tables, [int(w) for w in chosen], points, pool, rays=sampling.rays)
    light = _at_all(shot.packed.wavelengths_nm, chosen, found).reshape(count, *place.shape[:2])
    rgb = shot.weights(shot.packed.wavelengths_nm, direct_spectrum(shot, lens))
    level = light.mean(axis=0)
    brightest = float(level.max())
    if brightest <= 0.0:
        return black_picture(*shot.size_px)
    level = np.maximum(level, 1e-12 * brightest)
    colour = np.einsum("wab,wc->abc", light, rgb) / level[..., None] * shot.gain
    pixels = black_picture(*shot.size_px)
    step = len(angles) / (2.0 * pi) if round_about else (len(angles) - 1) / float(angles[-1] - angles[0])
    spread_polar(centre, round_about, first, (float(angles[0]), step), np.log(level), colour, shot.to_pixels, pixels)
    return pixels


def _at_all(wavelengths_nm: Floats, chosen: NDArray[np.intp], light: Floats) -> Floats:
    """Interpolate logarithms by a parabola: light follows a power of wavelength with a slowly varying exponent."""
    if len(chosen) == len(wavelengths_nm):
        return light
    t = np.log(wavelengths_nm)
    weights = np.array([[np.prod([(at - t[m]) / (t[k] - t[m]) for m in chosen if m != k]) for k in chosen] for at in t])
    lit = (light > 0.0).all(axis=0)
    return np.where(lit, np.exp(weights @ np.log(np.where(lit, light, 1.0))), 0.0)


def _nodes(shot: Shot, centre: Floats, sampling: Sampling) -> tuple[Floats, Floats, bool]:
    """Choose radii and angles of nodes around the direct image so that they cover the picture."""
    width, height = shot.size_px
    corners = np.array([[x, y] for x in (0.0, width) for y in (0.0, height)])
    seen = (corners - shot.to_pixels[:2]) / shot.to_pixels[2:] * np.array([1.0, -1.0]) - centre
    far = float(np.hypot(seen[:, 0], seen[:, 1]).max()) * 1.001
    low, high = seen.min(axis=0), seen.max(axis=0)
    pixel = 1.0 / float(shot.to_pixels[2:].max())
    if (low < 0.0).all() and (high > 0.0).all():
        return (
            _radii(0.0, far, pixel, sampling.rings),
            2.0 * pi * np.arange(sampling.spokes) / sampling.spokes,
            True,
        )
    near = float(np.hypot(*np.clip(0.0, low, high)))
    towards = np.arctan2(*(0.5 * (low + high))[::-1])
    turned = np.angle(np.exp(1j * (np.arctan2(seen[:, 1], seen[:, 0]) - towards)))
    angles = towards + np.linspace(turned.min() - 1e-3, turned.max() + 1e-3, sampling.fan)
    return _radii(0.999 * near, far, pixel, sampling.rings), angles, False


def _radii(near: float, far: float, pixel: float, rings: int) -> Floats:
    """Return the radii of circles between two distances, mm: `rings` of them, and more within large pixels."""
    usual = max(near, FIRST_RING * pixel)
    first = min(usual, max(near, FIRST_RING_MM))
    return np.geomspace(first, far, ceil(rings * log(far / first) / log(far / usual)))


def gather(
    lens: Lens, shot: Shot, tables: ScatterTables, wavelengths: list[int], points: Floats, pool: ThreadPoolExecutor,
    *, rays: int = FINE.rays,
) -> Floats:  # fmt: skip
    """Gather the scattered light of a shot at points of the sensor.

    Parameters
    ----------
    lens : Lens
    shot : Shot
    tables : ScatterTables
        At the shot's packed wavelengths.
    wavelengths : list of int
        Indices of the wavelengths to gather.
    points : ndarray, shape (P, 2)
        In the light's meridional frame, mm.
    pool : ThreadPoolExecutor
    rays : int
        `rays` squared from each point, for all surfaces in front of the stop together and for each surface behind it.

    Returns
    -------
    ndarray, shape (len(wavelengths), P)
        Irradiance per irradiance on the plane of the first vertex.
    """
    beams = list(pool.map(lambda w: _beams(lens, shot, tables, w), wavelengths))
    groups = _groups(lens, tables)
    # split points into parts of fixed size, so that all threads have work and sums do not depend on their number
    parts = np.array_split(np.arange(len(points)), max(1, ceil(len(points) / 256)))
    work = [(m, w, group, part) for m, w in enumerate(wavelengths) for group in groups for part in parts]

    def one(task: tuple[int, int, tuple[int, int, int], NDArray[np.intp]]) -> Floats:
        m, w, group, part = task
        return _gather_group(lens, shot, tables, w, beams[m], group, np.ascontiguousarray(points[part]), rays)

    light = np.zeros((len(wavelengths), len(points)))
    for (m, _, _, part), found in zip(work, pool.map(one, work), strict=True):
        light[m, part] += found
    return light


def _groups(lens: Lens, tables: ScatterTables) -> list[tuple[int, int, int]]:
    """Group rows that share rays: target row of the rays, first and last scattering row."""
    rows = [int(k) for k in np.flatnonzero(tables.shares.any(axis=0))]
    stop = lens.stop_row
    front = [k for k in rows if k < stop]
    return ([(stop, front[0], front[-1])] if front else []) + [(k, k, k) for k in rows if k > stop]


def _beams(lens: Lens, shot: Shot, tables: ScatterTables, w: int) -> Beams:
    rows = [int(k) for k in np.flatnonzero(tables.shares.any(axis=0))]
    radius = shot.opening.radius
    return trace_beams(shot.packed, w, direct_path(lens), shot.incidence.tilt, lens.stop_row, radius, rows)


def _gather_group(
    lens: Lens,
    shot: Shot,
    tables: ScatterTables,
    w: int,
    beams: Beams,
    group: tuple[int, int, int],
    points: Floats,
    rays: int,
) -> Floats:
    packed, opening = shot.packed, shot.opening
    target, first, last = group
    # surfaces in front reduce the light that arrives
    left = np.concatenate([[1.0], np.cumprod(1.0 - tables.shares[w])[:-1]])
    # a reflecting sensor adds a row, which scattered light does not cross
    own = len(lens.rows)
    nodes = beams.nodes[:own].copy()
    nodes[..., FLUX] *= left[:, None, None]
    out = np.zeros(len(points))
    gather_scatter(
        packed.arrays(packed.n_gap[w], packed.reflectance[w]), ScatterRows(target, first, last, own - 1),
        DirectBeam(tables.tables[w], tables.amounts[w], nodes, beams.boxes[:own]),
        ScatterTarget(_start(packed, w, target), beams.domains[target], rays),
        StopArrays(lens.stop_row, opening.blades, opening.mask, opening.half), shot.incidence.axes, points, out,
    )  # fmt: skip
    return out


def _start(packed: PackedLens, w: int, target: int) -> tuple[float, float]:
    """Return a ray's slope at the sensor per its position there and per its position on a row, from matrices."""
    total = np.eye(2)
    n = packed.n_gap[w]
    for k in range(target, len(packed.curvature)):
        bend = np.array([[1.0, 0.0], [(n[k] - n[k + 1]) * packed.curvature[k] / n[k + 1], n[k] / n[k + 1]]])
        following = packed.z_vertex[k + 1] if k + 1 < len(packed.curvature) else packed.sensor_z
        total = np.array([[1.0, following - packed.z_vertex[k]], [0.0, 1.0]]) @ bend @ total
    back = np.linalg.inv(total)
    reach = back[0, 1] if abs(back[0, 1]) > 1e-9 else 1e-9
    return float(-back[0, 0] / reach), float(1.0 / reach)
