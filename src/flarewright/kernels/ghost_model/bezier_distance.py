"""The border of Walch's ghost, four cubic Bezier curves mirrored at the horizon, and the distance of points from it.

Walch 2017, chapter 6: figure 6.2 (shape), equations 6.1 to 6.3 (distance). Points are processed in lanes that the
compiler vectorises.
"""

from math import sqrt

import numpy as np

from ..jit.decorators import inlined, inner

# points in one pass
LANES = 48

# number of parts of a curve; the search for the nearest point starts at the nearest of their ends
_CURVE_PARTS = 16
# convergence of Newton's method: a step in t below _CONVERGED (the next would be its square), or _STEPS steps, in which
# bisection halves a part to less than that
_CONVERGED, _STEPS = 1e-4, 24

# lanes of one curve's work array: a point above the horizon; squared distance to the nearest place and its t; t of the
# foot, and its lower and upper bound; squared distance to the foot, and the side of the curve
_X, _Y, _NEAR, _AT, _T, _LOW, _HIGH, _SQUARE, _SIDE = (k * LANES for k in range(9))
_WORK = 9 * LANES


@inlined
def _at(a, b, c, d, t):
    """Return one coordinate of a curve (equation 6.1)."""
    return a + t * (b + t * (c + t * d))


@inlined
def _speed(b, c, d, t):
    """Return the derivative of one coordinate by t."""
    return b + t * (2.0 * c + 3.0 * t * d)


@inner
def _curve(numbers, side, curve):
    """Fill the coefficients of the powers of t of the upper left (side -1) or upper right (+1) curve.

    Coordinates are along and across the field; the curve runs from the top to the horizon. Returns an upper bound of
    its speed.
    """
    at = 5 if side < 0.0 else 7
    extent = numbers[3] if side < 0.0 else numbers[4]
    along = numbers[0], numbers[0] + side * numbers[at], numbers[0] + side * extent, numbers[0] + side * extent
    across = numbers[2], numbers[2], numbers[at + 1], 0.0
    for k, (p0, p1, p2, p3) in enumerate((along, across)):
        curve[k, 0] = p0
        curve[k, 1] = 3.0 * (p1 - p0)
        curve[k, 2] = 3.0 * (p2 - 2.0 * p1 + p0)
        curve[k, 3] = p3 - 3.0 * p2 + 3.0 * p1 - p0
    fastest = 0.0
    # the speed is bounded by three times the longest side of the control polygon
    for k in range(3):
        dx, dy = along[k + 1] - along[k], across[k + 1] - across[k]
        fastest = max(fastest, 3.0 * sqrt(dx * dx + dy * dy))
    return fastest


@inner
def border_room():
    """Allocate the arrays of `border_of` (curves, places) and of `border_distances` (work, found, x, y)."""
    curves, places = np.empty((2, 2, 4)), np.empty((2, _CURVE_PARTS + 1, 2))
    return curves, places, np.empty((2, _WORK)), np.empty(LANES), np.empty(LANES), np.empty(LANES)


@inner
def border_of(numbers, curves, places):
    """Fill both upper curves of a ghost and sample points on them.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    curves : ndarray, shape (2, 2, 4)
        Left and right curve; along and across the field; coefficients of the powers of t.
    places : ndarray, shape (2, 17, 2)
        Sample points.

    Returns
    -------
    float
        Upper bound of the distance of a point of either curve from the nearest sample point.
    """
    fastest = max(_curve(numbers, -1.0, curves[0]), _curve(numbers, 1.0, curves[1]))
    for one in range(2):
        for k in range(_CURVE_PARTS + 1):
            for n in range(2):
                c = curves[one, n]
                places[one, k, n] = _at(c[0], c[1], c[2], c[3], k / _CURVE_PARTS)
    return 0.5 * fastest / _CURVE_PARTS


@inner
def _nearest_samples(places, work):
    """Fill the sample point nearest to each lane's point."""
    for m in range(LANES):
        work[_NEAR + m] = 1e300
        work[_AT + m] = 0.0
    for k in range(_CURVE_PARTS + 1):
        px, py, part = places[k, 0], places[k, 1], k / _CURVE_PARTS
        for m in range(LANES):
            dx, dy = px - work[_X + m], py - work[_Y + m]
            square = dx * dx + dy * dy
            nearer = square < work[_NEAR + m]
            work[_AT + m] = part if nearer else work[_AT + m]
            work[_NEAR + m] = square if nearer else work[_NEAR + m]


@inner
def _find_feet(curve, side, work):
    """Find each lane's foot on the left (side -1) or right curve by Newton steps or bisection (equation 6.2).

    The search starts at the nearest sample point.
    """
    ax, bx, cx, dx = curve[0, 0], curve[0, 1], curve[0, 2], curve[0, 3]
    ay, by, cy, dy = curve[1, 0], curve[1, 1], curve[1, 2], curve[1, 3]
    for m in range(LANES):
        work[_T + m] = work[_AT + m]
        work[_LOW + m] = max(work[_AT + m] - 1.0 / _CURVE_PARTS, 0.0)
        work[_HIGH + m] = min(work[_AT + m] + 1.0 / _CURVE_PARTS, 1.0)
    for _ in range(_STEPS):
        going = 0.0
        for m in range(LANES):
            t = work[_T + m]
            off_x, off_y = _at(ax, bx, cx, dx, t) - work[_X + m], _at(ay, by, cy, dy, t) - work[_Y + m]
            speed_x, speed_y = _speed(bx, cx, dx, t), _speed(by, cy, dy, t)
            slope = off_x * speed_x + off_y * speed_y
            turn = off_x * (2.0 * cx + 6.0 * t * dx) + off_y * (2.0 * cy + 6.0 * t * dy)
            bend = speed_x * speed_x + speed_y * speed_y + turn
            low = t if slope <= 0.0 else work[_LOW + m]
            high = t if slope > 0.0 else work[_HIGH + m]
            trial = t - slope / bend
            trial = trial if (bend > 0.0) & (trial >= low) & (trial <= high) else 0.5 * (low + high)
            work[_LOW + m], work[_HIGH + m], work[_T + m] = low, high, trial
            going += 1.0 if abs(trial - t) > _CONVERGED else 0.0
        if going == 0.0:
            break
    for m in range(LANES):
        t = work[_T + m]
        off_x, off_y = work[_X + m] - _at(ax, bx, cx, dx, t), work[_Y + m] - _at(ay, by, cy, dy, t)
        square = off_x * off_x + off_y * off_y
        # if there are several feet the search may end at a farther one: keep the sample point if that is nearer
        t = t if square <= work[_NEAR + m] else work[_AT + m]
        off_x, off_y = work[_X + m] - _at(ax, bx, cx, dx, t), work[_Y + m] - _at(ay, by, cy, dy, t)
        work[_T + m] = t
        work[_SQUARE + m] = off_x * off_x + off_y * off_y
        # the tangents at the ends are along the field and across it, also where a control point coincides with the end
        speed_x = _speed(bx, cx, dx, t) if (t > 0.0) & (t < 1.0) else (side if t <= 0.0 else 0.0)
        speed_y = _speed(by, cy, dy, t) if (t > 0.0) & (t < 1.0) else (0.0 if t <= 0.0 else -1.0)
        work[_SIDE + m] = off_x * speed_y - off_y * speed_x


@inner
def border_distances(curves, places, apart, x, y, work, found):
    """Fill the signed distances from a ghost's border to the points of all lanes.

    Parameters
    ----------
    curves, places, apart
        From `border_of`.
    x, y : ndarray, shape (LANES,)
        Along the field, and across it from the horizon, model pixels.
    work : ndarray, shape (2, 9 * LANES)
        Scratch.
    found : ndarray, shape (LANES,)
        Filled: positive inside.
    """
    left, right = work[0], work[1]
    for m in range(LANES):
        left[_X + m] = x[m]
        left[_Y + m] = abs(y[m])
        left[_SQUARE + m] = 1e300
    for m in range(LANES):
        right[_X + m] = x[m]
        right[_Y + m] = abs(y[m])
        right[_SQUARE + m] = 1e300
    _nearest_samples(places[0], left)
    _nearest_samples(places[1], right)
    nearer_l, nearer_r = 0.0, 0.0
    for m in range(LANES):
        far_l, far_r = sqrt(left[_NEAR + m]), sqrt(right[_NEAR + m])
        nearer_l += 1.0 if far_l <= far_r + apart else 0.0
        nearer_r += 1.0 if far_r <= far_l + apart else 0.0
    # skip a curve that cannot be nearest to any point, by the bound `apart`
    if nearer_l > 0.0:
        _find_feet(curves[0], -1.0, left)
    if nearer_r > 0.0:
        _find_feet(curves[1], 1.0, right)
    for m in range(LANES):
        on_left = left[_SQUARE + m] < right[_SQUARE + m]
        distance = sqrt(left[_SQUARE + m] if on_left else right[_SQUARE + m])
        # both curves run from the top to the horizon: the inside lies to the right of the right curve and to the left
        # of the left curve
        inward = -left[_SIDE + m] if on_left else right[_SIDE + m]
        found[m] = distance if inward >= 0.0 else -distance
