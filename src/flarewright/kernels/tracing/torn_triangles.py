"""Triangles of a bundle in which some rays fail."""

import numpy as np

from ..jit.decorators import compiled
from .sequential import ALIVE


@compiled
def find_torn(data, triangles):
    """Return the triangles of which one or two rays fail.

    Parameters
    ----------
    data : ndarray, shape (N, 5 + 2 C)
        As `kernels.tracing.sequential.trace_lanes` fills it.
    triangles : ndarray, shape (T, 3), int64

    Returns
    -------
    ndarray, int64
        Rising indices.
    """
    failed = 0
    for k in range(data.shape[0]):
        failed += not data[k, ALIVE] > 0.0
    torn = np.empty(triangles.shape[0] if failed > 0 else 0, dtype=np.int64)
    count = 0
    for t in range(torn.size):
        passing = 0
        for m in range(3):
            passing += data[triangles[t, m], ALIVE] > 0.0
        if 0 < passing < 3:
            torn[count] = t
            count += 1
    return torn[:count]
