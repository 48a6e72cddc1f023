"""Walch's ghost: four cubic Bezier curves mirrored at the horizon, lit by the signed distance to their border.

Walch 2017, chapter 6: equation 6.4 (transfer function); `bezier_distance` has the curves. Each channel has a border
level and an inner level, which enter linearly; the shape and the falloffs are shared.
"""

from math import ceil, floor

import numpy as np

from ..diffraction.fast_power import raise_lanes
from ..jit.decorators import compiled, inner
from .bezier_distance import LANES, border_distances, border_of, border_room

# parameters: shape of the border (centre along and across the field, height, extents left and right, control points,
# along and across, left and right), falloff outside and inside, exponents outside and inside, border level and inner
# level of three channels
NUMBERS = 19
FALL_OUT, FALL_IN, POWER_OUT, POWER_IN, BORDER, INNER = 9, 10, 11, 12, 13, 16


@inner
def _scratch():
    """Allocate the arrays of `_fade`: relative distance from the border, falloff, exponent, result, and bits."""
    return np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES, np.int64)


@inner
def _fade(numbers, found, room):
    """Compute the fade of the border level, S^E, clamped."""
    part, reaches, powers, faded, bits = room
    for m in range(LANES):
        out = found[m] < 0.0
        reaches[m] = max(numbers[FALL_OUT] if out else numbers[FALL_IN], 1e-6)
        powers[m] = numbers[POWER_OUT] if out else numbers[POWER_IN]
        part[m] = min(abs(found[m]) / reaches[m], 1.0)
    raise_lanes(part, powers, faded, bits)


@inner
def _window(numbers, frame, width, height):
    """Return the window of pixels that a ghost may touch; see `bezier_window`."""
    reach = numbers[FALL_OUT]
    a0 = numbers[0] - max(numbers[3], numbers[5], 0.0) - reach
    a1 = numbers[0] + max(numbers[4], numbers[7], 0.0) + reach
    c1 = max(numbers[2], numbers[6], numbers[8]) + reach
    x0, y0, x1, y1 = 1e30, 1e30, -1e30, -1e30
    for m in range(4):
        along, across = (a0 if m % 2 else a1), numbers[1] + (c1 if m // 2 else -c1)
        x = frame[0] + frame[4] * (frame[2] * along - frame[3] * across)
        y = frame[1] - frame[4] * (frame[3] * along + frame[2] * across)
        x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    if not (x1 > 0.0 and y1 > 0.0 and x0 < width and y0 < height):
        return 0, 0, 0, 0
    left, top = max(int(floor(x0)), 0), max(int(floor(y0)), 0)
    return left, top, min(int(ceil(x1)), width) - left, min(int(ceil(y1)), height) - top


@compiled
def bezier_window(numbers, frame, width, height):
    """Return the window of pixels that a Bezier ghost may touch: left, top, width, height.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    frame : ndarray, shape (5,)
        Axis x and y in pixels, cosine and sine of the roll, picture pixels per model pixel.
    width, height : int
        Size of the picture.
    """
    return _window(numbers, frame, width, height)


@inner
def _points(frame, left, row, count, across, x, y):
    """Fill the places of a row's pixels, along the field and across it from the horizon; repeat the last one."""
    up = (frame[1] - row - 0.5) / frame[4]
    for m in range(LANES):
        right = (left + min(m, count - 1) + 0.5 - frame[0]) / frame[4]
        x[m] = frame[2] * right + frame[3] * up
        y[m] = frame[2] * up - frame[3] * right - across


@inner
def _add_light(numbers, found, faded, count, row):
    """Add the light of `count` pixels with known distances to `row`, which holds three colours for each pixel."""
    red, green, blue = numbers[BORDER], numbers[BORDER + 1], numbers[BORDER + 2]
    inner_red, inner_green, inner_blue = numbers[INNER], numbers[INNER + 1], numbers[INNER + 2]
    for m in range(count):
        border, inside = 1.0 - faded[m], faded[m] if found[m] >= 0.0 else 0.0
        row[3 * m] += border * red + inside * inner_red
        row[3 * m + 1] += border * green + inside * inner_green
        row[3 * m + 2] += border * blue + inside * inner_blue


@inner
def _constant_rows(found, reaches, scale):
    """Return the number of following rows in which the light of a block of pixels is constant.

    A step of one pixel changes the distance by at most one pixel, so this is the distance to the falloff.
    """
    rows = np.int64(1 << 40)
    # integers: the compiler does not vectorise a minimum of floats
    for m in range(LANES):
        rows = min(rows, np.int64(scale * (abs(found[m]) - reaches[m])))
    return max(rows, 0)


@compiled
def draw_beziers(numbers, frame, left, top, pixels):
    """Draw Bezier ghosts inside a window.

    Parameters
    ----------
    numbers : ndarray, shape (G, 19)
    frame : ndarray, shape (5,)
    left, top : int
        First pixel of the window.
    pixels : ndarray, shape (h, w, 3), float64
        Added to: radiance at the pixels' centres.
    """
    curves, places, work, found, x, y = border_room()
    room = _scratch()
    height, width = pixels.shape[0], pixels.shape[1]
    moved = frame.copy()
    moved[0] -= left
    moved[1] -= top
    for g in range(numbers.shape[0]):
        ghost = numbers[g]
        x0, y0, wide, high = _window(ghost, moved, width, height)
        apart = border_of(ghost, curves, places)
        # for each block of pixels: the number of following rows with constant light, and whether it lies outside
        constant, outside = np.zeros(wide // LANES + 1, np.int64), np.zeros(wide // LANES + 1, np.bool_)
        for r in range(y0, y0 + high):
            for start in range(0, wide, LANES):
                count, block = min(LANES, wide - start), start // LANES
                row = pixels[r, x0 + start : x0 + start + count].reshape(3 * count)
                if constant[block] > 0:
                    constant[block] -= 1
                    if not outside[block]:
                        for m in range(count):
                            for n in range(3):
                                row[3 * m + n] += ghost[INNER + n]
                    continue
                _points(moved, x0 + start, r, count, ghost[1], x, y)
                border_distances(curves, places, apart, x, y, work, found)
                _fade(ghost, found, room)
                _add_light(ghost, found, room[3], count, row)
                constant[block], outside[block] = _constant_rows(found, room[1], moved[4]), found[0] < 0.0
