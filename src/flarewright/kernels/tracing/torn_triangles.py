"""Triangles of a bundle in which some rays fail."""

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .sequential import ALIVE, WEIGHT

# fraction of a cell's squared size: passing rays that span less lie on a line
_COLLINEAR_AREA = 1e-6


@compiled
def cut_torn(data, pupil, triangles):
    """Cut the triangles of which one or two rays fail halfway between passing and failed rays.

    Parameters
    ----------
    data : ndarray, shape (N, 5 + 2 C)
        As `kernels.tracing.sequential.trace_lanes` fills it.
    pupil : ndarray, shape (N, 2)
    triangles : ndarray, shape (T, 3), int64
        Those of a cell follow each other and begin with its centre.

    Returns
    -------
    rays : ndarray, shape (2 K, 5 + 2 C)
        Two new rays on the cuts of each of K torn triangles, all first ones before all second ones; linear in the pupil
        through the passing rays of the cell, and constant where these lie on a line.
    places : ndarray, shape (2 K, 2)
        Theirs in the pupil.
    parts : ndarray, shape (P, 3), int64
        What passes of the torn triangles; new rays are numbered from N.
    """
    torn = _find_torn(data, triangles)
    count, columns = torn.size, data.shape[1]
    rays, places = np.empty((2 * count, columns)), np.empty((2 * count, 2))
    parts = np.empty((2 * count, 3), dtype=np.int64)
    slopes = np.empty((2, columns))
    # a triangle that loses one corner keeps two parts; the second ones follow all first ones
    more, cell = count, np.int64(-1)
    for k in range(count):
        t = torn[k]
        if triangles[t, 0] != cell:
            cell = triangles[t, 0]
            _fit_slopes(data, pupil, triangles, t, slopes)
        # turn until the first ray passes and the last one fails
        turn = 0
        while not (_passes(data, triangles[t, turn]) and not _passes(data, triangles[t, (turn + 2) % 3])):
            turn += 1
        a, b, c = triangles[t, turn], triangles[t, (turn + 1) % 3], triangles[t, (turn + 2) % 3]
        two = _passes(data, b)
        # the cut of a-b, or of b-c where b passes, then that of a-c
        first, second = data.shape[0] + k, data.shape[0] + count + k
        _cut_edge(data, pupil, slopes, b if two else a, c if two else b, rays, places, k)
        _cut_edge(data, pupil, slopes, a, c, rays, places, count + k)
        parts[k, 0], parts[k, 1], parts[k, 2] = a, first, second
        if two:
            parts[more, 0], parts[more, 1], parts[more, 2] = a, b, first
            more += 1
    return rays, places, parts[:more]


@inner
def _find_torn(data, triangles):
    """Return rising indices of the triangles of which one or two rays fail."""
    failed = 0
    for k in range(data.shape[0]):
        failed += not data[k, ALIVE] > 0.0
    torn = np.empty(triangles.shape[0] if failed > 0 else 0, dtype=np.int64)
    count = 0
    for t in range(torn.size):
        passing = 0
        for m in range(3):
            passing += _passes(data, triangles[t, m])
        if 0 < passing < 3:
            torn[count] = t
            count += 1
    return torn[:count]


@borrowing
def _passes(data, k):
    return data[k, ALIVE] > 0.0


@borrowing
def _cut_edge(data, pupil, slopes, begin, end, rays, places, k):
    """Fill the k-th new ray and its place, halfway from a passing ray to a failed one."""
    across, along = 0.5 * (pupil[end, 0] - pupil[begin, 0]), 0.5 * (pupil[end, 1] - pupil[begin, 1])
    places[k, 0], places[k, 1] = pupil[begin, 0] + across, pupil[begin, 1] + along
    for m in range(data.shape[1]):
        rays[k, m] = data[begin, m] + (across * slopes[0, m] + along * slopes[1, m])
    rays[k, WEIGHT] = max(rays[k, WEIGHT], 0.0)
    rays[k, ALIVE] = 1.0


@borrowing
def _fit_slopes(data, pupil, triangles, t, slopes):
    """Fill the slopes of all quantities over the pupil, least squares over the passing rays of a triangle's cell.

    All 0 where these rays lie on a line.
    """
    middle = triangles[t, 0]
    begin, end = t, t + 1
    while begin > 0 and triangles[begin - 1, 0] == middle:
        begin -= 1
    while end < triangles.shape[0] and triangles[end, 0] == middle:
        end += 1
    # the centre, then the border; places count from the mean of the passing ones
    count, mean_x, mean_y = 0, 0.0, 0.0
    for k in range(begin - 1, end):
        node = middle if k < begin else triangles[k, 1]
        if _passes(data, node):
            count += 1
            mean_x, mean_y = mean_x + pupil[node, 0] - pupil[middle, 0], mean_y + pupil[node, 1] - pupil[middle, 1]
    mean_x, mean_y = pupil[middle, 0] + mean_x / count, pupil[middle, 1] + mean_y / count
    sxx, sxy, syy = 0.0, 0.0, 0.0
    for m in range(data.shape[1]):
        slopes[0, m], slopes[1, m] = 0.0, 0.0
    for k in range(begin - 1, end):
        node = middle if k < begin else triangles[k, 1]
        if _passes(data, node):
            x, y = pupil[node, 0] - mean_x, pupil[node, 1] - mean_y
            sxx, sxy, syy = sxx + x * x, sxy + x * y, syy + y * y
            for m in range(data.shape[1]):
                slopes[0, m], slopes[1, m] = slopes[0, m] + x * data[node, m], slopes[1, m] + y * data[node, m]
    determinant = sxx * syy - sxy * sxy
    line = determinant <= _COLLINEAR_AREA * (sxx + syy) * (sxx + syy)
    inverse = 0.0 if line else 1.0 / determinant
    for m in range(data.shape[1]):
        sdx, sdy = slopes[0, m], slopes[1, m]
        slopes[0, m], slopes[1, m] = (syy * sdx - sxy * sdy) * inverse, (sxx * sdy - sxy * sdx) * inverse
