"""The shape of a light: its outline in field angles, and its division into parts traced as one direction each."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, ceil, cos, degrees, hypot, pi, radians, sin, tan

import numpy as np

from ...errors import ProjectError
from ...model import Light
from ...model.project.light import LEAST_LIGHT_DEG, Polygon, Rectangle
from ...typing import Floats
from .polygon import centroid, closed, content, solid_angle

# corners of the polygon that replaces a disc
ROUND = 32
# largest field angle of a corner, degrees
WIDEST_DEG = 89.0
# a light that is made to fit stays so far within, relative
ROUNDED = 1.0 - 1e-9


@dataclass(frozen=True)
class Part:
    """A part of a light, traced as one direction.

    Attributes
    ----------
    field_deg : tuple of float
        Field angles of its centroid.
    share : float
        Its fraction of the light's irradiance on a plane that faces each part.
    corners : ndarray, shape (N, 2)
        Its outline, counter-clockwise: slopes (tan X, tan Y) relative to the centroid's.
    """

    field_deg: tuple[float, float]
    share: float
    corners: Floats


def light_outline(light: Light) -> Floats | None:
    """Return the outline of a light.

    Returns
    -------
    ndarray, shape (N, 2), or None
        Slopes (tan X, tan Y) of its field angles, counter-clockwise; None for a point.

    Raises
    ------
    ProjectError
        When a part of it lies beside or behind the camera, or when its area is 0 or its edges cross.
    """
    if not light.extended:
        return None
    if light.shape is None:
        corners = _disc(light)
    else:
        offsets = _offsets(light)
        angles = np.array(light.field_deg) + offsets
        # first, because areas of corners without a bound overflow
        if np.abs(angles).max() > WIDEST_DEG:
            raise ProjectError(
                f"the light {light.name!r} reaches beside or behind the camera; its corners must stay within "
                f"{WIDEST_DEG:g} degrees"
            )
        least = max(1e-9 * float(np.ptp(offsets, axis=0).max()) ** 2, LEAST_LIGHT_DEG**2)
        if isinstance(light.shape, Polygon) and abs(content(closed(offsets))) < least:
            raise ProjectError(f"the light {light.name!r} has no area; give corners that enclose an area")
        corners = np.tan(np.radians(angles))
        if _crosses_itself(corners):
            raise ProjectError(
                f"the light {light.name!r} has edges that cross each other; give its corners in order around it"
            )
    area = content(closed(corners))
    return corners if area > 0.0 else corners[::-1].copy()


def _crosses_itself(corners: Floats) -> bool:
    """Return whether two edges of a polygon cross."""
    ends = np.roll(corners, -1, axis=0)

    def side(points: Floats) -> Floats:
        # twice the area of the triangles of each edge (rows) and each point (columns)
        along, to = ends - corners, points[None] - corners[:, None]
        return np.asarray(along[:, None, 0] * to[..., 1] - along[:, None, 1] * to[..., 0])

    apart = side(corners) * side(ends) < 0.0
    return bool((apart & apart.T).any())


def disc_fits(light: Light) -> bool:
    """Return whether a round light lies within `WIDEST_DEG` of the axis."""
    slopes = (tan(radians(angle)) for angle in light.field_deg)
    return atan(hypot(*slopes)) + _disc_radius(light) <= radians(WIDEST_DEG)


def shrunk_to_fit(light: Light) -> Light:
    """Return a light no larger than fits within `WIDEST_DEG` of the axis, of the same shape and irradiance."""
    if light.shape is not None:
        across = np.abs(_offsets(light)).max()
        room = WIDEST_DEG - float(np.abs(light.field_deg).max())
        return light if across <= room else light.replace(shape=_scaled(light.shape, room / across * ROUNDED))
    slopes = (tan(radians(angle)) for angle in light.field_deg)
    room, radius = radians(WIDEST_DEG) - atan(hypot(*slopes)), _disc_radius(light)
    return light if radius <= room else light.replace(diameter_deg=light.diameter_deg * room / radius * ROUNDED)


def _scaled(shape: Rectangle | Polygon, factor: float) -> Rectangle | Polygon:
    """Return a shape of another size."""
    if isinstance(shape, Rectangle):
        return shape.replace(size_deg=tuple(size * factor for size in shape.size_deg))
    return shape.replace(corners_deg=tuple((x * factor, y * factor) for x, y in shape.corners_deg))


def _offsets(light: Light) -> Floats:
    """Return the corners of a light with a shape, field angles relative to its own, degrees."""
    if not isinstance(light.shape, Rectangle):
        assert light.shape is not None, "a disc has no corners"
        return np.array(light.shape.corners_deg)
    half_x, half_y = (0.5 * size for size in light.shape.size_deg)
    turn = radians(light.shape.rotation_deg)
    square = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    return np.asarray(square @ np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]]))


def _disc_radius(light: Light) -> float:
    """Return the angle from the centre to the corners of a polygon of the disc's area, rad."""
    step = 2.0 * pi / ROUND
    return float(radians(0.5 * light.diameter_deg) * (step / sin(step)) ** 0.5)


def _disc(light: Light) -> Floats:
    """Return directions half the diameter from the centre, as a polygon of the disc's area."""
    half = _disc_radius(light)
    slopes = [tan(radians(angle)) for angle in light.field_deg]
    if not disc_fits(light):
        raise ProjectError(
            f"the light {light.name!r} lies {degrees(atan(hypot(*slopes))):g} degrees from the axis, and its disc of "
            f"{light.diameter_deg:g} degrees reaches beyond {WIDEST_DEG:g}; move it inwards, or make it a point"
        )
    middle = np.array([*slopes, 1.0])
    middle /= np.linalg.norm(middle)
    across = np.cross([0.0, 1.0, 0.0], middle)
    across /= np.linalg.norm(across)
    up = np.cross(middle, across)
    angle = 2.0 * pi / ROUND * np.arange(ROUND)
    rim = cos(half) * middle + sin(half) * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * up)
    return np.asarray(rim[:, :2] / rim[:, 2:])


def parts(light: Light, step_deg: float, most: int | None = None) -> tuple[Part, ...]:
    """Divide a light into parts no wider than a step.

    Parameters
    ----------
    light : Light
    step_deg : float
    most : int, optional
        Largest number of parts from side to side and from top to bottom; a wide light then has wider parts.

    Returns
    -------
    tuple of Part
        Their shares add to 1; one part, without corners, for a point.

    Raises
    ------
    ProjectError
        As `light_outline`.

    Notes
    -----
    The light's radiance is uniform, so a part's share is its fraction of the solid angle.
    """
    corners = light_outline(light)
    if corners is None:
        return (Part(light.field_deg, 1.0, np.zeros((0, 2))),)
    low, high = corners.min(axis=0), corners.max(axis=0)
    counts = [max(1, ceil((high[k] - low[k]) / tan(radians(step_deg)) - 1e-9)) for k in (0, 1)]
    if most is not None:
        counts = [min(count, most) for count in counts]
    edges = [np.linspace(low[k], high[k], counts[k] + 1) for k in (0, 1)]
    found = []
    for a in range(counts[0]):
        for b in range(counts[1]):
            cell = corners
            for axis, k in ((0, a), (1, b)):
                cell = _cut(cell, axis, edges[axis][k], 1.0)
                cell = _cut(cell, axis, edges[axis][k + 1], -1.0)
            area = content(closed(cell)) if len(cell) > 2 else 0.0
            if area > 1e-9 * abs(content(closed(corners))):
                found.append((cell, centroid(closed(cell))))
    weights = np.array([solid_angle(closed(cell)) for cell, _ in found])
    weights /= weights.sum()
    return tuple(
        Part((degrees(atan(middle[0])), degrees(atan(middle[1]))), float(share), cell - middle)
        for (cell, middle), share in zip(found, weights, strict=True)
    )


def _cut(corners: Floats, axis: int, at: float, side: float) -> Floats:
    """Clip a polygon at a line across an axis (Sutherland and Hodgman 1974); `side` 1 keeps the part above."""
    if len(corners) == 0:
        return corners
    value = side * (corners[:, axis] - at)
    kept = []
    for k in range(len(corners)):
        m = (k + 1) % len(corners)
        if value[k] >= 0.0:
            kept.append(corners[k])
        if (value[k] > 0.0 > value[m]) or (value[k] < 0.0 < value[m]):
            kept.append(corners[k] + value[k] / (value[k] - value[m]) * (corners[m] - corners[k]))
    return np.array(kept).reshape(-1, 2)
