"""The region of the pupil from which a path accepts light, found by a pre-pass (Hullin 2011, section 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, cos, sin, sqrt, tan
from typing import Any

import numpy as np

from ...kernels.tracing.gap_search import PROBES
from ...kernels.tracing.incident_light import IncidentLight
from ...kernels.tracing.intersect import AXES, ORIGIN, sag_of_shape
from ...kernels.tracing.lens_arrays import LensArrays
from ...kernels.tracing.path_steps import PathSteps
from ...kernels.tracing.pupil_prepass import FEW_CELLS, find_box
from ...kernels.tracing.sequential import STOP_X, trace_nodes
from ...typing import Floats
from ..lens.paths import LightPath, joined_path_steps
from .pack import PackedLens, wavelengths_fitted

# cells of the pre-pass over half the pupil: 64 across the whole
PREPASS = (32, 64)
# cells of scans of a part of it; the scan of the part that reaches the stop has ENTRY, because it must find a blob
FINER, ENTRY = (12, 24), (20, 40)
# the same for a quick pre-pass
PREPASS_QUICK, ENTRY_QUICK = (24, 48), (14, 28)
# cells of a part's scans at other wavelengths; only for regions of at least BLOB cells of the whole front or
# SMALL_REGION cells of the part, next to which no separate blob is expected
COARSE = (8, 16)
BLOB, SMALL_REGION = 16, 64
# where fewer samples of a scan pass, its cells are halved, at most HALVED times: too coarse cells bound the light badly
FEW_LIT, HALVED = 6, 2
# largest number of scans
MOST_SCANS = 8
# by this part of its size a region is widened on each side to hold that of a light beside
NEAR = 0.25
_UNTRACED = np.empty((0, STOP_X))

TracingArguments = tuple[PathSteps, LensArrays, IncidentLight]


def tracing_arguments(packed: PackedLens, w: int | list[int], path: LightPath, tilt: float) -> TracingArguments:
    """Return the arguments that all tracing kernels share."""
    if isinstance(w, list):
        waves, n_gap, reflectance = packed.fitted
        if w == waves:
            return _listed(packed, n_gap, reflectance, path, tilt)
    return _listed(packed, packed.n_gap[w], packed.reflectance[w], path, tilt)


def _listed(packed: PackedLens, n_gap: Floats, reflectance: Floats, path: LightPath, tilt: float) -> TracingArguments:
    lens = packed.arrays(n_gap, reflectance)
    return PathSteps(path.rows, path.actions), lens, IncidentLight(tilt, packed.nearness)


def _looking_arguments(packed: PackedLens, w: int, path: LightPath, tilt: float) -> TracingArguments:
    """Return the same for the pre-pass: rays at one wavelength, with reflectances typical of all wavelengths."""
    two = len(path.mirrors) <= 2
    typical = packed.typical_reflectance if two else packed.typical_reflectance_of_four
    return _listed(packed, packed.n_gap[w], typical, path, tilt)


def front_box(packed: PackedLens, tilt: float) -> Floats:
    """Return the part of the first vertex' plane through which light can reach the first surface: x0, x1, y0, y1.

    For a lens with rotational symmetry only the half x >= 0.
    """
    first = packed.first_surface
    if packed.shapes is not None:
        return _shaped_box(packed, tilt, first)
    if packed.nearness > 0.0:
        return _near_box(packed, tilt, first)
    semi, c = packed.semi[first], packed.curvature[first]
    sag = c * semi**2 / (1.0 + sqrt(max(1.0 - (1.0 + packed.conic[first]) * (c * semi) ** 2, 0.0)))
    # rays that meet a rim at z = sag cross z = 0 displaced by sag tan(tilt)
    low, high = -semi - max(0.0, sag * tan(tilt)), semi + max(0.0, -sag * tan(tilt))
    lead = abs(packed.z_vertex[first] * tan(tilt))
    return np.array([0.0, semi, low - lead, high + lead]) * (1.0 + 1e-9)


def _near_box(packed: PackedLens, tilt: float, first: int) -> Floats:
    """Bound the front of a rotationally symmetric lens for a near light: projected circles of the first surface."""
    semi, c = float(packed.semi[first]), float(packed.curvature[first])
    radius = semi * np.linspace(0.0, 1.0, 33)
    root = np.sqrt(np.maximum(1.0 - (1.0 + packed.conic[first]) * (c * radius) ** 2, 0.0))
    z = packed.z_vertex[first] + c * radius**2 / (1.0 + root)
    distance, height = cos(tilt) / packed.nearness, -sin(tilt) / packed.nearness
    # from the light, a circle perpendicular to the axis projects to a circle on every parallel plane
    part = distance / np.maximum(distance + z, 1e-3 * distance)
    centre, reach = height * (1.0 - part), radius * part
    # between two circles the bound bulges a little
    slack = 1e-3 * semi
    return np.array([0.0, reach.max() + slack, (centre - reach).min() - slack, (centre + reach).max() + slack])


def _shaped_box(packed: PackedLens, tilt: float, first: int) -> Floats:
    """Bound the front of a lens whose first surface can have any shape and pose: by its rim and heights on it."""
    semi, shape = float(packed.semi[first]), packed.form[first]
    rim = _rim(packed.form.tobytes(), packed.form.shape[1], first, semi)
    rim = rim @ shape[AXES : AXES + 9].reshape(3, 3) + shape[ORIGIN : ORIGIN + 3]
    # the rim's chords cut its arcs short, and the surface may bulge beyond its rim's height
    slack = 0.01 * semi + float(np.ptp(np.append(rim[:, 2], shape[ORIGIN + 2])) * abs(tan(tilt)))
    z = packed.z_vertex[first] + rim[:, 2]
    at, across = rim[:, 1] - z * tan(tilt), rim[:, 0]
    if packed.nearness > 0.0:
        distance, lift = cos(tilt) / packed.nearness, -sin(tilt) / packed.nearness
        part = distance / np.maximum(distance + z, 1e-3 * distance)
        at, across = lift + (rim[:, 1] - lift) * part, rim[:, 0] * part
    left = 0.0 if packed.symmetric else float(across.min()) - slack
    return np.array([left, float(across.max()) + slack, float(at.min()) - slack, float(at.max()) + slack])


# every path asks, of the few directions that parts of a light have
@lru_cache(maxsize=32)
def _rim(form: bytes, columns: int, first: int, semi: float) -> Floats:
    """Return places along a surface's rim in its own frame, shape (N, 3), from the bytes of `PackedLens.form`."""
    # a copy, for a kernel is compiled once more for what may not be written
    shapes = np.frombuffer(form).reshape(-1, columns).copy()
    angle = np.linspace(0.0, 2.0 * np.pi, 65)
    x, y = semi * np.cos(angle), semi * np.sin(angle)
    return np.array([(u, v, sag_of_shape(shapes, first, u, v)[0]) for u, v in zip(x, y, strict=True)])


def cells_across(packed: PackedLens, cells: tuple[int, int]) -> tuple[int, int]:
    """Return the cells across and along the traced part of the pupil for `cells` of half the pupil."""
    return (cells[0] * (3 - packed.halves), cells[1])


@dataclass(frozen=True)
class Region:
    """Result of the pre-pass for a path, per unit irradiance.

    Attributes
    ----------
    box : ndarray, shape (4,)
        x0, x1, y0, y1 of the accepted pupil in the meridional frame, mm.
    flux : float
        Estimated flux, mm^2.
    seen_flux : float
        The part of it that can land in the picture; 0 when none does.
    brightness : float
        Irradiance on the sensor, weighted by flux.
    share : float
        Fraction of the box that passes light.
    slivers : bool
        Whether light was found between the samples, next to rays that fail.
    """

    box: Floats
    flux: float
    seen_flux: float
    brightness: float
    share: float
    slivers: bool = False


def find_region(
    packed: PackedLens,
    path: LightPath,
    tilt: float,
    iris_radius: float,
    view_radius: float = float("inf"),
    within: Floats | None = None,
    quick: bool = False,
    traced: Floats | None = None,
    one_color: bool = False,
    beside: Region | None = None,
) -> Region | None:
    """Find the part of the pupil that a path accepts (Hullin 2011, section 4.2, "Ray Bounding").

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    tilt : float
    iris_radius : float
        Radius of a circle around the iris, mm.
    view_radius : float
        Radius around the axis that the picture covers, mm.
    within : ndarray, shape (4,), optional
        A box that contains the region; None: the whole front.
    quick : bool
        Scan only the middle wavelength, with half as many samples, and widen the result for the others; refine only
        small regions, and do not search for a second one.
    traced : ndarray, optional
        The path's part of `first_look`, with the same light, `within` and `quick`.
    one_color : bool
        Only what passes at the middle wavelength is wanted.
    beside : Region, optional
        What the path accepts of a light beside this one: looked around first, further where light comes to its border.

    Returns
    -------
    Region or None
        None when no light passes.
    """
    limits = (path.stop_crossings, iris_radius, view_radius)
    middle, *others = [
        (*_looking_arguments(packed, w, path, tilt), *limits)
        for w in wavelengths_fitted(packed)[: 1 if quick or one_color else None]
    ]
    front = front_box(packed, tilt)
    finest = _finest(packed, front)
    around = None if beside is None else widened_box(beside.box, front, NEAR)
    # of a light far beside this one, the region can lie outside the front
    if beside is not None and around is not None and _area(around) > 0.0:
        found, sums, _ = _scan(packed, middle, around, cells_across(packed, FINER), finest, None, 1)
        if sums[4] >= SMALL_REGION and not _may_go_beyond(found, around, front):
            return _region(found, sums, beside.slivers)
    first, cells = _looked_at(packed, front, within, quick)
    box = first
    whole, few_cells = True, 1 if quick else FEW_CELLS
    held, slivers = np.array([np.inf, -np.inf, np.inf, -np.inf]), False
    halved, small = 0, False
    # what the finer scans have covered
    searched = np.array([np.inf, -np.inf, np.inf, -np.inf])
    for _ in range(MOST_SCANS):
        if not whole:
            searched = join_boxes(searched, box)
        found, sums, spots = _scan(
            packed,
            middle,
            box,
            cells,
            finest,
            traced if whole else None,
            few_cells,
            slivers=0 if quick else 2 if whole else int(slivers or small),
        )
        slivers = slivers or bool(spots[1] > spots[0])
        plenty = sums[4] >= (BLOB if whole else SMALL_REGION)
        # the first scan's cells are too large for the slivers beside a region of few of them
        small = small or (whole and not plenty)
        near, few = box, cells_across(packed, COARSE) if plenty else cells
        if whole and sums[4] > 0.0:
            # the whole front is too large for three scans when one colour already located the region
            near, few = _around(found, box, cells), cells_across(packed, COARSE if plenty else FINER)
        for other in others:
            elsewhere, more, _ = _scan(packed, other, near, few, finest)
            found = join_boxes(found, elsewhere)
            if not plenty:
                sums = np.maximum(sums, more)
        if found[1] <= found[0] or sums[0] <= 0.0:
            return None
        if sums[4] > 0.0 and spots[1] > spots[0]:
            # the next scan does not have to find again the light between samples next to the main region
            held = join_boxes(held, spots)
        found = join_boxes(found, held)
        shrunk = _area(found) < 0.3 * _area(box)
        roomy = _with_room(found, box, cells) if quick else found
        if quick and (not shrunk or sums[4] >= BLOB):
            break
        few_lit = sums[5] * cells[0] * cells[1] < FEW_LIT * _area(box)
        # light in few cells that comes to a side of its box may continue beyond, unless a finer scan has looked there
        open_sides = (found == box) & (box == searched) & (box != first) & (sums[4] < SMALL_REGION)
        # and a sliver that comes to a side was too narrow for the samples beyond
        open_sides |= (found == box) & (box != first) & (spots == box)
        if few_lit and not shrunk and halved < HALVED:
            box, cells = found, (2 * cells[0], 2 * cells[1])
            halved += 1
        elif open_sides.any():
            wide = np.where(open_sides, widened_box(found, first, 1.0), found)
            # wider cells would lose the light at the sides again
            box, cells = wide, cells_as_dense(cells, box, wide)
        elif shrunk:
            box, cells = found, cells_across(packed, FINER)
        else:
            break
        whole = False
    return _region(roomy, sums, slivers)


def region_at_ends(
    packed: PackedLens, path: LightPath, tilt: float, iris_radius: float, view_radius: float, known: Region
) -> Region | None:
    """Find the part of the pupil that a path accepts at more wavelengths, if it lies around a known part.

    Parameters
    ----------
    packed : PackedLens
        At more wavelengths.
    path, tilt, iris_radius, view_radius
        As in `find_region`.
    known : Region
        What the path accepts at some wavelengths between those of `packed`.

    Returns
    -------
    Region or None
        With `known` and what passes at both ends of the wavelengths; None where it does not lie around `known`.
    """
    front = front_box(packed, tilt)
    around, finest, box = widened_box(known.box, front, NEAR), _finest(packed, front), known.box
    # a number, for which the kernel is compiled
    cells, slivers = cells_across(packed, FINER), int(known.slivers)
    for w in wavelengths_fitted(packed)[1:]:
        arguments = (*_looking_arguments(packed, w, path, tilt), path.stop_crossings, iris_radius, view_radius)
        found, sums, _ = _scan(packed, arguments, around, cells, finest, slivers=slivers)
        if sums[4] < BLOB or _may_go_beyond(found, around, front):
            return None
        box = join_boxes(box, found)
    return replace(known, box=box, share=known.share * _area(known.box) / _area(box))


def _may_go_beyond(found: Floats, around: Floats, front: Floats) -> bool:
    """Return whether light that a scan found in a box comes to a side of it that is not one of the front."""
    return bool(((found == around) & (around != front)).any())


def _looked_at(packed: PackedLens, front: Floats, within: Floats | None, quick: bool) -> tuple[Floats, tuple[int, int]]:
    """Return the area of the first scan, and its cells."""
    box, cells = front, cells_across(packed, PREPASS_QUICK if quick else PREPASS)
    if within is None:
        return box, cells
    # as dense as on the whole front
    parts = (within[1::2] - within[0::2]) / (box[1::2] - box[0::2])
    few = cells_across(packed, ENTRY_QUICK if quick else ENTRY)
    return within, (max(ceil(cells[0] * parts[0]), few[0]), max(ceil(cells[1] * parts[1]), few[1]))


def first_look(
    packed: PackedLens, paths: Sequence[LightPath], tilt: float, within: Floats | None = None, quick: bool = False
) -> Floats:
    """Trace the rays of the first scan of `find_region` for several paths with common beginnings at once.

    Parameters
    ----------
    packed : PackedLens
        Only centred conics.
    paths : sequence of LightPath
        Of two reflections, in the order that `optics.lens.paths.joined_path_steps` requires.
    tilt, within, quick
        As in `find_region`.

    Returns
    -------
    ndarray, shape (P, N, 5 + 2 C)
        One entry per path; C is the largest number of stop crossings among them.
    """
    box, cells = _looked_at(packed, front_box(packed, tilt), within, quick)
    x, y = (box[2 * k] + np.arange(cells[k] + 1) * ((box[2 * k + 1] - box[2 * k]) / cells[k]) for k in (0, 1))
    px, py = np.repeat(x, len(y)), np.tile(y, len(x))
    data = np.empty((len(paths), len(px), STOP_X + 2 * max(path.stop_crossings for path in paths)))
    arguments = _looking_arguments(packed, wavelengths_fitted(packed)[0], paths[0], tilt)
    trace_nodes(PathSteps(*joined_path_steps(paths)), *arguments[1:], px, py, data.reshape(-1, data.shape[2]))
    return data


def _region(box: Floats, sums: Floats, slivers: bool) -> Region:
    """Return the region that a scan found in a box."""
    seen = float(sums[1]) if sums[3] > 0.0 else 0.0
    share = float(np.clip(sums[5] / _area(box), 1e-3, 1.0))
    return Region(box, float(sums[0]), seen, float(sums[2] / sums[0]), share, slivers)


def _area(box: Floats) -> float:
    return float((box[1] - box[0]) * (box[3] - box[2]))


def _with_room(found: Floats, box: Floats, cells: tuple[int, int]) -> Floats:
    """Widen the middle colour's region by one cell of its scan: other colours can pass slightly outside."""
    step = (box[1::2] - box[0::2]) / cells
    low, high = np.maximum(found[0::2] - step, box[0::2]), np.minimum(found[1::2] + step, box[1::2])
    return np.array([low[0], high[0], low[1], high[1]])


def _finest(packed: PackedLens, front: Floats) -> tuple[float, float]:
    """Return how finely scans search for light between samples: as on the whole front, mm in x and in y."""
    cells = cells_across(packed, PREPASS)
    return float(front[1] - front[0]) / (PROBES * cells[0]), float(front[3] - front[2]) / (PROBES * cells[1])


def measure_region(
    packed: PackedLens, path: LightPath, tilt: float, iris_radius: float, view_radius: float, box: Floats
) -> Region | None:
    """Estimate the flux of a path through a box that is known to contain its whole region.

    Parameters
    ----------
    packed, path, tilt, iris_radius, view_radius
        As in `find_region`.
    box : ndarray, shape (4,)

    Returns
    -------
    Region or None
        None when no light passes.
    """
    w, cells = wavelengths_fitted(packed)[0], cells_across(packed, FINER)
    arguments = (*_looking_arguments(packed, w, path, tilt), path.stop_crossings, iris_radius, view_radius)
    found, sums, spots = _scan(packed, arguments, box, cells, _finest(packed, front_box(packed, tilt)), slivers=1)
    if found[1] <= found[0] or sums[0] <= 0.0:
        return None
    return _region(_with_room(found, box, cells), sums, bool(spots[1] > spots[0]))


def widened_region(packed: PackedLens, region: Region, tilt: float, part: float) -> Region:
    """Widen a region on each side by a fraction of its size, within the front.

    Parameters
    ----------
    packed : PackedLens
    region : Region
    tilt : float
        From `incidence`.
    part : float

    Returns
    -------
    Region
        With the same flux.
    """
    wide = widened_box(region.box, front_box(packed, tilt), part)
    return replace(region, box=wide, share=region.share * _area(region.box) / _area(wide))


def join_boxes(a: Floats, b: Floats) -> Floats:
    """Return the bounding box of two boxes of the pupil, each shape (4,): x0, x1, y0, y1."""
    low, high = np.minimum(a[0::2], b[0::2]), np.maximum(a[1::2], b[1::2])
    return np.array([low[0], high[0], low[1], high[1]])


def widened_box(box: Floats, front: Floats, part: float) -> Floats:
    """Widen a box of the pupil on every side by a part of its size, within the front, each shape (4,)."""
    wide, high = part * (box[1::2] - box[0::2])
    grown = box + np.array([-wide, wide, -high, high])
    return np.asarray(np.clip(grown, front[[0, 0, 2, 2]], front[[1, 1, 3, 3]]))


def cells_as_dense(cells: tuple[int, int], box: Floats, other: Floats) -> tuple[int, int]:
    """Return numbers of cells that cover another box as densely as `cells` cover a box, and no fewer."""
    parts = (other[1::2] - other[0::2]) / (box[1::2] - box[0::2])
    return max(ceil(cells[0] * parts[0]), cells[0]), max(ceil(cells[1] * parts[1]), cells[1])


def _around(found: Floats, box: Floats, cells: tuple[int, int]) -> Floats:
    """Widen a region to three times its size plus four cells of its scan, within the scan's box."""
    wide = max(found[1] - found[0], 4.0 * (box[1] - box[0]) / cells[0])
    high = max(found[3] - found[2], 4.0 * (box[3] - box[2]) / cells[1])
    grown = found + np.array([-wide, wide, -high, high])
    return np.array([max(grown[0], box[0]), min(grown[1], box[1]), max(grown[2], box[2]), min(grown[3], box[3])])


def _scan(
    packed: PackedLens,
    arguments: tuple[Any, ...],
    box: Floats,
    cells: tuple[int, int],
    finest: tuple[float, float],
    traced: Floats | None = None,
    few_cells: int = FEW_CELLS,
    slivers: int = 0,
) -> tuple[Floats, Floats, Floats]:
    """Run the pre-pass over a box at one wavelength."""
    data = _UNTRACED if traced is None else traced
    found, sums, spots = find_box(*arguments, box, cells, few_cells, slivers, finest, data)
    if packed.halves == 1:
        # the kernel counts every ray for its mirror image too
        sums[:3] *= 0.5
    return found, sums, spots
