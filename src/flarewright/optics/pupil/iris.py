"""The opening at the stop: blades as implicit curves, its outline, and its antialiased transmittance.

Coordinates are those of the stop plane seen from behind the camera: x to the right, y up. Every opening made of blades
has the area of the round one, pi h^2, with h the semi-diameter of the stop.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...kernels.diffraction.image_lines import sum_lines
from ...model.lens.iris import Iris
from ...typing import Floats, Pixels

# lines of points that an image is read at together
_LINES = 64


def blade_edges(iris: Iris, semi_diameter: float) -> Floats:
    """Return the blades of the opening as implicit functions.

    Parameters
    ----------
    iris : Iris
        Its mask image is ignored.
    semi_diameter : float
        Semi-diameter h of the round opening of the same area, mm.

    Returns
    -------
    ndarray of float64, shape (B, 4)
        Rows (nx, ny, offset, curvature), one per blade, one for a round opening. With q = p - offset n, the point p is
        inside where f = n.q + curvature/2 |q|^2 <= 0 for every row. |grad f| = 1 on the border, so f is the signed
        distance near it. Curvature 0 is a straight blade.

    Raises
    ------
    ValueError
        When the semi-diameter is not positive.

    Notes
    -----
    The first edge faces up (+y), the others follow counter-clockwise. `rounding` r gives every blade the radius
    offset / r, so r = 1 is exactly the circle. The scale follows from the area of the polygon of arcs in closed form.
    """
    if not semi_diameter > 0.0:
        raise ValueError(f"the stop's semi-diameter must be positive, not {semi_diameter}")
    if iris.blades == 0 or iris.rounding == 1.0:
        return np.array([[0.0, 1.0, semi_diameter, 1.0 / semi_diameter]])
    offset = semi_diameter * math.sqrt(math.pi / _area_of_unit_apothem(iris.blades, iris.rounding))
    angle = math.pi / 2 + math.radians(iris.rotation_deg) + 2.0 * math.pi * np.arange(iris.blades) / iris.blades
    edges = np.empty((iris.blades, 4))
    edges[:, 0], edges[:, 1] = np.cos(angle), np.sin(angle)
    edges[:, 2] = offset
    edges[:, 3] = iris.rounding / offset
    return edges


def iris_outline(iris: Iris, semi_diameter: float, points: int = 180) -> Floats:
    """Return the border of the opening as a closed polyline, counter-clockwise.

    Parameters
    ----------
    iris : Iris
    semi_diameter : float
        As in `blade_edges`, mm.
    points : int
        Number of points; each blade gets an equal number, corners included, so the result can have a few more.

    Returns
    -------
    ndarray of float64, shape (P, 2)
        Points on the border; the last one connects to the first.

    Raises
    ------
    ValueError
        When `points` is below 3.
    """
    if points < 3:
        raise ValueError(f"an outline needs at least 3 points, not {points}")
    edges = blade_edges(iris, semi_diameter)
    if len(edges) == 1:
        turn = 2.0 * np.pi * np.arange(points) / points
        return semi_diameter * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    B = len(edges)
    each = -(-points // B)
    half = math.pi / B
    # equal steps of the polar angle, from one corner to just before the next
    theta = half * (2.0 * np.arange(each) / each - 1.0)
    radius = edges[0, 2] * _ray_length(np.cos(theta), float(edges[0, 3] * edges[0, 2]))
    turn = np.arctan2(edges[:, 1], edges[:, 0])[:, None] + theta
    line: Floats = (radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)).reshape(-1, 2)
    return line


def transmission(
    iris: Iris,
    semi_diameter: float,
    x: ArrayLike,
    y: ArrayLike,
    *,
    footprint: float = 0.0,
    mask: NDArray[np.floating] | None = None,
) -> Floats:
    """Return the transmittance of the stop at some points, antialiased.

    Parameters
    ----------
    iris : Iris
    semi_diameter : float
        Semi-diameter of the round opening, mm.
    x, y : array_like
        Points in the stop plane, mm; they broadcast.
    footprint : float
        Width of the area that a point represents, mm: borders are ramps of this width along their normal. 0 is a hard
        border. Ignored with a mask, whose pixels are interpolated linearly.
    mask : ndarray, shape (rows, columns), or None
        Grey image, 1 transmits, row 0 at the top; it spans the square around the round opening and is dark outside.
        `rotation_deg` rotates it like blades.

    Returns
    -------
    ndarray of float64
        Transmittance, 0 to 1 for a mask within 0 to 1.
    """
    px, py = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if mask is not None:
        px, py = np.broadcast_arrays(px / semi_diameter, py / semi_diameter)
        return _look_up(mask, iris.rotation_deg, px, py)
    return coverage(blade_edges(iris, semi_diameter), px, py, footprint)


def coverage(edges: Floats, x: Floats, y: Floats, footprint: float) -> Floats:
    """Return the fraction of a footprint that lies within equal blades.

    Parameters
    ----------
    edges : ndarray, shape (B, 4)
        From `blade_edges`.
    x, y : ndarray
        Points in the stop plane, mm; they broadcast.
    footprint : float
        As in `transmission`.

    Returns
    -------
    ndarray of float64
        0 to 1.
    """
    worst = _border_value(edges, x, y)
    if footprint <= 0.0:
        return np.where(worst <= 0.0, 1.0, 0.0)
    worst *= -1.0 / footprint
    worst += 0.5
    return np.clip(worst, 0.0, 1.0, out=worst)


def softened(ramp: Floats) -> Floats:
    """Turn borders that are linear ramps, the integral of a box, into those of a triangle, in place.

    Parameters
    ----------
    ramp : ndarray
        From `coverage` with a footprint; modified in place to save memory.

    Returns
    -------
    ndarray
        The same array.
    """
    border = (ramp > 0.0) & (ramp < 1.0)
    t = ramp[border]
    ramp[border] = np.where(t < 0.5, 2.0 * t**2, 1.0 - 2.0 * (1.0 - t) ** 2)
    return ramp


def resampled(image: Pixels, half: float, x: Floats, y: Floats) -> Pixels:
    """Average an image over triangles two samples wide.

    Parameters
    ----------
    image : ndarray, shape (rows, columns), float32
        Row 0 at the top; it spans [-half, half] squared, is linear between its pixels' centres and 0 outside.
    half : float
    x, y : ndarray, shapes (Nx,) and (Ny,)
        Evenly spaced, ascending.

    Returns
    -------
    ndarray of float32, shape (Ny, Nx)
    """
    lines, down = _triangles(y / half, image.shape[0])
    columns, across = _triangles(x / half, image.shape[1])
    out = np.zeros((len(y), len(x)), dtype=np.float32)
    # samples beyond the image stay 0, and what lies beyond the samples does not count
    rows_lit, columns_lit = _lit(down), _lit(across)
    if rows_lit.stop == 0 or columns_lit.stop == 0:
        return out
    lines, down, columns, across = lines[rows_lit], down[rows_lit], columns[columns_lit], across[columns_lit]
    used = columns[across > 0.0]
    left = int(used.min())
    averaged = np.empty((len(lines), int(used.max()) + 1 - left), dtype=np.float32)
    # up is the image's first row
    sum_lines(image, image.shape[0] - 1 - lines, down, left, averaged)
    turned = np.empty((len(columns), len(lines)), dtype=np.float32)
    sum_lines(np.ascontiguousarray(averaged.T), np.maximum(columns - left, 0), across, 0, turned)
    out[rows_lit, columns_lit] = turned.T
    return out


def _lit(weights: Floats) -> slice:
    """Return the samples that see the image, from the first to the last; an empty slice if none does."""
    lit = np.flatnonzero(weights.any(axis=1))
    return slice(int(lit[0]), int(lit[-1]) + 1) if lit.size else slice(0, 0)


def _triangles(at: Floats, pixels: int) -> tuple[NDArray[np.intp], Floats]:
    """Return which pixels of a line over [-1, 1] contribute to its samples: their numbers and weights, (N, K).

    Where there are fewer than K, the weights of the others are 0.

    Notes
    -----
    A weight is the overlap of the sample's triangle and of the pixel's, whose linear interpolation is a triangle too:
    the second differences of |x|^3 / 12 over both widths.
    """
    step = 0.5 * pixels * float(at[1] - at[0])
    places = 0.5 * pixels * (at + 1.0) - 0.5
    reach = step + 1.0
    numbers = np.floor(places - reach).astype(np.intp)[:, None] + np.arange(1, math.ceil(2.0 * reach) + 2)
    apart = numbers - places[:, None]
    weights = np.zeros(apart.shape)
    for one, share in ((-1.0, 1.0), (0.0, -2.0), (1.0, 1.0)):
        for other, part in ((-step, share), (0.0, -2.0 * share), (step, share)):
            far = np.abs(apart + (one + other))
            weights += part * (far * far * far)
    # rounding leaves some just below 0
    weights = np.maximum(weights / (12.0 * step**2), 0.0)
    inside = (numbers >= 0) & (numbers < pixels) & (np.abs(apart) < reach)
    return np.where(inside, numbers, 0), np.where(inside, weights, 0.0)


def _border_value(edges: Floats, x: Floats, y: Floats) -> Floats:
    """Return the largest implicit function of the blades (`blade_edges`) at points that broadcast.

    Blades differ only in their normals, so after expanding |q|^2 the blade-dependent part is linear in the point:
    f = (1 - c o) n.p + c / 2 |p|^2 + o (c o / 2 - 1), o the offset and c the curvature.
    """
    offset, curvature = float(edges[0, 2]), float(edges[0, 3])
    bend = 1.0 - curvature * offset
    worst: Floats = np.empty(np.broadcast_shapes(x.shape, y.shape))
    worst.fill(-np.inf)
    term = np.empty_like(worst)
    for nx, ny in edges[:, :2]:
        np.add(bend * nx * x, bend * ny * y, out=term)
        np.maximum(worst, term, out=worst)
    if curvature != 0.0:
        worst += np.add(0.5 * curvature * x * x, 0.5 * curvature * y * y, out=term)
    worst += offset * (0.5 * curvature * offset - 1.0)
    return worst


def _ray_length(cosine: Floats | float, k: float) -> Floats:
    """Return the distance from the centre to an arc of curvature k at apothem 1, `cosine` away from its normal.

    The positive root of k/2 rho^2 + (1 - k) cos rho - (1 - k/2) = 0, in a form without a special case for k = 0.
    """
    b = (1.0 - k) * np.asarray(cosine, dtype=np.float64)
    return (2.0 - k) / (b + np.sqrt(b * b + k * (2.0 - k)))


def _area_of_unit_apothem(blades: int, k: float) -> float:
    """Return the area of a regular polygon of arcs of curvature k whose edges are 1 from the centre."""
    alpha = math.pi / blades
    rho = float(_ray_length(math.cos(alpha), k))
    chord = rho * math.sin(alpha)  # half of it
    beta = math.asin(k * chord)
    triangle = chord * rho * math.cos(alpha)
    x = 2.0 * beta
    # circular segment over the squared half chord, (x - sin x) / (2 sin^2 beta); a series where this cancels
    if x < 0.1:
        share = x / 3 * (1 - x**2 / 20 * (1 - x**2 / 42 * (1 - x**2 / 72))) / float(np.sinc(beta / math.pi)) ** 2
    else:
        share = (x - math.sin(x)) / (2.0 * math.sin(beta) ** 2)
    segment = chord**2 * share
    return blades * (triangle + segment)


def _look_up(mask: NDArray[np.floating], rotation_deg: float, x: Floats, y: Floats) -> Floats:
    """Return bilinear samples of an image that spans [-1, 1]^2, row 0 at y = 1; 0 outside."""
    turn = math.radians(rotation_deg)
    c, s = math.cos(turn), math.sin(turn)
    rows, columns = mask.shape
    # a border of zeros makes the interpolation fade at the image's border
    padded = np.pad(np.asarray(mask, dtype=np.float64), 1)
    value: Floats = np.empty(x.shape)
    # a few lines of points at a time: a dozen arrays of all would take a gigabyte for a large image
    for first in range(0, max(len(x), 1) if x.ndim else 1, _LINES):
        band = slice(first, first + _LINES) if x.ndim else ()
        u = np.clip(0.5 * ((c * x[band] + s * y[band]) + 1.0) * columns + 0.5, 0.0, columns + 1.0)
        v = np.clip(0.5 * (1.0 - (c * y[band] - s * x[band])) * rows + 0.5, 0.0, rows + 1.0)
        i = np.minimum(v.astype(np.intp), rows)
        j = np.minimum(u.astype(np.intp), columns)
        fv, fu = v - i, u - j
        top = (1.0 - fu) * padded[i, j] + fu * padded[i, j + 1]
        bottom = (1.0 - fu) * padded[i + 1, j] + fu * padded[i + 1, j + 1]
        value[band] = (1.0 - fv) * top + fv * bottom
    return value
