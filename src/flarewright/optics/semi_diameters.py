"""Estimate the clear apertures that a prescription leaves out, by tracing."""

from __future__ import annotations

from functools import lru_cache
from math import atan, radians

import numpy as np
from numpy.typing import NDArray

from ..model import Lens, Stop, Surface
from .paraxial import D_LINE_NM, FirstOrder, first_order, path_matrices
from .paths import direct_path
from .shape import ideal, sag, transposed
from .trace import trace_polylines

# half diagonal of 36 x 24 mm, for lenses that do not state their field
IMAGE_RADIUS = 21.63
# part of the stop's radius that the beam from the corner still fills; photographic lenses vignette there
CORNER_PUPIL = 0.6
# mechanical allowance on the light's own radius
ALLOWANCE = 1.02
# estimates stay within this part of a surface's own sphere, and within what a lens file may say, mm
WITHIN_SPHERE, WIDEST = 0.98, 2000.0
# steps in which the chief ray is walked out to the corner
FIELD_STEPS = 24
# thinnest edge of an element or gap, mm
EDGE = 0.05


def half_field(lens: Lens) -> float:
    """Return the half field of view in rad: the lens file's, else from a 43.3 mm image circle."""
    if lens.field_deg is not None:
        return radians(lens.field_deg)
    return atan(IMAGE_RADIUS / first_order(lens).efl)


# an editor or a sequence asks for the same lens again and again
@lru_cache(maxsize=64)
def complete(lens: Lens) -> Lens:
    """Fill in missing semi-diameters and mark them as estimated.

    Parameters
    ----------
    lens : Lens

    Returns
    -------
    Lens
        The same lens when nothing was missing.

    Notes
    -----
    A surface must pass the full beam on the axis and, from the corner of the field, the part of the beam that crosses
    the stop within 0.6 of its radius; it stays within its own sphere and does not cut its neighbours.
    """
    missing = [k for k, row in enumerate(lens.rows) if isinstance(row, Surface) and row.semi_diameter is None]
    if not missing:
        return lens
    needed = _needed(lens) * ALLOWANCE
    rows = list(lens.rows)
    for k in missing:
        row = rows[k]
        assert isinstance(row, Surface)
        radius = float(min(needed[k], WITHIN_SPHERE * row.equator, WIDEST))
        rows[k] = row.replace(semi_diameter=radius, semi_diameter_estimated=True)
    _keep_apart(rows, set(missing))
    completed: Lens = lens.replace(rows=tuple(rows))
    return completed


def _needed(lens: Lens) -> NDArray[np.float64]:
    """Largest height of the light on every row, of the lens as designed, in both its meridians."""
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


def _meridian(lens: Lens, angle: float, order: FirstOrder, pupil: float) -> NDArray[np.float64]:
    """Largest height of the light in the y-z plane, on the axis and from the corner."""
    stop, distance = order.stop_semi_diameter, order.sensor_distance
    on_axis = _beam_radius(lens, 0.0, stop, pupil, distance)
    return np.maximum(on_axis, _beam_radius(lens, angle, stop * CORNER_PUPIL, pupil, distance))


def _beam_radius(lens: Lens, angle: float, stop: float, pupil: float, distance: float) -> NDArray[np.float64]:
    """Largest height of the meridional rays from `angle` that cross the stop within a height, per row."""
    chief, step, found = 0.0, 0.0, 0.0
    # walk the chief ray out from the axis: the pupil of a wide angle wanders, and other branches may reach the stop too
    for at in np.linspace(0.0, angle, 1 if angle == 0.0 else FIELD_STEPS + 1):
        aimed = _aim(lens, float(at), chief + step, pupil, distance)
        if aimed is None:
            break
        chief, step, found = aimed, aimed - chief, float(at)
    y = np.linspace(chief - 1.5 * pupil, chief + 1.5 * pupil, 1201)
    hits = trace_polylines(lens, None, np.zeros_like(y), y, -found, sensor_distance=distance)
    passing = np.isfinite(hits[:, -1, 1]) & (np.abs(hits[:, 1 + lens.stop_row, 1]) <= stop)
    # only the beam that hangs together with the chief ray
    blocked = np.flatnonzero(~passing)
    middle = int(np.argmin(np.abs(y - chief)))
    start = blocked[blocked < middle].max(initial=-1) + 1
    end = blocked[blocked > middle].min(initial=len(y))
    if not passing[middle]:
        return np.zeros(len(lens.rows))
    heights: NDArray[np.float64] = np.abs(hits[start:end, 1:-1, 1]).max(axis=0)
    return heights


def _aim(lens: Lens, angle: float, guess: float, reach: float, distance: float) -> float | None:
    """Find where the ray through the middle of the stop crosses the plane of the first vertex, near a guess."""
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
    """Least distance between two surfaces at a height, over both meridians."""
    x, y = np.array([0.0, r]), np.array([r, 0.0])
    return float((front.thickness + sag(back, x, y) - sag(front, x, y)).min())


def _keep_apart(rows: list[Surface | Stop], estimated: set[int]) -> None:
    """Shrink estimates until neighbouring surfaces do not cross at their common height."""
    for k in range(len(rows) - 1):
        front, back = rows[k], rows[k + 1]
        if not isinstance(front, Surface) or not isinstance(back, Surface):
            continue
        assert front.semi_diameter is not None
        assert back.semi_diameter is not None
        common = min(front.semi_diameter, back.semi_diameter)
        limit = common
        while limit > 0.2 * common and _edge_gap(front, back, limit) < EDGE:
            limit *= 0.98
        if limit < common:
            for m, row in ((k, front), (k + 1, back)):
                if m in estimated and row.semi_diameter is not None and row.semi_diameter > limit:
                    rows[m] = row.replace(semi_diameter=limit)
