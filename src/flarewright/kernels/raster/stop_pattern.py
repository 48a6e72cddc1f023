"""Transmittance patterns in the stop plane: a picture of the stop, or tables across iris edges and around corners."""

from math import sqrt

import numpy as np

from ..jit.decorators import borrowing, inlined, inner
from ..jit.simd import LANES, multiply_between, multiply_taken

# columns of a table of patterns, one row for each crossing of the stop; lengths in mm, places from the centre
# a picture, or a corner's table: its first index, rows and columns; samples per mm, and the sample at 0
FIRST, ROWS, COLUMNS, PER_MM_X, PER_MM_Y, AT_X, AT_Y = 0, 1, 2, 3, 4, 5, 6
# beyond this distance in x or y the pattern is dark
OUTSIDE = 7
# number of corners of the iris: -1 for a picture, 0 for a round opening
CORNERS = 8
# the table across an edge: its first index, length, samples per mm; the edge lies in its middle
EDGE, EDGE_COUNT, EDGE_PER_MM = 9, 10, 11
# distance of a corner; cosine and sine of the angle between it and a blade's normal; offset and radius (0: straight) of
# a blade
DISTANCE, COSINE, SINE, OFFSET, RADIUS = 12, 13, 14, 15, 16
# distance from the border beyond which the pattern is constant: 1 inside, 0 outside
MARGIN = 17
# half the inverse of cosine and sine between a corner's direction and the tangents there
TO_ALONG, TO_ACROSS = 18, 19
# within this radius the pattern is 1
DEEP = 20
# invisible error of places in the stop, mm
FINE = 21
TABLE_COLUMNS = 22

# forms of a polygon's places in the stop (`place_in_pattern`)
OPEN, ON_EDGE, ALONG_BLADE, ROUND, PICTURE, ANYWHERE = 0, 1, 2, 3, 4, 5

# columns of a polygon's places, one row for each pattern: two linear functions of the pixel coordinates (value at the
# origin, gradient), the bounds of each over the polygon, and the form returned by `place_in_pattern`
U, V, U_LOW, U_HIGH, V_LOW, V_HIGH, WAY = 0, 3, 6, 7, 8, 9, 10
PLACE_COLUMNS = 11


@inlined
def nearest_corner(table, corners, k, x, y):
    """Return the index of the corner whose direction is nearest to that of a place."""
    best, found = -np.inf, 0
    for j in range(np.int64(table[k, CORNERS])):
        along = corners[j, 0] * x + corners[j, 1] * y
        if along > best:
            best, found = along, j
    return found


@inlined
def beyond_blade(table, k, along, across):
    """Return the signed distance beyond the corner's blade on the +across side, positive outside the opening."""
    if table[k, RADIUS] == 0.0:
        return along * table[k, COSINE] + across * table[k, SINE] - table[k, OFFSET]
    back = table[k, OFFSET] - table[k, RADIUS]
    x, y = along - back * table[k, COSINE], across - back * table[k, SINE]
    return sqrt(x * x + y * y) - table[k, RADIUS]


@inlined
def _corner_place(table, k, beyond, other):
    """Return column and row in a corner's table of a place at these distances beyond the corner's two blades."""
    column = (beyond + other) * table[k, TO_ALONG] * table[k, PER_MM_X] + table[k, AT_X]
    row = (beyond - other) * table[k, TO_ACROSS] * table[k, PER_MM_Y]
    return column, row


@inlined
def _between(values, at, columns, right, down):
    """Interpolate a table bilinearly between four values, the upper left of which has index `at`."""
    # unsigned indices skip Numba's check for negative ones
    here, below = np.uint64(at), np.uint64(at + columns)
    one = np.uint64(1)
    upper = values[here] + (values[here + one] - values[here]) * right
    lower = values[below] + (values[below + one] - values[below]) * right
    return upper + (lower - upper) * down


@inlined
def _bilinear(values, first, columns, column, row):
    """Interpolate the table that starts at index `first` bilinearly; column and row must not be negative."""
    c, r = np.int64(column), np.int64(row)
    return _between(values, first + r * columns + c, columns, np.float32(column - c), np.float32(row - r))


@inlined
def _edge_value(patterns, first, last, at):
    """Return the nearest value of an edge table at position `at`, clamped to 0 ... last; the table is fine enough."""
    return patterns[np.uint64(first + np.int64(np.int32(min(max(at, np.float32(0.0)), last) + np.float32(0.5))))]


@borrowing
def pattern_value(patterns, table, corners, k, x, y):
    """Return the value of the k-th pattern at a place in the stop, mm."""
    if table[k, CORNERS] < 0.0:
        column = min(max(x * table[k, PER_MM_X] + table[k, AT_X], 0.0), table[k, COLUMNS] - 1.001)
        row = min(max(y * table[k, PER_MM_Y] + table[k, AT_Y], 0.0), table[k, ROWS] - 1.001)
        start, columns = np.int64(table[k, FIRST]), np.int64(table[k, COLUMNS])
        return _bilinear(patterns, start, columns, column, row)
    if table[k, CORNERS] == 0.0:
        beyond = sqrt(x * x + y * y) - table[k, RADIUS]
    else:
        j = nearest_corner(table, corners, k, x, y)
        along, across = corners[j, 0] * x + corners[j, 1] * y, abs(corners[j, 0] * y - corners[j, 1] * x)
        beyond, other = beyond_blade(table, k, along, across), beyond_blade(table, k, along, -across)
        column, row = _corner_place(table, k, beyond, other)
        if column >= 0.0 and column < table[k, COLUMNS] - 1.001 and row < table[k, ROWS] - 1.001:
            start, columns = np.int64(table[k, FIRST]), np.int64(table[k, COLUMNS])
            return _bilinear(patterns, start, columns, column, row)
    at = beyond * table[k, EDGE_PER_MM] + 0.5 * (table[k, EDGE_COUNT] - 1.0)
    return _edge_value(patterns, np.int64(table[k, EDGE]), np.float32(table[k, EDGE_COUNT] - 1.0), np.float32(at))


@borrowing
def place_in_pattern(table, corners, k, stops, count):
    """Convert a polygon's places in the stop, shape (>= count, 2), mm, to look-up coordinates, in place.

    Returns
    -------
    int
        `OPEN`: the pattern is 1. `ON_EDGE`: the first coordinate is the position in the table of a straight edge.
        `ALONG_BLADE`: coordinates along the normal of a blade and along the blade, mm, where both nearest corners
        belong to that blade. `ROUND`: from the centre of the opening or of a blade's arc, mm. `PICTURE`, `ANYWHERE`:
        unchanged, mm.
    """
    if table[k, CORNERS] < 0.0:
        return PICTURE
    outside = -np.inf
    for m in range(count):
        outside = max(outside, stops[m, 0] * stops[m, 0] + stops[m, 1] * stops[m, 1])
    if outside < table[k, DEEP] * table[k, DEEP]:
        return OPEN
    if table[k, CORNERS] == 0.0:
        return ROUND
    # for each vertex: the nearest corner of the iris, the nearer blade of that corner, the distance beyond that blade
    corner, blade, aside = np.int64(-1), np.int64(-1), True
    left, right = True, True
    many = np.int64(table[k, CORNERS])
    far = -np.inf
    for m in range(count):
        x, y = stops[m, 0], stops[m, 1]
        j = nearest_corner(table, corners, k, x, y)
        across = corners[j, 0] * y - corners[j, 1] * x
        other = j + 1 if across >= 0.0 else j
        if other == many:
            other = np.int64(0)
        corner, blade = (j, other) if m == 0 else (corner, blade)
        aside = aside and other == blade
        # blade b lies between corners b - 1 and b
        left = left and (j == corner or j + 1 == corner or (corner == 0 and j + 1 == many))
        right = right and (j == corner or j == corner + 1 or (j == 0 and corner + 1 == many))
        along = corners[j, 0] * x + corners[j, 1] * y
        far = max(far, beyond_blade(table, k, along, abs(across)))
    if far < -table[k, MARGIN]:
        return OPEN
    if not (aside or left or right):
        return ANYWHERE
    if not aside:
        blade = corner if left else np.int64((corner + 1) % many)
    nx, ny = _normal(table, corners, k, blade)
    if aside and table[k, RADIUS] != 0.0 and _is_beside_corners(table, k, nx, ny, stops, count):
        back = table[k, OFFSET] - table[k, RADIUS]
        for m in range(count):
            stops[m, 0], stops[m, 1] = stops[m, 0] - back * nx, stops[m, 1] - back * ny
        return ROUND
    on_edge = aside and table[k, RADIUS] == 0.0 and not _near_corner(table, corners, k, blade, stops, count)
    for m in range(count):
        x, y = stops[m, 0], stops[m, 1]
        along, beside = nx * x + ny * y, nx * y - ny * x
        if on_edge:
            along = (along - table[k, OFFSET]) * table[k, EDGE_PER_MM] + 0.5 * (table[k, EDGE_COUNT] - 1.0)
        stops[m, 0], stops[m, 1] = along, beside
    return ON_EDGE if on_edge else ALONG_BLADE


@inlined
def _normal(table, corners, k, blade):
    """Return the normal of blade b, which lies between corners b - 1 and b."""
    cx, cy = corners[blade, 0], corners[blade, 1]
    cosine, sine = table[k, COSINE], -table[k, SINE]
    return cosine * cx - sine * cy, sine * cx + cosine * cy


@borrowing
def _near_corner(table, corners, k, blade, stops, count):
    """Return whether a polygon overlaps the table of a corner of a blade."""
    for side in range(2):
        j = blade - side if blade - side >= 0 else np.int64(table[k, CORNERS]) - 1
        left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
        for m in range(count):
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


@borrowing
def _is_beside_corners(table, k, nx, ny, stops, count):
    """Return whether a polygon nearest to one curved blade, of this normal, reads no table of a corner."""
    low, left, right = np.inf, np.inf, -np.inf
    for m in range(count):
        p, q = nx * stops[m, 0] + ny * stops[m, 1], abs(nx * stops[m, 1] - ny * stops[m, 0])
        # both ends of the blade folded onto one corner, as in `weave`
        along, across = p * table[k, COSINE] + q * table[k, SINE], abs(q * table[k, COSINE] - p * table[k, SINE])
        beyond, other = beyond_blade(table, k, along, across), beyond_blade(table, k, along, -across)
        column, row = _corner_place(table, k, beyond, other)
        low, left, right = min(low, row), min(left, column), max(right, column)
    return low >= table[k, ROWS] - 1.0 or right < 0.0 or left >= table[k, COLUMNS] - 1.0


@inner
def room_to_weave(crossings, width):
    """Return zeroed arrays `places`, `light`, `where`, `beside` and `below` for `weave`, for a picture of a width."""
    # `weave` rounds up to whole vectors
    wide = width + LANES
    places = np.empty((crossings, PLACE_COLUMNS))
    light, where = np.empty(wide, dtype=np.float32), np.empty(wide, dtype=np.int32)
    beside, below = np.empty(wide, dtype=np.float32), np.empty(wide, dtype=np.float32)
    # loops compile in a tenth of the time of `np.zeros`
    for k in range(crossings):
        for m in range(PLACE_COLUMNS):
            places[k, m] = 0.0
    for m in range(wide):
        light[m], where[m], beside[m], below[m] = 0.0, 0, 0.0, 0.0
    return places, light, where, beside, below


@inlined
def weave(patterns, table, corners, places, light, where, beside, below, row, first, last):
    """Fill the product of the patterns at the pixel centres of a row, columns `first` to `last`.

    Parameters
    ----------
    patterns, table, corners
        As in `pattern_value`.
    places : ndarray, shape (C, PLACE_COLUMNS)
        Places of the polygon.
    light : ndarray, float32
        By column; filled, and up to LANES - 1 columns further.
    where, beside, below : ndarray
        Scratch: indices in `patterns`, int32, and fractions of a sample towards the next column and the next row,
        float32.
    row, first, last : int

    Notes
    -----
    One loop for each look-up form, without calls: passing arrays would take longer than most look-ups. Indices are
    computed for several pixels at once, the values are then read one by one. Pixels are counted in int32: without
    AVX-512 a vector of int64 becomes floats one by one.
    """
    y, begin = row + 0.5, np.uint64(first)
    count = last + 1 - first
    # round up to whole vectors: scalar remainder loops would take longer than the extra pixels
    padded = -(-count // LANES) * LANES
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    for m in range(padded):
        light[begin + np.uint64(m)] = one
    for k in range(places.shape[0]):
        way = np.int64(places[k, WAY])
        if way == OPEN:
            continue
        # clamp to the polygon's bounds: a pixel's centre may lie outside the polygon
        u_low, u_high = np.float32(places[k, U_LOW]), np.float32(places[k, U_HIGH])
        v_low, v_high = np.float32(places[k, V_LOW]), np.float32(places[k, V_HIGH])
        u0 = np.float32(places[k, U] + places[k, U + 1] * (first + 0.5) + places[k, U + 2] * y)
        v0 = np.float32(places[k, V] + places[k, V + 1] * (first + 0.5) + places[k, V + 2] * y)
        du, dv = np.float32(places[k, U + 1]), np.float32(places[k, V + 1])
        edge, longest = np.int32(table[k, EDGE]), np.float32(table[k, EDGE_COUNT] - 1.0)
        edge_per_mm, middle = np.float32(table[k, EDGE_PER_MM]), np.float32(0.5 * (table[k, EDGE_COUNT] - 1.0))
        start, columns = np.int32(table[k, FIRST]), np.int32(table[k, COLUMNS])
        last_column, last_row = np.float32(table[k, COLUMNS] - 1.001), np.float32(table[k, ROWS] - 1.001)
        if way == ON_EDGE:
            u0, u_low, u_high = u0 + half, max(u_low, zero) + half, min(u_high, longest) + half
            for m in range(padded):
                where[np.uint64(m)] = edge + np.int32(min(max(u0 + du * np.float32(np.int32(m)), u_low), u_high))
        elif way == ROUND:
            radius, middle = np.float32(table[k, RADIUS]), np.float32(middle + half)
            for m in range(padded):
                u = min(max(u0 + du * np.float32(np.int32(m)), u_low), u_high)
                v = min(max(v0 + dv * np.float32(np.int32(m)), v_low), v_high)
                at = (sqrt(u * u + v * v) - radius) * edge_per_mm + middle
                where[np.uint64(m)] = edge + np.int32(min(max(at, half), longest + half))
        elif way == PICTURE:
            per_x, per_y = np.float32(table[k, PER_MM_X]), np.float32(table[k, PER_MM_Y])
            at_x, at_y = np.float32(table[k, AT_X]), np.float32(table[k, AT_Y])
            for m in range(padded):
                u = min(max(u0 + du * np.float32(np.int32(m)), u_low), u_high)
                v = min(max(v0 + dv * np.float32(np.int32(m)), v_low), v_high)
                column = min(max(u * per_x + at_x, zero), last_column)
                line = min(max(v * per_y + at_y, zero), last_row)
                c, r = np.int32(column), np.int32(line)
                where[np.uint64(m)] = start + r * columns + c
                beside[np.uint64(m)], below[np.uint64(m)] = column - np.float32(c), line - np.float32(r)
        elif way == ALONG_BLADE:
            to_along = np.float32(table[k, TO_ALONG] * table[k, PER_MM_X])
            to_across = np.float32(table[k, TO_ACROSS] * table[k, PER_MM_Y])
            at_corner, offset = np.float32(table[k, AT_X]), np.float32(table[k, OFFSET])
            cosine, sine = np.float32(table[k, COSINE]), np.float32(table[k, SINE])
            radius, middle = np.float32(table[k, RADIUS]), middle + half
            back_x, back_y = (offset - radius) * cosine, (offset - radius) * sine
            curved = radius > zero
            across = np.float32(columns)
            for m in range(padded):
                p = min(max(u0 + du * np.float32(np.int32(m)), u_low), u_high)
                q = abs(min(max(v0 + dv * np.float32(np.int32(m)), v_low), v_high))
                # by symmetry fold both ends of the blade onto one corner
                u, v = p * cosine + q * sine, abs(q * cosine - p * sine)
                beyond, other = u * cosine + v * sine - offset, u * cosine - v * sine - offset
                if curved:
                    x, z, w = u - back_x, v - back_y, v + back_y
                    beyond, other = sqrt(x * x + z * z) - radius, sqrt(x * x + w * w) - radius
                column, line = (beyond + other) * to_along + at_corner, (beyond - other) * to_across
                nearest = np.int32(min(max(beyond * edge_per_mm + middle, half), longest + half))
                near = (column >= zero) & (column < last_column) & (line < last_row)
                column, line = min(max(column, zero), last_column), min(max(line, zero), last_row)
                # a float32 product of small integers is exact, and faster than an integer product
                cell, cells = np.float32(np.int32(column)), np.float32(np.int32(line))
                where[np.uint64(m)] = start + np.int32(cells * across + cell) if near else edge + nearest
                beside[np.uint64(m)] = column - cell if near else zero
                below[np.uint64(m)] = line - cells if near else zero
        else:
            for m in range(count):
                u = min(max(u0 + du * np.float32(m), u_low), u_high)
                v = min(max(v0 + dv * np.float32(m), v_low), v_high)
                # float64 as at the other calls, so that only one version is compiled
                light[begin + np.uint64(m)] *= pattern_value(patterns, table, corners, k, np.float64(u), np.float64(v))
        if way in (ON_EDGE, ROUND):
            for m in range(0, count, LANES):
                multiply_taken(light, begin + np.uint64(m), patterns, where, m)
        elif way != ANYWHERE:
            for m in range(0, count, LANES):
                multiply_between(light, begin + np.uint64(m), patterns, columns, where, beside, below, m)


@borrowing
def is_dark(table, corners, k, stops, count):
    """Return whether a pattern is dark over a whole polygon, shape (>= count, 2), mm."""
    left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
    for m in range(count):
        left, right = min(left, stops[m, 0]), max(right, stops[m, 0])
        low, high = min(low, stops[m, 1]), max(high, stops[m, 1])
    outside = table[k, OUTSIDE]
    if right <= -outside or left >= outside or high <= -outside or low >= outside:
        return True
    if table[k, CORNERS] <= 0.0:
        return False
    # dark if the whole polygon lies beyond the tangent of the same blade
    far = table[k, OFFSET] + table[k, MARGIN]
    x, y = stops[0, 0], stops[0, 1]
    if x * x + y * y < far * far:
        return False
    j = nearest_corner(table, corners, k, x, y)
    for side in (-1.0, 1.0):
        nx = corners[j, 0] * table[k, COSINE] - side * corners[j, 1] * table[k, SINE]
        ny = corners[j, 1] * table[k, COSINE] + side * corners[j, 0] * table[k, SINE]
        nearest = np.inf
        for m in range(count):
            nearest = min(nearest, nx * stops[m, 0] + ny * stops[m, 1])
        if nearest >= far:
            return True
    return False
