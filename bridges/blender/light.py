"""The irradiance of lamps and of glowing surfaces at the camera, in parts that can be hidden one by one."""

from collections.abc import Sequence
from math import cos, hypot, pi, sin, sqrt, tan
from typing import NamedTuple

from .vectors import Matrix, Vector, column, cross, dot, length, minus, plus, times, two_across, unit

# turn between two points of a sunflower, which cover a disc evenly
_GOLDEN_ANGLE = pi * (3.0 - sqrt(5.0))
# steps of the lattice that covers a rectangle evenly (M. Roberts, R2 sequence)
_LATTICE = (0.7548776662466927, 0.5698402909980532)
# a spread below this, radians, shines in parallel
_LEAST_SPREAD = 1e-4


class Lamp(NamedTuple):
    """A lamp of Blender.

    Attributes
    ----------
    kind : str
        "POINT", "SPOT", "AREA" or "SUN".
    matrix : sequence
        Four rows, from the lamp to the world.
    power : float
        W, or W/m^2 of a sun.
    radius : float
        Of a point or a spot, in the unit of the scene, whatever the scale of the object.
    soft : bool
        A point or spot of some radius is a disc that faces who looks at it, and not a sphere.
    normalized : bool
        The size changes the radiance, and not the power.
    spot_angle, spot_blend : float
        Whole angle of the cone, radians; part of the cone with a soft edge.
    shape : str
        "SQUARE", "RECTANGLE", "DISK" or "ELLIPSE".
    size : tuple of float
        Of an area, before the scale of the object.
    spread : float
        Whole angle into which an area shines, radians.
    angle : float
        Angular diameter of a sun, radians.
    """

    kind: str
    matrix: Matrix
    power: float
    radius: float = 0.0
    soft: bool = True
    normalized: bool = True
    spot_angle: float = pi
    spot_blend: float = 0.0
    shape: str = "SQUARE"
    size: tuple[float, float] = (0.0, 0.0)
    spread: float = pi
    angle: float = 0.0


class Sample(NamedTuple):
    """A part of a light source.

    Attributes
    ----------
    direction : tuple of float
        From the camera, unit length.
    distance : float
        Infinite for a sun.
    irradiance : float
        On a plane at the camera that faces the source; W/m^2 of the whole, divided among its parts.
    """

    direction: Vector
    distance: float
    irradiance: float


def lamp_samples(lamp: Lamp, camera: Vector, count: int) -> list[Sample]:
    """Return parts of a lamp with the irradiance of each at the camera.

    Parameters
    ----------
    lamp : Lamp
    camera : tuple of float
        Its place in the world.
    count : int
        Number of parts of a lamp that is no point.

    Returns
    -------
    list of Sample
        Their sum is the irradiance without anything between.

    Notes
    -----
    Cycles' units: a point of power P has the radiant intensity P / (4 pi), so its radiance is P / (4 pi^2 r^2), a
    spot the same within its cone, an area of size A the radiance P / (pi A), a sun the irradiance P.
    tests/bridges/test_blender_light.py compares all of them with rendered pictures.
    """
    if lamp.power <= 0.0:
        return []
    if lamp.kind == "SUN":
        return _sun(lamp, count)
    if lamp.kind == "AREA":
        return _area(lamp, camera, count)
    return _point(lamp, camera, count)


def lamp_radius(lamp: Lamp) -> float:
    """Return the radius of a lamp's disc; that of a disc with the same area for other areas."""
    if lamp.kind != "AREA":
        return lamp.radius
    return sqrt(_area_size(lamp)[2] / pi)


def _sun(lamp: Lamp, count: int) -> list[Sample]:
    axis = unit(column(lamp.matrix, 2))
    half = 0.5 * lamp.angle
    irradiance = lamp.power
    if not lamp.normalized and half > 0.0:
        irradiance *= pi * sin(half) ** 2
    if half <= 0.0:
        return [Sample(axis, float("inf"), irradiance)]
    right, up = two_across(axis)
    found = []
    for x, y in _disc(count):
        # even in the solid angle weighted by the cosine, so that all parts have the same irradiance
        direction = unit(plus(axis, plus(times(right, x * tan(half)), times(up, y * tan(half)))))
        found.append(Sample(direction, float("inf"), irradiance / count))
    return found


def _point(lamp: Lamp, camera: Vector, count: int) -> list[Sample]:
    away = minus(column(lamp.matrix, 3), camera)
    distance, radius = length(away), lamp.radius
    if distance <= max(radius, 1e-9):
        return []
    power = lamp.power
    if not lamp.normalized:
        power *= 4.0 * pi * radius**2 if radius > 0.0 else 4.0
    # a disc that faces the camera, or a sphere
    square = distance**2 + (radius**2 if lamp.soft else 0.0)
    number = count if radius > 0.0 else 1
    share = power / (4.0 * pi * square) / number
    direction = unit(away)
    right, up = two_across(direction)
    found = []
    for x, y in _disc(number):
        place = plus(away, plus(times(right, x * radius), times(up, y * radius)))
        part = share if lamp.kind == "POINT" else share * _spot_part(lamp, times(place, -1.0))
        if part > 0.0:
            found.append(Sample(unit(place), length(place), part))
    return found


def _spot_part(lamp: Lamp, ray: Vector) -> float:
    """Return the part of a spot's light along a ray from it: 1 inside the cone, falling over its soft edge."""
    # a scaled spot has a cone of elliptic section: the ray is turned into the lamp's own, unscaled space
    local = []
    for k in range(3):
        axis = column(lamp.matrix, k)
        local.append(dot(ray, axis) / dot(axis, axis))
    cosine = -local[2] / max(sqrt(sum(part * part for part in local)), 1e-300)
    edge = cos(0.5 * lamp.spot_angle)
    soft = (1.0 - edge) * lamp.spot_blend
    if cosine <= edge:
        return 0.0
    inside = min((cosine - edge) / soft, 1.0) if soft > 0.0 else 1.0
    return inside * inside * (3.0 - 2.0 * inside)


def _area_size(lamp: Lamp) -> tuple[float, float, float]:
    """Return width, height and area of an area lamp in the world."""
    high = lamp.size[0] if lamp.shape in ("SQUARE", "DISK") else lamp.size[1]
    across = lamp.size[0] * length(column(lamp.matrix, 0))
    down = high * length(column(lamp.matrix, 1))
    return across, down, across * down * (0.25 * pi if lamp.shape in ("DISK", "ELLIPSE") else 1.0)


def _area(lamp: Lamp, camera: Vector, count: int) -> list[Sample]:
    across, down, area = _area_size(lamp)
    if area <= 0.0:
        return []
    right, up, back = (unit(column(lamp.matrix, k)) for k in range(3))
    middle = minus(column(lamp.matrix, 3), camera)
    facing = unit(middle)
    radiance = lamp.power / pi if not lamp.normalized else lamp.power / (pi * area)
    half = 0.5 * lamp.spread
    if half < _LEAST_SPREAD:
        return _parallel(lamp, middle, radiance)
    found = []
    for x, y in _disc(count) if lamp.shape in ("DISK", "ELLIPSE") else _square(count):
        place = plus(middle, plus(times(right, 0.5 * across * x), times(up, 0.5 * down * y)))
        distance = length(place)
        direction = unit(place)
        # an area shines along its -z
        leaving = dot(direction, back)
        part = radiance * leaving * dot(direction, facing) * area / (distance**2 * count) if leaving > 0.0 else 0.0
        part *= _spread_part(half, leaving)
        if part > 0.0:
            found.append(Sample(direction, distance, part))
    return found


def _spread_part(half: float, cosine: float) -> float:
    """Return the factor of the radiance of an area behind a grid that lets light within an angle pass."""
    if half >= 0.5 * pi - 1e-6 or cosine <= 0.0:
        return 1.0
    slope = sqrt(max(1.0 - cosine**2, 0.0)) / cosine
    return max(tan(half) - slope, 0.0) / (tan(half) - half)


def _parallel(lamp: Lamp, middle: Vector, radiance: float) -> list[Sample]:
    """Return the light of an area that shines in parallel, which only a camera in its beam sees."""
    across, down, _ = _area_size(lamp)
    right, up, back = (unit(column(lamp.matrix, k)) for k in range(3))
    x, y, distance = dot(middle, right) / (0.5 * across), dot(middle, up) / (0.5 * down), dot(middle, back)
    outside = hypot(x, y) if lamp.shape in ("DISK", "ELLIPSE") else max(abs(x), abs(y))
    return [Sample(back, distance, pi * radiance)] if outside <= 1.0 and distance > 0.0 else []


def mesh_samples(triangles: Sequence[tuple[Vector, Vector, Vector]], camera: Vector, count: int) -> list[Sample]:
    """Return parts of a glowing surface of radiance 1 with the irradiance of each at the camera.

    Parameters
    ----------
    triangles : sequence
        Corners in the world. Both sides glow.
    camera : tuple of float
    count : int

    Returns
    -------
    list of Sample
        Points evenly spread over the surface. Those on its back are not left out: the caller finds out what is seen.
    """
    areas = [0.5 * length(cross(minus(b, a), minus(c, a))) for a, b, c in triangles]
    total = sum(areas)
    if total <= 0.0:
        return []
    found = []
    passed, k = 0.0, 0
    facing = unit(minus(_centre(triangles, areas), camera))
    for n in range(count):
        at = (n + 0.5) / count * total
        while k < len(areas) - 1 and passed + areas[k] < at:
            passed, k = passed + areas[k], k + 1
        a, b, c = triangles[k]
        # an even lattice folded into the triangle
        u, v = ((n + 1) * _LATTICE[0]) % 1.0, ((n + 1) * _LATTICE[1]) % 1.0
        if u + v > 1.0:
            u, v = 1.0 - u, 1.0 - v
        ab, ac = minus(b, a), minus(c, a)
        away = minus(plus(a, plus(times(ab, u), times(ac, v))), camera)
        distance, direction = length(away), unit(away)
        if distance <= 0.0:
            continue
        leaving = abs(dot(direction, unit(cross(ab, ac))))
        found.append(
            Sample(direction, distance, total / count * leaving * max(dot(direction, facing), 0.0) / distance**2)
        )
    return found


def _centre(triangles: Sequence[tuple[Vector, Vector, Vector]], areas: Sequence[float]) -> Vector:
    """Return the centre of a surface."""
    middle: Vector = (0.0, 0.0, 0.0)
    for corners, area in zip(triangles, areas, strict=True):
        for corner in corners:
            middle = plus(middle, times(corner, area / 3.0))
    return times(middle, 1.0 / sum(areas))


def _disc(count: int) -> list[tuple[float, float]]:
    """Return points evenly spread over a disc of radius 1; the middle for one."""
    if count == 1:
        return [(0.0, 0.0)]
    found = []
    for k in range(count):
        radius = sqrt((k + 0.5) / count)
        found.append((radius * cos(k * _GOLDEN_ANGLE), radius * sin(k * _GOLDEN_ANGLE)))
    return found


def _square(count: int) -> list[tuple[float, float]]:
    """Return points evenly spread over a square from -1 to 1; the middle for one."""
    steps = [(k + 1) * _LATTICE[0] % 1.0 for k in range(count)], [(k + 0.5) / count for k in range(count)]
    return [(0.0, 0.0)] if count == 1 else [(2.0 * x - 1.0, 2.0 * y - 1.0) for x, y in zip(*steps, strict=True)]
