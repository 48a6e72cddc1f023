"""Estimate missing clear apertures by ray tracing."""

from __future__ import annotations

from functools import lru_cache
from math import atan, radians

import numpy as np

from ...model import Lens, Stop, Surface
from ...typing import Floats
from ..lens.dispersion import D_LINE_NM
from ..lens.paraxial import FirstOrder, first_order, path_matrices
from ..lens.paths import direct_path
from ..lens.surface_shape import ideal, sag, transposed
from ..rays.single_rays import trace_polylines

# half diagonal of 36 x 24 mm, for lenses without a stated field: the picture's size does not scale with the lens
IMAGE_RADIUS = 21.63
# fraction of the stop's radius that the corner beam fills; photographic lenses vignette there
CORNER_PUPIL = 0.6
# mechanical allowance relative to the light's radius
ALLOWANCE = 1.02
# upper limits of estimates: fraction of a surface's own sphere, and the limit of lens files, mm
WITHIN_SPHERE, WIDEST = 0.98, 2000.0
# steps in which the chief ray moves out to the corner
FIELD_STEPS = 24
# least distance of neighbouring surfaces at their rims: fraction of the stop's radius (0.05 mm for 50 mm f/1.4), but
# of a thinner gap no more than this part, as it is thin by design and not by its rims
EDGE, OF_GAP = 0.0027, 0.5


def half_field(lens: Lens) -> float:
    """Return the half field of view in rad: from the lens file, else from a 43.3 mm image circle."""
    if lens.field_deg is not None:
        return radians(lens.field_deg)
    return atan(IMAGE_RADIUS / first_order(lens).efl)


# cached: an editor or a sequence completes the same lens repeatedly
@lru_cache(maxsize=64)
def with_semi_diameters(lens: Lens) -> Lens:
    """Fill in missing semi-diameters and mark them as estimated.

    Returns
    -------
    Lens
        The same lens when none was missing.

    Notes
    -----
    A surface must pass the full axial beam and, from the corner of the field, the beam within 0.6 of the stop's radius;
    it stays within its own sphere and does not intersect its neighbours.
    """
    missing = [k for k, row in enumerate(lens.rows) if isinstance(row, Surface) and row.semi_diameter is None]
    if not missing:
        return lens
    needed = _required_heights(lens) * ALLOWANCE
    rows = list(lens.rows)
    for k in missing:
        row = rows[k]
        assert isinstance(row, Surface)
        radius = float(min(needed[k], WITHIN_SPHERE * row.equator, WIDEST))
        rows[k] = row.replace(semi_diameter=radius, semi_diameter_estimated=True)
    _separate_neighbours(rows, set(missing), EDGE * first_order(ideal(lens)).stop_semi_diameter)
    return lens.replace(rows=tuple(rows))


def _required_heights(lens: Lens) -> Floats:
    """Return the largest height of the light at every row of the nominal lens, in both meridians."""
    plain = ideal(lens)
    order = first_order(plain)
    needed = _meridian(plain, half_field(plain), order, order.entrance_pupil_diameter)
    if not any(isinstance(row, Surface) and row.toroidal for row in plain.rows):
        return needed
    other = transposed(plain)
    (to_stop,), _ = path_matrices(other, direct_path(other), D_LINE_NM, 0.0)
    pupil = 2.0 * order.stop_semi_diameter / max(abs(float(to_stop[0, 0])), 1e-9)
    angle = half_field(plain)
    if plain.field_deg is None and order.efl_x is not None and order.efl_x > 0.0:
        angle = atan(IMAGE_RADIUS / order.efl_x)
    return np.maximum(needed, _meridian(other, angle, order, pupil))


def _meridian(lens: Lens, angle: float, order: FirstOrder, pupil: float) -> Floats:
    """Return the largest height of the light in the y-z plane, for the axial and the corner beam."""
    stop, distance = order.stop_semi_diameter, order.sensor_distance
    on_axis = _beam_radius(lens, 0.0, stop, pupil, distance)
    return np.maximum(on_axis, _beam_radius(lens, angle, stop * CORNER_PUPIL, pupil, distance))


def _beam_radius(lens: Lens, angle: float, stop: float, pupil: float, distance: float) -> Floats:
    """Return the largest height per row of the meridional rays from `angle` that cross the stop within a height."""
    chief, step, found = 0.0, 0.0, 0.0
    # move the chief ray out in steps: the pupil of a wide angle moves, and other branches can reach the stop as well
    for at in np.linspace(0.0, angle, 1 if angle == 0.0 else FIELD_STEPS + 1):
        aimed = _aim(lens, float(at), chief + step, pupil, distance)
        if aimed is None:
            break
        chief, step, found = aimed, aimed - chief, float(at)
    y = np.linspace(chief - 1.5 * pupil, chief + 1.5 * pupil, 1201)
    hits = trace_polylines(lens, None, np.zeros_like(y), y, -found, sensor_distance=distance)
    passing = np.isfinite(hits[:, -1, 1]) & (np.abs(hits[:, 1 + lens.stop_row, 1]) <= stop)
    # only the beam connected to the chief ray
    blocked = np.flatnonzero(~passing)
    middle = int(np.argmin(np.abs(y - chief)))
    start = blocked[blocked < middle].max(initial=-1) + 1
    end = blocked[blocked > middle].min(initial=len(y))
    if not passing[middle]:
        return np.zeros(len(lens.rows))
    heights: Floats = np.abs(hits[start:end, 1:-1, 1]).max(axis=0)
    return heights


def _aim(lens: Lens, angle: float, guess: float, reach: float, distance: float) -> float | None:
    """Return where the ray through the stop's centre crosses the plane of the first vertex, near a guess."""
    y = np.linspace(guess - reach, guess + reach, 401)
    hits = trace_polylines(lens, None, np.zeros_like(y), y, -angle, sensor_distance=distance)
    at_stop = np.where(np.isfinite(hits[:, -1, 1]), hits[:, 1 + lens.stop_row, 1], np.nan)
    crossing = np.flatnonzero(at_stop[:-1] * at_stop[1:] <= 0.0)
    if crossing.size == 0:
        return None
    k = crossing[np.argmin(np.abs(y[crossing] - guess))]
    change = at_stop[k + 1] - at_stop[k]
    return float(y[k] if change == 0.0 else y[k] - at_stop[k] * (y[k + 1] - y[k]) / change)


def _edge_gap(front: Surface, back: Surface, r: float) -> float:
    """Return the least distance of two surfaces at a height, over both meridians."""
    x, y = np.array([0.0, r]), np.array([r, 0.0])
    return float((front.thickness + sag(back, x, y) - sag(front, x, y)).min())


def _separate_neighbours(rows: list[Surface | Stop], estimated: set[int], edge: float) -> None:
    """Reduce estimates until neighbouring surfaces are `edge` or half their gap apart at their common height."""
    for k in range(len(rows) - 1):
        front, back = rows[k], rows[k + 1]
        if not isinstance(front, Surface) or not isinstance(back, Surface):
            continue
        assert front.semi_diameter is not None
        assert back.semi_diameter is not None
        common = min(front.semi_diameter, back.semi_diameter)
        limit, least = common, min(edge, OF_GAP * front.thickness)
        while limit > 0.2 * common and _edge_gap(front, back, limit) < least:
            limit *= 0.98
        if limit < common:
            for m, row in ((k, front), (k + 1, back)):
                if m in estimated and row.semi_diameter is not None and row.semi_diameter > limit:
                    rows[m] = row.replace(semi_diameter=limit)
