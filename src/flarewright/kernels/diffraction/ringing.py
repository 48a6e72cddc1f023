"""Draw a ray bundle whose light is multiplied by diffraction patterns in the stop plane instead of cut by the iris."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...typing import Floats, Indices, Pixels
from ..jit.decorators import borrowing, compiled, embedded
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


class StopPatterns(NamedTuple):
    """The diffraction patterns of a path in the stop plane.

    Attributes
    ----------
    values : ndarray, shape (P,), float32
        Pictures of the stop, each 0 along its border and with the lowest row first; tables of corners and edges.
    table : ndarray, shape (C, TABLE_COLUMNS)
        Location of the pattern of each crossing of the stop in `values` (`kernels.raster.stop_pattern`).
    corners : ndarray, shape (J, 2)
        Directions of the corners of the iris.
    """

    values: Pixels
    table: Floats
    corners: Floats


class _Bundle(NamedTuple):
    """A bundle (`kernels.raster.bundle.draw_bundle`) or its mirror image, and what is known of its nodes.

    Attributes
    ----------
    data, pupil, triangles, densities
        As in `draw_bundle`.
    spots, blocked : ndarray, shape (N, 2) and (N,)
        From `_place_nodes`.
    deep : ndarray, shape (N,), bool
        From `_find_deep`.
    mirror : float
        1, or -1 for the mirror image.
    """

    data: Floats
    pupil: Floats
    triangles: Indices
    densities: Floats
    spots: Floats
    blocked: Indices
    deep: Floats
    mirror: float


class _Target(NamedTuple):
    """Where a bundle is drawn: `axes`, `to_pixels`, `gain`, `rgb` and `plane` of `draw_bundle`."""

    axes: Floats
    to_pixels: Floats
    gain: float
    rgb: Floats
    plane: Floats


class _Room(NamedTuple):
    """Working arrays: polygons and their values, a triangle's corners, and places in the stop.

    Attributes
    ----------
    polygon, other : ndarray, shape (MAX_VERTICES, PSTOP + 2 C)
    values : ndarray, shape (MAX_VERTICES,)
    corner : ndarray, shape (3, 3)
        Column, row and density of a triangle's corners.
    stops : ndarray, shape (C, _CELL_NODES, 2)
        Places in the stop of the nodes of a cell or a triangle.
    no_blades : ndarray, shape (0, 4)
    """

    polygon: Floats
    other: Floats
    values: Floats
    corner: Floats
    stops: Floats
    no_blades: Floats


@compiled
def draw_ringing(data, pupil, triangles, densities, patterns, axes, to_pixels, gain, rgb, plane, halves):
    """Add a bundle, and its mirror image where it has one, to a picture, with its light multiplied by patterns.

    Parameters
    ----------
    data, pupil, triangles, densities, axes, to_pixels, gain, rgb, plane, halves
        As in `kernels.raster.bundle.draw_bundle`.
    patterns : StopPatterns

    Notes
    -----
    Rims cut geometrically. Patterns are sampled at pixel centres, so they must be smooth over a pixel. As in
    `draw_bundle`, a cell is drawn as one polygon if its density and its places in the stop are nearly linear.
    """
    _, width = plane_size(plane)
    crossings = patterns.table.shape[0]
    columns = PSTOP + 2 * crossings
    room = _Room(
        np.empty((MAX_VERTICES, columns)), np.empty((MAX_VERTICES, columns)), np.empty(MAX_VERTICES), np.empty((3, 3)),
        np.empty((crossings, _CELL_NODES, 2)), np.empty((0, 4)),
    )  # fmt: skip
    spots, blocked = np.empty((pupil.shape[0], 2)), np.empty(pupil.shape[0], dtype=np.int64)
    deep = np.empty(pupil.shape[0], dtype=np.bool_)
    places, light, where, beside, below = room_to_weave(crossings, width)
    texture = patterns.values, patterns.table, patterns.corners, places, light, where, beside, below
    target = _Target(axes, to_pixels, gain, rgb, plane)
    for half in range(halves):
        mirror = 1.0 - 2.0 * half
        _place_nodes(data, mirror, crossings, room.no_blades, axes, to_pixels, spots, blocked)
        _find_deep(data, crossings, patterns.table, deep)
        bundle = _Bundle(data, pupil, triangles, densities, spots, blocked, deep, mirror)
        start = np.int64(0)
        while start < triangles.shape[0]:
            end = start + 1
            while end < triangles.shape[0] and triangles[end, 0] == triangles[start, 0]:
                end += 1
            if end - start < 4 or not _draw_cell(bundle, start, end, texture, target, room):
                for t in range(start, end):
                    _draw_triangle(bundle, t, texture, target, room)
            start = end


@embedded
def _draw_cell(bundle, start, end, texture, target, room):
    """Draw the triangles around a node as one polygon; return False if they must be drawn one by one.

    A cell of which nothing is seen counts as drawn.
    """
    _, table, corners, places = texture[:4]
    data, triangles, spots = bundle.data, bundle.triangles, bundle.spots
    height, width = plane_size(target.plane)
    count = _gather_cell(spots, bundle.blocked, triangles, start, end, width, height, room.polygon)
    if count <= 0:
        return count < 0
    inside = bundle.deep[triangles[start, 0]]
    for t in range(start, end):
        inside = inside and bundle.deep[triangles[t, 1]]
    if not inside:
        _gather_stops(data, triangles, start, end, bundle.mirror, target.axes, room.stops)
        if _is_dark_anywhere(table, corners, room.stops, count + 1):
            return True
    flux, area = 0.0, 0.0
    for t in range(start, end):
        part, spread = _triangle_flux(data, bundle.pupil, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        flux += part * target.gain
        area += spread
    pixel_area = target.to_pixels[2] * target.to_pixels[3]
    drawn = abs(area) * pixel_area
    fits, base, gx, gy, low, high = _plane_over_cell(
        spots, bundle.densities, triangles, start, end, flux / drawn, target.gain / pixel_area, drawn
    )
    for k in range(table.shape[0]):
        places[k, WAY] = OPEN
    if fits and not inside:
        fits = _places_over_cell(spots, triangles, start, end, room.stops, table, corners, places)
    if fits:
        fill_polygon(room.polygon, count, base, gx, gy, low, high, target.rgb, target.plane, texture)
    return fits


@embedded
def _draw_triangle(bundle, t, texture, target, room):
    """Draw one triangle of a bundle."""
    values, table, corners, places = texture[:4]
    data, pupil, triangles, spots, blocked = bundle.data, bundle.pupil, bundle.triangles, bundle.spots, bundle.blocked
    polygon, corner, stops = room.polygon, room.corner, room.stops
    height, width = plane_size(target.plane)
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    if min(blocked[a], blocked[b], blocked[c]) < 0 or blocked[a] & blocked[b] & blocked[c] != 0:
        return
    left, right = min(spots[a, 0], spots[b, 0], spots[c, 0]), max(spots[a, 0], spots[b, 0], spots[c, 0])
    top, bottom = min(spots[a, 1], spots[b, 1], spots[c, 1]), max(spots[a, 1], spots[b, 1], spots[c, 1])
    if right <= 0.0 or left >= width or bottom <= 0.0 or top >= height:
        return
    open_ = bundle.deep[a] and bundle.deep[b] and bundle.deep[c]
    if not open_:
        _place_in_stop(data, triangles, t, bundle.mirror, target.axes, stops)
        # an int literal has another type and would compile the callees a second time
        if _is_dark_anywhere(table, corners, stops, np.int64(3)):
            return
    flux, area = _triangle_flux(data, pupil, a, b, c)
    flux *= target.gain
    whole = blocked[a] | blocked[b] | blocked[c] == 0
    pixel_area = target.to_pixels[2] * target.to_pixels[3]
    drawn = abs(area) * pixel_area
    inside = left >= 0.0 and top >= 0.0 and int(left) == int(right) and int(top) == int(bottom)
    if (whole and inside) or drawn < SLIVER:
        for k in range(0 if open_ else table.shape[0]):
            x = (stops[k, 0, 0] + stops[k, 1, 0] + stops[k, 2, 0]) / 3.0
            y = (stops[k, 0, 1] + stops[k, 1, 1] + stops[k, 2, 1]) / 3.0
            flux *= pattern_value(values, table, corners, k, x, y)
        if whole and inside:
            add_to_pixel(target.plane, int(top), int(left), flux, target.rgb)
            return
    count = _outline_of_triangle(bundle, t, whole, table.shape[0], target, room)
    if count == 0:
        return
    if drawn < SLIVER:
        if not whole:
            flux *= abs(polygon_area(polygon, count, PP, PQ)) / _pupil_area(pupil, a, b, c)
        _splat_polygon(polygon, count, flux, target.rgb, target.plane)
        return
    for m in range(3):
        k = triangles[t, m]
        corner[m, 0], corner[m, 1], corner[m, 2] = spots[k, 0], spots[k, 1], bundle.densities[k]
    if open_:
        for k in range(table.shape[0]):
            places[k, WAY] = OPEN
    else:
        _places_over_triangle(corner, stops, table, corners, places)
    base, gx, gy, low, high = _plane_through(corner, flux / drawn, target.gain / pixel_area, drawn)
    if left < 0.0 or right > width or top < 0.0 or bottom > height:
        count = cut_to_rectangle(polygon, count, room.other, room.values, float(width), float(height))
        if count < 3:
            return
    fill_polygon(polygon, count, base, gx, gy, low, high, target.rgb, target.plane, texture)


@borrowing
def _outline_of_triangle(bundle, t, whole, crossings, target, room):
    """Fill the polygon with what the rims leave of a triangle, in pixels; return its number of vertices."""
    polygon, axes, to_pixels = room.polygon, target.axes, target.to_pixels
    if whole:
        for m in range(3):
            k = bundle.triangles[t, m]
            polygon[m, PX], polygon[m, PY] = bundle.spots[k, 0], bundle.spots[k, 1]
        return np.int64(3)
    count = clip_triangle(
        bundle.data, bundle.pupil, bundle.triangles[t], bundle.mirror, crossings, room.no_blades, axes, polygon,
        room.other, room.values,
    )  # fmt: skip
    for k in range(count):
        x, y = polygon[k, PX], polygon[k, PY]
        polygon[k, PX] = to_pixels[0] - to_pixels[2] * (x * axes[0, 0] + y * axes[1, 0])
        polygon[k, PY] = to_pixels[1] + to_pixels[3] * (x * axes[0, 1] + y * axes[1, 1])
    return count


@borrowing
def _is_dark_anywhere(table, corners, stops, count):
    """Return whether any crossing's pattern is dark at the first `count` places in the stop."""
    dark = False
    for k in range(table.shape[0]):
        dark = dark or is_dark(table, corners, k, stops[k], count)
    return dark


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
