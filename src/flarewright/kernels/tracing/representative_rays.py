"""Representative rays of a bundle: their visibility, selection, shift between two wavelengths."""

from math import sqrt

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .clip import blade_value, inscribed_square
from .sequential import ALIVE, REL, STOP_X, X, Y


@borrowing
def crosses(rays, k, iris_radius):
    """Return whether a ray crosses the stop inside a circle, at every crossing."""
    for column in range(STOP_X, rays.shape[1], 2):
        u, v = rays[k, column], rays[k, column + 1]
        if not u * u + v * v <= iris_radius * iris_radius:
            return False
    return True


@borrowing
def passes(rays, k, iris_radius):
    """Return whether a ray passes all rims and crosses the stop inside a circle, at every crossing."""
    return rays[k, ALIVE] > 0.0 and rays[k, REL] <= 1.0 and crosses(rays, k, iris_radius)


@borrowing
def lands_at(place, x, y):
    """Return column and row of a place on the sensor; `place` as in `seen_rays`."""
    return place[0, 0] + place[0, 1] * x + place[0, 2] * y, place[1, 0] + place[1, 1] * x + place[1, 2] * y


@borrowing
def within_blades(rays, k, inner2, blades, axes):
    """Return whether a ray crosses the stop within the blades, at every crossing.

    `inner2` is `clip.inscribed_square` of them; `axes` as in `clip.clip_triangle`.
    """
    for column in range(STOP_X, rays.shape[1], 2):
        x, y = rays[k, column], rays[k, column + 1]
        if x * x + y * y < inner2:
            continue
        u, v = x * axes[0, 0] + y * axes[1, 0], x * axes[0, 1] + y * axes[1, 1]
        for b in range(blades.shape[0]):
            if blade_value(blades, b, u, v) > 0.0:
                return False
    return True


@compiled
def seen_rays(rays, iris_radius, blades, axes, place, width, height):
    """Return which rays pass all rims, cross the stop within the iris, and land in the picture.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
        As `kernels.tracing.sequential.trace_lanes` fills them.
    iris_radius : float
        Radius of the circumscribed circle of the iris, mm.
    blades : ndarray, shape (B, 4)
        Edges of the iris in the upright frame (`optics.pupil.iris.blade_edges`).
    axes : ndarray, shape (2, 2)
        Upright x, y of the meridional x axis and of the meridional y axis.
    place : ndarray, shape (2, 3)
        For column and row: the value at x = y = 0 on the sensor, and the derivatives by x and by y, pixels per mm.
    width, height : float
        Size of the picture; infinite to check only rims and iris.

    Returns
    -------
    ndarray, shape (N,), bool
    """
    seen, inner2 = np.empty(rays.shape[0], dtype=np.bool_), inscribed_square(blades)
    for k in range(rays.shape[0]):
        seen[k] = passes(rays, k, iris_radius) and is_seen(rays, k, inner2, blades, axes, place, width, height)
    return seen


@borrowing
def is_seen(rays, k, inner2, blades, axes, place, width, height):
    """Return whether a ray that passes all rims passes the blades and lands in the picture, as in `seen_rays`.

    `inner2` as in `within_blades`.
    """
    if not within_blades(rays, k, inner2, blades, axes):
        return False
    column, row = lands_at(place, rays[k, X], rays[k, Y])
    return width == np.inf or (0.0 <= column < width and 0.0 <= row < height)


@compiled
def choose_seen(rays, pupil, triangles, every, iris_radius, blades, axes, places, width, height, count):
    """Choose nodes as `choose_representatives` does, among those whose rays `seen_rays` finds at one wavelength.

    Parameters
    ----------
    rays, iris_radius, blades, width, height
        As in `seen_rays`.
    pupil, triangles, every, count
        As in `choose_representatives`.
    axes, places : ndarray, shape (H, 2, 2) and (H, 2, 3)
        As in `seen_rays`, of each half of the bundle.

    Returns
    -------
    ndarray, int64
        Nodes of the bundle, of either half; empty if no ray is seen.
    """
    passing, inner2 = np.empty((axes.shape[0], rays.shape[0]), dtype=np.bool_), inscribed_square(blades)
    for k in range(rays.shape[0]):
        # the same of both halves
        alive = passes(rays, k, iris_radius)
        for half in range(axes.shape[0]):
            passing[half, k] = alive and is_seen(rays, k, inner2, blades, axes[half], places[half], width, height)
    chosen = _choose(pupil, triangles, every, passing, count)
    for k in range(chosen.size):
        chosen[k] %= rays.shape[0]
    return chosen


@compiled
def choose_representatives(pupil, triangles, every, passing, count):
    """Choose nodes of a bundle, spread evenly over the area of the pupil that passes.

    Parameters
    ----------
    pupil : ndarray, shape (N, 2)
    triangles : ndarray, shape (T, 3), int64
    every : int
        Use each `every`-th triangle.
    passing : ndarray, shape (H, N), bool
        For each half of the bundle. Both halves of a triangle are counted in a row, so that nodes are as many places of
        the pupil as without halves.
    count : int
        Number of nodes to choose.

    Returns
    -------
    ndarray, int64
        `count` nodes, plus N times their half; empty if no node passes.
    """
    return _choose(pupil, triangles, every, passing, count)


@inner
def _choose(pupil, triangles, every, passing, count):
    """Choose nodes; arguments and result as of `choose_representatives`."""
    halves, nodes = passing.shape
    reached = np.empty(3 * halves * (-(-triangles.shape[0] // every)))
    total = 0.0
    corner = 0
    for t in range(0, triangles.shape[0], every):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x1, y1 = pupil[b, 0] - pupil[a, 0], pupil[b, 1] - pupil[a, 1]
        x2, y2 = pupil[c, 0] - pupil[a, 0], pupil[c, 1] - pupil[a, 1]
        area = abs(x1 * y2 - y1 * x2)
        for half in range(halves):
            for m in range(3):
                if passing[half, triangles[t, m]]:
                    total += area
                reached[corner] = total
                corner += 1
    chosen = np.empty(count if total > 0.0 else 0, dtype=np.int64)
    corner = 0
    for k in range(chosen.size):
        share = (k + 0.5) / count * total
        while corner + 1 < reached.size and reached[corner] < share:
            corner += 1
        half = corner // 3 % halves
        chosen[k] = triangles[corner // (3 * halves) * every, corner % 3] + half * nodes
    return chosen


@compiled
def shift_quantile(short, long, iris_radius, view_radius, quantile):
    """Return a quantile of the shifts of a bundle's rays on the sensor between two wavelengths.

    Parameters
    ----------
    short, long : ndarray, shape (N, 5 + 2 C)
        The same rays at both wavelengths (`kernels.tracing.sequential.trace_lanes`).
    iris_radius : float
        Ignore rays that cross the stop farther out at the first wavelength, mm.
    view_radius : float
        Ignore rays that land farther from the axis at the first wavelength, mm.
    quantile : float
        Quantile over the rays that reach the sensor at both wavelengths and pass all rims at one of them at least.

    Returns
    -------
    float
        Shift, mm; 0 if no ray passes.
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
    """Return the value of a rank among the first `count` values by quickselect (Hoare 1961); reorders the values."""
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
