"""Soft borders: a picture, kept as differences along rows, spread by the discrete Gaussian of a variance.

A ghost's border is never sharp. The light has a size, of which every ghost is an image, and each wavelength draws the
ghost in its own size. The discrete Gaussian exp(-t) I_n(t) (Lindeberg 1990, "Scale-space for discrete signals") has
variance t for every t, however small, and its derivative by t is half of the second differences: exact, and smooth in
the one number that a fit looks for.
"""

from math import ceil, sqrt

import numpy as np

from ._jit import inner

# no pixel reaches farther than this
_FARTHEST = 64


@inner
def reach_of(variance):
    """Return how many pixels the discrete Gaussian reaches to each side."""
    if variance <= 0.0:
        return 0
    return min(int(ceil(3.5 * sqrt(variance))) + 1, _FARTHEST)


@inner
def taps_of(variance, taps):
    """Fill exp(-t) I_n(t), n from 0, by the recurrence downwards (Miller); their sum over both sides is 1."""
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
    """Spread what differs along rows, in place.

    Column 0 holds the light left of the window; beyond the window the picture is taken to go on as at its border.

    Parameters
    ----------
    differences : ndarray, shape (H, W + 1, Q)
    taps : ndarray, shape (R + 1,)
    left, top, right, bottom : int
        Of the part that may hold something, before it is spread.
    """
    height, width, count = differences.shape[0], differences.shape[1] - 1, differences.shape[2]
    reach = taps.size - 1
    x0, x1 = max(left - reach, 1), min(right + reach + 1, width)
    y0, y1 = max(top - reach, 0), min(bottom + reach, height)
    if y1 <= y0 or x1 <= x0:
        return
    flat = differences.reshape(differences.size)
    both = np.empty(2 * reach + 1)
    for k in range(-reach, reach + 1):
        both[reach + k] = taps[abs(k)]
    _spread_rows(flat, both, count, width, x0, x1, max(top, 0), min(bottom, height))
    # down the columns, the light left of the window with them
    first = 0 if x0 == 1 else x0
    _spread_columns(flat, taps, count, width, height, first, x1, y0, y1)


@inner
def _spread_rows(flat, both, count, width, x0, x1, y0, y1):
    """Spread along rows: what differs, mostly nothing, is scattered."""
    reach = both.size // 2
    low, high = max(x0 - reach, 1), min(x1 + reach, width)
    size = (high - low) * count
    source = np.empty(size)
    for y in range(y0, y1):
        row = y * (width + 1) * count
        start = row + low * count
        for i in range(size):
            source[i] = flat[start + i]
            flat[start + i] = 0.0
        first, last = _run(source, 0, size, 0)
        while first < size:
            if low * count + first < (reach + 1) * count or low * count + last + reach * count >= width * count:
                for i in range(first, last + 1):
                    for k in range(2 * reach + 1):
                        at = low * count + i + (k - reach) * count
                        # what spreads beyond the left border is part of the light left of the window
                        if at < width * count:
                            flat[row + (at if at >= 0 else i % count)] += both[k] * source[i]
            else:
                for k in range(2 * reach + 1):
                    to, weight = start + (k - reach) * count, both[k]
                    for i in range(first, last + 1):
                        flat[to + i] += weight * source[i]
            first, last = _run(source, 0, size, last + 1)


@inner
def _run(numbers, begin, size, at):
    """Return the first and last place, from one on, of a run of numbers that are not 0; gaps of eight are none."""
    while at < size and numbers[begin + at] == 0.0:
        at += 1
    first = last = at
    while at < size and at - last <= 8:
        if numbers[begin + at] != 0.0:
            last = at
        at += 1
    return first, last


@inner
def _spread_columns(flat, taps, count, width, height, x0, x1, y0, y1):
    """Spread down the columns, runs of what differs at once; beyond the first and last row they go on as these are."""
    reach = taps.size - 1
    across = (x1 - x0) * count
    tails = np.zeros(reach + 1)
    tails[reach] = taps[reach]
    for k in range(reach - 1, -1, -1):
        tails[k] = tails[k + 1] + taps[k]
    held = np.empty((y1 - y0) * across)
    for y in range(y0, y1):
        start, here = (y * (width + 1) + x0) * count, (y - y0) * across
        for i in range(across):
            held[here + i] = flat[start + i]
            flat[start + i] = 0.0
    for y in range(y0, y1):
        here = (y - y0) * across
        first, last = _run(held, here, across, 0)
        while first < across:
            for to in range(max(y - reach, y0), min(y + reach + 1, y1)):
                away = abs(y - to)
                weight = tails[away] if y == 0 or y == height - 1 else taps[away]
                start = (to * (width + 1) + x0) * count
                for n in range(first, last + 1):
                    flat[start + n] += weight * held[here + n]
            first, last = _run(held, here, across, last + 1)


@inner
def add_spreading(differences, scale, change):
    """Add half of the second differences of a picture, times a scale: its derivative by the variance of its spread.

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
