"""Weighted sums of the lines of an image, to resample it along one axis."""

from __future__ import annotations

import numpy as np

from ..jit.decorators import compiled


@compiled
def sum_lines(image, numbers, weights, left, out):
    """Fill lines with weighted sums of an image's lines.

    Parameters
    ----------
    image : ndarray, shape (L, C), float32
    numbers : ndarray, shape (N, K), int64
        Lines of the image.
    weights : ndarray, shape (N, K), float64
        Their weights; lines of weight 0 are not read.
    left : int
        First column of the image that is summed.
    out : ndarray, shape (N, D), float32
        Filled, from as many columns.
    """
    for n in range(numbers.shape[0]):
        line = out[n]
        for c in range(line.size):
            line[c] = 0.0
        for k in range(numbers.shape[1]):
            weight = np.float32(weights[n, k])
            if weight == 0.0:
                continue
            read = image[numbers[n, k], left : left + line.size]
            for c in range(line.size):
                line[c] += weight * read[c]
