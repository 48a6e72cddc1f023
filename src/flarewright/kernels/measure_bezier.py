"""Walch's ghost: four cubic Bezier curves mirrored at the horizon, lit by the signed distance to their border.

Walch 2017, chapter 6: figure 6.2 (shape), equations 6.1 to 6.3 (distance) and 6.4 (transfer function). Colour: border
and inner level per channel, which enter linearly; the shape and the falloffs are shared.
"""

from math import ceil, exp, floor, log, sqrt

import numpy as np

from ._jit import compiled, inner

# centre along and across the field, height, extents left and right, control points (along, across) left and right,
# falloff outside and inside, exponents outside and inside, border level and inner level of three channels
NUMBERS = 19
SHAPE = 9
FALL_OUT, FALL_IN, POWER_OUT, POWER_IN, BORDER, INNER = 9, 10, 11, 12, 13, 16

_STARTS = 4
_HALVINGS = 14
_POLISH = 3


@inner
def _segment(numbers, side, control):
    """Fill the control points of the upper left (side -1) or upper right (+1) curve, from the top to the horizon."""
    at = 5 if side < 0.0 else 7
    extent = numbers[3] if side < 0.0 else numbers[4]
    control[0, 0], control[0, 1] = numbers[0], numbers[2]
    control[1, 0], control[1, 1] = numbers[0] + side * numbers[at], numbers[2]
    control[2, 0], control[2, 1] = numbers[0] + side * extent, numbers[at + 1]
    control[3, 0], control[3, 1] = numbers[0] + side * extent, 0.0


@inner
def _curve(control, t):
    """Return the point of a cubic Bezier curve and its derivative (equation 6.1)."""
    s = 1.0 - t
    b0, b1, b2, b3 = s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t
    x = b0 * control[0, 0] + b1 * control[1, 0] + b2 * control[2, 0] + b3 * control[3, 0]
    y = b0 * control[0, 1] + b1 * control[1, 1] + b2 * control[2, 1] + b3 * control[3, 1]
    d0, d1, d2 = 3.0 * s * s, 6.0 * s * t, 3.0 * t * t
    dx = d0 * (control[1, 0] - control[0, 0]) + d1 * (control[2, 0] - control[1, 0])
    dy = d0 * (control[1, 1] - control[0, 1]) + d1 * (control[2, 1] - control[1, 1])
    return x, y, dx + d2 * (control[3, 0] - control[2, 0]), dy + d2 * (control[3, 1] - control[2, 1])


@inner
def _square(control, t, x, y):
    """Return the squared distance of (x, y) to the curve's point at t."""
    bx, by, _, _ = _curve(control, t)
    return (bx - x) ** 2 + (by - y) ** 2


@inner
def _nearest(control, x, y):
    """Return where the curve is nearest: the best of a few parts, halved again and again, then Newton's steps."""
    best, t = 1e300, 0.0
    for k in range(_STARTS):
        middle = (k + 0.5) / _STARTS
        square = _square(control, middle, x, y)
        if square < best:
            best, t = square, middle
    half = 0.5 / _STARTS
    for _ in range(_HALVINGS):
        half *= 0.5
        lower, upper = max(t - half, 0.0), min(t + half, 1.0)
        low, high = _square(control, lower, x, y), _square(control, upper, x, y)
        if low < best and low <= high:
            best, t = low, lower
        elif high < best:
            best, t = high, upper
    for _ in range(_POLISH):
        bx, by, dx, dy = _curve(control, t)
        slope = (bx - x) * dx + (by - y) * dy
        square = dx * dx + dy * dy
        if square < 1e-18:
            break
        # Gauss and Newton's step; the curvature's part is left out, so it never climbs
        trial = min(max(t - slope / square, 0.0), 1.0)
        distance = _square(control, trial, x, y)
        if distance >= best:
            break
        best, t = distance, trial
    return best, t


@inner
def _signed_distance(left, right, x, y):
    """Return the signed distance to the border, positive inside; the side, the place on it, and the inward normal."""
    above = abs(y)
    square_l, t_l = _nearest(left, x, above)
    square_r, t_r = _nearest(right, x, above)
    if square_l < square_r:
        side, t, square = -1.0, t_l, square_l
        bx, by, dx, dy = _curve(left, t)
    else:
        side, t, square = 1.0, t_r, square_r
        bx, by, dx, dy = _curve(right, t)
    # on the way from the top to the horizon the inside lies to the right of the right curve, to the left of the other
    nx, ny = side * dy, -side * dx
    inside = nx * (x - bx) + ny * (above - by) >= 0.0
    distance = sqrt(square)
    sign = 1.0 if inside else -1.0
    if distance > 1e-9:
        nx, ny = sign * (x - bx) / distance, sign * (above - by) / distance
    else:
        length = sqrt(nx * nx + ny * ny)
        # where a control point lies on an end the curve has no direction there
        nx, ny = (nx / length, ny / length) if length > 1e-12 else (-side, 0.0)
    return sign * distance, side, t, nx, ny


@inner
def _share(distance, reach, power):
    """Return how far the border level has faded (S^E, clamped) and its derivatives by distance, reach and power."""
    reach = max(reach, 1e-6)
    s = abs(distance) / reach
    if s >= 1.0:
        return 1.0, 0.0, 0.0, 0.0
    if s < 1e-12:
        return 0.0, 0.0, 0.0, 0.0
    value = exp(power * log(s))
    by = power * value / s / reach
    return value, by if distance > 0.0 else -by, -by * s, value * log(s)


@compiled
def signed_distances(numbers, points, out):
    """Fill the signed distance of points to the border, positive inside.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    points : ndarray, shape (M, 2)
        Along the field and across it, pixels of the model from the axis.
    out : ndarray, shape (M,)

    Notes
    -----
    Walch 2017, equations 6.2 and 6.3; compared with the roots of the fifth-order polynomial in the tests.
    """
    left, right = np.empty((4, 2)), np.empty((4, 2))
    _segment(numbers, -1.0, left)
    _segment(numbers, 1.0, right)
    for k in range(points.shape[0]):
        out[k], _, _, _, _ = _signed_distance(left, right, points[k, 0], points[k, 1] - numbers[1])


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
def draw_bezier(numbers, frame, left, top, pixels, changes):
    """Draw a Bezier ghost inside a window, with its derivatives when asked.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    frame : ndarray, shape (5,)
    left, top : int
        First pixel of the window.
    pixels : ndarray, shape (h, w, 3), float64
        Added to: radiance at the pixels' centres.
    changes : ndarray, shape (h, w, 3, 19) or (0, 0, 3, 19), float64
        Filled with the derivatives by every number when it is not empty.
    """
    control_l, control_r = np.empty((4, 2)), np.empty((4, 2))
    _segment(numbers, -1.0, control_l)
    _segment(numbers, 1.0, control_r)
    by = np.empty(SHAPE)
    derive = changes.shape[0] > 0
    for r in range(pixels.shape[0]):
        for c in range(pixels.shape[1]):
            dx, dy = (left + c + 0.5 - frame[0]) / frame[4], (frame[1] - top - r - 0.5) / frame[4]
            x, y = frame[2] * dx + frame[3] * dy, frame[2] * dy - frame[3] * dx - numbers[1]
            distance, side, t, nx, ny = _signed_distance(control_l, control_r, x, y)
            out = distance < 0.0
            faded, by_d, by_reach, by_power = _share(
                distance, numbers[FALL_OUT if out else FALL_IN], numbers[POWER_OUT if out else POWER_IN]
            )
            if derive:
                _bernstein_changes(t, side, nx, ny, 1.0 if y >= 0.0 else -1.0, by)
            for m in range(3):
                level = 0.0 if out else numbers[INNER + m]
                step = level - numbers[BORDER + m]
                pixels[r, c, m] += numbers[BORDER + m] + step * faded
                if derive:
                    row = changes[r, c, m]
                    row[:] = 0.0
                    for q in range(SHAPE):
                        row[q] = step * by_d * by[q]
                    row[FALL_OUT if out else FALL_IN] = step * by_reach
                    row[POWER_OUT if out else POWER_IN] = step * by_power
                    row[BORDER + m] = 1.0 - faded
                    row[INNER + m] = 0.0 if out else faded
