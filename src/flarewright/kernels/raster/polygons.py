"""Draw convex polygons with exact pixel coverage.

A polygon is cut into strips, each within one row of pixels and with one left and one right edge. The part of a pixel to
the right of an edge is an exact integral, so no polygon is too thin or too small to draw, and polygons that share an
edge add up without a seam.
"""

from math import floor, prod, sqrt

import numpy as np

from ..jit.decorators import borrowing, compiled, inlined
from ..jit.simd import LANES, add_colored, fetch
from ..tracing.clip import PX, PY
from .plane_memory import black_memory
from .stop_pattern import OPEN, WAY, weave

# a row of the picture is stored in blocks of this many pixels, each channel separately: one vector to the compiler
BLOCK = LANES
# floats of a block: three channels
_FLOATS = 3 * BLOCK
# prefetch distance in rows: rows lie too far apart in memory for the hardware prefetcher
_PREFETCH_ROWS = 3


def plane_shape(width, height):
    """Return the shape of a picture of width x height pixels in blocks, (H, ceil(W / BLOCK), 3, BLOCK).

    The last block of a row may have pixels beyond the width: drawn on, but dropped by `to_pixels`.
    """
    return height, -(-width // BLOCK), 3, BLOCK


def blank_plane(width, height):
    """Return a black picture in the block form of `fill_polygon`.

    Parameters
    ----------
    width, height : int
        Pixels.

    Returns
    -------
    ndarray of float32, of `plane_shape`
    """
    shape = plane_shape(width, height)
    return black_memory(prod(shape)).reshape(shape)


def to_pixels(plane, width):
    """Return the pixels of a picture stored in blocks, shape (H, W, 3), float32."""
    height, blocks = plane.shape[:2]
    return np.ascontiguousarray(np.moveaxis(plane, 2, 3)).reshape(height, blocks * BLOCK, 3)[:, :width]


@inlined
def _right_of(t, near, far, half_inverse):
    """Integrate max(t - x, 0) over a strip whose edge runs from x = near to x = far."""
    u = min(max(t, near), far) - near
    return u * u * half_inverse + max(t - far, 0.0)


@inlined
def _share(c, la, lb, l_inverse, ra, rb, r_inverse):
    """Return the area of pixel [c, c + 1] between two edges, per height of the strip."""
    left = _right_of(c + 1.0, la, lb, l_inverse) - _right_of(c, la, lb, l_inverse)
    return left - _right_of(c + 1.0, ra, rb, r_inverse) + _right_of(c, ra, rb, r_inverse)


@inlined
def _covered(c, near, far, inverse):
    """Return the part of pixel [c, c + 1] to the right of an edge, computed without cancellation."""
    one = np.float32(1.0)
    start, end = min(max(c, near), far), min(max(c + one, near), far)
    return inverse * (end - start) * (np.float32(0.5) * (start + end) - near) + max(
        c + one - max(far, c), np.float32(0.0)
    )


@inlined
def plane_size(plane):
    """Return height and width of a picture in either form of `fill_polygon`."""
    return plane.shape[0], plane.shape[1] if plane.ndim == 3 else BLOCK * plane.shape[1]


@borrowing
def _vertex_after(k, way, count):
    """Return the index of the vertex `way` steps ahead around a polygon."""
    k += way
    return k - count if k >= count else k


@borrowing
def _fill_rows(
    flat, blocks, lanes, row, rows, depth, xl0, xl1, left_slope, xr0, xr1, right_slope, start, gx, gy,
    density_low, density_high, rgb,
):  # fmt: skip
    """Add the strips of a polygon in consecutive rows that share their two edges.

    Each pixel receives its exact coverage times the density at its centre. `flat` is the picture as a flat array,
    indexed by unsigned integers: the check for negative indices would prevent vectorisation of the loop over a block.
    """
    la, lb = min(xl0, xl1), max(xl0, xl1)
    ra, rb = min(xr0, xr1), max(xr0, xr1)
    l_inverse, r_inverse = np.float32(1.0 / max(lb - la, 1e-6)), np.float32(1.0 / max(rb - ra, 1e-6))
    red, green, blue = np.float32(rgb[0] * depth), np.float32(rgb[1] * depth), np.float32(rgb[2] * depth)
    slope, low, high = np.float32(gx), np.float32(density_low), np.float32(density_high)
    ahead = np.uint64(_PREFETCH_ROWS * blocks * _FLOATS)
    for _ in range(rows):
        place = np.uint64((row * blocks + int(la) // BLOCK) * _FLOATS)
        for block in range(int(la) // BLOCK, min(int(rb) // BLOCK, blocks - 1) + 1):
            x0 = float(BLOCK * block)
            first = np.float32(start + gx * (x0 + 0.5))
            # a block spans two cache lines
            fetch(flat, place + ahead)
            fetch(flat, place + ahead + np.uint64(16))
            if x0 >= lb and x0 + BLOCK <= ra:
                # no edge crosses this block. The loop length is a variable: the compiler would unroll a constant one
                for m in range(lanes):
                    # int32 as in `weave`
                    value = min(max(first + slope * np.float32(np.int32(m)), low), high)
                    at = place + np.uint64(m)
                    flat[at] += red * value
                    flat[at + np.uint64(BLOCK)] += green * value
                    flat[at + np.uint64(2 * BLOCK)] += blue * value
            else:
                l0, l1, r0, r1 = np.float32(la - x0), np.float32(lb - x0), np.float32(ra - x0), np.float32(rb - x0)
                for m in range(BLOCK):
                    c = np.float32(m)
                    value = min(max(first + slope * c, low), high) * (
                        _covered(c, l0, l1, l_inverse) - _covered(c, r0, r1, r_inverse)
                    )
                    at = place + np.uint64(m)
                    flat[at] += red * value
                    flat[at + np.uint64(BLOCK)] += green * value
                    flat[at + np.uint64(2 * BLOCK)] += blue * value
            place += np.uint64(_FLOATS)
        la, lb, ra, rb = la + left_slope, lb + left_slope, ra + right_slope, rb + right_slope
        start += gy
        row += 1


@borrowing
def _fill_woven(flat, blocks, row, depth, xl0, xl1, xr0, xr1, start, gx, density_low, density_high, rgb, light):
    """Add a strip of a polygon as `_fill_rows` does, multiplied by `light`, which is overwritten."""
    la, lb = min(xl0, xl1), max(xl0, xl1)
    ra, rb = min(xr0, xr1), max(xr0, xr1)
    l_inverse, r_inverse = np.float32(1.0 / max(lb - la, 1e-6)), np.float32(1.0 / max(rb - ra, 1e-6))
    slope, low, high = np.float32(gx), np.float32(density_low), np.float32(density_high)
    red, green, blue = np.float32(rgb[0] * depth), np.float32(rgb[1] * depth), np.float32(rgb[2] * depth)
    ahead = np.uint64(_PREFETCH_ROWS * blocks * _FLOATS)
    for block in range(int(la) // BLOCK, min(int(rb) // BLOCK, blocks - 1) + 1):
        x0 = float(BLOCK * block)
        base = np.float32(start + gx * (x0 + 0.5))
        l0, l1, r0, r1 = np.float32(la - x0), np.float32(lb - x0), np.float32(ra - x0), np.float32(rb - x0)
        begin = np.uint64(BLOCK * block)
        for m in range(BLOCK):
            c = np.float32(m)
            light[begin + np.uint64(m)] *= min(max(base + slope * c, low), high) * (
                _covered(c, l0, l1, l_inverse) - _covered(c, r0, r1, r_inverse)
            )
        place = np.uint64((row * blocks + block) * _FLOATS)
        fetch(flat, place + ahead)
        fetch(flat, place + ahead + np.uint64(16))
        add_colored(flat, place, light, begin, red, green, blue)


@inlined
def _strip(width, xl0, xl1, xr0, xr1):
    """Return a strip's first pixel, number of pixels, edges relative to that pixel, and range of uncut pixels."""
    la, lb = min(xl0, xl1), max(xl0, xl1)
    ra, rb = min(xr0, xr1), max(xr0, xr1)
    first = int(la)
    count = min(int(rb) + 1, width) - first
    la, lb, ra, rb = la - first, lb - first, ra - first, rb - first
    l_inverse, r_inverse = 0.5 / max(lb - la, 1e-9), 0.5 / max(rb - ra, 1e-9)
    return first, count, la, lb, ra, rb, l_inverse, r_inverse, int(lb) + 1, int(ra)


@borrowing
def _mark_strip(flat, width, row, depth, xl0, xl1, xr0, xr1, density, rgb):
    """Add a strip of constant density to a picture of row differences: only pixels at its edges change."""
    first, count, la, lb, ra, rb, l_inverse, r_inverse, whole, rest = _strip(width, xl0, xl1, xr0, xr1)
    if rest < whole:
        whole, rest = count, count
    before = 0.0
    for part in range(2):
        # first the pixels of the left edge and the first whole one, then those of the right edge and the one behind
        start, end = (0, whole) if part == 0 else (rest, count)
        for c in range(start, end + 1):
            here = 0.0
            if c < end:
                here = _share(float(c), la, lb, l_inverse, ra, rb, r_inverse)
            elif part == 0 and whole < rest:
                here = 1.0
            if first + c < width:
                place = np.uint64(3 * (row * width + first + c))
                change = (here - before) * depth * density
                flat[place] += rgb[0] * change
                flat[place + np.uint64(1)] += rgb[1] * change
                flat[place + np.uint64(2)] += rgb[2] * change
            before = here


@borrowing
def _mark_woven(flat, width, row, depth, xl0, xl1, xr0, xr1, density, rgb, light):
    """Add a strip as `_mark_strip` does, multiplied by `light`."""
    first, count, la, lb, ra, rb, l_inverse, r_inverse, whole, rest = _strip(width, xl0, xl1, xr0, xr1)
    before = 0.0
    for c in range(count + 1):
        here = 0.0
        if c < count:
            here = light[np.uint64(first + c)] * density
            if c < whole or c >= rest:
                here *= _share(float(c), la, lb, l_inverse, ra, rb, r_inverse)
        # where the patterns are constant the difference is 0
        if here != before and first + c < width:
            place = np.uint64(3 * (row * width + first + c))
            change = (here - before) * depth
            flat[place] += rgb[0] * change
            flat[place + np.uint64(1)] += rgb[1] * change
            flat[place + np.uint64(2)] += rgb[2] * change
        before = here


@compiled
def sum_rows(differences, pixels):
    """Sum a picture of row differences to the picture.

    Parameters
    ----------
    differences : ndarray, shape (H, W, 3), float64
        From `fill_polygon` in its second form.
    pixels : ndarray, shape (H, W, 3), float32 or float64
        Filled; may be the differences themselves.
    """
    for row in range(differences.shape[0]):
        red, green, blue = 0.0, 0.0, 0.0
        for c in range(differences.shape[1]):
            red += differences[row, c, 0]
            green += differences[row, c, 1]
            blue += differences[row, c, 2]
            pixels[row, c, 0], pixels[row, c, 1], pixels[row, c, 2] = red, green, blue


@borrowing
def fill_polygon(polygon, count, density, gx, gy, density_low, density_high, rgb, plane, texture=None):
    """Add a convex polygon of linearly varying density to a picture.

    Parameters
    ----------
    polygon : ndarray, shape (V, >= 2)
        Vertices in pixels inside the picture (columns PX, PY; pixel k spans [k, k + 1]).
    count : int
    density, gx, gy : float
        Flux per pixel at the picture's origin and its gradient.
    density_low, density_high : float
        Bounds of the density, for pixels whose centre lies outside the polygon.
    rgb : ndarray, shape (3,)
    plane : ndarray, shape (H, B, 3, BLOCK), float32, or (H, W, 3), float64
        Added to. In the second form the density must be constant and only differences along the rows are stored, so
        that the cost depends on the border and not on the area; `sum_rows` computes the picture from them.
    texture : tuple of ndarray, or None
        Patterns to multiply the light by: the first arguments of `kernels.raster.stop_pattern.weave`.

    Notes
    -----
    A pixel receives exact coverage times the density at its centre; the sum over pixels is the polygon's flux.
    """
    woven = False
    if texture is not None:
        # unpack once and not for every strip: referencing an array takes as long as a few pixels
        patterns, table, corners, places, light, where, beside, below = texture
        for k in range(places.shape[0]):
            woven = woven or places[k, WAY] != OPEN
    top = bottom = count - count  # zeros of the type of `count`, not literals
    twice_area = 0.0
    for k in range(count):
        if polygon[k, PY] < polygon[top, PY]:
            top = k
        if polygon[k, PY] > polygon[bottom, PY]:
            bottom = k
        following = k + 1 if k + 1 < count else 0
        twice_area += (polygon[k, PX] - polygon[0, PX]) * (polygon[following, PY] - polygon[0, PY])
        twice_area -= (polygon[following, PX] - polygon[0, PX]) * (polygon[k, PY] - polygon[0, PY])
    # y points down: with positive area the vertices run down on the right
    way = 1 if twice_area > 0.0 else count - 1
    left, right = top, top
    y, end = polygon[top, PY], polygon[bottom, PY]
    row = np.int64(y)
    flat = plane.reshape(plane.size)
    last_row = plane.shape[0] - 1
    left_slope, right_slope = 0.0, 0.0
    left_end, right_end = y, y
    while y < end:
        while left_end <= y and left != bottom:
            following = _vertex_after(left, count - way, count)
            left_end = polygon[following, PY]
            if left_end > y:
                left_slope = (polygon[following, PX] - polygon[left, PX]) / (left_end - polygon[left, PY])
                break
            left = following
        while right_end <= y and right != bottom:
            following = _vertex_after(right, way, count)
            right_end = polygon[following, PY]
            if right_end > y:
                right_slope = (polygon[following, PX] - polygon[right, PX]) / (right_end - polygon[right, PY])
                break
            right = following
        level = min(left_end, right_end)
        y_next = min(row + 1.0, level)
        rows = np.int64(1)
        if y_next > y and row <= last_row:
            xl, xr = polygon[left, PX], polygon[right, PX]
            yl, yr = polygon[left, PY], polygon[right, PY]
            xl0, xl1 = xl + (y - yl) * left_slope, xl + (y_next - yl) * left_slope
            xr0, xr1 = xr + (y - yr) * right_slope, xr + (y_next - yr) * right_slope
            if plane.ndim == 3 and texture is not None and woven:
                first, last = int(min(xl0, xl1)), min(int(max(xr0, xr1)), plane.shape[1] - 1)
                weave(patterns, table, corners, places, light, where, beside, below, row, first, last)
                _mark_woven(flat, plane.shape[1], row, y_next - y, xl0, xl1, xr0, xr1, density, rgb, light)
            elif plane.ndim == 3:
                _mark_strip(flat, plane.shape[1], row, y_next - y, xl0, xl1, xr0, xr1, density, rgb)
            else:
                if texture is not None and woven:
                    first, last = int(min(xl0, xl1)) // BLOCK, min(int(max(xr0, xr1)) // BLOCK, plane.shape[1] - 1)
                    weave(
                        patterns, table, corners, places, light, where, beside, below, row, BLOCK * first,
                        BLOCK * last + BLOCK - 1,
                    )  # fmt: skip
                    _fill_woven(
                        flat, plane.shape[1], row, y_next - y, xl0, xl1, xr0, xr1, density + gy * (row + 0.5), gx,
                        density_low, density_high, rgb, light,
                    )  # fmt: skip
                else:
                    if y == row and level >= row + 2.0:
                        # whole rows without a vertex
                        rows = min(int(level), last_row + 1) - row
                        y_next = float(row + rows)
                    _fill_rows(
                        flat, plane.shape[1], plane.shape[3], row, rows, min(y_next - y, 1.0), xl0, xl1, left_slope,
                        xr0, xr1, right_slope, density + gy * (row + 0.5), gx, gy, density_low, density_high, rgb,
                    )  # fmt: skip
        if left_end <= y_next:
            left = _vertex_after(left, count - way, count)
        if right_end <= y_next:
            right = _vertex_after(right, way, count)
        if y_next >= row + 1.0:
            row += rows
        y = y_next


@borrowing
def add_to_pixel(plane, row, column, light, rgb):
    """Add light to one pixel of a picture in blocks."""
    block, m = column // BLOCK, column % BLOCK
    plane[row, block, 0, m] += rgb[0] * light
    plane[row, block, 1, m] += rgb[1] * light
    plane[row, block, 2, m] += rgb[2] * light


@borrowing
def splat_line(x0, y0, x1, y1, flux, rgb, plane):
    """Spread flux along a segment, each sample bilinearly over its four nearest pixels: for slivers without area.

    Parameters
    ----------
    x0, y0, x1, y1 : float
        Segment in pixels.
    flux : float
    rgb : ndarray, shape (3,)
    plane : ndarray, shape (H, B, 3, BLOCK), float32
        Added to; light outside the picture is dropped.
    """
    height, width = plane.shape[0], BLOCK * plane.shape[1]
    length = sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    samples = int(min(2.0 * length, 8192.0)) + 1
    share = flux / samples
    for k in range(samples):
        t = (k + 0.5) / samples
        x, y = x0 + t * (x1 - x0) - 0.5, y0 + t * (y1 - y0) - 0.5
        if not (-1.0 < x < width and -1.0 < y < height):
            continue
        c, r = int(floor(x)), int(floor(y))
        fx, fy = x - c, y - r
        for m in range(4):
            cc, rr = c + m % 2, r + m // 2
            part = (fx if m % 2 else 1.0 - fx) * (fy if m // 2 else 1.0 - fy) * share
            if 0 <= cc < width and 0 <= rr < height:
                add_to_pixel(plane, rr, cc, part, rgb)
