"""Area lights: how far each ghost moves over a part of a light, and what that spreads it over.

A part of a light is traced as one direction. The other directions make the same ghost elsewhere: over a small part the
motion is straight, so the part's ghost is the traced one spread over the part's outline, mapped to the sensor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import measure_bundle
from ..optics.border import content, mapped, points, rim
from ..optics.bundle import trace_bundle, trace_grid
from ..optics.paths import LightPath
from ..optics.region import find_region
from .ghosts_draft import draft_centre
from .shot import Shot, moved

Floats = NDArray[np.float64]

# what a spread may be rounded by: pixels, and part of its own size; ghosts of one rounded spread are spread together
Rounding = tuple[float, float]
ROUNDING: Rounding = (0.3, 0.03)
# ... of drafts, whose ghosts are matrices' anyway: fewer spreads, so that a hand may drag a lamp
DRAFT_ROUNDING: Rounding = (0.6, 0.12)
# a spread narrower than this many pixels is not seen
NARROW_PX = 0.35
# coarse pixels that a spread and a ghost must keep across before either is drawn at half the resolution
COARSE_PX = 6.0
# largest relative error of a ghost's flux where only its centroid is asked for
CENTRE_TOLERANCE = 3e-3


def motion(shot: Shot, path: LightPath, *, draft: bool = False) -> tuple[Floats, float] | None:
    """Measure how a ghost's centroid moves over the part of a light, on the unbounded sensor plane.

    Parameters
    ----------
    shot : Shot
        With a border.
    path : LightPath
    draft : bool
        By matrices instead of rays.

    Returns
    -------
    matrix : ndarray, shape (2, 2)
        Upright mm per slope, from the part's left to its right and from its lower to its upper side.
    size : float
        The ghost's own root mean square radius, mm; infinite by matrices.

    None when the path passes no light.
    """
    assert shot.border is not None
    here = np.tan(np.radians(shot.light.field_deg))
    if shot.packed.symmetric and not draft:
        return _turned(shot, path, here)
    ends = [_ends(shot, path, here, axis, draft=draft) for axis in np.eye(2)]
    known = [end for end in ends if end is not None]
    if not known:
        return None
    columns = [np.zeros(2) if end is None else end[0] for end in ends]
    return np.stack(columns, axis=1), float(np.mean([size for _, _, size in known]))


def _turned(shot: Shot, path: LightPath, here: Floats) -> tuple[Floats, float] | None:
    """Measure the motion towards the axis; across it, a lens of revolution turns its ghosts about the axis."""
    slope = float(np.hypot(*here))
    radial = here / slope if slope > 0.0 else np.array([1.0, 0.0])
    found = _ends(shot, path, here, radial, draft=False)
    if found is None:
        return None
    column, middle, size = found
    along = float(column @ radial)
    across = float(middle @ radial) / slope if slope > 1e-9 else along
    outward = np.outer(radial, radial)
    return along * outward + across * (np.eye(2) - outward), size


def _ends(
    shot: Shot, path: LightPath, here: Floats, axis: Floats, *, draft: bool
) -> tuple[Floats, Floats, float] | None:
    """Measure the motion between the ends of the part along an axis: mm per slope, the ghost's middle, its size."""
    assert shot.border is not None
    along = points(shot.border) @ axis
    found = [(float(d), traced_centre(shot, path, here + d * axis, draft=draft)) for d in (along.min(), along.max())]
    lit = [(d, *centre) for d, centre in found if centre is not None]
    if len(lit) == 1:
        # dark at one end: from the other to the middle
        middle = traced_centre(shot, path, here, draft=draft)
        lit += [(0.0, *middle)] if middle is not None else []
    if len(lit) < 2:
        return None
    (a, start, one), (b, stop, other) = lit
    motion = (stop - start) / (b - a)
    return motion, start - a * motion, 0.5 * (one + other)


def traced_centre(shot: Shot, path: LightPath, slope: Floats, *, draft: bool = False) -> tuple[Floats, float] | None:
    """Measure where a path's light lands when the light stands elsewhere, on the unbounded sensor plane.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    slope : ndarray, shape (2,)
        tan X and tan Y of its field angles.
    draft : bool
        By matrices instead of rays.

    Returns
    -------
    place : ndarray, shape (2,)
        Centroid, upright, mm.
    size : float
        Root mean square radius, mm; infinite by matrices.

    None when the path passes no light.
    """
    elsewhere = moved(shot, slope)
    if draft:
        return draft_centre(elsewhere, path), float("inf")
    packed, seen, opening = elsewhere.packed, elsewhere.incidence, shot.opening
    region = find_region(packed, path, seen.tilt, opening.radius)
    if region is None:
        return None
    bundle = trace_grid(
        packed, path, seen.tilt, (opening.radius, opening.inner), region, tolerance=0.25, scale=1e-6,
        flux_tolerance=CENTRE_TOLERANCE,
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
    """Map the outline of a part of a light to what its ghost is spread over.

    Parameters
    ----------
    shot : Shot
        With a border.
    matrix : ndarray, shape (2, 2)
        From `motion`; rounded a little, so that ghosts with much the same spread have the same.
    to_pixels : ndarray, shape (4,)
        The ghost's own.
    rounding : tuple of float
        What it may be rounded by: pixels, and part of its size.

    Returns
    -------
    ndarray, shape (N, 5)
        Columns and rows from the ghost's place.
    """
    assert shot.border is not None
    round_px, round_part = rounding
    extent = 0.5 * np.ptp(points(shot.border), axis=0)
    pixels = matrix * np.array([[to_pixels[2]], [-to_pixels[3]]]) * extent
    largest = float(np.abs(pixels).max())
    unit = 2.0 * round_px
    while unit < round_part * largest:
        unit *= 2.0
    # rounded once more, so that parts of one shape have the same border to the bit
    return np.asarray(np.round(mapped(shot.border, np.round(pixels / unit) * unit / extent), 6) + 0.0)


def halvings(border_px: Floats, size_px: float, most: int) -> int:
    """Return how often the resolution of a spread ghost may be halved before anyone can see it.

    Parameters
    ----------
    border_px : ndarray, shape (N, 5)
        From `spread_border`.
    size_px : float
        The ghost's own radius.
    most : int

    Returns
    -------
    int
    """
    # what is torn has finer parts than it is wide; of a disc both are its radius
    fine = 2.0 * abs(content(border_px)) / max(rim(border_px), 1e-9)
    wide = min(0.5 * float(np.ptp(points(border_px), axis=0).min()), fine, size_px)
    return int(np.clip(np.floor(np.log2(max(wide, 1e-9) / COARSE_PX)), 0, most))
