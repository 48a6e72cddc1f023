"""Shape and pose of every row: sag, and the shape table for the tracing kernels."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from ...errors import LensError
from ...kernels.tracing.intersect import (
    ASPHERE,
    AXES,
    CENTRED,
    CONIC,
    CONIC_X,
    CONIC_Y,
    CURVATURE_X,
    CURVATURE_Y,
    DEGREE,
    HALF,
    HEIGHTS,
    KIND,
    ODD,
    ODD_COUNT,
    ORIGIN,
    POLYNOMIAL,
    SAG,
    SCALE,
    SIDE,
    TANGENT,
    TORUS,
)
from ...model import Element, Lens, Stop, Surface
from ...typing import Floats
from .zernike import MOST_DEGREE, figure_polynomial

NM = 1e-6
# an asphere continues as its tangent from this multiple of its semi-diameter; rays there are blocked but still traced
ROOM = 1.1


def is_surface_of_revolution(row: Surface | Stop) -> bool:
    """Return whether a row is a surface of revolution around its own axis without figure error, or the stop."""
    return isinstance(row, Stop) or not (row.toroidal or row.figure is not None)


def has_rotational_symmetry(lens: Lens) -> bool:
    """Return whether a lens has rotational symmetry, so that half a bundle suffices."""
    moved = any(element.displaced for element in lens.elements)
    return not moved and all(
        is_surface_of_revolution(row) and not getattr(row, "displaced", False) for row in lens.rows
    )


def curvature_across(lens: Lens) -> Floats | None:
    """Return each row's curvature in the x-z plane, shape (K,); None when all equal those in the y-z plane."""
    across = [0.0 if isinstance(row, Stop) else row.meridian_x[0] for row in lens.rows]
    along = [0.0 if isinstance(row, Stop) else row.curvature for row in lens.rows]
    return None if across == along else np.array(across)


def ideal(lens: Lens) -> Lens:
    """Return the nominal lens: no decentre, tilt or figure errors."""
    if not lens.elements and not any(isinstance(row, Surface) and (row.displaced or row.figure) for row in lens.rows):
        return lens
    rows = [
        row.replace(decentre=None, tilt_deg=None, figure=None) if isinstance(row, Surface) else row for row in lens.rows
    ]
    return lens.replace(rows=tuple(rows), elements=())


def transposed(lens: Lens) -> Lens:
    """Return the ideal lens with its two meridians exchanged; a torus becomes a biconic surface of both curvatures."""

    def exchange(row: Surface | Stop) -> Surface | Stop:
        if not (isinstance(row, Surface) and row.toroidal):
            return row
        curvature, conic = row.meridian_x
        exchanged = {"curvature": curvature, "conic": conic, "curvature_x": row.curvature, "conic_x": row.conic}
        # the circle of a torus has no terms
        return row.replace(**exchanged, torus=False, asphere=() if row.torus else row.asphere)

    plain = ideal(lens)
    return plain.replace(rows=tuple(exchange(row) for row in plain.rows))


def sag(row: Surface | Stop, x: Floats, y: Floats) -> Floats:
    """Return the height of a row's ideal form over the plane of its vertex.

    Parameters
    ----------
    row : Surface or Stop
    x, y : ndarray
        mm, broadcast against each other.

    Returns
    -------
    ndarray
        mm; without meaning beyond the equator of a sphere, where there is no surface.

    Notes
    -----
    The same as `kernels.tracing.intersect.sag_of_shape` (tests/optics/lens/test_surface_shape.py compares them), but on
    whole arrays and without compilation.
    """
    if isinstance(row, Stop):
        return np.zeros(np.broadcast(x, y).shape)
    (cx, kx), cy, ky = row.meridian_x, row.curvature, row.conic
    if row.torus:
        profile = cy * y**2 / (1.0 + np.sqrt(np.maximum(1.0 - (1.0 + ky) * cy**2 * y**2, 0.0)))
        profile = profile + sum(term * y ** (2 * k + 4) for k, term in enumerate(row.asphere))
        beside = 1.0 - cx * profile
        around = np.sqrt(np.maximum(beside**2 - cx**2 * x**2, 0.0))
        return np.asarray((profile * (1.0 + beside) + cx * x**2) / (1.0 + around))
    room = 1.0 - (1.0 + kx) * cx**2 * x**2 - (1.0 + ky) * cy**2 * y**2
    found: Floats = (cx * x**2 + cy * y**2) / (1.0 + np.sqrt(np.maximum(room, 0.0)))
    r2 = x**2 + y**2
    for k, term in enumerate(row.asphere):
        found = found + term * r2 ** (k + 2)
    for k, term in enumerate(row.odd_asphere):
        found = found + term * r2 ** (k + 1.5)
    return found


def shape_table(lens: Lens) -> Floats | None:
    """Return shape and pose of every row for `kernels.tracing.general_ray`.

    Returns
    -------
    ndarray, shape (K, P), or None
        In the lens' frame; None when every row is a centred conic of revolution, which needs no table.

    Raises
    ------
    LensError
        When the image of a figure has not been read, or a row with a figure error has no semi-diameter.
    """
    if has_rotational_symmetry(lens) and not any(
        isinstance(row, Surface) and (row.asphere or row.odd_asphere) for row in lens.rows
    ):
        return None
    most = max((len(_heights(row)) ** 2 for row in lens.rows), default=0)
    table = np.zeros((len(lens.rows), HEIGHTS + most))
    table[:, TANGENT], table[:, DEGREE] = np.inf, -1.0
    table[:, AXES : AXES + 9] = np.eye(3).ravel()
    at = surface_frames(lens)
    for k, row in enumerate(lens.rows):
        if isinstance(row, Stop):
            continue
        origin, axes = at[k]
        entry = table[k]
        entry[ORIGIN : ORIGIN + 3], entry[AXES : AXES + 9] = origin, axes.ravel()
        entry[CURVATURE_X], entry[CONIC_X] = row.meridian_x
        entry[CURVATURE_Y], entry[CONIC_Y] = row.curvature, row.conic
        entry[TORUS] = row.torus
        moved = bool(np.any(origin != 0.0) or np.any(axes != np.eye(3)))
        entry[KIND] = (
            SAG if row.asphere or row.odd_asphere or not is_surface_of_revolution(row) else CONIC if moved else CENTRED
        )
        entry[ASPHERE : ASPHERE + len(row.asphere)] = row.asphere
        entry[ODD_COUNT] = len(row.odd_asphere)
        entry[ODD : ODD + len(row.odd_asphere)] = row.odd_asphere
        if row.semi_diameter is not None:
            entry[TANGENT] = (ROOM * row.semi_diameter) ** 2
        if row.figure is not None:
            _write_figure(entry, row, f"{lens.name}, row {k}")
    return table


def _heights(row: Surface | Stop) -> tuple[tuple[float, ...], ...]:
    return () if isinstance(row, Stop) or row.figure is None else (row.figure.heights or ())


def _write_figure(entry: Floats, row: Surface, where: str) -> None:
    figure = row.figure
    assert figure is not None
    if row.semi_diameter is None:
        raise LensError(f"{where}: a figure error needs the semi-diameter, which is missing; give semi_diameter")
    if figure.zernike_nm:
        entry[SCALE], entry[DEGREE] = 1.0 / row.semi_diameter, MOST_DEGREE
        coefficients = figure_polynomial(figure.zernike_nm) * NM
        entry[POLYNOMIAL : POLYNOMIAL + coefficients.size] = coefficients.ravel()
    if figure.image is None:
        return
    if figure.heights is None:
        raise LensError(f"{where}: the figure's image {figure.image} has not been read; load the lens with load_lens")
    assert figure.peak_valley_nm is not None
    heights = np.array(figure.heights) * figure.peak_valley_nm * NM
    entry[SIDE], entry[HALF] = len(heights), row.semi_diameter
    entry[HEIGHTS : HEIGHTS + heights.size] = heights.ravel()


def surface_frames(lens: Lens) -> list[tuple[Floats, Floats]]:
    """Return each row's vertex relative to its place on the axis, and its local axes as rows of a matrix."""
    z = np.concatenate([[0.0], np.cumsum([row.thickness for row in lens.rows[:-1]])])
    element_of: dict[int, Element] = {
        row: element for element in lens.elements for row in range(element.rows[0], element.rows[1] + 1)
    }
    found = []
    for k, row in enumerate(lens.rows):
        origin, turn = np.zeros(3), np.eye(3)
        if isinstance(row, Surface) and row.displaced:
            origin[:2] = row.decentre or (0.0, 0.0)
            turn = _turn(row.tilt_deg or (0.0, 0.0))
        element = element_of.get(k)
        if element is not None and element.displaced:
            # an element rotates about the vertex of its first row, together with its rows
            whole = _turn(element.tilt_deg)
            lever = np.array([0.0, 0.0, z[k] - z[element.rows[0]]])
            origin = whole @ (origin + lever) - lever + np.array([*element.decentre, 0.0])
            turn = whole @ turn
        found.append((origin, turn.T))
    return found


def _turn(tilt_deg: tuple[float, float]) -> Floats:
    """Return the rotation about the x axis, then about the lens' y axis; right-handed."""
    a, b = radians(tilt_deg[0]), radians(tilt_deg[1])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos(a), -sin(a)], [0.0, sin(a), cos(a)]])
    about_y = np.array([[cos(b), 0.0, sin(b)], [0.0, 1.0, 0.0], [-sin(b), 0.0, cos(b)]])
    both: Floats = about_y @ about_x
    return both


def seen_along(table: Floats, axes: Floats) -> Floats:
    """Rotate a shape table into the meridional frame of a light.

    Parameters
    ----------
    table : ndarray, shape (K, P)
        In the lens' frame.
    axes : ndarray, shape (2, 2)
        `optics.rays.bundle.Incidence.axes`.

    Returns
    -------
    ndarray, shape (K, P)
    """
    turn = np.eye(3)
    turn[:2, :2] = axes
    seen: Floats = table.copy()
    seen[:, ORIGIN : ORIGIN + 3] = table[:, ORIGIN : ORIGIN + 3] @ turn.T
    seen[:, AXES : AXES + 9] = (table[:, AXES : AXES + 9].reshape(-1, 3, 3) @ turn.T).reshape(-1, 9)
    return seen
