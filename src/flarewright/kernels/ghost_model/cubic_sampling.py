"""Interpolate pictures between their cells by cubic convolution."""

from math import floor

import numpy as np

from ..jit.decorators import compiled, inner


@inner
def _weights(t, out):
    """Fill the weights of the four cells around a place; t is the distance from the second, in cells."""
    out[0] = t * (-0.5 + t * (1.0 - 0.5 * t))
    out[1] = 1.0 + t * t * (-2.5 + 1.5 * t)
    out[2] = t * (0.5 + t * (2.0 - 1.5 * t))
    out[3] = t * t * (-0.5 + 0.5 * t)


@compiled
def cubic_samples(cells, column, row, out):
    """Interpolate a picture at places between its cells.

    Parameters
    ----------
    cells : ndarray, shape (H, W, 3), float32
        Continued beyond its border by the border cells.
    column, row : ndarray, shape (N,), float64
        Places; whole numbers are the centres of cells.
    out : ndarray, shape (N, 3), float64
        Filled.

    Notes
    -----
    Keys (1981), Cubic convolution interpolation for digital image processing, equation 4 with a = -1/2: exact for
    polynomials up to second order, which tests/kernels/ghost_model/test_cubic_sampling.py checks.
    """
    height, width = cells.shape[0], cells.shape[1]
    across, down = np.empty(4), np.empty(4)
    for n in range(column.size):
        left, top = int(floor(column[n])), int(floor(row[n]))
        _weights(column[n] - left, across)
        _weights(row[n] - top, down)
        out[n, 0], out[n, 1], out[n, 2] = 0.0, 0.0, 0.0
        for a in range(4):
            r = min(max(top + a - 1, 0), height - 1)
            for b in range(4):
                c = min(max(left + b - 1, 0), width - 1)
                weight = down[a] * across[b]
                for m in range(3):
                    out[n, m] += weight * cells[r, c, m]
