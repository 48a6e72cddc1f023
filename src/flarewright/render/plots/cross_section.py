"""The cross-section of a lens as SVG: glass, stop, sensor, rays and, optionally, one ghost path."""

from __future__ import annotations

import html
from dataclasses import dataclass, field
from math import cos, hypot, radians, sin, sqrt, tan

import numpy as np

from ...errors import ProjectError
from ...model import Iris, Lens, Row, Surface
from ...optics.lens.paraxial import FirstOrder, vertex_positions
from ...optics.lens.surface_shape import sag, surface_frames
from ...optics.pupil.iris import iris_outline
from ...typing import Floats

WIDTH_PX = 900.0
_MARGIN_PX = 34.0
_HEAD_PX = 62.0
_FOOT_PX = 44.0
_TALLEST_PX = 460.0
# largest angle of drawn rays: steeper ones run almost vertically, and those above 90 degrees come from behind
_STEEPEST_DEG = 85.0
_RAYS = 7
# candidate rays, and the number if fewer than `_RAYS` pass, as for a ghost that fills little of the entrance
_CANDIDATES, _MORE_CANDIDATES = 401, 8001

_INK, _FAINT, _PAPER = "#22313f", "#8796a5", "#fbfcfd"
_AXIS_RAYS, _FIELD_RAYS, _GHOST_RAYS = "#2f7fd1", "#e08a1e", "#c8313b"
_CROWN, _FLINT, _EDGE = "#cfe4f3", "#cbd8c4", "#51718c"


@dataclass(frozen=True)
class Drawing:
    """SVG text, and remarks about what could not be drawn."""

    svg: str
    remarks: tuple[str, ...]


@dataclass
class _Canvas:
    """The map from millimetres to pixels, and the elements drawn so far."""

    scale: float
    left: float
    middle: float
    parts: list[str] = field(default_factory=list)

    def at(self, z: float, y: float) -> tuple[float, float]:
        return self.left + z * self.scale, self.middle - y * self.scale

    def line(self, points: Floats, style: str) -> None:
        text = " ".join(f"{px:.2f},{py:.2f}" for px, py in (self.at(z, y) for z, y in points))
        self.parts.append(f'<polyline points="{text}" fill="none" {style}/>')

    def text(self, px: float, py: float, words: str, style: str) -> None:
        self.parts.append(f'<text x="{px:.2f}" y="{py:.2f}" {style}>{html.escape(words)}</text>')


def cross_section(
    lens: Lens,
    order: FirstOrder,
    *,
    field_deg: tuple[float, float] | None = None,
    ghost: tuple[int, int] | None = None,
    iris: Iris | None = None,
) -> Drawing:
    """Draw a lens from the side, with light from the left.

    Parameters
    ----------
    lens : Lens
        With all semi-diameters.
    order : FirstOrder
        Gives stop diameter and sensor position.
    field_deg : tuple of float, optional
        Angles of a light whose rays are drawn besides the axial ones; None: the field of the lens, if known.
    ghost : tuple of int, optional
        Rows (j, i) of a ghost path to draw; j = len(lens.rows) is the sensor.
    iris : Iris, optional
        If no other rays pass, draw those that pass only its corners; None: round.

    Returns
    -------
    Drawing
        SVG, 900 px wide.

    Raises
    ------
    ProjectError
        `ghost` is not a two-reflection path of this lens.
    """
    if ghost is not None:
        _check_ghost(lens, ghost)
    z = vertex_positions(lens)
    sensor_z = float(z[-1]) + order.sensor_distance
    semi = [_semi(row, order) for row in lens.rows]
    wanted = hypot(*field_deg) if field_deg is not None else (lens.field_deg or 0.0)
    angle = min(wanted, _STEEPEST_DEG)
    lead = 0.16 * max(sensor_z, 2.0 * max(semi))
    image = min(order.efl * tan(radians(min(angle, 60.0))), 2.0 * max(semi))
    half = 1.08 * max(*semi, image, 0.12 * sensor_z)
    scale = min((WIDTH_PX - 2 * _MARGIN_PX) / (sensor_z + lead), _TALLEST_PX / (2 * half))
    left = (WIDTH_PX - scale * (sensor_z + lead)) / 2 + scale * lead
    canvas = _Canvas(scale, left, _HEAD_PX + half * scale)
    height = _HEAD_PX + 2 * half * scale + _FOOT_PX

    canvas.line(np.array([[-lead, 0.0], [sensor_z, 0.0]]), f'stroke="{_FAINT}" stroke-dasharray="9 3 2 3"')
    for k in range(len(lens.rows)):
        _draw_glass(canvas, lens, z, semi, k)
    # Steep rays come from far above; clip them to the area between head and foot.
    canvas.parts.append('<g clip-path="url(#sheet)">')
    remarks = [] if angle == wanted else [f"a light at {wanted:g} degrees is too steep to draw and taken at {angle:g}"]
    remarks += _draw_fans(canvas, lens, order, lead, angle, ghost, _corner(iris))
    canvas.parts.append("</g>")
    _draw_surfaces(canvas, lens, z, semi)
    _draw_stop(canvas, float(z[lens.stop_row]), order.stop_semi_diameter, _blade_reach(lens, semi, order))
    canvas.line(np.array([[sensor_z, -half / 1.08], [sensor_z, half / 1.08]]), f'stroke="{_INK}" stroke-width="2.5"')
    _label(canvas, lens, order, angle, ghost, height)
    body = "\n".join(canvas.parts)
    return Drawing(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX:.0f} {height:.0f}" '
        f'width="{WIDTH_PX:.0f}" height="{height:.0f}" font-family="Helvetica, Arial, sans-serif">\n'
        f"<title>{html.escape(lens.name)}</title>\n"
        f'<clipPath id="sheet"><rect x="0" y="{_HEAD_PX - 26:.0f}" width="{WIDTH_PX:.0f}" '
        f'height="{2 * half * scale + 40:.0f}"/></clipPath>\n'
        f'<rect width="100%" height="100%" fill="{_PAPER}"/>\n{body}\n</svg>\n',
        tuple(remarks),
    )


def _check_ghost(lens: Lens, ghost: tuple[int, int]) -> None:
    j, i = ghost
    last = len(lens.rows) - 1
    if not 0 <= i < j <= last + 1 or lens.stop_row in ghost:
        raise ProjectError(
            f"{_name(lens, ghost)} is not a ghost of {lens.name}: a path J-I reflects at row J or at the sensor, then "
            f"at row I < J, both between 0 and {last} and neither the stop (row {lens.stop_row})"
        )


def _name(lens: Lens, ghost: tuple[int, int]) -> str:
    return f"{'sensor' if ghost[0] == len(lens.rows) else ghost[0]}-{ghost[1]}"


def _semi(row: object, order: FirstOrder) -> float:
    if isinstance(row, Surface):
        return row.semi_diameter or order.entrance_pupil_diameter / 2
    return order.stop_semi_diameter


def _profile(row: Row, vertex: float, semi: float, place: tuple[Floats, Floats]) -> Floats:
    """Return points (z, y) along a surface, from its lower to its upper edge."""
    y = np.linspace(-semi, semi, 65)
    own = np.stack([np.zeros_like(y), y, sag(row, np.zeros_like(y), y)], axis=1)
    # A decentred or tilted surface is cut in the drawing plane; its depth is ignored.
    origin, axes = place
    seen = own @ axes + origin
    return np.stack([vertex + seen[:, 2], seen[:, 1]], axis=1)


def _draw_glass(canvas: _Canvas, lens: Lens, z: Floats, semi: list[float], k: int) -> None:
    """Fill the glass between a row and the next surface."""
    row = lens.rows[k]
    if not isinstance(row, Surface) or row.medium is None:
        return
    at = surface_frames(lens)
    front = _profile(row, float(z[k]), semi[k], at[k])
    back = _profile(lens.rows[k + 1], float(z[k + 1]), semi[k + 1], at[k + 1])
    top, bottom = max(front[-1, 1], back[-1, 1]), min(front[0, 1], back[0, 1])
    outline = [
        *front, [front[-1, 0], top], [back[-1, 0], top], *back[::-1], [back[0, 0], bottom], [front[0, 0], bottom],
    ]  # fmt: skip
    flint = row.medium.v_d is not None and row.medium.v_d < 50.0
    points = " ".join(f"{px:.2f},{py:.2f}" for px, py in (canvas.at(a, b) for a, b in outline))
    canvas.parts.append(
        f'<polygon points="{points}" fill="{_FLINT if flint else _CROWN}" fill-opacity="0.85" '
        f'stroke="{_EDGE}" stroke-width="0.8" stroke-linejoin="round"/>'
    )


def _draw_surfaces(canvas: _Canvas, lens: Lens, z: Floats, semi: list[float]) -> None:
    """Draw every refracting surface over the rays, and the row numbers above the glass."""
    top = canvas.middle - max(semi) * canvas.scale
    previous = -100.0
    at = surface_frames(lens)
    level = 0
    for k, row in enumerate(lens.rows):
        if isinstance(row, Surface):
            canvas.line(_profile(row, float(z[k]), semi[k], at[k]), f'stroke="{_EDGE}" stroke-width="1.3"')
        px, _ = canvas.at(float(z[k]), 0.0)
        # Stagger the numbers of close rows so that they stay legible.
        level = (level + 1) % 3 if px - previous < 13.0 else 0
        previous = px
        canvas.text(px, top - 6.0 - 10.0 * level, str(k), f'font-size="9" text-anchor="middle" fill="{_FAINT}"')


def _blade_reach(lens: Lens, semi: list[float], order: FirstOrder) -> float:
    """Return the outer end of the drawn blades: the edge of the neighbouring glass."""
    k = lens.stop_row
    near = [semi[j] for j in (k - 1, k + 1) if 0 <= j < len(semi)]
    return max(1.05 * max(near), 1.25 * order.stop_semi_diameter)


def _draw_stop(canvas: _Canvas, z: float, opening: float, reach: float) -> None:
    for side in (1.0, -1.0):
        canvas.line(np.array([[z, side * opening], [z, side * reach]]), f'stroke="{_INK}" stroke-width="3"')
        tip = 5.0 / canvas.scale
        canvas.line(
            np.array([[z - tip, side * opening], [z + tip, side * opening]]), f'stroke="{_INK}" stroke-width="1.5"'
        )


def _corner(iris: Iris | None) -> float:
    """Return the largest radius of the opening relative to the round one."""
    if iris is None:
        return 1.0
    if iris.mask is not None:
        # a mask covers the square around the round opening
        return sqrt(2.0)
    return float(np.hypot(*iris_outline(iris, 1.0).T).max())


def _draw_fans(
    canvas: _Canvas,
    lens: Lens,
    order: FirstOrder,
    lead: float,
    angle: float,
    ghost: tuple[int, int] | None,
    corner: float,
) -> list[str]:
    """Draw the axial, field and ghost rays; return remarks on paths that no ray passes."""
    remarks: list[str] = []
    fans: list[tuple[float, tuple[int, int] | None, str]] = [(0.0, None, _AXIS_RAYS)]
    if ghost is not None:
        # With a ghost, draw no field rays: too many lines.
        fans.append((angle, ghost, _GHOST_RAYS))
    elif angle:
        fans.append((angle, None, _FIELD_RAYS))
    for angle_deg, path, colour in fans:
        rays = _fan(lens, order, angle_deg, path)
        if not len(rays) and path is not None and corner > 1.0:
            rays = _fan(lens, order, angle_deg, path, corner)
        if not len(rays):
            what = f"the ghost {_name(lens, path)}" if path else "the direct path"
            remarks.append(f"no ray of {what} gets through at {angle_deg:g} degrees, so none is drawn")
        for points in rays:
            direction = np.array([cos(radians(angle_deg)), -sin(radians(angle_deg))])
            before = points[0] - direction * (points[0, 0] + lead) / direction[0]
            canvas.line(
                np.vstack([before, points]),
                f'stroke="{colour}" stroke-width="{1.3 if path else 0.9}" stroke-opacity="0.8" stroke-linejoin="round"',
            )
    return remarks


def _fan(
    lens: Lens, order: FirstOrder, angle_deg: float, ghost: tuple[int, int] | None, corner: float = 1.0
) -> list[Floats]:
    """Return the polylines (z, y) of a few rays that pass, spread over the opening."""
    for tried in (_CANDIDATES, _MORE_CANDIDATES):
        hits = _passing(lens, order, angle_deg, ghost, corner, tried)
        if len(hits) >= _RAYS:
            break
    if not len(hits):
        return []
    chosen = np.unique(np.linspace(0, len(hits) - 1, _RAYS).round().astype(int))
    # Start at the first surface, not at the plane of the first vertex.
    return [np.stack([hits[k, 1:, 2], hits[k, 1:, 1]], axis=1) for k in chosen]


def _passing(
    lens: Lens, order: FirstOrder, angle_deg: float, ghost: tuple[int, int] | None, corner: float, tried: int
) -> Floats:
    """Trace candidate rays and return the hits (x, y, z) of those that pass all edges."""
    from ...optics.lens.paths import direct_path, ghost_path, sensor_path
    from ...optics.rays.single_rays import trace_polylines

    sensor = len(lens.rows)
    path = direct_path(lens)
    if ghost is not None:
        path = sensor_path(lens, ghost[1]) if ghost[0] == sensor else ghost_path(lens, *ghost)
    first = lens.rows[0]
    limit = _semi(first, order)
    # Rays start on the plane of the first vertex; oblique ones can enter a bulging front from farther out.
    reach = limit * (1.0 + abs(tan(radians(angle_deg))))
    y = np.linspace(-reach, reach, tried)
    hits = trace_polylines(lens, ghost, np.zeros_like(y), y, -radians(angle_deg), sensor_distance=order.sensor_distance)
    # the sensor is unbounded here and clips nothing
    semi = np.array([np.inf if row == sensor else _semi(lens.rows[row], order) for row in path.rows])
    semi[path.rows == lens.stop_row] *= corner
    radius = np.hypot(hits[:, 1:-1, 0], hits[:, 1:-1, 1])
    with np.errstate(invalid="ignore"):
        through = (radius <= semi * (1 + 1e-9)).all(axis=1) & np.isfinite(hits).all(axis=(1, 2))
    return np.asarray(hits[through])


def _label(
    canvas: _Canvas, lens: Lens, order: FirstOrder, angle: float, ghost: tuple[int, int] | None, height: float
) -> None:
    canvas.text(_MARGIN_PX, 26.0, lens.name, f'font-size="16" font-weight="bold" fill="{_INK}"')
    facts = f"focal length {order.efl:.2f} mm · f/{order.f_number:g} · back focus {order.bfl:.2f} mm"
    canvas.text(WIDTH_PX - _MARGIN_PX, 26.0, facts, f'font-size="12" text-anchor="end" fill="{_INK}"')
    foot = height - 16.0
    legend = [(_AXIS_RAYS, "axis")]
    if ghost is not None:
        legend.append((_GHOST_RAYS, f"ghost {_name(lens, ghost)}, light at {angle:g}°"))
    elif angle:
        legend.append((_FIELD_RAYS, f"light at {angle:g}°"))
    at = _MARGIN_PX
    for colour, words in legend:
        canvas.parts.append(
            f'<line x1="{at}" y1="{foot - 4}" x2="{at + 22}" y2="{foot - 4}" stroke="{colour}" stroke-width="2"/>'
        )
        canvas.text(at + 28, foot, words, f'font-size="11" fill="{_INK}"')
        at += 46 + 6.2 * len(words)
    steps = (200.0, 100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5)
    bar = next((step for step in steps if step * canvas.scale < 160), steps[-1])
    right = WIDTH_PX - _MARGIN_PX
    canvas.parts.append(
        f'<line x1="{right - bar * canvas.scale:.2f}" y1="{foot - 4}" x2="{right}" y2="{foot - 4}" '
        f'stroke="{_INK}" stroke-width="2"/>'
    )
    canvas.text(right - bar * canvas.scale - 6, foot, f"{bar:g} mm", f'font-size="11" text-anchor="end" fill="{_INK}"')
