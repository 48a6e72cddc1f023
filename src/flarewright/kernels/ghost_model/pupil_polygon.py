"""The iris of a measured ghost's pupil: a centred regular polygon with the area of the unit disc.

Angles are counterclockwise from the direction of the field s; the normal of side e has the angle
`turn` + 2 pi e / blades.
"""

from math import cos, pi, sin, sqrt

from ..jit.decorators import inner


@inner
def apothem(blades):
    """Return the distance of the sides from the centre, for an area of pi."""
    return sqrt(2.0 * pi / (blades * sin(2.0 * pi / blades))) * cos(pi / blades)


@inner
def ends(blades, turn):
    """Return the two places at which the polygon crosses the line along s."""
    low, high, reach = -1e30, 1e30, apothem(blades)
    for e in range(blades):
        along = cos(turn + 2.0 * pi * e / blades)
        if along > 1e-9:
            high = min(high, reach / along)
        elif along < -1e-9:
            low = max(low, reach / along)
    return low, high


@inner
def nearest_side(middle, cosine, sine, blades, turn):
    """Return the side that a spoke from (middle, 0) meets first, its distance, and the derivative by `middle`."""
    best, side, by, away = 1e30, 0, 0.0, apothem(blades)
    turn_c, turn_s = cos(2.0 * pi / blades), sin(2.0 * pi / blades)
    along, across = cos(turn), sin(turn)
    for e in range(blades):
        facing = along * cosine + across * sine
        if facing > 1e-9:
            reach = (away - middle * along) / facing
            if reach < best:
                best, side, by = reach, e, -along / facing
        along, across = along * turn_c - across * turn_s, across * turn_c + along * turn_s
    return side, best, by


@inner
def side_corner(blades, turn, a, b, spot):
    """Fill the corner between two sides; return whether they are neighbours."""
    if (a + 1) % blades == b:
        between = a + 0.5
    elif (b + 1) % blades == a:
        between = b + 0.5
    else:
        return False
    reach = apothem(blades) / cos(pi / blades)
    angle = turn + 2.0 * pi * between / blades
    spot[0], spot[1] = reach * cos(angle), reach * sin(angle)
    return True


@inner
def side_and_disc(blades, turn, side, centre, radius, near_x, near_y, spot, by):
    """Fill the intersection of a side and a disc's rim nearest to a point, and its derivatives by centre and radius.

    `by` has shape (2, 2): along and across, by centre and by radius. Returns whether they intersect.
    """
    angle = turn + 2.0 * pi * side / blades
    c, s = cos(angle), sin(angle)
    away = apothem(blades)
    # position along the side of the foot of the perpendicular from the disc's centre
    foot = -centre * s
    square = radius * radius - (away - centre * c) * (away - centre * c)
    if square < 1e-8:
        return False
    best = 1e30
    for k in range(2):
        at = foot + (sqrt(square) if k == 0 else -sqrt(square))
        x, y = away * c - at * s, away * s + at * c
        off = (x - near_x) * (x - near_x) + (y - near_y) * (y - near_y)
        if off < best:
            best = off
            spot[0], spot[1] = x, y
    steep = -(spot[0] - centre) * s + spot[1] * c
    if abs(steep) < 1e-9:
        return False
    moved, grown = (spot[0] - centre) / steep, radius / steep
    by[0, 0], by[1, 0] = -s * moved, c * moved
    by[0, 1], by[1, 1] = -s * grown, c * grown
    return True
