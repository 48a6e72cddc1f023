"""Convolution of a picture with a small kernel, tap by tap: cheaper than a Fourier transform up to some 700 taps."""

import numpy as np

from ..jit.decorators import compiled


@compiled
def spread_taps(picture, kernel, first_row, first_column, light):
    """Add a picture, spread by a kernel, to a window of the result.

    Parameters
    ----------
    picture : ndarray, shape (H, W, 3), float32
    kernel : ndarray, shape (A, B), float32
    first_row, first_column : int
        The window's corner in the whole result, which has H + A - 1 rows and W + B - 1 columns.
    light : ndarray, shape (H', W', 3), float32
        The window, added to.

    Notes
    -----
    Each tap adds a multiple of a row to a row of the result, a loop that the compiler vectorises; a picture without
    light in some place adds exact zeros there, as a Fourier transform does not.
    """
    height, width = picture.shape[0], 3 * picture.shape[1]
    source, result = picture.reshape(picture.size), light.reshape(light.size)
    across = 3 * light.shape[1]
    for row in range(light.shape[0]):
        for a in range(kernel.shape[0]):
            below = row + first_row - a
            if below < 0 or below >= height:
                continue
            for b in range(kernel.shape[1]):
                tap = kernel[a, b]
                if tap == 0.0:
                    continue
                # column c of the picture lands at c + b - first_column
                shift = 3 * (b - first_column)
                start, end = max(0, -shift), min(width, across - shift)
                to, at = np.uint64(row * across + start + shift), np.uint64(below * width + start)
                for m in range(end - start):
                    result[to + np.uint64(m)] += tap * source[at + np.uint64(m)]
