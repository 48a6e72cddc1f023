"""Normal equations of the fit of a drawn picture, computed directly from differences along rows.

A fit needs thousands of small products, in several threads. A BLAS library that starts threads for each product takes
several times as long, and its sums depend on the number of threads.
"""

import numpy as np

from ..jit.decorators import borrowing, inner

# pixels whose products are summed at once: the matrix is read and written once for all of them
_TOGETHER = 8


@inner
def normal_equations(changes, weight, residual, matrix, side, mean):
    """Sum J' W J, J' W r and J' W 1 over pixels.

    Parameters
    ----------
    changes : ndarray, shape (H, W + 1, Q), float64
        The derivatives J as differences along rows, as filled by `draw_with_changes`.
    weight, residual : ndarray, shape (H, W), float64
        W, at least 0, and r.
    matrix : ndarray, shape (Q, Q), float64
        Filled.
    side, mean : ndarray, shape (Q,), float64
        Filled: J' W r and J' W 1.
    """
    count = matrix.shape[0]
    here = np.empty(count)
    rows, weighted = np.empty((_TOGETHER, count)), np.empty((_TOGETHER, count))
    matrix[:] = 0.0
    side[:] = 0.0
    mean[:] = 0.0
    held = 0
    for y in range(weight.shape[0]):
        here[:] = 0.0
        # neighbouring pixels with the same derivatives are summed as one
        total, light, lit = 0.0, 0.0, False
        for x in range(weight.shape[1] + 1):
            moved = 0.0
            for q in range(count):
                moved += abs(changes[y, x, q])
            if moved > 0.0 or x == weight.shape[1]:
                if lit and total > 0.0:
                    for q in range(count):
                        rows[held, q] = here[q]
                        weighted[held, q] = total * here[q]
                        side[q] += light * here[q]
                        mean[q] += total * here[q]
                    held += 1
                    if held == _TOGETHER:
                        _add_products(rows, weighted, matrix)
                        held = 0
                for q in range(count):
                    here[q] += changes[y, x, q]
                total, light, lit = 0.0, 0.0, True
            if x < weight.shape[1] and weight[y, x] > 0.0:
                total += weight[y, x]
                light += weight[y, x] * residual[y, x]
    rows[held:] = 0.0
    weighted[held:] = 0.0
    _add_products(rows, weighted, matrix)
    for a in range(count):
        for b in range(a):
            matrix[a, b] = matrix[b, a]


@borrowing
def _add_products(rows, weighted, matrix):
    """Add the products of `_TOGETHER` pixels to the matrix' upper triangle."""
    count = matrix.shape[0]
    for a in range(count):
        w0, w1, w2, w3 = weighted[0, a], weighted[1, a], weighted[2, a], weighted[3, a]
        w4, w5, w6, w7 = weighted[4, a], weighted[5, a], weighted[6, a], weighted[7, a]
        for b in range(a, count):
            first = (w0 * rows[0, b] + w1 * rows[1, b]) + (w2 * rows[2, b] + w3 * rows[3, b])
            second = (w4 * rows[4, b] + w5 * rows[5, b]) + (w6 * rows[6, b] + w7 * rows[7, b])
            matrix[a, b] += first + second
