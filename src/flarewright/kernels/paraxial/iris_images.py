"""Cut the entrance pupil of a paraxial ghost by the images of the iris, edge by edge along a linked polygon."""

import numpy as np

from ..jit.decorators import borrowing


@borrowing
def close_ring(corners, spots, ring):
    """Link a convex polygon to a ring of vertices.

    Parameters
    ----------
    corners : ndarray, shape (N, 2)
        In order around the polygon.
    spots : ndarray, shape (N + M, 2)
        Filled with the corners; the rest is for new vertices, two for each of M / 2 cuts.
    ring : ndarray, shape (N + M, 2), int64
        Filled with the vertex after and before each.
    """
    sides = corners.shape[0]
    for k in range(sides):
        spots[k, 0], spots[k, 1] = corners[k, 0], corners[k, 1]
        ring[k, 0], ring[k, 1] = k + 1, k - 1
    ring[sides - 1, 0], ring[0, 1] = 0, sides - 1


@borrowing
def _above(spots, k, a, b, high):
    return a * spots[k, 0] + b * spots[k, 1] - high


@borrowing
def _highest(spots, ring, start, a, b, high, slack):
    """Return the vertex with the largest value of a linear function, found by walking uphill both ways."""
    best, peak = start, _above(spots, start, a, b, high)
    for way in range(2):
        k, value = start, _above(spots, start, a, b, high)
        while True:
            following = ring[k, way]
            next_value = _above(spots, following, a, b, high)
            if next_value < value - slack or following == start:
                break
            k, value = following, next_value
            if value > peak:
                best, peak = k, value
    return best, peak


@borrowing
def _crossing_between(spots, inside, outside, a, b, high, new):
    """Set a new vertex where the line between two others crosses an edge."""
    low, up = _above(spots, inside, a, b, high), _above(spots, outside, a, b, high)
    # both are zero but for rounding where the edge passes through both vertices
    t = min(low / (low - up), 1.0) if low < 0.0 and low < up else 0.0
    for m in range(2):
        spots[new, m] = spots[inside, m] + t * (spots[outside, m] - spots[inside, m])


@borrowing
def cut_ring(spots, ring, head, used, a, b, high, slack):
    """Keep the part of a convex polygon where a x + b y <= high.

    Parameters
    ----------
    spots, ring : ndarray
        From `close_ring`; changed.
    head : int
        Any vertex of the polygon; the search for the highest vertex starts there.
    used : int
        Number of vertices so far, those cut off included.
    a, b, high : float
    slack : float
        Differences of values that count as none, because vertices can coincide but for rounding.

    Returns
    -------
    head : int
        A vertex of the rest, near the cut; -1 if nothing is left.
    used : int
    """
    head, peak = _highest(spots, ring, head, a, b, high, slack)
    if peak <= slack:
        return head, used
    after, before = ring[head, 0], ring[head, 1]
    while _above(spots, after, a, b, high) > 0.0:
        if after == head:
            return np.int64(-1), used
        after = ring[after, 0]
    while _above(spots, before, a, b, high) > 0.0:
        before = ring[before, 1]
    _crossing_between(spots, before, ring[before, 0], a, b, high, used)
    _crossing_between(spots, after, ring[after, 1], a, b, high, used + 1)
    ring[before, 0], ring[used, 0], ring[used + 1, 0] = used, used + 1, after
    ring[after, 1], ring[used + 1, 1], ring[used, 1] = used + 1, used, before
    return used, used + 2
