"""Soft borders: blur a picture, stored as differences along rows, with a discrete Gaussian.

A ghost's border is never sharp: every ghost is an image of the light, which has a size, and each wavelength draws the
ghost in a different size. The discrete Gaussian exp(-t) I_n(t) (Lindeberg 1990, "Scale-space for discrete signals") has
variance t for every t, however small. Its derivative by t is half of the second differences, exact and smooth in the
one parameter that a fit varies.
"""

from math import ceil, sqrt

import numpy as np

from ..jit.decorators import inner

# largest reach of the filter, pixels
_FARTHEST = 64
# block sizes of the filter, numbers and columns: small enough to stay in the cache for all taps
_CHUNK, _TILE = 1024, 64


@inner
def reach_of(variance):
    """Return the reach of the discrete Gaussian to each side, pixels."""
    if variance <= 0.0:
        return 0
    return min(int(ceil(3.5 * sqrt(variance))) + 1, _FARTHEST)


@inner
def taps_of(variance, taps):
    """Fill exp(-t) I_n(t), n from 0, by downward recurrence (Miller), normalised to a sum of 1 over both sides."""
    last = taps.size - 1
    t = max(variance, 1e-12)
    above, here = 0.0, 1e-30
    for n in range(last + 16, 0, -1):
        # I_(n-1) = I_(n+1) + 2 n / t I_n
        below = above + 2.0 * n / t * here
        above, here = here, below
        if n - 1 <= last:
            taps[n - 1] = here
        if here > 1e200:
            above *= 1e-200
            here *= 1e-200
            for k in range(min(n - 1, last + 1), last + 1):
                taps[k] *= 1e-200
    total = taps[0]
    for n in range(1, last + 1):
        total += 2.0 * taps[n]
    for n in range(last + 1):
        taps[n] /= total


@inner
def soften(differences, taps, left, top, right, bottom):
    """Blur a picture stored as differences along rows, in place.

    Column 0 holds the light left of the window. Beyond the window the picture is continued by its border pixels.

    Parameters
    ----------
    differences : ndarray, shape (H, W + 1, Q)
    taps : ndarray, shape (R + 1,)
    left, top, right, bottom : int
        Bounds of the part that may be nonzero before the blur.
    """
    height, width, count = differences.shape[0], differences.shape[1] - 1, differences.shape[2]
    reach = taps.size - 1
    x0, y0, y1 = max(left, 1), max(top, 0), min(bottom, height)
    x1 = max(min(right + 1, width), x0)
    if y1 <= y0 or left >= width or right + reach < 0:
        return
    flat = differences.reshape(differences.size)
    _spread_rows(flat, taps, count, width, x0, x1, y0, y1)
    # blur down the columns, including column 0
    first, last = max(x0 - reach, 0) * count, min(x1 + reach, width) * count
    _spread_columns(flat, taps, (width + 1) * count, height, first, last, y0, y1)


@inner
def _spread_rows(flat, taps, count, width, x0, x1, y0, y1):
    """Blur columns x0 to x1 along rows."""
    reach, size = taps.size - 1, (x1 - x0) * count
    held, spread = np.zeros(size + 4 * reach * count), np.empty(size + 2 * reach * count)
    # columns that receive light, without column 0
    first, last = max(x0 - reach, 1), min(x1 + reach, width)
    for y in range(y0, y1):
        start = y * (width + 1) * count
        row = flat[start : start + width * count]
        _copy(row[x0 * count :], held[2 * reach * count : 2 * reach * count + size])
        _filter(held, taps, count, spread)
        _copy(spread[(first - x0 + reach) * count :], row[first * count : last * count])
        # light blurred beyond the left border belongs to column 0
        for i in range((first - x0 + reach) * count):
            row[i % count] += spread[i]


@inner
def _spread_columns(flat, taps, stride, height, first, last, y0, y1):
    """Blur rows y0 to y1 down the columns; continue the picture by its first and last row."""
    reach = taps.size - 1
    held, spread = np.empty((y1 - y0 + 4 * reach) * _TILE), np.empty((y1 - y0 + 2 * reach) * _TILE)
    for begin in range(first, last, _TILE):
        across = min(_TILE, last - begin)
        for y in range(y0 - 2 * reach, y1 + 2 * reach):
            row = held[(y - y0 + 2 * reach) * across : (y - y0 + 2 * reach + 1) * across]
            near = min(max(y, y0), y1 - 1)
            if near == y or near == 0 or near == height - 1:
                _copy(flat[near * stride + begin :], row)
            else:
                row[:] = 0.0
        _filter(held, taps, across, spread[: (y1 - y0 + 2 * reach) * across])
        for y in range(max(y0 - reach, 0), min(y1 + reach, height)):
            start = y * stride + begin
            _copy(spread[(y - y0 + reach) * across :], flat[start : start + across])


@inner
def _copy(source, target):
    """Copy the first items of `source` to `target`."""
    for i in range(target.size):
        target[i] = source[i]


@inner
def _filter(source, taps, stride, out):
    """Apply a symmetric filter along a stride; `source` starts `reach` strides before `out`."""
    reach = taps.size - 1
    for begin in range(0, out.size, _CHUNK):
        part = out[begin : begin + _CHUNK]
        middle = source[begin + reach * stride :]
        for i in range(part.size):
            part[i] = taps[0] * middle[i]
        k = 1
        while k < reach:
            before, after = source[begin + (reach - k) * stride :], source[begin + (reach + k) * stride :]
            left, right = source[begin + (reach - k - 1) * stride :], source[begin + (reach + k + 1) * stride :]
            for i in range(part.size):
                part[i] += taps[k] * (before[i] + after[i]) + taps[k + 1] * (left[i] + right[i])
            k += 2
        if k == reach:
            before, after = source[begin:], source[begin + 2 * reach * stride :]
            for i in range(part.size):
                part[i] += taps[reach] * (before[i] + after[i])


@inner
def add_spreading(differences, scale, change):
    """Add half of the second differences of a picture, times a scale: its derivative by the variance of its blur.

    Parameters
    ----------
    differences : ndarray, shape (H, W + 1)
    scale : float
    change : ndarray, shape (H, W + 1)
        Added to: differences along rows of the derivative.
    """
    height, width = differences.shape[0], differences.shape[1] - 1
    for y in range(height):
        above, below = max(y - 1, 0), min(y + 1, height - 1)
        if width > 1:
            change[y, 0] += 0.5 * scale * differences[y, 1]
        change[y, 0] += 0.5 * scale * (differences[above, 0] + differences[below, 0] - 2.0 * differences[y, 0])
        for c in range(1, width):
            across = -2.0 * differences[y, c]
            if c > 1:
                across += differences[y, c - 1]
            if c + 1 < width:
                across += differences[y, c + 1]
            down = differences[above, c] + differences[below, c] - 2.0 * differences[y, c]
            change[y, c] += 0.5 * scale * (across + down)
