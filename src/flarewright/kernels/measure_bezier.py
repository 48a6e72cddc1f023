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

# parts of a curve whose ends are compared first, and steps from the nearest of them, which end below a part of it
_PARTS = 12
_STEPS = 12
_ENOUGH = 1e-7


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
def _places(control, places):
    """Fill places on a curve; return how far a point of it is from the nearest of them at most."""
    apart = 0.0
    for k in range(_PARTS + 1):
        places[k, 0], places[k, 1], _, _ = _curve(control, k / _PARTS)
    # no part of a curve is longer than its control polygon: its speed is no more than that of its fastest side
    for k in range(3):
        dx, dy = control[k + 1, 0] - control[k, 0], control[k + 1, 1] - control[k, 1]
        apart = max(apart, 3.0 * sqrt(dx * dx + dy * dy))
    return 0.5 * apart / _PARTS


@inner
def _border(numbers, left, right, places_l, places_r):
    """Fill both curves and places on them; return how far a point of either is from the nearest of them at most."""
    _segment(numbers, -1.0, left)
    _segment(numbers, 1.0, right)
    return max(_places(left, places_l), _places(right, places_r))


@inner
def _first(places, x, y):
    """Return the squared distance of (x, y) to the nearest place, and which it is."""
    best, at = 1e300, 0
    for k in range(_PARTS + 1):
        square = (places[k, 0] - x) ** 2 + (places[k, 1] - y) ** 2
        if square < best:
            best, at = square, k
    return best, at


@inner
def _nearest(control, best, at, x, y):
    """Return the squared distance to the curve near one of its places, and where on it: Newton's steps or halvings."""
    t = at / _PARTS
    lower, upper = max(t - 1.0 / _PARTS, 0.0), min(t + 1.0 / _PARTS, 1.0)
    found = t
    for _ in range(_STEPS):
        bx, by, dx, dy = _curve(control, t)
        square = (bx - x) ** 2 + (by - y) ** 2
        if square <= best:
            best, found = square, t
        slope = (bx - x) * dx + (by - y) * dy
        if slope > 0.0:
            upper = t
        else:
            lower = t
        if upper - lower < _ENOUGH:
            break
        # the second derivative is linear in t
        s = 1.0 - t
        ax = 6.0 * (s * (control[2, 0] - 2.0 * control[1, 0] + control[0, 0])
                    + t * (control[3, 0] - 2.0 * control[2, 0] + control[1, 0]))  # fmt: skip
        ay = 6.0 * (s * (control[2, 1] - 2.0 * control[1, 1] + control[0, 1])
                    + t * (control[3, 1] - 2.0 * control[2, 1] + control[1, 1]))  # fmt: skip
        bend = dx * dx + dy * dy + (bx - x) * ax + (by - y) * ay
        trial = t - slope / bend if bend > 0.0 else -1.0
        if not lower < trial < upper:
            trial = 0.5 * (lower + upper)
        if abs(trial - t) < _ENOUGH:
            break
        t = trial
    return best, found


@inner
def _signed_distance(left, right, places_l, places_r, apart, x, y):
    """Return the signed distance to the border, positive inside; the side, the place on it, and the inward normal."""
    above = abs(y)
    square_l, at_l = _first(places_l, x, above)
    square_r, at_r = _first(places_r, x, above)
    # a curve whose places are all farther than the other's nearest one by more than it may come nearer is not asked
    far_l, far_r = sqrt(square_l), sqrt(square_r)
    t_l, t_r = 0.0, 1.0
    if far_l <= far_r + apart:
        square_l, t_l = _nearest(left, square_l, at_l, x, above)
    if far_r <= far_l + apart:
        square_r, t_r = _nearest(right, square_r, at_r, x, above)
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
    places_l, places_r = np.empty((_PARTS + 1, 2)), np.empty((_PARTS + 1, 2))
    apart = _border(numbers, left, right, places_l, places_r)
    for k in range(points.shape[0]):
        out[k], _, _, _, _ = _signed_distance(
            left, right, places_l, places_r, apart, points[k, 0], points[k, 1] - numbers[1]
        )


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
    places_l, places_r = np.empty((_PARTS + 1, 2)), np.empty((_PARTS + 1, 2))
    apart = _border(numbers, control_l, control_r, places_l, places_r)
    by = np.empty(SHAPE)
    derive = changes.shape[0] > 0
    for r in range(pixels.shape[0]):
        # pixels that follow and are as far from the border as makes no difference any more, and whether outside
        same, out = 0, False
        for c in range(pixels.shape[1]):
            if same > 0:
                same -= 1
                if not out:
                    for m in range(3):
                        pixels[r, c, m] += numbers[INNER + m]
                continue
            dx, dy = (left + c + 0.5 - frame[0]) / frame[4], (frame[1] - top - r - 0.5) / frame[4]
            x, y = frame[2] * dx + frame[3] * dy, frame[2] * dy - frame[3] * dx - numbers[1]
            distance, side, t, nx, ny = _signed_distance(control_l, control_r, places_l, places_r, apart, x, y)
            out = distance < 0.0
            reach = numbers[FALL_OUT if out else FALL_IN]
            faded, by_d, by_reach, by_power = _share(distance, reach, numbers[POWER_OUT if out else POWER_IN])
            if derive:
                _bernstein_changes(t, side, nx, ny, 1.0 if y >= 0.0 else -1.0, by)
            else:
                # a step of a pixel changes the distance by a pixel at most
                same = max(int(frame[4] * (abs(distance) - max(reach, 1e-6))), 0)
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
