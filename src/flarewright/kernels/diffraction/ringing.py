"""Draw a ray bundle whose light is multiplied by diffraction patterns in the stop plane instead of cut by the iris."""

import numpy as np

from ..jit.decorators import borrowing, compiled
from ..raster.bundle import (
    SLIVER,
    _gather_cell,
    _place_nodes,
    _plane_over_cell,
    _plane_through,
    _pupil_area,
    _put_in_stop,
    _splat_polygon,
    _triangle_flux,
)
from ..raster.polygons import add_to_pixel, fill_polygon, plane_size
from ..raster.stop_pattern import (
    ANYWHERE,
    DEEP,
    EDGE_PER_MM,
    FINE,
    ON_EDGE,
    OPEN,
    WAY,
    is_dark,
    pattern_value,
    place_in_pattern,
    room_to_weave,
)
from ..tracing.clip import (
    MAX_VERTICES,
    PP,
    PQ,
    PSTOP,
    PX,
    PY,
    clip_triangle,
    cut_to_rectangle,
    polygon_area,
    slope_over,
)
from ..tracing.sequential import STOP_X

# largest number of nodes of a cell: its centre and eight around it
_CELL_NODES = 9


@compiled
def draw_ringing(
    data, pupil, triangles, densities, crossings, patterns, table, corners, axes, to_pixels, gain, rgb, plane, halves,
):  # fmt: skip
    """Add a bundle, and its mirror image where it has one, to a picture, with its light multiplied by patterns.

    Parameters
    ----------
    data, pupil, triangles, densities, crossings, axes, to_pixels, gain, rgb, plane, halves
        As in `kernels.raster.bundle.draw_bundle`.
    patterns : ndarray, shape (P,), float32
        Pictures of the stop, each 0 along its border and with the lowest row first; tables of corners and edges.
    table : ndarray, shape (C, TABLE_COLUMNS)
        Location of the pattern of each crossing of the stop in `patterns` (`kernels.raster.stop_pattern`).
    corners : ndarray, shape (J, 2)
        Directions of the corners of the iris.

    Notes
    -----
    Rims cut geometrically. Patterns are sampled at pixel centres, so they must be smooth over a pixel. As in
    `draw_bundle`, a cell is drawn as one polygon if its density and its places in the stop are nearly linear.
    """
    height, width = plane_size(plane)
    columns = PSTOP + 2 * crossings
    polygon, other = np.empty((MAX_VERTICES, columns)), np.empty((MAX_VERTICES, columns))
    values = np.empty(MAX_VERTICES)
    corner, stops = np.empty((3, 3)), np.empty((crossings, _CELL_NODES, 2))
    spots, blocked = np.empty((pupil.shape[0], 2)), np.empty(pupil.shape[0], dtype=np.int64)
    deep = np.empty(pupil.shape[0], dtype=np.bool_)
    no_blades = np.empty((0, 4))
    places, light, where, beside, below = room_to_weave(crossings, width)
    texture = patterns, table, corners, places, light, where, beside, below
    # an int literal has another type and would compile the callees a second time
    three = np.int64(3)
    pixel_area = to_pixels[2] * to_pixels[3]
    for half in range(halves):
        mirror = 1.0 - 2.0 * half
        _place_nodes(data, mirror, crossings, no_blades, axes, to_pixels, spots, blocked)
        _find_deep(data, crossings, table, deep)
        start = np.int64(0)
        while start < triangles.shape[0]:
            end = start + 1
            while end < triangles.shape[0] and triangles[end, 0] == triangles[start, 0]:
                end += 1
            if end - start >= 4:
                count = _gather_cell(spots, blocked, triangles, start, end, width, height, polygon)
                if count > 0:
                    inside = deep[triangles[start, 0]]
                    for t in range(start, end):
                        inside = inside and deep[triangles[t, 1]]
                    if not inside:
                        _gather_stops(data, triangles, start, end, mirror, axes, stops)
                        dark = False
                        for k in range(crossings):
                            dark = dark or is_dark(table, corners, k, stops[k], count + 1)
                        if dark:
                            start = end
                            continue
                    flux, area = 0.0, 0.0
                    for t in range(start, end):
                        part, spread = _triangle_flux(data, pupil, triangles[t, 0], triangles[t, 1], triangles[t, 2])
                        flux += part * gain
                        area += spread
                    drawn = abs(area) * pixel_area
                    fits, base, gx, gy, low, high = _plane_over_cell(
                        spots, densities, triangles, start, end, flux / drawn, gain / pixel_area, drawn
                    )
                    for k in range(crossings):
                        places[k, WAY] = OPEN
                    if fits and not inside:
                        fits = _places_over_cell(spots, triangles, start, end, stops, table, corners, places)
                    if fits:
                        fill_polygon(polygon, count, base, gx, gy, low, high, rgb, plane, texture)
                        start = end
                        continue
            for t in range(start, end):
                a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                if min(blocked[a], blocked[b], blocked[c]) < 0 or blocked[a] & blocked[b] & blocked[c] != 0:
                    continue
                left, right = min(spots[a, 0], spots[b, 0], spots[c, 0]), max(spots[a, 0], spots[b, 0], spots[c, 0])
                top, bottom = min(spots[a, 1], spots[b, 1], spots[c, 1]), max(spots[a, 1], spots[b, 1], spots[c, 1])
                if right <= 0.0 or left >= width or bottom <= 0.0 or top >= height:
                    continue
                _place_in_stop(data, triangles, t, mirror, axes, stops)
                dark = False
                for k in range(crossings):
                    dark = dark or is_dark(table, corners, k, stops[k], three)
                if dark:
                    continue
                flux, area = _triangle_flux(data, pupil, a, b, c)
                flux *= gain
                whole = blocked[a] | blocked[b] | blocked[c] == 0
                drawn = abs(area) * pixel_area
                inside = left >= 0.0 and top >= 0.0 and int(left) == int(right) and int(top) == int(bottom)
                if (whole and inside) or drawn < SLIVER:
                    for k in range(crossings):
                        x = (stops[k, 0, 0] + stops[k, 1, 0] + stops[k, 2, 0]) / 3.0
                        y = (stops[k, 0, 1] + stops[k, 1, 1] + stops[k, 2, 1]) / 3.0
                        flux *= pattern_value(patterns, table, corners, k, x, y)
                    if whole and inside:
                        add_to_pixel(plane, int(top), int(left), flux, rgb)
                        continue
                count = 3
                if whole:
                    for m in range(3):
                        polygon[m, PX], polygon[m, PY] = spots[triangles[t, m], 0], spots[triangles[t, m], 1]
                else:
                    count = clip_triangle(
                        data, pupil, triangles[t], mirror, crossings, no_blades, axes, polygon, other, values
                    )
                    if count == 0:
                        continue
                    for k in range(count):
                        x, y = polygon[k, PX], polygon[k, PY]
                        polygon[k, PX] = to_pixels[0] - to_pixels[2] * (x * axes[0, 0] + y * axes[1, 0])
                        polygon[k, PY] = to_pixels[1] + to_pixels[3] * (x * axes[0, 1] + y * axes[1, 1])
                if drawn < SLIVER:
                    if not whole:
                        flux *= abs(polygon_area(polygon, count, PP, PQ)) / _pupil_area(pupil, a, b, c)
                    _splat_polygon(polygon, count, flux, rgb, plane)
                    continue
                for m in range(3):
                    k = triangles[t, m]
                    corner[m, 0], corner[m, 1], corner[m, 2] = spots[k, 0], spots[k, 1], densities[k]
                _places_over_triangle(corner, stops, table, corners, places)
                base, gx, gy, low, high = _plane_through(corner, flux / drawn, gain / pixel_area, drawn)
                if left < 0.0 or right > width or top < 0.0 or bottom > height:
                    count = cut_to_rectangle(polygon, count, other, values, float(width), float(height))
                    if count < 3:
                        continue
                fill_polygon(polygon, count, base, gx, gy, low, high, rgb, plane, texture)
            start = end


@borrowing
def _find_deep(data, crossings, table, deep):
    """Fill whether each node lies so far inside the iris at all crossings that the patterns are 1 there."""
    for k in range(data.shape[0]):
        inside = True
        for c in range(crossings):
            u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
            inside = inside and u * u + v * v < table[c, DEEP] * table[c, DEEP]
        deep[k] = inside


@borrowing
def _place_in_stop(data, triangles, t, mirror, axes, stops):
    """Fill `stops` with the places where a triangle's corners cross the stop."""
    for m in range(3):
        _put_in_stop(data, triangles[t, m], mirror, axes, stops, m)


@borrowing
def _gather_stops(data, triangles, start, end, mirror, axes, stops):
    """Fill `stops` with the places where a cell's centre and the nodes around it cross the stop."""
    _put_in_stop(data, triangles[start, 0], mirror, axes, stops, np.int64(0))
    for t in range(start, end):
        _put_in_stop(data, triangles[t, 1], mirror, axes, stops, t - start + 1)


@borrowing
def _places_over_triangle(corner, stops, table, corners, places):
    """Fill the look-up coordinates of a triangle's patterns, linear in the pixel coordinates (`stop_pattern.weave`)."""
    x1, y1 = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1]
    x2, y2 = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1]
    inverse = 1.0 / (x1 * y2 - x2 * y1)
    for k in range(places.shape[0]):
        places[k, WAY] = place_in_pattern(table, corners, k, stops[k], np.int64(3))
        for q in range(2):
            d0, d1, d2 = stops[k, 0, q], stops[k, 1, q], stops[k, 2, q]
            gx, gy = slope_over(x1, y1, x2, y2, inverse, d1 - d0, d2 - d0)
            places[k, 3 * q] = d0 - gx * corner[0, 0] - gy * corner[0, 1]
            places[k, 3 * q + 1], places[k, 3 * q + 2] = gx, gy
            places[k, 6 + 2 * q], places[k, 7 + 2 * q] = min(d0, d1, d2), max(d0, d1, d2)


@borrowing
def _places_over_cell(spots, triangles, start, end, stops, table, corners, places):
    """Fill the look-up coordinates of a cell's patterns; return False if they are not linear in the pixel coordinates.

    Notes
    -----
    Least squares over the border's nodes and the centre, as in `bundle._plane_over_cell`.
    """
    n = end - start + 1
    cx, cy = spots[triangles[start, 0], 0], spots[triangles[start, 0], 1]
    sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0
    for t in range(start, end):
        x, y = spots[triangles[t, 1], 0] - cx, spots[triangles[t, 1], 1] - cy
        sx, sy, sxx, sxy, syy = sx + x, sy + y, sxx + x * x, sxy + x * y, syy + y * y
    mx, my = sx / n, sy / n
    sxx, sxy, syy = sxx - sx * mx, sxy - sx * my, syy - sy * my
    inverse = 1.0 / (sxx * syy - sxy * sxy)
    for k in range(places.shape[0]):
        way = place_in_pattern(table, corners, k, stops[k], n)
        places[k, WAY] = way
        if way == OPEN:
            continue
        if way == ANYWHERE:
            # each of its triangles may lie along a single blade, for which the look-up is faster
            return False
        allowed = table[k, FINE]
        if way == ON_EDGE:
            allowed *= table[k, EDGE_PER_MM]
        for q in range(1 if way == ON_EDGE else 2):
            sd, sdx, sdy = 0.0, 0.0, 0.0
            middle = stops[k, 0, q]
            for m in range(1, n):
                node = triangles[start + m - 1, 1]
                x, y, d = spots[node, 0] - cx, spots[node, 1] - cy, stops[k, m, q] - middle
                sd, sdx, sdy = sd + d, sdx + x * d, sdy + y * d
            md = sd / n
            sdx, sdy = sdx - sd * mx, sdy - sd * my
            gx, gy = (sdx * syy - sdy * sxy) * inverse, (sdy * sxx - sdx * sxy) * inverse
            level = md - gx * mx - gy * my
            off, low, high = abs(level), middle, middle
            for m in range(1, n):
                node = triangles[start + m - 1, 1]
                d = stops[k, m, q] - middle
                off = max(off, abs(level + gx * (spots[node, 0] - cx) + gy * (spots[node, 1] - cy) - d))
                low, high = min(low, stops[k, m, q]), max(high, stops[k, m, q])
            if not off <= allowed:
                return False
            places[k, 3 * q], places[k, 3 * q + 1], places[k, 3 * q + 2] = middle + level - gx * cx - gy * cy, gx, gy
            places[k, 6 + 2 * q], places[k, 7 + 2 * q] = low, high
    return True
