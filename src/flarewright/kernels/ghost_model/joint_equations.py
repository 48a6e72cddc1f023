"""Normal equations of all ghosts of a view, with any number of parameters each, by pairs of overlapping windows."""

import numpy as np

from ..jit.decorators import compiled, inner

# pixels whose products are summed at once, see `normal_equations`
_TOGETHER = 8


@compiled
def add_jointly(changes, windows, weight, residual, matrix, side, mean):
    """Sum J' W J, J' W r and J' W 1 over the pixels of a view.

    Parameters
    ----------
    changes : ndarray, shape (P,), float64
        Derivatives of one ghost after another, as differences along the rows of its window, (H, W + 1, Q) each;
        overwritten by the derivatives.
    windows : ndarray, shape (G, 7), int64
        For each ghost: index of its first item in `changes`, index of its first parameter, number of parameters, and
        top, left, height and width of its window in the view.
    weight, residual : ndarray, shape (H, W), float64
        W, at least 0, and r.
    matrix : ndarray, shape (N, N), float64
    side, mean : ndarray, shape (N,), float64
        Added to.
    """
    for a in range(windows.shape[0]):
        _add_alone(changes, windows[a], weight, residual, side, mean)
    for a in range(windows.shape[0]):
        for b in range(a, windows.shape[0]):
            _add_pair(changes, windows[a], windows[b], weight, matrix)


@inner
def _add_alone(changes, window, weight, residual, side, mean):
    """Sum a ghost's differences to derivatives, in place, and add its sums to `side` and `mean`."""
    start, first, count, top, left, height, width = window
    for y in range(height):
        for x in range(width):
            at = start + (y * (width + 1) + x) * count
            if x > 0:
                for q in range(count):
                    changes[at + q] += changes[at - count + q]
            w = weight[top + y, left + x]
            if w > 0.0:
                lit = w * residual[top + y, left + x]
                for q in range(count):
                    side[first + q] += lit * changes[at + q]
                    mean[first + q] += w * changes[at + q]


@inner
def _add_pair(changes, one, other, weight, matrix):
    """Add the products of two ghosts' derivatives where their windows overlap."""
    start_a, row, count_a, top_a, left_a, height_a, width_a = one
    start_b, column, count_b, top_b, left_b, height_b, width_b = other
    top, bottom = max(top_a, top_b), min(top_a + height_a, top_b + height_b)
    left, right = max(left_a, left_b), min(left_a + width_a, left_b + width_b)
    if top >= bottom or left >= right:
        return
    weighted, there = np.zeros((_TOGETHER, count_a)), np.zeros((_TOGETHER, count_b))
    found = np.zeros((count_a, count_b))
    held = 0
    for y in range(top, bottom):
        for x in range(left, right):
            w = weight[y, x]
            at_a = start_a + ((y - top_a) * (width_a + 1) + x - left_a) * count_a
            at_b = start_b + ((y - top_b) * (width_b + 1) + x - left_b) * count_b
            # skip pixels of the windows that a ghost does not reach
            if w <= 0.0 or _is_zero(changes, at_a, count_a) or _is_zero(changes, at_b, count_b):
                continue
            for q in range(count_a):
                weighted[held, q] = w * changes[at_a + q]
            for q in range(count_b):
                there[held, q] = changes[at_b + q]
            held += 1
            if held == _TOGETHER:
                _add_products(weighted, there, found)
                held = 0
    weighted[held:] = 0.0
    _add_products(weighted, there, found)
    for a in range(count_a):
        for b in range(count_b):
            matrix[row + a, column + b] += found[a, b]
            if row != column:
                matrix[column + b, row + a] += found[a, b]


@inner
def _is_zero(changes, at, count):
    """Return whether all derivatives of a ghost are 0 at a pixel."""
    for q in range(count):
        if changes[at + q] != 0.0:
            return False
    return True


@inner
def _add_products(weighted, there, found):
    """Add the products of `_TOGETHER` pixels to `found`."""
    for a in range(found.shape[0]):
        w0, w1, w2, w3 = weighted[0, a], weighted[1, a], weighted[2, a], weighted[3, a]
        w4, w5, w6, w7 = weighted[4, a], weighted[5, a], weighted[6, a], weighted[7, a]
        for b in range(found.shape[1]):
            first = (w0 * there[0, b] + w1 * there[1, b]) + (w2 * there[2, b] + w3 * there[3, b])
            second = (w4 * there[4, b] + w5 * there[5, b]) + (w6 * there[6, b] + w7 * there[7, b])
            found[a, b] += first + second
