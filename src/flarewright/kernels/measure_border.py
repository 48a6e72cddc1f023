"""The border of Walch's ghost, four cubic Bezier curves mirrored at the horizon, and how far from it many points lie.

Walch 2017, chapter 6: figure 6.2 (shape), equations 6.1 to 6.3 (distance). Points are asked in lanes that the compiler
vectorises.
"""

from math import sqrt

import numpy as np

from ._jit import compiled, inlined, inner

# centre along and across the field, height, extents left and right, control points (along, across) left and right
SHAPE = 9
LANES = 48

# parts of a curve whose ends are compared first
_PARTS = 16
# steps from the nearest of them: until none goes farther, where Newton's next goes its square, and at most, which halve
# such a part to less
_ENOUGH, _STEPS = 1e-4, 24

# lanes of one curve's work: a point above the horizon, the square of its distance to the nearest place and where that
# is; where the foot is, and between which bounds; the square of the distance to it, and which side of the curve it is
_X, _Y, _NEAR, _AT, _T, _LOW, _HIGH, _SQUARE, _SIDE = (k * LANES for k in range(9))
_WORK = 9 * LANES
# lanes of an answer: signed distance, positive inside; 1 for the curve on the right, -1; where on it the foot is
DISTANCE, SIDE, FOOT = (k * LANES for k in range(3))
FOUND = 3 * LANES


@inlined
def _at(a, b, c, d, t):
    """Return one coordinate of a curve (equation 6.1)."""
    return a + t * (b + t * (c + t * d))


@inlined
def _speed(b, c, d, t):
    """Return its derivative."""
    return b + t * (2.0 * c + 3.0 * t * d)


@inner
def _curve(numbers, side, curve):
    """Fill the powers of t of the upper left (side -1) or upper right (+1) curve, along and across the field.

    It runs from the top to the horizon. Returns its largest speed at most.
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
    # no point of a curve is faster than the fastest side of its control polygon
    for k in range(3):
        dx, dy = along[k + 1] - along[k], across[k + 1] - across[k]
        fastest = max(fastest, 3.0 * sqrt(dx * dx + dy * dy))
    return fastest


@inner
def border_room():
    """Return what `border_of` fills, curves and places, and what `distances` needs: work, found, x and y."""
    curves, places = np.empty((2, 2, 4)), np.empty((2, _PARTS + 1, 2))
    return curves, places, np.empty((2, _WORK)), np.empty(FOUND), np.empty(LANES), np.empty(LANES)


@inner
def border_of(numbers, curves, places):
    """Fill both upper curves of a ghost and places on them.

    Parameters
    ----------
    numbers : ndarray, shape (19,)
    curves : ndarray, shape (2, 2, 4)
        Left and right; along and across the field; powers of t.
    places : ndarray, shape (2, 17, 2)

    Returns
    -------
    float
        How far a point of either curve is from the nearest place at most.
    """
    fastest = max(_curve(numbers, -1.0, curves[0]), _curve(numbers, 1.0, curves[1]))
    for one in range(2):
        for k in range(_PARTS + 1):
            for n in range(2):
                c = curves[one, n]
                places[one, k, n] = _at(c[0], c[1], c[2], c[3], k / _PARTS)
    return 0.5 * fastest / _PARTS


@inner
def _look(places, work):
    """Find the place that is nearest to each lane's point."""
    for m in range(LANES):
        work[_NEAR + m] = 1e300
        work[_AT + m] = 0.0
    for k in range(_PARTS + 1):
        px, py, part = places[k, 0], places[k, 1], k / _PARTS
        for m in range(LANES):
            dx, dy = px - work[_X + m], py - work[_Y + m]
            square = dx * dx + dy * dy
            nearer = square < work[_NEAR + m]
            work[_AT + m] = part if nearer else work[_AT + m]
            work[_NEAR + m] = square if nearer else work[_NEAR + m]


@inner
def _settle(curve, side, work):
    """Find each lane's foot on the left (side -1) or right curve near its place: Newton's steps or halvings (6.2)."""
    ax, bx, cx, dx = curve[0, 0], curve[0, 1], curve[0, 2], curve[0, 3]
    ay, by, cy, dy = curve[1, 0], curve[1, 1], curve[1, 2], curve[1, 3]
    for m in range(LANES):
        work[_T + m] = work[_AT + m]
        work[_LOW + m] = max(work[_AT + m] - 1.0 / _PARTS, 0.0)
        work[_HIGH + m] = min(work[_AT + m] + 1.0 / _PARTS, 1.0)
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
            going += 1.0 if abs(trial - t) > _ENOUGH else 0.0
        if going == 0.0:
            break
    for m in range(LANES):
        t = work[_T + m]
        off_x, off_y = work[_X + m] - _at(ax, bx, cx, dx, t), work[_Y + m] - _at(ay, by, cy, dy, t)
        square = off_x * off_x + off_y * off_y
        # of several feet near a place the steps may end at a farther one
        t = t if square <= work[_NEAR + m] else work[_AT + m]
        off_x, off_y = work[_X + m] - _at(ax, bx, cx, dx, t), work[_Y + m] - _at(ay, by, cy, dy, t)
        work[_T + m] = t
        work[_SQUARE + m] = off_x * off_x + off_y * off_y
        # at its ends a curve goes along the field and across it, also one whose control points lie there
        speed_x = _speed(bx, cx, dx, t) if (t > 0.0) & (t < 1.0) else (side if t <= 0.0 else 0.0)
        speed_y = _speed(by, cy, dy, t) if (t > 0.0) & (t < 1.0) else (0.0 if t <= 0.0 else -1.0)
        work[_SIDE + m] = off_x * speed_y - off_y * speed_x


@inner
def distances(curves, places, apart, x, y, work, found):
    """Fill how far a ghost's border is from the points of all lanes.

    Parameters
    ----------
    curves, places, apart
        From `border_of`.
    x, y : ndarray, shape (LANES,)
        Along the field, and across it from the horizon, pixels of the model.
    work : ndarray, shape (2, 9 * LANES)
        Changed.
    found : ndarray, shape (FOUND,)
        `DISTANCE`, `SIDE` and `FOOT`.
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
    _look(places[0], left)
    _look(places[1], right)
    nearer_l, nearer_r = 0.0, 0.0
    for m in range(LANES):
        far_l, far_r = sqrt(left[_NEAR + m]), sqrt(right[_NEAR + m])
        nearer_l += 1.0 if far_l <= far_r + apart else 0.0
        nearer_r += 1.0 if far_r <= far_l + apart else 0.0
    # a curve whose places are all farther than the other's nearest one by more than it may come nearer is not asked
    if nearer_l > 0.0:
        _settle(curves[0], -1.0, left)
    if nearer_r > 0.0:
        _settle(curves[1], 1.0, right)
    for m in range(LANES):
        on_left = left[_SQUARE + m] < right[_SQUARE + m]
        distance = sqrt(left[_SQUARE + m] if on_left else right[_SQUARE + m])
        # on the way from the top to the horizon the inside lies to the right of the right curve, to the left of the
        # other
        inward = -left[_SIDE + m] if on_left else right[_SIDE + m]
        found[DISTANCE + m] = distance if inward >= 0.0 else -distance
        found[SIDE + m] = -1.0 if on_left else 1.0
        found[FOOT + m] = left[_T + m] if on_left else right[_T + m]


@inner
def inward_normal(curves, side, t, distance, x, y):
    """Return how the signed distance of a point changes as it moves along the field and away from the horizon.

    Parameters
    ----------
    curves : ndarray, shape (2, 2, 4)
    side, t, distance : float
        Of the point, from `distances`.
    x, y : float
        Along the field, and away from the horizon.
    """
    u, v = curves[0 if side < 0.0 else 1]
    if abs(distance) > 1e-9:
        return (x - _at(u[0], u[1], u[2], u[3], t)) / distance, (y - _at(v[0], v[1], v[2], v[3], t)) / distance
    nx, ny = side * _speed(v[1], v[2], v[3], t), -side * _speed(u[1], u[2], u[3], t)
    length = sqrt(nx * nx + ny * ny)
    # where a control point lies on an end the curve has no direction there
    return (nx / length, ny / length) if length > 1e-12 else (-side, 0.0)


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
    curves, places, work, found, x, y = border_room()
    apart = border_of(numbers, curves, places)
    for start in range(0, points.shape[0], LANES):
        for m in range(LANES):
            k = min(start + m, points.shape[0] - 1)
            x[m], y[m] = points[k, 0], points[k, 1] - numbers[1]
        distances(curves, places, apart, x, y, work, found)
        for m in range(min(LANES, points.shape[0] - start)):
            out[start + m] = found[DISTANCE + m]
