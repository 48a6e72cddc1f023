"""Edge thickness: the gap between neighbouring surfaces at the edge of the axial beam, with exact derivatives.

The beam fills the stop, or the entrance if that is smaller. For neighbours k and m the gap at height r is
d + sag(c_m, r) - sag(c_k, r), which is monotonic in r: a gap that is positive at the beam's edge is positive inside it.
The stop counts as a plane.
"""

import numpy as np

from ..jit.decorators import compiled, inner
from .ghosts import add_by_prescription, add_gradient, reduce_rows

# beyond this part of the radius of curvature sags continue linearly, so that they have a slope everywhere
_ROUND = 0.98


@inner
def sag_parts(c, r):
    """Return the sag of a sphere at height r, and its derivatives by c and by r."""
    u = abs(c) * r
    if u <= _ROUND:
        s = np.sqrt(1.0 - u * u)
        return c * r * r / (1.0 + s), r * r / (s * (1.0 + s)), c * r / s
    s = np.sqrt(1.0 - _ROUND * _ROUND)
    slope = _ROUND / s
    height = 1.0 - s + slope * (u - _ROUND)
    return height / c, (slope * u - height) / (c * c), slope if c > 0.0 else -slope


@inner
def fill_beam(q, rows, stop, entrance, work, beam):
    """Fill the axial ray's height on every row over its height at the entrance, then that height and what limits it.

    The last item is 1 if the entrance limits the beam, 0 if the stop does.
    """
    y, w = 1.0, 0.0
    for k in range(rows):
        beam[k] = y
        w -= work[0, k] * y
        y += work[1, k] * w
    a = beam[stop]
    limited = q[0] > entrance * abs(a)
    beam[rows] = 0.5 * entrance if limited else 0.5 * q[0] / a
    beam[rows + 1] = 1.0 if limited else 0.0


@compiled
def beam_of(q, stop, entrance, work, beam):
    """Compute the axial beam of a prescription.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    stop : int
    entrance : float
        mm.
    work : ndarray, shape (WORK_ROWS, K)
        Working space.
    beam : ndarray, shape (K + 2,)
        Filled as by `fill_beam`.
    """
    rows = (q.size - 1) // 3
    reduce_rows(q, rows, work)
    fill_beam(q, rows, stop, entrance, work, beam)


@inner
def pair_of(k, stop, beam):
    """Return the row whose beam height is used for the gap behind row k."""
    if k == stop:
        return k + 1
    if k + 1 == stop or abs(beam[k]) <= abs(beam[k + 1]):
        return k
    return k + 1


@inner
def edge_values(q, rows, stop, limits, beam, out):
    """Fill by how much each gap falls short of its least edge, then by how much each surface exceeds its steepness.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    rows, stop : int
    limits : ndarray, shape (2,)
        Least thickness of an edge, mm (for a gap less than twice that, half the gap); largest height of the beam over
        the radius of curvature.
    beam : ndarray, shape (K + 2,)
        From `fill_beam`.
    out : ndarray, shape (2 K,)
        Filled; 0 where the limit is met.
    """
    for k in range(rows):
        c, r = q[1 + rows + k], abs(beam[k] * beam[rows])
        out[rows + k] = 0.0 if k == stop else max(abs(c) * r - limits[1], 0.0)
        out[k] = 0.0
        if k + 1 < rows:
            r = abs(beam[pair_of(k, stop, beam)] * beam[rows])
            front, _, _ = sag_parts(c, r)
            back, _, _ = sag_parts(q[2 + rows + k], r)
            out[k] = max(min(limits[0], 0.5 * q[1 + k]) - (q[1 + k] + back - front), 0.0)


@inner
def edge_row(q, rows, stop, number, limits, work, beam, trail, partial, row):
    """Differentiate one nonzero item of `edge_values` by the prescription."""
    for v in range(row.size):
        row[v] = 0.0
    if number >= rows:
        k = number - rows
        c, r = q[1 + rows + k], abs(beam[k] * beam[rows])
        row[1 + rows + k] = r if c > 0.0 else -r
        _add_height(q, rows, stop, k, abs(c), work, beam, trail, partial, row)
        return
    k = number
    at = pair_of(k, stop, beam)
    r = abs(beam[at] * beam[rows])
    _, front_c, front_r = sag_parts(q[1 + rows + k], r)
    _, back_c, back_r = sag_parts(q[2 + rows + k], r)
    row[1 + k] = -0.5 if 0.5 * q[1 + k] < limits[0] else -1.0
    row[1 + rows + k] += front_c
    row[2 + rows + k] -= back_c
    _add_height(q, rows, stop, at, front_r - back_r, work, beam, trail, partial, row)


@inner
def _add_height(q, rows, stop, at, factor, work, beam, trail, partial, row):
    """Add the derivatives of the beam's height on a row, times a factor."""
    begin = beam[rows]
    f = factor if beam[at] * begin >= 0.0 else -factor
    add_gradient(0, at, -1, -1, begin, 0.0, 1.0, 0.0, work, trail, partial)
    add_by_prescription(q, rows, 0, at, partial, f, row)
    if beam[rows + 1] == 0.0:
        # the stop limits the ray: a change in front of the stop changes the ray's height at the entrance
        f *= beam[at] / beam[stop]
        row[0] += 0.5 * f
        add_gradient(0, stop, -1, -1, begin, 0.0, 1.0, 0.0, work, trail, partial)
        add_by_prescription(q, rows, 0, stop, partial, -f, row)
