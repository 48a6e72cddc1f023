"""The pupil of a measured ghost: a fan of points over the intersection of discs, and their places on the sensor.

A ghost of a lens of revolution maps a pupil point p and a field s to (x, y) = s f(p.p, p.s, s.s) + p g(p.p, p.s, s.s);
symmetry allows no other form. Both f and g are a polynomial divided by 1 + b p.s + c s.s: if a ghost grows many times
with the field, a polynomial of few terms does not fit, but this quotient does (`benchmarks.measure.terms`).

The rims of the pupil are the unit disc, or an iris of straight blades with the same area, and discs whose centres move
with s. The open part of the pupil is therefore convex; with discs alone it is symmetric about the line along s. Every
point has derivatives by the ghost's parameters.
"""

from math import cos, pi, sin, sqrt

import numpy as np

from ..jit.decorators import borrowing, inner
from .pupil_polygon import ends, nearest_side, side_and_disc, side_corner

# monomials of u = p.p, v = p.s, w = s.s up to second order: of f, of g and of the intensity
TERMS = 10
# parameters, in this order: f, g, intensity; three for each disc: centre by s, centre by s (s.s), radius; number of
# blades of the iris, 0 for a round one; direction of a side's normal in the picture, radians counterclockwise from the
# right; variance of the blur, model pixels squared; lateral colour (`lateral_colour`): f', g', f", g", growth of f' and
# of g' with w; b and c of the divisor of f and g
FIRST_G, FIRST_I, FIRST_DISC = TERMS, 2 * TERMS, 3 * TERMS
DISC_NUMBERS = 3
MOST_DISCS = 4
BLADES = FIRST_DISC + DISC_NUMBERS * MOST_DISCS
TURN = BLADES + 1
SOFT = TURN + 1
LATERAL = SOFT + 1
LATERAL_NUMBERS = 6
BELOW = LATERAL + LATERAL_NUMBERS
BELOW_NUMBERS = 2
# least value of the divisor of f and g
LEAST_BELOW = 0.05


@borrowing
def monomials(u, v, w, out):
    """Fill the ten monomials of (u, v, w): 1, u, v, w, uu, uv, vv, uw, vw, ww."""
    out[0], out[1], out[2], out[3] = 1.0, u, v, w
    out[4], out[5], out[6] = u * u, u * v, v * v
    out[7], out[8], out[9] = u * w, v * w, w * w


@borrowing
def slopes(c, at, u, v, w):
    """Return value and derivatives by u and v of the polynomial whose ten coefficients start at c[at]."""
    value = c[at] + c[at + 1] * u + c[at + 2] * v + c[at + 3] * w + c[at + 4] * u * u + c[at + 5] * u * v
    value += c[at + 6] * v * v + c[at + 7] * u * w + c[at + 8] * v * w + c[at + 9] * w * w
    by_u = c[at + 1] + 2.0 * c[at + 4] * u + c[at + 5] * v + c[at + 7] * w
    by_v = c[at + 2] + c[at + 5] * u + 2.0 * c[at + 6] * v + c[at + 8] * w
    return value, by_u, by_v


@borrowing
def at_field(c, at, w, out):
    """Fill the six coefficients of 1, u, v, uu, uv, vv of a ten-term polynomial at a fixed w = s.s."""
    out[0] = c[at] + c[at + 3] * w + c[at + 9] * w * w
    out[1], out[2] = c[at + 1] + c[at + 7] * w, c[at + 2] + c[at + 8] * w
    out[3], out[4], out[5] = c[at + 4], c[at + 5], c[at + 6]


@borrowing
def divisor_at(parameters, v, w):
    """Return the divisor of f and g, and 1 if it follows the parameters or 0 if it is clamped to `LEAST_BELOW`."""
    value = 1.0 + parameters[BELOW] * v + parameters[BELOW + 1] * w
    return (value, 1.0) if value > LEAST_BELOW else (LEAST_BELOW, 0.0)


@borrowing
def level(six, u, v):
    """Return the value of a polynomial from its six coefficients of `at_field`."""
    return six[0] + u * (six[1] + six[3] * u + six[4] * v) + v * (six[2] + six[5] * v)


@borrowing
def _reach(middle, cosine, sine, centre, radius):
    """Return the distance from `middle` to a disc's rim, and its derivatives by middle - centre and by radius."""
    a = middle - centre
    root = sqrt(max(radius * radius - a * a * sine * sine, 1e-12))
    return root - a * cosine, -cosine - a * sine * sine / root, radius / root


@borrowing
def _nearest_rim(middle, cosine, sine, discs, count, blades, turn):
    """Return the first rim along a spoke: the index of a disc, or -1 - e for side e of the iris."""
    best, at, first = 1e30, 0, 0
    if blades > 0:
        side, best, _ = nearest_side(middle, cosine, sine, blades, turn)
        at, first = -1 - side, 1
    for k in range(first, count):
        reach, _, _ = _reach(middle, cosine, sine, discs[k, 0], discs[k, 1])
        if reach < best:
            best, at = reach, k
    return at


@inner
def _corner(discs, a, b, upper, spot, by):
    """Fill the intersection of two discs' rims and its derivatives by centre and radius; return whether it exists."""
    ca, ra, cb, rb = discs[a, 0], discs[a, 1], discs[b, 0], discs[b, 1]
    apart = cb - ca
    if abs(apart) < 1e-9:
        return False
    xi = (ra * ra - rb * rb - ca * ca + cb * cb) / (2.0 * apart)
    square = ra * ra - (xi - ca) * (xi - ca)
    if square < 1e-8:
        return False
    eta = sqrt(square)
    spot[0], spot[1] = xi, eta if upper else -eta
    dxi = np.zeros(4)
    dxi[0], dxi[1] = (xi - ca) / apart, ra / apart
    dxi[2], dxi[3] = (cb - xi) / apart, -rb / apart
    for m in range(4):
        deta = -(xi - ca) * dxi[m]
        if m == 0:
            deta += xi - ca
        elif m == 1:
            deta += ra
        disc = a if m < 2 else b
        by[0, 2 * disc + m % 2] = dxi[m]
        by[1, 2 * disc + m % 2] = deta / spot[1]
    return True


@borrowing
def rims(parameters, disc_count, sigma, discs):
    """Fill centre (along s) and radius of each disc at a field; the first is the unit disc."""
    discs[0, 0], discs[0, 1] = 0.0, 1.0
    w = sigma * sigma
    for k in range(disc_count):
        at = FIRST_DISC + DISC_NUMBERS * k
        discs[k + 1, 0] = sigma * (parameters[at] + parameters[at + 1] * w)
        discs[k + 1, 1] = parameters[at + 2]


@inner
def border(discs, count, spokes, blades, turn, with_changes, points, by):
    """Fill the border of the open pupil, spoke by spoke, from the middle of its axis.

    Parameters
    ----------
    discs : ndarray, shape (D, 2)
        Centre along s and radius.
    count, spokes, blades : int
        With blades above 0 the iris replaces the first disc.
    turn : float
        Angle of a side's normal from s, radians.
    with_changes : bool
        Whether to fill `by`.
    points : ndarray, shape (spokes + 1, 2)
        Filled: along s and across; the last item is the centre.
    by : ndarray, shape (spokes + 1, 2, 2 * D)
        Filled: derivatives by each disc's centre and radius.

    Returns
    -------
    bool
        False if the pupil is closed.
    """
    low, high, at_low, at_high = -1e30, 1e30, 0, 0
    if blades > 0:
        low, high = ends(blades, turn)
    for k in range(1 if blades > 0 else 0, count):
        if discs[k, 1] <= 0.0:
            return False
        if discs[k, 0] - discs[k, 1] > low:
            low, at_low = discs[k, 0] - discs[k, 1], k
        if discs[k, 0] + discs[k, 1] < high:
            high, at_high = discs[k, 0] + discs[k, 1], k
    if high - low < 1e-6:
        return False
    middle = 0.5 * (low + high)
    by[:] = 0.0
    points[spokes, 0], points[spokes, 1] = middle, 0.0
    by[spokes, 0, 2 * at_low] += 0.5
    by[spokes, 0, 2 * at_low + 1] -= 0.5
    by[spokes, 0, 2 * at_high] += 0.5
    by[spokes, 0, 2 * at_high + 1] += 0.5
    active = np.empty(spokes, np.int64)
    turn_c, turn_s = cos(2.0 * pi / spokes), sin(2.0 * pi / spokes)
    cosine, sine = 1.0, 0.0
    for j in range(spokes):
        k = _nearest_rim(middle, cosine, sine, discs, count, blades, turn) if count > 1 or blades > 0 else 0
        active[j] = k
        if k < 0:
            # the first disc has no parameters, so its derivatives are not used
            _, reach, by_a = nearest_side(middle, cosine, sine, blades, turn)
            k, by_r = 0, 0.0
        else:
            reach, by_a, by_r = _reach(middle, cosine, sine, discs[k, 0], discs[k, 1])
        points[j, 0], points[j, 1] = middle + reach * cosine, reach * sine
        for q in range(2 * count if with_changes else 0):
            dm = by[spokes, 0, q]
            dreach = by_a * (dm - (1.0 if q == 2 * k else 0.0)) + (by_r if q == 2 * k + 1 else 0.0)
            by[j, 0, q], by[j, 1, q] = dm + dreach * cosine, dreach * sine
        cosine, sine = cosine * turn_c - sine * turn_s, sine * turn_c + cosine * turn_s
    if count > 1 or blades > 0:
        _snap_corners(discs, spokes, blades, turn, active, middle, points, by)
    return True


@inner
def _intersection(discs, blades, turn, a, b, upper, near_x, near_y, spot, change):
    """Fill the intersection of two rims, and its derivatives; return whether there is one."""
    if a >= 0 and b >= 0:
        return _corner(discs, a, b, upper, spot, change)
    if a < 0 and b < 0:
        return side_corner(blades, turn, -1 - a, -1 - b, spot)
    side, disc = (-1 - a, b) if a < 0 else (-1 - b, a)
    return side_and_disc(
        blades, turn, side, discs[disc, 0], discs[disc, 1], near_x, near_y, spot, change[:, 2 * disc : 2 * disc + 2]
    )


@inner
def _snap_corners(discs, spokes, blades, turn, active, middle, points, by):
    """Move the nearest spoke onto each corner between two rims: a chord of the fan would cut the corner off."""
    spot, change = np.empty(2), np.empty((2, by.shape[2]))
    for j in range(spokes):
        after = j + 1 if j + 1 < spokes else 0
        if active[j] == active[after]:
            continue
        change[:] = 0.0
        upper = sin(2.0 * pi * (j + 0.5) / spokes) > 0.0
        near_x, near_y = 0.5 * (points[j, 0] + points[after, 0]), 0.5 * (points[j, 1] + points[after, 1])
        if not _intersection(discs, blades, turn, active[j], active[after], upper, near_x, near_y, spot, change):
            continue
        here = np.arctan2(spot[1], spot[0] - middle)
        away = here - 2.0 * pi * j / spokes
        away -= 2.0 * pi * np.floor(away / (2.0 * pi))
        if away > 2.0 * pi / spokes:
            continue
        at = j if away < pi / spokes else after
        # loops: an assignment of whole arrays compiles Numba's text of its error message as well
        for axis in range(2):
            points[at, axis] = spot[axis]
            for n in range(by.shape[2]):
                by[at, axis, n] = change[axis, n]


@borrowing
def picture_step(frame, along, across):
    """Return a step along s and across it as columns and rows of the picture, with rows down."""
    return (frame[4] * (frame[2] * along - frame[3] * across), -frame[4] * (frame[3] * along + frame[2] * across))


@borrowing
def pupil_change(n, sigma, pupil_by, i, j):
    """Return the derivative of a pupil point by parameter n, which belongs to a disc."""
    disc, which = (n - FIRST_DISC) // DISC_NUMBERS + 1, (n - FIRST_DISC) % DISC_NUMBERS
    if which == 2:
        return pupil_by[i, j, 0, 2 * disc + 1], pupil_by[i, j, 1, 2 * disc + 1]
    by = sigma if which == 0 else sigma * sigma * sigma
    return by * pupil_by[i, j, 0, 2 * disc], by * pupil_by[i, j, 1, 2 * disc]


@borrowing
def place_point(parameters, xi, eta, sigma):
    """Return the place of a pupil point on the sensor, along s and across, and its derivatives by the pupil point."""
    u, v, w = xi * xi + eta * eta, xi * sigma, sigma * sigma
    f, fu, fv = slopes(parameters, 0, u, v, w)
    g, gu, gv = slopes(parameters, FIRST_G, u, v, w)
    f_xi, f_eta = 2.0 * xi * fu + sigma * fv, 2.0 * eta * fu
    g_xi, g_eta = 2.0 * xi * gu + sigma * gv, 2.0 * eta * gu
    value, follows = divisor_at(parameters, v, w)
    along, across = (sigma * f + xi * g) / value, eta * g / value
    by_xi = follows * sigma * parameters[BELOW]
    return (
        along, across, (sigma * f_xi + g + xi * g_xi - along * by_xi) / value, (sigma * f_eta + xi * g_eta) / value,
        (eta * g_xi - across * by_xi) / value, (g + eta * g_eta) / value,
    )  # fmt: skip
