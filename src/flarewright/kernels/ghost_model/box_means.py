"""Means of a picture over axis-aligned squares at any position, over the measured pixels only."""

import numpy as np

from ..jit.decorators import borrowing, compiled

# measured part of a square below which its mean is 0
_NOTHING = 1e-6


@borrowing
def _prefix_sum(sums, x, y, m):
    """Return the sum over all pixels left of and above a place, interpolated linearly within a pixel."""
    left, top = min(int(x), sums.shape[1] - 2), min(int(y), sums.shape[0] - 2)
    a, b = x - left, y - top
    upper = (1.0 - a) * sums[top, left, m] + a * sums[top, left + 1, m]
    return (1.0 - b) * upper + b * ((1.0 - a) * sums[top + 1, left, m] + a * sums[top + 1, left + 1, m])


@compiled
def box_means(picture, x, y, side, mean, part):
    """Fill the means of a picture over squares.

    Parameters
    ----------
    picture : ndarray, shape (H, W, 3), float32
        NaN where nothing was measured.
    x, y : ndarray, shape (P,), float64
        Centres of the squares, pixels from the picture's corner.
    side : float
        Side of the squares, pixels.
    mean, part : ndarray, shape (P, 3), float64
        Filled: the mean, 0 where nothing was measured; the measured part of the square.
    """
    height, width = picture.shape[0], picture.shape[1]
    # summed-area tables of light and of the number of measured pixels, for each colour
    sums = np.zeros((height + 1, width + 1, 6))
    for r in range(height):
        for c in range(width):
            for m in range(3):
                value = picture[r, c, m]
                known = np.isfinite(value)
                above, here = sums[r, c + 1], sums[r + 1, c]
                corner = sums[r, c]
                sums[r + 1, c + 1, m] = above[m] + here[m] - corner[m] + (value if known else 0.0)
                sums[r + 1, c + 1, 3 + m] = above[3 + m] + here[3 + m] - corner[3 + m] + (1.0 if known else 0.0)
    for p in range(x.size):
        x0, x1 = min(max(x[p] - 0.5 * side, 0.0), width), min(max(x[p] + 0.5 * side, 0.0), width)
        y0, y1 = min(max(y[p] - 0.5 * side, 0.0), height), min(max(y[p] + 0.5 * side, 0.0), height)
        for m in range(3):
            count = (_prefix_sum(sums, x1, y1, 3 + m) - _prefix_sum(sums, x1, y0, 3 + m)) - (
                _prefix_sum(sums, x0, y1, 3 + m) - _prefix_sum(sums, x0, y0, 3 + m)
            )
            part[p, m] = count / side**2
            mean[p, m] = 0.0
            if part[p, m] > _NOTHING:
                light = (_prefix_sum(sums, x1, y1, m) - _prefix_sum(sums, x1, y0, m)) - (
                    _prefix_sum(sums, x0, y1, m) - _prefix_sum(sums, x0, y0, m)
                )
                mean[p, m] = light / max(count, 1e-9)
