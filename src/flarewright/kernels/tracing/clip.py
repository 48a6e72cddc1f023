"""Clip a triangle of a ray bundle by the rims of the surfaces and the blades of the iris."""

import numpy as np

from ..jit.decorators import borrowing, inlined
from .sequential import REL, STOP_X, WEIGHT, X, Y

# columns of a polygon's vertex; then u, v for each crossing of the stop
PX, PY, PREL, PP, PQ, PW, PSTOP = 0, 1, 2, 3, 4, 5, 6
MAX_VERTICES = 256


@inlined
def slope_over(x1, y1, x2, y2, inverse, rise1, rise2):
    """Return the gradient of a linear function over a triangle, from its rise along two sides (x1, y1) and (x2, y2).

    `inverse` is 1 / (x1 y2 - x2 y1).
    """
    return (rise1 * y2 - rise2 * y1) * inverse, (rise2 * x1 - rise1 * x2) * inverse


@borrowing
def _cut(polygon, count, values, other):
    """Keep the part of a convex polygon where linearly interpolated values are <= 0 (Sutherland and Hodgman 1974)."""
    kept = 0
    width = polygon.shape[1]
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        here, there = values[k], values[following]
        if here <= 0.0:
            for m in range(width):
                other[kept, m] = polygon[k, m]
            kept += 1
        if (here <= 0.0) != (there <= 0.0):
            t = here / (here - there)
            for m in range(width):
                other[kept, m] = polygon[k, m] + t * (polygon[following, m] - polygon[k, m])
            kept += 1
    for k in range(kept):
        for m in range(width):
            polygon[k, m] = other[k, m]
    return kept


@borrowing
def blade_value(blades, b, u, v):
    """Evaluate a blade's edge: <= 0 on the open side, its gradient 1 on the border (`iris.blade_edges`)."""
    qx, qy = u - blades[b, 2] * blades[b, 0], v - blades[b, 2] * blades[b, 1]
    return blades[b, 0] * qx + blades[b, 1] * qy + 0.5 * blades[b, 3] * (qx * qx + qy * qy)


@borrowing
def inscribed_square(blades):
    """Return the squared radius of the circle around the axis that no blade cuts, within which most rays lie.

    Infinite without blades, negative if one covers the axis. No blade is curved more than this circle.
    """
    least = np.inf
    for b in range(blades.shape[0]):
        least = min(least, blades[b, 2] * abs(blades[b, 2]))
    return least


@borrowing
def cut_by_blades(polygon, count, crossings, blades, other, values):
    """Cut a polygon by every blade at every stop crossing; return its number of vertices, 0 if nothing passes."""
    for c in range(crossings):
        for b in range(blades.shape[0]):
            high = -np.inf
            for m in range(count):
                values[m] = blade_value(blades, b, polygon[m, PSTOP + 2 * c], polygon[m, PSTOP + 2 * c + 1])
                high = max(high, values[m])
            if high > 0.0:
                count = _cut(polygon, count, values, other)
    return count if count >= 3 else 0


@borrowing
def clip_triangle(data, pupil, triangle, mirror, crossings, blades, axes, polygon, other, values):
    """Cut one triangle by rims and blades.

    Parameters
    ----------
    data : ndarray, shape (N, 5 + 2 C)
        Traced nodes (`kernels.tracing.sequential`).
    pupil : ndarray, shape (N, 2)
    triangle : ndarray, shape (3,)
    mirror : float
        +1 for the traced half of the bundle, -1 for its mirror image.
    crossings : int
    blades : ndarray, shape (B, 4)
        Edges of the iris in the upright frame; empty without an iris.
    axes : ndarray, shape (2, 2)
        Upright x, y of the meridional x axis and of the meridional y axis.
    polygon, other : ndarray, shape (MAX_VERTICES, 6 + 2 C)
        Result (sensor x, y in the meridional frame, largest r / semi-diameter, pupil x, y, weight, stop u, v in the
        upright frame per crossing), and scratch.
    values : ndarray, shape (MAX_VERTICES,)
        Scratch.

    Returns
    -------
    int
        Number of vertices of the polygon, 0 if nothing passes.
    """
    rel_high = 0.0
    rel_low = np.inf
    for m in range(3):
        k = triangle[m]
        polygon[m, PX] = mirror * data[k, X]
        polygon[m, PY] = data[k, Y]
        polygon[m, PREL] = data[k, REL]
        polygon[m, PP] = mirror * pupil[k, 0]
        polygon[m, PQ] = pupil[k, 1]
        polygon[m, PW] = data[k, WEIGHT]
        for c in range(crossings):
            u, v = mirror * data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
            polygon[m, PSTOP + 2 * c] = u * axes[0, 0] + v * axes[1, 0]
            polygon[m, PSTOP + 2 * c + 1] = u * axes[0, 1] + v * axes[1, 1]
        rel_high, rel_low = max(rel_high, data[k, REL]), min(rel_low, data[k, REL])
    if rel_low > 1.0:
        return 0
    count = np.int64(3)
    if rel_high > 1.0:
        for m in range(count):
            values[m] = polygon[m, PREL] - 1.0
        count = _cut(polygon, count, values, other)
    return cut_by_blades(polygon, count, crossings, blades, other, values)


@borrowing
def polygon_area(polygon, count, a, b):
    """Return the signed area of a polygon in two of its columns."""
    area = 0.0
    for k in range(1, count - 1):
        area += (polygon[k, a] - polygon[0, a]) * (polygon[k + 1, b] - polygon[0, b])
        area -= (polygon[k, b] - polygon[0, b]) * (polygon[k + 1, a] - polygon[0, a])
    return 0.5 * area


@borrowing
def cut_to_rectangle(polygon, count, other, values, width, height):
    """Cut a polygon whose first two columns are pixels to the picture [0, width] x [0, height]."""
    for side in range(4):
        high = -np.inf
        for k in range(count):
            if side == 0:
                values[k] = -polygon[k, PX]
            elif side == 1:
                values[k] = polygon[k, PX] - width
            elif side == 2:
                values[k] = -polygon[k, PY]
            else:
                values[k] = polygon[k, PY] - height
            high = max(high, values[k])
        if high > 0.0:
            count = _cut(polygon, count, values, other)
    return count
