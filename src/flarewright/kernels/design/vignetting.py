"""Vignetting of ghosts: the light's slope over the slope at which a ghost's centre is hidden, with derivatives.

The centre of a ghost bounded by the stop is hidden when its ray misses the entrance; that of a ghost bounded by the
entrance, when its ray misses the stop (Van Acoleyen 2025, section 5.6.3 and figure 5.15).
"""

from ..jit.decorators import inner
from .ghosts import REACH_THESIS, add_by_prescription, add_gradient, fill_suffix, own_column


@inner
def beyond_sight(g, slope, values):
    """Return the light's slope over the slope at which the ghost's centre is hidden; 0 where it is visible."""
    ratio = slope / values[g, REACH_THESIS]
    return ratio if ratio > 1.0 else 0.0


@inner
def fill_mirrors_of_ghosts(stop, rows, mirrors, between):
    """Fill the mirrors (j, i) of every ghost, in the order of `ghosts.list_ghosts`."""
    ghost = 0
    for half in range(2):
        first, last = (0, stop) if half == 0 else (stop, rows)
        for j in range(first, last):
            for i in range(j - 1, first - 1, -1):
                if mirrors[j] and mirrors[i]:
                    between[ghost, 0], between[ghost, 1] = j, i
                    ghost += 1


@inner
def sight_row(q, rows, stop, j, i, entrance, work, trail, partial, row):
    """Differentiate 1 / REACH_THESIS of one ghost by the prescription.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    rows, stop, j, i : int
    entrance : float
    work : ndarray, shape (WORK_ROWS, K)
        Reduced rows of the same prescription (`ghosts.reduce_rows`).
    trail : ndarray, shape (TRAIL * K,)
        Scratch.
    partial : ndarray, shape (4, K)
        All 0.
    row : ndarray, shape (1 + 3 K,)
        Filled.
    """
    for v in range(row.size):
        row[v] = 0.0
    # ghosts behind the stop share the path to the stop
    front = j < stop
    if front:
        a, _ = own_column(0, stop, j, i, 1.0, 0.0, work)
        b, _ = own_column(0, stop, j, i, 0.0, 1.0, work)
    else:
        a, b, _, _ = fill_suffix(0, stop, work)
        j, i = -1, -1
    sign = 1.0 if b >= 0.0 else -1.0
    if entrance * abs(a) >= q[0]:
        # |b| / (entrance / 2 |a|)
        by_b = 2.0 * sign / (entrance * abs(a))
        add_gradient(0, stop, j, i, 1.0, 0.0, -by_b * b / a, 0.0, work, trail, partial)
    else:
        by_b = 2.0 * sign / q[0]
        row[0] = -by_b * b / q[0]
    add_gradient(0, stop, j, i, 0.0, 1.0, by_b, 0.0, work, trail, partial)
    add_by_prescription(q, rows, 0, stop, partial, 1.0, row)
