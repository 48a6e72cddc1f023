"""Walch's ghost: four cubic Bezier curves mirrored at the horizon, lit by the signed distance to their border.

Walch 2017, chapter 6: equation 6.4 (transfer function); `measure_border` has the curves. Colour: border and inner level
per channel, which enter linearly; the shape and the falloffs are shared.
"""

from math import ceil, floor, log

import numpy as np

from ._jit import compiled, inner
from .measure_border import DISTANCE, FOOT, LANES, SHAPE, SIDE, border_of, border_room, distances, inward_normal
from .powers import raise_lanes

# the border's, falloff outside and inside, exponents outside and inside, border level and inner level of three channels
NUMBERS = 19
FALL_OUT, FALL_IN, POWER_OUT, POWER_IN, BORDER, INNER = 9, 10, 11, 12, 13, 16


@inner
def _room():
    """Return what `_fade` needs and fills: how far from the border, falloff, exponent and share; and bits."""
    return np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES, np.int64)


@inner
def _fade(numbers, found, room):
    """Find how far the border level has faded (S^E, clamped)."""
    part, reaches, powers, faded, bits = room
    for m in range(LANES):
        out = found[DISTANCE + m] < 0.0
        reaches[m] = max(numbers[FALL_OUT] if out else numbers[FALL_IN], 1e-6)
        powers[m] = numbers[POWER_OUT] if out else numbers[POWER_IN]
        part[m] = min(abs(found[DISTANCE + m]) / reaches[m], 1.0)
    raise_lanes(part, powers, faded, bits)


@inner
def _fading(distance, s, reach, power, faded):
    """Return the derivatives of what `_fade` finds by distance, reach and power."""
    if s >= 1.0 or s < 1e-12:
        return 0.0, 0.0, 0.0
    by = power * faded / s / reach
    return by if distance > 0.0 else -by, -by * s, faded * log(s)


@inner
def _bernstein_changes(t, side, nx, ny, flip, out):
    """Fill how the signed distance changes with the shape's nine numbers: the normal times how the border moves."""
    s = 1.0 - t
    b0, b1, b2, b3 = s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t
    out[:SHAPE] = 0.0
    out[0] = -nx
    out[1] = -ny * flip
    out[2] = -ny * (b0 + b1)
    at = 5 if side < 0.0 else 7
    out[3 if side < 0.0 else 4] = -nx * side * (b2 + b3)
    out[at] = -nx * side * b1
    out[at + 1] = -ny * b2


@inner
def _window(numbers, frame, width, height):
    """Return the pixels that a ghost may touch; see `bezier_window`."""
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
    """Return the pixels that a Bezier ghost may touch: left, top, width, height.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    frame : ndarray, shape (5,)
        Axis x and y in pixels, cosine and sine of the roll, pixels per pixel of the model.
    width, height : int
        Of the picture.
    """
    return _window(numbers, frame, width, height)


@inner
def _points(frame, left, row, count, across, x, y):
    """Fill where pixels of a row lie: along the field, and across it from the horizon; behind the last as the last."""
    up = (frame[1] - row - 0.5) / frame[4]
    for m in range(LANES):
        right = (left + min(m, count - 1) + 0.5 - frame[0]) / frame[4]
        x[m] = frame[2] * right + frame[3] * up
        y[m] = frame[2] * up - frame[3] * right - across


@inner
def _lit(numbers, found, faded, count, row):
    """Add the light of pixels whose distances are known; `row` holds three colours after each other."""
    red, green, blue = numbers[BORDER], numbers[BORDER + 1], numbers[BORDER + 2]
    inner_red, inner_green, inner_blue = numbers[INNER], numbers[INNER + 1], numbers[INNER + 2]
    for m in range(count):
        border, inside = 1.0 - faded[m], faded[m] if found[DISTANCE + m] >= 0.0 else 0.0
        row[3 * m] += border * red + inside * inner_red
        row[3 * m + 1] += border * green + inside * inner_green
        row[3 * m + 2] += border * blue + inside * inner_blue


@inner
def _spared(found, reaches, scale):
    """Return for how many rows more the pixels beside some are lit evenly: so far are these from where light changes.

    A step of a pixel changes the distance by a pixel at most.
    """
    rows = np.int64(1 << 40)
    # whole numbers, for the compiler vectorises only their minimum
    for m in range(LANES):
        rows = min(rows, np.int64(scale * (abs(found[DISTANCE + m]) - reaches[m])))
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
    room = _room()
    height, width = pixels.shape[0], pixels.shape[1]
    moved = frame.copy()
    moved[0] -= left
    moved[1] -= top
    for g in range(numbers.shape[0]):
        ghost = numbers[g]
        x0, y0, wide, high = _window(ghost, moved, width, height)
        apart = border_of(ghost, curves, places)
        # of each block of pixels, which rows that follow are lit evenly, and whether outside
        spared, outside = np.zeros(wide // LANES + 1, np.int64), np.zeros(wide // LANES + 1, np.bool_)
        for r in range(y0, y0 + high):
            for start in range(0, wide, LANES):
                count, block = min(LANES, wide - start), start // LANES
                row = pixels[r, x0 + start : x0 + start + count].reshape(3 * count)
                if spared[block] > 0:
                    spared[block] -= 1
                    if not outside[block]:
                        for m in range(count):
                            for n in range(3):
                                row[3 * m + n] += ghost[INNER + n]
                    continue
                _points(moved, x0 + start, r, count, ghost[1], x, y)
                distances(curves, places, apart, x, y, work, found)
                _fade(ghost, found, room)
                _lit(ghost, found, room[3], count, row)
                spared[block], outside[block] = _spared(found, room[1], moved[4]), found[DISTANCE] < 0.0


@compiled
def draw_bezier(numbers, frame, left, top, pixels, changes):
    """Draw a Bezier ghost inside a window, with its derivatives.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    frame : ndarray, shape (5,)
    left, top : int
        First pixel of the window.
    pixels : ndarray, shape (h, w, 3), float64
        Added to: radiance at the pixels' centres.
    changes : ndarray, shape (h, w, 3, 19), float64
        Filled with the derivatives by every number.
    """
    curves, places, work, found, x, y = border_room()
    room = _room()
    apart = border_of(numbers, curves, places)
    by = np.empty(SHAPE)
    for r in range(pixels.shape[0]):
        for start in range(0, pixels.shape[1], LANES):
            count = min(LANES, pixels.shape[1] - start)
            _points(frame, left + start, top + r, count, numbers[1], x, y)
            distances(curves, places, apart, x, y, work, found)
            _fade(numbers, found, room)
            part, reaches, powers, faded, _ = room
            _lit(numbers, found, faded, count, pixels[r, start : start + count].reshape(3 * count))
            for m in range(count):
                distance, side, t = found[DISTANCE + m], found[SIDE + m], found[FOOT + m]
                out = distance < 0.0
                by_d, by_reach, by_power = _fading(distance, part[m], reaches[m], powers[m], faded[m])
                nx, ny = inward_normal(curves, side, t, distance, x[m], abs(y[m]))
                _bernstein_changes(t, side, nx, ny, 1.0 if y[m] >= 0.0 else -1.0, by)
                for n in range(3):
                    step = (0.0 if out else numbers[INNER + n]) - numbers[BORDER + n]
                    row = changes[r, start + m, n]
                    row[:] = 0.0
                    for q in range(SHAPE):
                        row[q] = step * by_d * by[q]
                    row[FALL_OUT if out else FALL_IN] = step * by_reach
                    row[POWER_OUT if out else POWER_IN] = step * by_power
                    row[BORDER + n] = 1.0 - faded[m]
                    row[INNER + n] = 0.0 if out else faded[m]
