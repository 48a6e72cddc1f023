"""Draw convex polygons with exact pixel coverage, so that what is drawn is what was meant to be drawn.

Each edge adds the area to its right to the pixels it crosses, as differences along the row; a running sum over the row
gives every pixel's coverage (the way font rasterisers work). No triangle is too thin or too small for it.
"""

from math import floor, sqrt

import numpy as np

from ._jit import compiled
from .clip import PX, PY


@compiled
def _add_edge(cover, first_row, low, high, x0, y0, x1, y1):
    """Add one edge's signed coverage differences to the local rows and note the columns that it touches."""
    sign, side = 1.0, 0
    if y1 < y0:
        sign, side = -1.0, 1
        x0, y0, x1, y1 = x1, y1, x0, y0
    slope = (x1 - x0) / (y1 - y0)
    row = int(y0)
    x_top, y_top = x0, y0
    while y_top < y1:
        # coordinates are inside the picture, so truncation is the floor
        y_bottom = min(row + 1.0, y1)
        x_bottom = x0 + (y_bottom - y0) * slope if y_bottom < y1 else x1
        d = (y_bottom - y_top) * sign
        xa, xb = min(x_top, x_bottom), max(x_top, x_bottom)
        ca, cb = int(xa), int(xb)
        k = row - first_row
        if ca == cb:
            right = 0.5 * (xa + xb) - ca
            cover[k, ca] += d * (1.0 - right)
            cover[k, ca + 1] += d * right
        else:
            s = 1.0 / (xb - xa)
            done = 0.5 * s * (ca + 1 - xa) * (ca + 1 - xa)
            cover[k, ca] += d * done
            # coverage grows by s with each full column
            for c in range(ca + 1, cb):
                covered = s * (c + 0.5 - xa)
                cover[k, c] += d * (covered - done)
                done = covered
            left = 1.0 - 0.5 * s * (xb - cb) * (xb - cb)
            cover[k, cb] += d * (left - done)
            cover[k, cb + 1] += d * (1.0 - left)
        low[side, k] = min(low[side, k], ca)
        high[side, k] = max(high[side, k], cb + 1)
        x_top, y_top = x_bottom, y_bottom
        row += 1


@compiled
def fill_polygon(polygon, count, density, gx, gy, density_low, density_high, rgb, plane, cover, low, high):
    """Add a convex polygon with linearly varying density to a picture.

    Parameters
    ----------
    polygon : ndarray, shape (V, >= 2)
        Vertices in pixels inside the picture (columns PX, PY; pixel k spans [k, k + 1]).
    count : int
    density, gx, gy : float
        Flux per pixel at the picture's origin and its gradient.
    density_low, density_high : float
        Bounds kept at pixels whose centre lies outside the polygon.
    rgb : ndarray, shape (3,)
    plane : ndarray, shape (3, H, W), float32
        Added to.
    cover : ndarray, shape (H + 1, W + 3), float64
        Scratch, all zero before and after.
    low, high : ndarray, shape (2, H + 1), int64
        Scratch.

    Notes
    -----
    A pixel receives exact coverage times the density at its centre; the sum over pixels is the polygon's flux.
    """
    y_low, y_high = np.inf, -np.inf
    for k in range(count):
        y_low, y_high = min(y_low, polygon[k, PY]), max(y_high, polygon[k, PY])
    first_row = int(y_low)
    last_row = min(int(y_high), plane.shape[1] - 1)
    for r in range(last_row - first_row + 2):
        low[0, r], low[1, r] = 1 << 30, 1 << 30
        high[0, r], high[1, r] = -1, -1
    twice_area = 0.0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        x0, y0, x1, y1 = polygon[k, PX], polygon[k, PY], polygon[following, PX], polygon[following, PY]
        twice_area += (x0 - polygon[0, PX]) * (y1 - polygon[0, PY]) - (x1 - polygon[0, PX]) * (y0 - polygon[0, PY])
        if y0 != y1:
            _add_edge(cover, first_row, low, high, x0, y0, x1, y1)
    # running upwards on the right means running downwards on the left
    sign = 1.0 if twice_area < 0.0 else -1.0
    for r in range(last_row - first_row + 2):
        row = first_row + r
        start, end = min(low[0, r], low[1, r]), max(high[0, r], high[1, r])
        if end < 0:
            continue
        if row > last_row or high[0, r] < 0 or high[1, r] < 0:
            for c in range(start, end + 1):
                cover[r, c] = 0.0
            continue
        base = density + gy * (row + 0.5)
        # between the pixels that the left and the right edges touch, coverage does not change
        pause, resume = min(high[0, r], high[1, r]), max(low[0, r], low[1, r])
        if resume <= pause + 4:
            pause, resume = end, end + 1
        total = _sweep(cover, r, start, pause, 0.0, sign, base, gx, density_low, density_high, rgb, plane, row)
        if resume <= end:
            even = np.float32((base + gx * (pause + 1.5)) * total * sign)
            slope = np.float32(gx * total * sign)
            for channel in range(3):
                _fill_run(plane[channel, row, pause + 1 : resume], np.float32(rgb[channel]), even, slope)
            _sweep(cover, r, resume, end, total, sign, base, gx, density_low, density_high, rgb, plane, row)


@compiled
def _fill_run(run, colour, even, slope):
    """Add a linear ramp to fully covered pixels."""
    for c in range(run.size):
        run[c] += colour * (even + slope * np.float32(c))


@compiled
def _sweep(cover, r, start, end, total, sign, base, gx, density_low, density_high, rgb, plane, row):
    """Sum coverage over partly covered pixels, deposit it and clear the scratch."""
    width = plane.shape[2]
    for c in range(start, end + 1):
        total += cover[r, c]
        cover[r, c] = 0.0
        if c < width:
            value = total * sign * min(max(base + gx * (c + 0.5), density_low), density_high)
            plane[0, row, c] += rgb[0] * value
            plane[1, row, c] += rgb[1] * value
            plane[2, row, c] += rgb[2] * value
    return total


@compiled
def splat_line(x0, y0, x1, y1, flux, rgb, plane):
    """Spread flux along a segment, each sample over its four nearest pixels: for slivers without area.

    Parameters
    ----------
    x0, y0, x1, y1 : float
        Segment in pixels.
    flux : float
    rgb : ndarray, shape (3,)
    plane : ndarray, shape (3, H, W), float32
        Added to; what falls outside is lost to the sensor.
    """
    height, width = plane.shape[1], plane.shape[2]
    length = sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
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
                plane[0, rr, cc] += rgb[0] * part
                plane[1, rr, cc] += rgb[1] * part
                plane[2, rr, cc] += rgb[2] * part
