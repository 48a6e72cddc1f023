"""Rays that stand for a bundle's light: which are seen, which are chosen, how far they move between two wavelengths."""

from math import sqrt

import numpy as np

from ._jit import borrowing, compiled
from .trace import ALIVE, REFLECT, REL, STOP_X, X, Y, hit_rays


@borrowing
def crosses(rays, k, iris_radius):
    """Tell whether a ray crosses the stop in a circle, each time."""
    for column in range(STOP_X, rays.shape[1], 2):
        u, v = rays[k, column], rays[k, column + 1]
        if not u * u + v * v <= iris_radius * iris_radius:
            return False
    return True


@borrowing
def passes(rays, k, iris_radius):
    """Tell whether a ray meets no rim and crosses the stop in a circle, each time."""
    return rays[k, ALIVE] > 0.0 and rays[k, REL] <= 1.0 and crosses(rays, k, iris_radius)


@borrowing
def landed(place, x, y):
    """Return the column and row of a place on the sensor; `place` as in `seen_rays`."""
    return place[0, 0] + place[0, 1] * x + place[0, 2] * y, place[1, 0] + place[1, 1] * x + place[1, 2] * y


@compiled
def seen_rays(rays, iris_radius, place, width, height):
    """Tell which rays meet no rim, cross the stop in the circle around the iris, and land in the picture.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
        As `kernels.trace.trace_lanes` fills them.
    iris_radius : float
        mm.
    place : ndarray, shape (2, 3)
        Column and row of x = y = 0 on the sensor, and how they grow with x and with y, pixels per mm.
    width, height : float
        Of the picture; infinite to ask for the rims and the iris alone.

    Returns
    -------
    ndarray, shape (N,), bool
    """
    seen = np.empty(rays.shape[0], dtype=np.bool_)
    everywhere = width == np.inf
    for k in range(rays.shape[0]):
        seen[k] = False
        if not passes(rays, k, iris_radius):
            continue
        x, y = rays[k, X], rays[k, Y]
        column, row = landed(place, x, y)
        seen[k] = everywhere or (0.0 <= column < width and 0.0 <= row < height)
    return seen


@compiled
def standing_rays(pupil, triangles, passing, step, count):
    """Choose nodes of a bundle, spread evenly over the area of the pupil that passes.

    Parameters
    ----------
    pupil : ndarray, shape (N, 2)
    triangles : ndarray, shape (T, 3), int64
    passing : ndarray, shape (N,), bool
    step : int
        Every so many triangles are looked at.
    count : int

    Returns
    -------
    ndarray, int64
        `count` nodes, or none where none passes.
    """
    reached = np.empty(3 * ((triangles.shape[0] + step - 1) // step))
    total = 0.0
    corner = 0
    for t in range(0, triangles.shape[0], step):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x1, y1 = pupil[b, 0] - pupil[a, 0], pupil[b, 1] - pupil[a, 1]
        x2, y2 = pupil[c, 0] - pupil[a, 0], pupil[c, 1] - pupil[a, 1]
        area = abs(x1 * y2 - y1 * x2)
        for m in range(3):
            if passing[triangles[t, m]]:
                total += area
            reached[corner] = total
            corner += 1
    chosen = np.empty(count if total > 0.0 else 0, dtype=np.int64)
    corner = 0
    for k in range(chosen.size):
        share = (k + 0.5) / count * total
        while corner + 1 < reached.size and reached[corner] < share:
            corner += 1
        chosen[k] = triangles[corner // 3 * step, corner % 3]
    return chosen


@compiled
def traced_squares(rows, actions, curvature, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, squares):
    """Tell at which angles rays meet the mirrors of a path.

    Parameters
    ----------
    rows ... py
        As in `kernels.trace.hit_rays`.
    squares : ndarray, shape (N, M)
        Filled, from the first row on, with the squared sines on the side of the lower index; 1 under total reflection.

    Returns
    -------
    int
        How many rows are filled: rays that end tell nothing.

    Notes
    -----
    A mirror turns a ray's direction by twice the cosine along its normal: |d' - d| = 2 cos.
    """
    steps = rows.shape[0]
    hits = np.empty((px.shape[0], steps + 2, 3))
    hit_rays(rows, actions, curvature, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits)
    count = 0
    for k in range(px.shape[0]):
        if not np.isfinite(hits[k, steps + 1, 0] + hits[k, steps + 1, 1]):
            continue
        mirror = 0
        for step in range(steps):
            if actions[step] != REFLECT:
                continue
            # unit vectors to the mirror and away from it
            one, other = 0.0, 0.0
            for axis in range(3):
                at = hits[k, step + 1, axis]
                one += (at - hits[k, step, axis]) ** 2
                other += (hits[k, step + 2, axis] - at) ** 2
            one, other = 1.0 / sqrt(one), 1.0 / sqrt(other)
            turned = 0.0
            for axis in range(3):
                at = hits[k, step + 1, axis]
                turned += ((hits[k, step + 2, axis] - at) * other - (at - hits[k, step, axis]) * one) ** 2
            n_in, n_out = n_gap[rows[step]], n_gap[rows[step] + 1]
            if mirror % 2 == 1:
                n_in, n_out = n_out, n_in
            ratio = max(n_in / n_out, 1.0)
            squares[count, mirror] = min(max((1.0 - 0.25 * turned) * ratio * ratio, 0.0), 1.0)
            mirror += 1
        count += 1
    return count


@compiled
def wide_shift(short, long, iris_radius, view_radius, quantile):
    """Tell how far a bundle's light moves on the sensor between two wavelengths.

    Parameters
    ----------
    short, long : ndarray, shape (N, 5 + 2 C)
        The same rays at both (`kernels.trace.trace_lanes`).
    iris_radius : float
        What crosses the stop farther out at the first, mm, does not count.
    view_radius : float
        Nor does what lands farther from the axis, mm.
    quantile : float
        Of the rays that live at both and meet no rim at one of them at least.

    Returns
    -------
    float
        mm; 0 where no ray passes.
    """
    shifts = np.empty(short.shape[0])
    count = 0
    for k in range(short.shape[0]):
        if short[k, ALIVE] * long[k, ALIVE] == 0.0 or min(short[k, REL], long[k, REL]) > 1.0:
            continue
        if not crosses(short, k, iris_radius):
            continue
        x, y = short[k, X], short[k, Y]
        if x * x + y * y <= view_radius * view_radius:
            across, along = long[k, X] - x, long[k, Y] - y
            shifts[count] = across * across + along * along
            count += 1
    return sqrt(_ranked(shifts, count, int(quantile * (count - 1)))) if count > 0 else 0.0


@borrowing
def _ranked(values, count, rank):
    """Return the value of a rank among the first so many, by dividing them (Hoare 1961); their order is lost."""
    low, high = 0, count - 1
    while low < high:
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return values[rank]
