"""An iris given as an image: the part of a polygon's light that each place of the stop lets through."""

from math import ceil, floor

import numpy as np

from ._jit import inner
from .clip import MAX_VERTICES, PSTOP, PX, PY, cut_to_rectangle
from .raster import fill_polygon, plane_size


@inner
def mask_value(mask, half, u, v):
    """Interpolate a mask that spans [-half, half] squared, row 0 at +v; 0 outside."""
    rows, columns = mask.shape
    x = (u / half + 1.0) * 0.5 * columns - 0.5
    y = (1.0 - v / half) * 0.5 * rows - 0.5
    if x < -0.5 or y < -0.5 or x > columns - 0.5 or y > rows - 0.5:
        return 0.0
    x, y = min(max(x, 0.0), columns - 1.0), min(max(y, 0.0), rows - 1.0)
    c, r = min(int(floor(x)), columns - 2), min(int(floor(y)), rows - 2)
    fx, fy = x - c, y - r
    upper = mask[r, c] * (1.0 - fx) + mask[r, c + 1] * fx
    lower = mask[r + 1, c] * (1.0 - fx) + mask[r + 1, c + 1] * fx
    return upper * (1.0 - fy) + lower * fy


@inner
def _uniform(polygon, count, crossing, mask, half):
    """Return the mask's value where it does not vary over a polygon, else -1."""
    rows, columns = mask.shape
    u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
    for k in range(count):
        u, v = polygon[k, PSTOP + 2 * crossing], polygon[k, PSTOP + 2 * crossing + 1]
        u_low, u_high = min(u_low, u), max(u_high, u)
        v_low, v_high = min(v_low, v), max(v_high, v)
    if u_high < -half or u_low > half or v_high < -half or v_low > half:
        return 0.0
    if u_low < -half or u_high > half or v_low < -half or v_high > half:
        return -1.0
    c0 = max(int(floor((u_low / half + 1.0) * 0.5 * columns - 0.5)), 0)
    c1 = min(int(floor((u_high / half + 1.0) * 0.5 * columns - 0.5)) + 1, columns - 1)
    r0 = max(int(floor((1.0 - v_high / half) * 0.5 * rows - 0.5)), 0)
    r1 = min(int(floor((1.0 - v_low / half) * 0.5 * rows - 0.5)) + 1, rows - 1)
    first = mask[r0, c0]
    for r in range(r0, r1 + 1):
        for c in range(c0, c1 + 1):
            if mask[r, c] != first:
                return -1.0
    return first


@inner
def _pieces(polygon, k, crossings, mask, half):
    """How finely to divide a fan triangle: to a texel of the mask or to a pixel, whichever is coarser."""
    texels, pixels = 1.0, 1.0
    for a, b in ((0, k), (k, k + 1), (k + 1, 0)):
        pixels = max(pixels, abs(polygon[a, PX] - polygon[b, PX]), abs(polygon[a, PY] - polygon[b, PY]))
        for c in range(crossings):
            m = PSTOP + 2 * c
            span = max(abs(polygon[a, m] - polygon[b, m]), abs(polygon[a, m + 1] - polygon[b, m + 1]))
            texels = max(texels, span / (2.0 * half) * max(mask.shape[0], mask.shape[1]))
    return int(ceil(min(min(texels, pixels), 256.0)))


@inner
def fill_through_mask(polygon, count, crossings, mask, half, density, gx, gy, density_low, density_high, rgb, plane):
    """Draw a polygon as `fill_polygon` does, its light multiplied by the mask at every crossing of the stop.

    Parameters
    ----------
    polygon : ndarray, shape (V, 6 + 2 C)
        Vertices in pixels with their places in the stop (`kernels.clip`); may reach outside the picture.
    count, crossings : int
    mask : ndarray, shape (A, B)
        Transmittance, row 0 up.
    half : float
        The mask spans [-half, half] in the stop, mm.
    density ... plane
        As in `fill_polygon`.

    Notes
    -----
    Where the mask varies, the polygon is divided linearly until a piece is a texel or a pixel.
    """
    height, width = plane_size(plane)
    value = 1.0
    for c in range(crossings):
        here = _uniform(polygon, count, c, mask, half)
        if here == 0.0:
            return
        value = -1.0 if here < 0.0 or value < 0.0 else value * here
    piece, other = np.empty((MAX_VERTICES, 2)), np.empty((MAX_VERTICES, 2))
    values = np.empty(MAX_VERTICES)
    if value >= 0.0:
        for k in range(count):
            piece[k, 0], piece[k, 1] = polygon[k, PX], polygon[k, PY]
        kept = cut_to_rectangle(piece, count, other, values, float(width), float(height))
        if kept >= 3:
            fill_polygon(piece, kept, density, gx, gy, density_low, density_high, rgb * value, plane)
        return
    for k in range(1, count - 1):
        n = _pieces(polygon, k, crossings, mask, half)
        for i in range(n):
            for j in range(2 * (n - i) - 1):
                value = 1.0
                # corners of the j-th small triangle of strip i, in steps of 1 / n from vertex 0
                a, b, down = i, j // 2, j % 2
                for c in range(crossings):
                    s, t = (a + (1.0 + down) / 3.0) / n, (b + (1.0 + down) / 3.0) / n
                    m = PSTOP + 2 * c
                    u = polygon[0, m] + s * (polygon[k, m] - polygon[0, m]) + t * (polygon[k + 1, m] - polygon[0, m])
                    m += 1
                    v = polygon[0, m] + s * (polygon[k, m] - polygon[0, m]) + t * (polygon[k + 1, m] - polygon[0, m])
                    value *= mask_value(mask, half, u, v)
                if value == 0.0:
                    continue
                for m in range(3):
                    # upward: (a, b), (a + 1, b), (a, b + 1); downward: (a + 1, b), (a + 1, b + 1), (a, b + 1)
                    ga = a + (1 if m == 1 or (down and m == 0) else 0)
                    gb = b + (1 if m == 2 or (down and m == 1) else 0)
                    for q in range(2):
                        piece[m, q] = (
                            polygon[0, q]
                            + ga / n * (polygon[k, q] - polygon[0, q])
                            + gb / n * (polygon[k + 1, q] - polygon[0, q])
                        )
                kept = cut_to_rectangle(piece, 3, other, values, float(width), float(height))
                if kept >= 3:
                    fill_polygon(piece, kept, density, gx, gy, density_low, density_high, rgb * value, plane)
