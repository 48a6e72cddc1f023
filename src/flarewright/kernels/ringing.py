"""Draw a bundle of rays through patterns that stand in the plane of the stop instead of the iris."""

import numpy as np

from ._jit import compiled, inner
from .bundle import SLIVER, _place_nodes, _plane_through, _pupil_area, _splat_polygon, _triangle_flux
from .clip import MAX_VERTICES, PP, PQ, PSTOP, PX, PY, clip_triangle, cut_to_rectangle, polygon_area
from .pattern import is_dark, pattern_value, place_in_pattern
from .raster import BLOCK, add_to_pixel, fill_polygon, plane_size
from .trace import STOP_X


@compiled
def draw_ringing(
    data, pupil, triangles, densities, crossings, patterns, table, corners, axes, to_pixels, gain, rgb, plane, gray,
    halves,
):  # fmt: skip
    """Add a bundle, and its mirror image where it has one, to a picture, its light multiplied by patterns.

    Parameters
    ----------
    data, pupil, triangles, densities, crossings, axes, to_pixels, gain, rgb, plane, halves
        As in `kernels.bundle.draw_bundle`.
    patterns : ndarray, shape (P,), float32
        Pictures of the stop, each 0 along its border, its first row the lowest; tables of corners and edges.
    table : ndarray, shape (C, TABLE_COLUMNS)
        Which of them make the pattern of each crossing of the stop, and where they lie (`kernels.pattern`).
    corners : ndarray, shape (J, 2)
        Directions of the corners of the iris.
    gray : ndarray, shape (H, BLOCK W), float32
        Zeros of the picture's size, and zeros afterwards: a bundle has one colour, which it is given at the end.

    Notes
    -----
    Rims cut geometrically. A pattern is taken at pixels' centres, so it has to be smooth over a pixel.
    """
    height, width = plane_size(plane)
    columns = PSTOP + 2 * crossings
    polygon, other = np.empty((MAX_VERTICES, columns)), np.empty((MAX_VERTICES, columns))
    values = np.empty(MAX_VERTICES)
    corner, stops = np.empty((3, 3)), np.empty((crossings, 3, 2))
    spots, blocked = np.empty((pupil.shape[0], 2)), np.empty(pupil.shape[0], dtype=np.int64)
    places, no_blades = np.empty((crossings, 11)), np.empty((0, 4))
    texture = (patterns, table, corners, places, np.zeros(width, dtype=np.float32))
    pixel_area = to_pixels[2] * to_pixels[3]
    first, last = height, -1
    for half in range(halves):
        mirror = 1.0 - 2.0 * half
        _place_nodes(data, mirror, crossings, no_blades, axes, to_pixels, spots, blocked)
        for t in range(triangles.shape[0]):
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
                dark = dark or is_dark(table, corners, k, stops[k])
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
            _spread_patterns(corner, stops, table, corners, places)
            base, gx, gy, low, high = _plane_through(corner, flux / drawn, gain / pixel_area, drawn)
            if left < 0.0 or right > width or top < 0.0 or bottom > height:
                count = cut_to_rectangle(polygon, count, other, values, float(width), float(height))
                if count < 3:
                    continue
            fill_polygon(polygon, count, base, gx, gy, low, high, rgb, gray, texture)
            first, last = min(first, max(int(top), 0)), max(last, min(int(bottom), height - 1))
    _add_gray(gray, first, last, rgb, plane)


@inner
def _add_gray(gray, first, last, rgb, plane):
    """Add the rows of a picture without colours to one in blocks."""
    red, green, blue = np.float32(rgb[0]), np.float32(rgb[1]), np.float32(rgb[2])
    flat, lines = plane.reshape(plane.size), gray.reshape(gray.size)
    for block in range(first * plane.shape[1], (last + 1) * plane.shape[1]):
        at, place = np.uint64(BLOCK * block), np.uint64(3 * BLOCK * block)
        for m in range(BLOCK):
            light = lines[at + np.uint64(m)]
            lines[at + np.uint64(m)] = np.float32(0.0)
            flat[place + np.uint64(m)] += red * light
            flat[place + np.uint64(BLOCK + m)] += green * light
            flat[place + np.uint64(2 * BLOCK + m)] += blue * light


@inner
def _place_in_stop(data, triangles, t, mirror, axes, stops):
    """Fill in where a triangle's corners cross the stop, in the upright frame."""
    for k in range(stops.shape[0]):
        for m in range(3):
            node = triangles[t, m]
            u, v = mirror * data[node, STOP_X + 2 * k], data[node, STOP_X + 2 * k + 1]
            stops[k, m, 0], stops[k, m, 1] = u * axes[0, 0] + v * axes[1, 0], u * axes[0, 1] + v * axes[1, 1]


@inner
def _spread_patterns(corner, stops, table, corners, places):
    """Fill in how a triangle's patterns are looked up, linear in the picture's pixels (`pattern.weave`)."""
    x1, y1 = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1]
    x2, y2 = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1]
    inverse = 1.0 / (x1 * y2 - x2 * y1)
    for k in range(places.shape[0]):
        places[k, 10] = place_in_pattern(table, corners, k, stops[k])
        for q in range(2):
            d0, d1, d2 = stops[k, 0, q], stops[k, 1, q], stops[k, 2, q]
            gx = ((d1 - d0) * y2 - (d2 - d0) * y1) * inverse
            gy = ((d2 - d0) * x1 - (d1 - d0) * x2) * inverse
            places[k, 3 * q] = d0 - gx * corner[0, 0] - gy * corner[0, 1]
            places[k, 3 * q + 1], places[k, 3 * q + 2] = gx, gy
            places[k, 6 + 2 * q], places[k, 7 + 2 * q] = min(d0, d1, d2), max(d0, d1, d2)
