"""Area lights: the motion of each ghost over a part of a light, and the shape over which it spreads the ghost.

A part of a light is traced as one direction. The other directions give the same ghost at other places. Over a small
part the motion is linear, so the ghost of the part is the traced one, spread over the part's outline mapped to the
sensor.
"""

from __future__ import annotations

import numpy as np

from ...kernels.raster.bundle import measure_bundle
from ...optics.lens.paths import LightPath
from ...optics.pupil.polygon import content, mapped, points, rim
from ...optics.rays.bundle import Refinement, trace_bundle, trace_grid
from ...optics.rays.pupil_region import Region, find_region
from ...typing import Floats
from .paraxial_place import draft_centre
from .shot import Shot, moved

# rounding of a spread: pixels, and relative to its size; ghosts with the same rounded spread are spread together
Rounding = tuple[float, float]
ROUNDING: Rounding = (0.3, 0.03)
# of drafts, which are approximate anyway: fewer different spreads keep the dragging of a lamp interactive
DRAFT_ROUNDING: Rounding = (0.6, 0.12)
# a narrower spread is invisible, pixels
NARROW_PX = 0.35
# half width of a spread that is a line, pixels
LINE_PX = 0.01
# least width of spread and ghost, in coarse pixels, for drawing at half the resolution
COARSE_PX = 6.0
# largest relative error of a ghost's flux where only its centroid is needed
CENTRE_TOLERANCE = 3e-3


def motion(shot: Shot, path: LightPath, *, draft: bool = False) -> tuple[Floats, float] | None:
    """Compute the motion of a ghost's centroid over a part of a light, on the unbounded sensor plane.

    Parameters
    ----------
    shot : Shot
        With a border.
    path : LightPath
    draft : bool
        Use matrices instead of rays.

    Returns
    -------
    matrix : ndarray, shape (2, 2)
        Upright mm per slope; columns for left to right and for bottom to top of the part.
    size : float
        Root mean square radius of the ghost, mm; infinite with matrices.

    None if the path passes no light.
    """
    assert shot.border is not None
    here = np.tan(np.radians(shot.light.field_deg))
    if shot.packed.symmetric and not draft:
        return _turned(shot, path, here)
    near: list[Region] = []
    ends = [_ends(shot, path, here, axis, near, draft=draft) for axis in np.eye(2)]
    known = [end for end in ends if end is not None]
    if not known:
        return None
    columns = [np.zeros(2) if end is None else end[0] for end in ends]
    return np.stack(columns, axis=1), float(np.mean([size for _, _, size in known]))


def _turned(shot: Shot, path: LightPath, here: Floats) -> tuple[Floats, float] | None:
    """Compute the motion towards the axis; across it, a symmetric lens rotates its ghosts about the axis."""
    slope = float(np.hypot(*here))
    radial = here / slope if slope > 0.0 else np.array([1.0, 0.0])
    found = _ends(shot, path, here, radial, [], draft=False)
    if found is None:
        return None
    column, middle, size = found
    along = float(column @ radial)
    across = float(middle @ radial) / slope if slope > 1e-9 else along
    outward = np.outer(radial, radial)
    return along * outward + across * (np.eye(2) - outward), size


def _ends(
    shot: Shot, path: LightPath, here: Floats, axis: Floats, near: list[Region], *, draft: bool
) -> tuple[Floats, Floats, float] | None:
    """Compute the motion between the ends of the part along an axis: mm per slope, the ghost's centre, its size."""
    assert shot.border is not None
    along = points(shot.border) @ axis
    found = [(float(d), _centre(shot, path, here + d * axis, near, draft=draft)) for d in (along.min(), along.max())]
    lit = [(d, *centre) for d, centre in found if centre is not None]
    if len(lit) == 1:
        # dark at one end: use the other end and the centre
        middle = _centre(shot, path, here, near, draft=draft)
        lit += [(0.0, *middle)] if middle is not None else []
    if len(lit) < 2:
        return None
    (a, start, one), (b, stop, other) = lit
    motion = (stop - start) / (b - a)
    return motion, start - a * motion, 0.5 * (one + other)


def traced_centre(shot: Shot, path: LightPath, slope: Floats) -> tuple[Floats, float] | None:
    """Compute where a path's light lands for another direction of the light, on the unbounded sensor plane.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    slope : ndarray, shape (2,)
        tan X and tan Y of the field angles.

    Returns
    -------
    place : ndarray, shape (2,)
        Centroid, upright, mm.
    size : float
        Root mean square radius, mm.

    None if the path passes no light.
    """
    return _centre(shot, path, slope, [], draft=False)


def _centre(
    shot: Shot, path: LightPath, slope: Floats, near: list[Region], *, draft: bool
) -> tuple[Floats, float] | None:
    """As `traced_centre`; `near` holds regions of neighbouring directions, to which the path's region is added."""
    elsewhere = moved(shot, slope)
    if draft:
        return draft_centre(elsewhere, path), float("inf")
    packed, seen, opening = elsewhere.packed, elsewhere.incidence, shot.opening
    region = find_region(packed, path, seen.tilt, opening.radius, one_color=True, beside=near[-1] if near else None)
    if region is None:
        return None
    near.append(region)
    bundle = trace_grid(
        packed, path, seen.tilt, (opening.radius, opening.inner), region,
        Refinement(1e-6, flux_tolerance=CENTRE_TOLERANCE, one_color=True),
    )  # fmt: skip
    data = trace_bundle(packed, len(packed.wavelengths_nm) // 2, bundle, seen.tilt)
    sums = measure_bundle(
        data, bundle.pupil, bundle.triangles, path.stop_crossings, opening.blades, seen.axes, bundle.halves
    )
    if sums[0] <= 0.0:
        return None
    x, y = sums[1] / sums[0], sums[2] / sums[0]
    return np.array([x, y]), float(np.sqrt(max(sums[3] / sums[0] - x * x - y * y, 0.0)))


def spread_border(shot: Shot, matrix: Floats, to_pixels: Floats, rounding: Rounding = ROUNDING) -> Floats:
    """Map the outline of a part of a light to the shape over which its ghost is spread.

    Parameters
    ----------
    shot : Shot
        With a border.
    matrix : ndarray, shape (2, 2)
        From `motion`. It is rounded, so that ghosts with similar spreads share one.
    to_pixels : ndarray, shape (4,)
        Of the ghost.
    rounding : tuple of float
        Allowed rounding: pixels, and relative to the size.

    Returns
    -------
    ndarray, shape (N, 5)
        Columns and rows relative to the ghost's position.
    """
    assert shot.border is not None
    round_px, round_part = rounding
    extent = 0.5 * np.ptp(points(shot.border), axis=0)
    pixels = matrix * np.array([[to_pixels[2]], [-to_pixels[3]]]) * extent
    largest = float(np.abs(pixels).max())
    unit = 2.0 * round_px
    while unit < round_part * largest:
        unit *= 2.0
    # round the result too, so that parts of one shape get bit-identical borders
    return np.asarray(np.round(mapped(shot.border, _with_area(np.round(pixels / unit) * unit) / extent), 6) + 0.0)


def _with_area(matrix: Floats) -> Floats:
    """Widen a matrix that maps shapes to a line, to `LINE_PX`: only a shape with an area defines where its light is."""
    left, sizes, right = np.linalg.svd(matrix)
    # a shape that is mapped to a point stays one
    if sizes[1] >= LINE_PX or sizes[0] == 0.0:
        return matrix
    return np.asarray(matrix + (LINE_PX - sizes[1]) * np.outer(left[:, 1], right[1]))


def halvings(border_px: Floats, size_px: float, most: int) -> int:
    """Return how often the resolution of a spread ghost can be halved without a visible difference.

    Parameters
    ----------
    border_px : ndarray, shape (N, 5)
        From `spread_border`.
    size_px : float
        Radius of the ghost.
    most : int
    """
    # a ragged shape has details finer than its width; for a disc both equal its radius
    fine = 2.0 * abs(content(border_px)) / max(rim(border_px), 1e-9)
    wide = min(0.5 * float(np.ptp(points(border_px), axis=0).min()), fine, size_px)
    return int(np.clip(np.floor(np.log2(max(wide, 1e-9) / COARSE_PX)), 0, most))
