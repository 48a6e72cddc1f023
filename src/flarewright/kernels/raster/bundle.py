"""Convert a traced bundle to light on the sensor: draw it, and integrate its flux, centroid and extent."""

import numpy as np

from ..jit.decorators import borrowing, compiled
from ..tracing.clip import (
    MAX_VERTICES,
    PP,
    PQ,
    PSTOP,
    PW,
    PX,
    PY,
    blade_value,
    clip_triangle,
    cut_to_rectangle,
    inscribed_square,
    polygon_area,
    slope_over,
)
from ..tracing.sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y
from .iris_mask import even_value, fill_through_mask, mask_texture, masked_point
from .polygons import add_to_pixel, fill_polygon, plane_size, splat_line

# polygons thinner than this, in square pixels, are drawn as lines
SLIVER = 1e-4
# the bit shared by all edges beyond the 60th (`_place_nodes`)
SHARED_BIT = 61
SHARED = np.int64(1 << SHARED_BIT)
# smaller cells and triangles, in square pixels, get a constant density: a gradient would be evaluated at pixel centres
# far outside them
EVEN_CELL, EVEN_TRIANGLE = 0.5, 1.0
# so are triangles thinner than this, pixels; cells of such ones are drawn triangle by triangle
THIN = 0.5
# a cell whose density departs from a plane by more than this part is drawn triangle by triangle
ROUGH = 5e-3
# a cell whose flux differs by more than this part from the flux of its nodes' densities is drawn with the flux of each
# triangle
UNEVEN = 0.01


@borrowing
def _triangle_flux(data, pupil, a, b, c):
    """Return the flux of a triangle (pupil area times mean weight) and its signed area on the sensor."""
    spread = (data[b, X] - data[a, X]) * (data[c, Y] - data[a, Y])
    spread -= (data[b, Y] - data[a, Y]) * (data[c, X] - data[a, X])
    mean = (data[a, WEIGHT] + data[b, WEIGHT] + data[c, WEIGHT]) / 3.0
    return _pupil_area(pupil, a, b, c) * mean, 0.5 * spread


@compiled
def node_densities(data, pupil, triangles):
    """Average the irradiance of the triangles around each node, by flux and area.

    Parameters
    ----------
    data : ndarray, shape (N, >= 5)
    pupil : ndarray, shape (N, 2)
    triangles : ndarray, shape (T, 3)

    Returns
    -------
    ndarray, shape (N,)
        Flux per mm^2 of the sensor; finite on caustics because the unsigned areas add.

    Notes
    -----
    Hullin 2011, section 4.3, "Smooth shading".
    """
    flux, area = np.empty(pupil.shape[0]), np.empty(pupil.shape[0])
    for k in range(flux.size):
        flux[k], area[k] = 0.0, 0.0
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if data[a, ALIVE] * data[b, ALIVE] * data[c, ALIVE] == 0.0:
            continue
        f, spread = _triangle_flux(data, pupil, a, b, c)
        for m in range(3):
            flux[triangles[t, m]] += f
            area[triangles[t, m]] += abs(spread)
    for k in range(flux.size):
        flux[k] = flux[k] / area[k] if area[k] > 0.0 else 0.0
    return flux


@compiled
def draw_bundle(
    data, pupil, triangles, densities, crossings, blades, mask, axes, to_pixels, gain, rgb, plane, halves,
):  # fmt: skip
    """Add a bundle, and its mirror image where it has one, to a picture; conserves flux.

    Parameters
    ----------
    data, pupil, triangles
        The traced bundle (`build_mesh`, `trace_nodes`).
    densities : ndarray, shape (N,)
        From `node_densities`.
    crossings, blades, axes
        As in `clip_triangle`.
    mask : tuple of ndarray, or None
        As in `fill_through_mask`; None where the iris has blades: the mask code is then not compiled.
    to_pixels : ndarray, shape (4,)
        Column of the axis, row of the axis, pixels per mm across and down.
    gain : float
        Factor of the flux: cosine of the field angle times the light's intensity.
    rgb : ndarray, shape (3,)
    plane : ndarray, shape (H, B, 3, BLOCK), float32
        Flux per pixel, added to (`kernels.raster.polygons.blank_plane`).
    halves : int
        2: draw the bundle and its mirror image in x; 1: draw the bundle alone.

    Notes
    -----
    A triangle's flux is its pupil area times its mean weight, spread over its image with a density that is linear
    between its nodes. Rims and blades cut it geometrically, so edges are exact, and folded parts of the map add up.
    Slivers are drawn as lines.
    """
    height, width = plane_size(plane)
    columns = PSTOP + 2 * crossings
    polygon, other = np.empty((MAX_VERTICES, columns)), np.empty((MAX_VERTICES, columns))
    values = np.empty(MAX_VERTICES)
    corner = np.empty((3, 3))
    spots, blocked = np.empty((pupil.shape[0], 2)), np.empty(pupil.shape[0], dtype=np.int64)
    pixel_area = to_pixels[2] * to_pixels[3]
    if mask is not None:
        texture, stops = mask_texture(mask, crossings, width), np.empty((crossings, 3, 2))
    for half in range(halves):
        mirror = 1.0 - 2.0 * half
        _place_nodes(data, mirror, crossings, blades, axes, to_pixels, spots, blocked)
        # an int literal has another type and would compile the callees a second time
        start = np.int64(0)
        while start < triangles.shape[0]:
            # a cell is a fan of triangles around its middle; most are smooth enough to be drawn as one polygon
            end = start + 1
            while end < triangles.shape[0] and triangles[end, 0] == triangles[start, 0]:
                end += 1
            # flux per node density, common to the cell; 0: use the flux of each triangle
            common = 0.0
            if end - start >= 4:
                count = _gather_cell(spots, blocked, triangles, start, end, width, height, polygon)
                if count < 0:
                    start = end
                    continue
                alike = 1.0
                if mask is not None and count > 0:
                    alike = _even_over_cell(data, triangles, start, end, mirror, crossings, axes, mask)
                    if alike == 0.0:
                        start = end
                        continue
                if count > 0 and alike > 0.0:
                    flux, area, meant = 0.0, 0.0, 0.0
                    for t in range(start, end):
                        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                        part, spread = _triangle_flux(data, pupil, a, b, c)
                        flux += part * gain
                        area += spread
                        meant += abs(spread) * (densities[a] + densities[b] + densities[c]) / 3.0
                    drawn = abs(area) * pixel_area
                    fits, base, gx, gy, dense_low, dense_high = _plane_over_cell(
                        spots, densities, triangles, start, end, flux / drawn, gain / pixel_area, drawn
                    )
                    if fits:
                        if mask is not None:
                            base, gx, gy = base * alike, gx * alike, gy * alike
                            dense_low, dense_high = dense_low * alike, dense_high * alike
                        fill_polygon(polygon, count, base, gx, gy, dense_low, dense_high, rgb, plane)
                        start = end
                        continue
                    # scale the node densities to the flux of the cell: the flux of single triangles would show, because
                    # their sides are chords
                    common = flux / meant if meant > 0.0 else 0.0
                    # beside a fold the node densities are unreliable
                    if abs(common - gain) > UNEVEN * gain:
                        common = 0.0
            # not a separate function: passing a dozen arrays would take as long as the triangle
            for t in range(start, end):
                a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                # one of the rays ended, or one edge blocks all three
                if min(blocked[a], blocked[b], blocked[c]) < 0 or blocked[a] & blocked[b] & blocked[c] & ~SHARED != 0:
                    continue
                left, right = min(spots[a, 0], spots[b, 0], spots[c, 0]), max(spots[a, 0], spots[b, 0], spots[c, 0])
                top, bottom = min(spots[a, 1], spots[b, 1], spots[c, 1]), max(spots[a, 1], spots[b, 1], spots[c, 1])
                if right <= 0.0 or left >= width or bottom <= 0.0 or top >= height:
                    continue
                flux, area = _triangle_flux(data, pupil, a, b, c)
                flux *= gain
                if common > 0.0:
                    flux = common * abs(area) * (densities[a] + densities[b] + densities[c]) / 3.0
                whole = blocked[a] | blocked[b] | blocked[c] == 0
                if whole and mask is None:
                    if left >= 0.0 and top >= 0.0 and int(left) == int(right) and int(top) == int(bottom):
                        add_to_pixel(plane, int(top), int(left), flux, rgb)
                        continue
                    count = 3
                    for m in range(3):
                        polygon[m, PX], polygon[m, PY] = spots[triangles[t, m], 0], spots[triangles[t, m], 1]
                else:
                    count = clip_triangle(
                        data, pupil, triangles[t], mirror, crossings, blades, axes, polygon, other, values
                    )
                    for k in range(count):
                        x, y = polygon[k, PX], polygon[k, PY]
                        polygon[k, PX] = to_pixels[0] - to_pixels[2] * (x * axes[0, 0] + y * axes[1, 0])
                        polygon[k, PY] = to_pixels[1] + to_pixels[3] * (x * axes[0, 1] + y * axes[1, 1])
                if count == 0:
                    continue
                drawn = abs(area) * pixel_area
                if drawn < SLIVER:
                    part = 1.0
                    if not whole or mask is not None:
                        part = abs(polygon_area(polygon, count, PP, PQ)) / _pupil_area(pupil, a, b, c)
                    if mask is not None:
                        part *= masked_point(polygon, crossings, mask, texture)
                    _splat_polygon(polygon, count, flux * part, rgb, plane)
                    continue
                for m in range(3):
                    k = triangles[t, m]
                    corner[m, 0], corner[m, 1], corner[m, 2] = spots[k, 0], spots[k, 1], densities[k]
                base, gx, gy, dense_low, dense_high = _plane_through(corner, flux / drawn, gain / pixel_area, drawn)
                if mask is not None:
                    for m in range(3):
                        _put_in_stop(data, triangles[t, m], mirror, axes, stops, m)
                    fill_through_mask(
                        polygon, count, crossings, corner, stops, mask, texture, base, gx, gy, dense_low, dense_high,
                        rgb, plane, other, values,
                    )  # fmt: skip
                    continue
                if left < 0.0 or right > width or top < 0.0 or bottom > height:
                    count = cut_to_rectangle(polygon, count, other, values, float(width), float(height))
                    if count < 3:
                        continue
                fill_polygon(polygon, count, base, gx, gy, dense_low, dense_high, rgb, plane)
            start = end


@borrowing
def _put_in_stop(data, node, mirror, axes, stops, m):
    """Fill the m-th place in the stop with those of a node, in the upright frame."""
    for k in range(stops.shape[0]):
        u, v = mirror * data[node, STOP_X + 2 * k], data[node, STOP_X + 2 * k + 1]
        stops[k, m, 0], stops[k, m, 1] = u * axes[0, 0] + v * axes[1, 0], u * axes[0, 1] + v * axes[1, 1]


@borrowing
def _even_over_cell(data, triangles, start, end, mirror, crossings, axes, mask):
    """Return a mask's transmittance over a cell if it is constant at all crossings, 0 where it is dark, else -1."""
    alike = 1.0
    for c in range(crossings):
        u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
        for t in range(start, end):
            k = triangles[t, 1]
            x, y = mirror * data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
            u, v = x * axes[0, 0] + y * axes[1, 0], x * axes[0, 1] + y * axes[1, 1]
            u_low, u_high, v_low, v_high = min(u_low, u), max(u_high, u), min(v_low, v), max(v_high, v)
        value = even_value(mask, u_low, u_high, v_low, v_high)
        if value == 0.0:
            return 0.0
        alike = -1.0 if value < 0.0 or alike < 0.0 else alike * value
    return alike


@borrowing
def _gather_cell(spots, blocked, triangles, start, end, width, height, polygon):
    """Collect the border of a cell; return its number of vertices.

    0: it cannot be drawn as one polygon. -1: nothing of it is seen. No edge may cut the cell, its map may not fold, and
    its border must be monotonic in y on both sides for `fill_polygon`.
    """
    count = end - start
    centre = triangles[start, 0]
    cx, cy = spots[centre, 0], spots[centre, 1]
    left, right, top, bottom = cx, cx, cy, cy
    cuts, common = blocked[centre], blocked[centre] & ~SHARED
    for t in range(start, end):
        k = triangles[t, 1]
        cuts, common = min(cuts, blocked[k]) if cuts < 0 else cuts | blocked[k], common & blocked[k]
        left, right = min(left, spots[k, 0]), max(right, spots[k, 0])
        top, bottom = min(top, spots[k, 1]), max(bottom, spots[k, 1])
    if cuts >= 0 and (common != 0 or right <= 0.0 or left >= width or bottom <= 0.0 or top >= height):
        return np.int64(-1)
    if cuts != 0 or left < 0.0 or right > width or top < 0.0 or bottom > height:
        return np.int64(0)
    low, high = np.inf, -np.inf
    turns = 0
    for m in range(count):
        t = start + m
        following = t + 1 if m + 1 < count else start
        beyond = following + 1 if following + 1 < end else start
        a, b = triangles[t, 1], triangles[t, 2]
        if b != triangles[following, 1]:
            return np.int64(0)
        ax, ay, bx, by = spots[a, 0], spots[a, 1], spots[b, 0], spots[b, 1]
        polygon[m, PX], polygon[m, PY] = ax, ay
        area = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
        low, high = min(low, area), max(high, area)
        if (by >= ay) != (spots[triangles[beyond, 1], 1] >= by):
            turns += 1
    if low * high <= 0.0 or turns != 2:
        return np.int64(0)
    longest = max(right - left, bottom - top)
    # what is as thin as a line may have a border that crosses itself, of which `fill_polygon` would lose a part
    if longest > 2.0 and max(abs(low), abs(high)) < 0.5 * THIN * longest:
        return np.int64(0)
    return np.int64(count)


@borrowing
def _plane_over_cell(spots, densities, triangles, start, end, mean, unit, drawn):
    """Fit a linear density to the nodes of a cell; return whether it fits, value at the origin, gradient, bounds.

    Notes
    -----
    Least squares over the border's nodes and the centre; scaled to the cell's mean density as in `_plane_through`.
    """
    if drawn < EVEN_CELL:
        return True, mean, 0.0, 0.0, mean, mean
    centre = triangles[start, 0]
    cx, cy, average = spots[centre, 0], spots[centre, 1], densities[centre]
    sx, sy, sxx, sxy, syy, sd, sdx, sdy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    area, area_x, area_y = 0.0, 0.0, 0.0
    for t in range(start, end):
        k, following = triangles[t, 1], triangles[t, 2]
        x, y, d = spots[k, 0] - cx, spots[k, 1] - cy, densities[k] - average
        to_x, to_y = spots[following, 0] - cx, spots[following, 1] - cy
        part = x * to_y - y * to_x
        area, area_x, area_y = area + part, area_x + part * (x + to_x) / 3.0, area_y + part * (y + to_y) / 3.0
        sx, sy, sd = sx + x, sy + y, sd + d
        sxx, sxy, syy, sdx, sdy = sxx + x * x, sxy + x * y, syy + y * y, sdx + x * d, sdy + y * d
    n = end - start + 1.0
    mx, my, md = sx / n, sy / n, sd / n
    sxx, sxy, syy, sdx, sdy = sxx - sx * mx, sxy - sx * my, syy - sy * my, sdx - sx * md, sdy - sy * md
    inverse = 1.0 / (sxx * syy - sxy * sxy)
    gx, gy = (sdx * syy - sdy * sxy) * inverse, (sdy * sxx - sdx * sxy) * inverse
    rough = abs(md - gx * mx - gy * my)
    low, high = np.inf, -np.inf
    for t in range(start, end):
        k = triangles[t, 1]
        smooth = md + gx * (spots[k, 0] - cx - mx) + gy * (spots[k, 1] - cy - my)
        rough = max(rough, abs(densities[k] - average - smooth))
        low, high = min(low, smooth), max(high, smooth)
    # the mean of a linear density over a polygon is its value at the centroid
    x, y = area_x / area, area_y / area
    middle = average + md + gx * (x - mx) + gy * (y - my)
    ratio = mean / middle
    if rough > ROUGH * middle or not 0.5 * unit < ratio < 2.0 * unit:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0
    gx, gy = gx * ratio, gy * ratio
    base = mean - gx * (cx + x) - gy * (cy + y)
    return True, base, gx, gy, (average + low) * ratio, (average + high) * ratio


@borrowing
def _place_nodes(data, mirror, crossings, blades, axes, to_pixels, spots, blocked):
    """Fill the nodes' places in pixels and a bit set of the edges that block them; 0: none, -1: the ray ended."""
    inner2 = inscribed_square(blades)
    for k in range(data.shape[0]):
        x, y = mirror * data[k, X], data[k, Y]
        # the upright picture is the sensor turned by 180 degrees
        spots[k, 0] = to_pixels[0] - to_pixels[2] * (x * axes[0, 0] + y * axes[1, 0])
        spots[k, 1] = to_pixels[1] + to_pixels[3] * (x * axes[0, 1] + y * axes[1, 1])
        if data[k, ALIVE] == 0.0:
            blocked[k] = -1
            continue
        found = np.int64(data[k, REL] > 1.0)
        for c in range(crossings):
            u, v = mirror * data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
            if u * u + v * v < inner2:
                continue
            up_x, up_y = u * axes[0, 0] + v * axes[1, 0], u * axes[0, 1] + v * axes[1, 1]
            for b in range(blades.shape[0]):
                if blade_value(blades, b, up_x, up_y) > 0.0:
                    # 24 blades at three crossings need more bits than there are: the last edges share one
                    found |= np.int64(1) << min(c * blades.shape[0] + b + 1, SHARED_BIT)
        blocked[k] = found


@borrowing
def _pupil_area(pupil, a, b, c):
    """Return the area of a triangle of the pupil; its nodes run counter-clockwise."""
    area = (pupil[b, 0] - pupil[a, 0]) * (pupil[c, 1] - pupil[a, 1])
    return 0.5 * (area - (pupil[b, 1] - pupil[a, 1]) * (pupil[c, 0] - pupil[a, 0]))


@borrowing
def _plane_through(corner, mean, unit, drawn):
    """Return the linear density through three nodes, scaled to a mean: value at the origin, gradient, bounds.

    `unit` is the flux per pixel of a node density of 1.
    """
    average = (corner[0, 2] + corner[1, 2] + corner[2, 2]) / 3.0
    ratio = mean / average if average > 0.0 else 0.0
    x1, y1 = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1]
    x2, y2 = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1]
    longest = max(abs(x1), abs(x2), abs(x2 - x1), abs(y1), abs(y2), abs(y2 - y1))
    # use a constant density at folds, where it differs strongly from the neighbours, and where a slope is invisible
    if drawn < max(EVEN_TRIANGLE, 0.5 * THIN * longest) or not 0.5 * unit < ratio < 2.0 * unit:
        return mean, 0.0, 0.0, mean, mean
    d0, d1, d2 = corner[0, 2] * ratio, corner[1, 2] * ratio, corner[2, 2] * ratio
    inverse = 1.0 / (x1 * y2 - x2 * y1)
    gx, gy = slope_over(x1, y1, x2, y2, inverse, d1 - d0, d2 - d0)
    base = d0 - gx * corner[0, 0] - gy * corner[0, 1]
    return base, gx, gy, min(min(d0, d1), d2), max(max(d0, d1), d2)


@borrowing
def _splat_polygon(polygon, count, flux, rgb, plane):
    """Draw a polygon without area as the line between its two farthest vertices."""
    best, a, b = -1.0, 0, 0
    for k in range(count):
        for m in range(k + 1, count):
            dx, dy = polygon[k, PX] - polygon[m, PX], polygon[k, PY] - polygon[m, PY]
            length = dx * dx + dy * dy
            if length > best:
                best, a, b = length, k, m
    splat_line(polygon[a, PX], polygon[a, PY], polygon[b, PX], polygon[b, PY], flux, rgb, plane)


@compiled
def measure_bundle(data, pupil, triangles, crossings, blades, axes, halves):
    """Integrate a bundle over the part of the pupil that passes.

    Parameters
    ----------
    data, pupil, triangles, crossings, blades, axes, halves
        As in `draw_bundle`.

    Returns
    -------
    ndarray, shape (8,)
        Integrals over the pupil of weight times 1, x, y, x^2 + y^2 (upright picture, mm); the accepted pupil area;
        largest |x|, least y and largest y on the sensor in the meridional frame.

    Notes
    -----
    Weight and position are linear within a triangle, so mid-edge quadrature is exact to second order.
    """
    columns = PSTOP + 2 * crossings
    polygon, other = np.empty((MAX_VERTICES, columns)), np.empty((MAX_VERTICES, columns))
    values = np.empty(MAX_VERTICES)
    sums = np.empty(8)
    for m in range(6):
        sums[m] = 0.0
    sums[6], sums[7] = np.inf, -np.inf
    for t in range(triangles.shape[0]):
        triangle = triangles[t]
        if data[triangle[0], ALIVE] * data[triangle[1], ALIVE] * data[triangle[2], ALIVE] == 0.0:
            continue
        for half in range(halves):
            count = clip_triangle(
                data, pupil, triangle, 1.0 - 2.0 * half, crossings, blades, axes, polygon, other, values
            )
            for k in range(count):
                sums[5] = max(sums[5], abs(polygon[k, PX]))
                sums[6], sums[7] = min(sums[6], polygon[k, PY]), max(sums[7], polygon[k, PY])
            for k in range(1, count - 1):
                area = (polygon[k, PP] - polygon[0, PP]) * (polygon[k + 1, PQ] - polygon[0, PQ])
                area -= (polygon[k, PQ] - polygon[0, PQ]) * (polygon[k + 1, PP] - polygon[0, PP])
                third = abs(area) / 6.0
                sums[4] += 3.0 * third
                for edge in range(3):
                    a = 0 if edge == 0 else (k if edge == 1 else k + 1)
                    b = k if edge == 0 else (k + 1 if edge == 1 else 0)
                    w = 0.5 * (polygon[a, PW] + polygon[b, PW]) * third
                    mx, my = 0.5 * (polygon[a, PX] + polygon[b, PX]), 0.5 * (polygon[a, PY] + polygon[b, PY])
                    x, y = mx * axes[0, 0] + my * axes[1, 0], mx * axes[0, 1] + my * axes[1, 1]
                    sums[0] += w
                    sums[1] -= w * x
                    sums[2] -= w * y
                    sums[3] += w * (x * x + y * y)
    return sums
