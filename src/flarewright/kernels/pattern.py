"""Patterns in the plane of the stop: a picture of it, or tables across an iris' edges and around its corners."""

from math import sqrt

import numpy as np

from ._jit import compiled, inlined, inner
from .trace import STOP_X

# columns of a table of patterns, one row a crossing of the stop; lengths in mm, places as seen from the middle
# a picture, or a corner's table: its place, rows and columns; samples per mm, and the sample at 0
FIRST, ROWS, COLUMNS, PER_MM_X, PER_MM_Y, AT_X, AT_Y = 0, 1, 2, 3, 4, 5, 6
# beyond this distance in x or y all is dark
OUTSIDE = 7
# how many corners the iris has: -1 for a picture, 0 for a round opening
CORNERS = 8
# the table across an edge: its place, length, samples per mm; the border is in its middle
EDGE, EDGE_COUNT, EDGE_PER_MM = 9, 10, 11
# a corner's distance; cosine and sine between it and a blade's normal; a blade's offset and radius, 0 if straight
DISTANCE, COSINE, SINE, OFFSET, RADIUS = 12, 13, 14, 15, 16
# farther within than this nothing is known of the border
MARGIN = 17
# half the inverse of cosine and sine between a corner's direction and the tangents there
TO_ALONG, TO_ACROSS = 18, 19
TABLE_COLUMNS = 20

# how a triangle's places in the stop are told, besides as seen from a corner (`place_in_pattern`)
ANYWHERE, ON_EDGE, OPEN, ROUND, PICTURE = -1, -2, -3, -4, -5


@inlined
def nearest_corner(table, corners, k, x, y):
    """Return the corner in whose direction a place lies."""
    best, found = -np.inf, 0
    for j in range(np.int64(table[k, CORNERS])):
        along = corners[j, 0] * x + corners[j, 1] * y
        if along > best:
            best, found = along, j
    return found


@inlined
def beyond_blade(table, k, along, across):
    """Return the distance beyond one of a corner's two blades, that on the side of +across; seen from the middle."""
    if table[k, RADIUS] == 0.0:
        return along * table[k, COSINE] + across * table[k, SINE] - table[k, OFFSET]
    back = table[k, OFFSET] - table[k, RADIUS]
    x, y = along - back * table[k, COSINE], across - back * table[k, SINE]
    return sqrt(x * x + y * y) - table[k, RADIUS]


@inlined
def bilinear(values, first, columns, column, row):
    """Interpolate a table that begins at `first` between four of its values; column and row are not below 0."""
    c, r = np.int64(column), np.int64(row)
    fx, fy = column - c, row - r
    # an unsigned place needs no check for counting from the end
    at = np.uint64(first + r * columns + c)
    below = at + np.uint64(columns)
    one = np.uint64(1)
    upper = values[at] + (values[at + one] - values[at]) * fx
    lower = values[below] + (values[below + one] - values[below]) * fx
    return upper + (lower - upper) * fy


@inlined
def _edge_value(patterns, first, last, at):
    """Interpolate a table of an edge at `at`, between 0 and last."""
    at = min(max(at, 0.0), last)
    c = np.int64(at)
    place = np.uint64(first + c)
    return patterns[place] + (patterns[place + np.uint64(1)] - patterns[place]) * (at - c)


@inner
def pattern_value(patterns, table, corners, k, x, y):
    """Return the k-th pattern at a place in the stop, mm."""
    if table[k, CORNERS] < 0.0:
        column = min(max(x * table[k, PER_MM_X] + table[k, AT_X], 0.0), table[k, COLUMNS] - 1.001)
        row = min(max(y * table[k, PER_MM_Y] + table[k, AT_Y], 0.0), table[k, ROWS] - 1.001)
        return bilinear(patterns, np.int64(table[k, FIRST]), np.int64(table[k, COLUMNS]), column, row)
    if table[k, CORNERS] == 0.0:
        beyond = sqrt(x * x + y * y) - table[k, RADIUS]
    else:
        j = nearest_corner(table, corners, k, x, y)
        along, across = corners[j, 0] * x + corners[j, 1] * y, abs(corners[j, 0] * y - corners[j, 1] * x)
        beyond, other = beyond_blade(table, k, along, across), beyond_blade(table, k, along, -across)
        column = (beyond + other) * table[k, TO_ALONG] * table[k, PER_MM_X] + table[k, AT_X]
        row = (beyond - other) * table[k, TO_ACROSS] * table[k, PER_MM_Y]
        if column >= 0.0 and column < table[k, COLUMNS] - 1.001 and row < table[k, ROWS] - 1.001:
            return bilinear(patterns, np.int64(table[k, FIRST]), np.int64(table[k, COLUMNS]), column, row)
    at = beyond * table[k, EDGE_PER_MM] + 0.5 * (table[k, EDGE_COUNT] - 1.0)
    return _edge_value(patterns, np.int64(table[k, EDGE]), table[k, EDGE_COUNT] - 1.001, at)


@inner
def place_in_pattern(table, corners, k, stops):
    """Change a triangle's corners in the stop, shape (3, 2), mm, into what its pattern is looked up by.

    Returns
    -------
    int
        `OPEN`: the pattern is 1. `ON_EDGE`: how far along the table of a straight edge, once. A corner of the iris, 0
        or more: as seen from it, along its direction and across. `ANYWHERE`, `ROUND`, `PICTURE`: mm, as they were.
    """
    if table[k, CORNERS] < 0.0:
        return PICTURE
    if table[k, CORNERS] == 0.0:
        outside = -np.inf
        for m in range(3):
            outside = max(outside, stops[m, 0] * stops[m, 0] + stops[m, 1] * stops[m, 1])
        within = max(table[k, RADIUS] - table[k, MARGIN], 0.0)
        return OPEN if outside < within * within else ROUND
    # of each of its corners: the nearest one of the iris, the nearer blade beside that, how far beyond it, how far away
    corner, blade, alike, aside = np.int64(-1), np.int64(-1), True, True
    far = -np.inf
    for m in range(3):
        x, y = stops[m, 0], stops[m, 1]
        j = nearest_corner(table, corners, k, x, y)
        across = corners[j, 0] * y - corners[j, 1] * x
        other = j + 1 if across >= 0.0 else j
        if other == table[k, CORNERS]:
            other = 0
        corner, blade = (j, other) if m == 0 else (corner, blade)
        alike, aside = alike and j == corner, aside and other == blade
        along = corners[j, 0] * x + corners[j, 1] * y
        far = max(far, beyond_blade(table, k, along, abs(across)))
    if far < -table[k, MARGIN]:
        return OPEN
    if aside and table[k, RADIUS] == 0.0 and not _near_corner(table, corners, k, blade, stops):
        nx, ny = _normal(table, corners, k, blade)
        for m in range(3):
            beyond = nx * stops[m, 0] + ny * stops[m, 1] - table[k, OFFSET]
            stops[m, 0] = beyond * table[k, EDGE_PER_MM] + 0.5 * (table[k, EDGE_COUNT] - 1.0)
            stops[m, 1] = 0.0
        return ON_EDGE
    if not alike:
        return ANYWHERE
    for m in range(3):
        x, y = stops[m, 0], stops[m, 1]
        stops[m, 0] = corners[corner, 0] * x + corners[corner, 1] * y
        stops[m, 1] = corners[corner, 0] * y - corners[corner, 1] * x
    return corner


@inlined
def _normal(table, corners, k, blade):
    """Return a blade's normal: between the corner before it and the one of its number."""
    cx, cy = corners[blade, 0], corners[blade, 1]
    cosine, sine = table[k, COSINE], -table[k, SINE]
    return cosine * cx - sine * cy, sine * cx + cosine * cy


@inner
def _near_corner(table, corners, k, blade, stops):
    """Tell whether a triangle comes into the table of a corner of a blade."""
    for side in range(2):
        j = blade - side if blade - side >= 0 else np.int64(table[k, CORNERS]) - 1
        left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
        for m in range(3):
            along = corners[j, 0] * stops[m, 0] + corners[j, 1] * stops[m, 1]
            across = corners[j, 0] * stops[m, 1] - corners[j, 1] * stops[m, 0]
            left, right = min(left, along), max(right, along)
            low, high = min(low, across), max(high, across)
        outer = (table[k, COLUMNS] - table[k, AT_X]) / table[k, PER_MM_X]
        inner_end = table[k, AT_X] / table[k, PER_MM_X]
        reach = table[k, ROWS] / table[k, PER_MM_Y]
        left, right = left - table[k, DISTANCE], right - table[k, DISTANCE]
        if low < reach and high > -reach and left < outer and right > -inner_end:
            return True
    return False


@inlined
def weave(patterns, table, corners, k, places, row, first, last, light):
    """Multiply the light of a row's pixels from `first` to `last` by a pattern.

    Parameters
    ----------
    patterns, table, corners, k
        As in `pattern_value`.
    places : ndarray, shape (C, 11)
        For each pattern two linear functions of the picture's pixels (value at the origin, gradient), the bounds of
        each over the polygon, and what `place_in_pattern` returned.
    row, first, last : int
    light : ndarray, float32
        By column.

    Notes
    -----
    A loop for each way of looking up, without calls: handing over arrays would cost more than most look-ups.
    """
    way, y = np.int64(places[k, 10]), row + 0.5
    # a pixel's centre may lie beside the polygon
    u0, du = places[k, 0] + 0.5 * places[k, 1] + places[k, 2] * y, places[k, 1]
    v0, dv = places[k, 3] + 0.5 * places[k, 4] + places[k, 5] * y, places[k, 4]
    u_low, u_high, v_low, v_high = places[k, 6], places[k, 7], places[k, 8], places[k, 9]
    edge, longest, edge_per_mm = np.int64(table[k, EDGE]), table[k, EDGE_COUNT] - 1.001, table[k, EDGE_PER_MM]
    middle = 0.5 * (table[k, EDGE_COUNT] - 1.0)
    start, columns = np.int64(table[k, FIRST]), np.int64(table[k, COLUMNS])
    last_column, last_row = table[k, COLUMNS] - 1.001, table[k, ROWS] - 1.001
    if way == ON_EDGE:
        for c in range(first, last + 1):
            at = min(max(u0 + du * c, u_low), u_high)
            light[np.uint64(c)] *= np.float32(_edge_value(patterns, edge, longest, at))
    elif way >= 0:
        to_along, to_across, zero = table[k, TO_ALONG] * table[k, PER_MM_X], table[k, TO_ACROSS], table[k, AT_X]
        to_across *= table[k, PER_MM_Y]
        cosine, sine, radius = table[k, COSINE], table[k, SINE], table[k, RADIUS]
        back = table[k, OFFSET] - radius
        for c in range(first, last + 1):
            u, v = min(max(u0 + du * c, u_low), u_high), abs(min(max(v0 + dv * c, v_low), v_high))
            beyond, other = u * cosine + v * sine - table[k, OFFSET], u * cosine - v * sine - table[k, OFFSET]
            if radius > 0.0:
                x, z, w = u - back * cosine, v - back * sine, v + back * sine
                beyond, other = sqrt(x * x + z * z) - radius, sqrt(x * x + w * w) - radius
            column, line = (beyond + other) * to_along + zero, (beyond - other) * to_across
            if column >= 0.0 and column < last_column and line < last_row:
                value = bilinear(patterns, start, columns, column, line)
            else:
                value = _edge_value(patterns, edge, longest, beyond * edge_per_mm + middle)
            light[np.uint64(c)] *= np.float32(value)
    elif way == ROUND:
        for c in range(first, last + 1):
            u, v = min(max(u0 + du * c, u_low), u_high), min(max(v0 + dv * c, v_low), v_high)
            beyond = sqrt(u * u + v * v) - table[k, RADIUS]
            light[np.uint64(c)] *= np.float32(_edge_value(patterns, edge, longest, beyond * edge_per_mm + middle))
    elif way == PICTURE:
        for c in range(first, last + 1):
            u, v = min(max(u0 + du * c, u_low), u_high), min(max(v0 + dv * c, v_low), v_high)
            column = min(max(u * table[k, PER_MM_X] + table[k, AT_X], 0.0), last_column)
            line = min(max(v * table[k, PER_MM_Y] + table[k, AT_Y], 0.0), last_row)
            light[np.uint64(c)] *= np.float32(bilinear(patterns, start, columns, column, line))
    elif way == ANYWHERE:
        for c in range(first, last + 1):
            u, v = min(max(u0 + du * c, u_low), u_high), min(max(v0 + dv * c, v_low), v_high)
            light[np.uint64(c)] *= np.float32(pattern_value(patterns, table, corners, k, u, v))


@inner
def is_dark(table, corners, k, places):
    """Tell whether a pattern is dark over a triangle, shape (3, 2), mm."""
    left, right = min(places[0, 0], places[1, 0], places[2, 0]), max(places[0, 0], places[1, 0], places[2, 0])
    low, high = min(places[0, 1], places[1, 1], places[2, 1]), max(places[0, 1], places[1, 1], places[2, 1])
    outside = table[k, OUTSIDE]
    if right <= -outside or left >= outside or high <= -outside or low >= outside:
        return True
    if table[k, CORNERS] <= 0.0:
        return False
    # beyond one and the same blade's tangent, all of it
    far = table[k, OFFSET] + table[k, MARGIN]
    for side in (-1.0, 1.0):
        j = nearest_corner(table, corners, k, places[0, 0], places[0, 1])
        nx = corners[j, 0] * table[k, COSINE] - side * corners[j, 1] * table[k, SINE]
        ny = corners[j, 1] * table[k, COSINE] + side * corners[j, 0] * table[k, SINE]
        if (
            min(
                nx * places[0, 0] + ny * places[0, 1],
                nx * places[1, 0] + ny * places[1, 1],
                nx * places[2, 0] + ny * places[2, 1],
            )
            >= far
        ):
            return True
    return False


@compiled
def find_open(data, triangles, halves, crossings, axes, table, corners):
    """Tell which cells lie so far within the iris that nothing is known of its border there.

    Parameters
    ----------
    data, triangles, halves, crossings, axes
        As in `kernels.bundle.draw_bundle`.
    table, corners : ndarray
        As in `kernels.ringing.draw_ringing`.

    Returns
    -------
    ndarray, shape (T,), bool
        For each triangle whether all of its cell does, at all crossings.
    """
    deep = np.ones(data.shape[0], dtype=np.bool_)
    for node in range(data.shape[0]):
        for half in range(halves):
            for k in range(crossings):
                u, v = (1.0 - 2.0 * half) * data[node, STOP_X + 2 * k], data[node, STOP_X + 2 * k + 1]
                x, y = u * axes[0, 0] + v * axes[1, 0], u * axes[0, 1] + v * axes[1, 1]
                if table[k, CORNERS] < 0.0:
                    deep[node] = False
                    continue
                if table[k, CORNERS] == 0.0:
                    beyond = sqrt(x * x + y * y) - table[k, RADIUS]
                else:
                    j = nearest_corner(table, corners, k, x, y)
                    across = abs(corners[j, 0] * y - corners[j, 1] * x)
                    beyond = beyond_blade(table, k, corners[j, 0] * x + corners[j, 1] * y, across)
                deep[node] &= beyond < -table[k, MARGIN]
    found = np.empty(triangles.shape[0], dtype=np.bool_)
    start = np.int64(0)
    while start < triangles.shape[0]:
        end, whole = start, True
        while end < triangles.shape[0] and triangles[end, 0] == triangles[start, 0]:
            whole = whole and deep[triangles[end, 0]] and deep[triangles[end, 1]] and deep[triangles[end, 2]]
            end += 1
        for t in range(start, end):
            found[t] = whole
        start = end
    return found
