"""Zernike polynomials as sums of x^i y^j, the form in which one kernel evaluates every figure error."""

from __future__ import annotations

from functools import lru_cache
from math import comb, factorial, sqrt

import numpy as np

from ...typing import Floats

MOST_DEGREE = 6


def noll_order(index: int) -> tuple[int, int]:
    """Return (n, m) of Noll's index; m is negative for the sine terms.

    Parameters
    ----------
    index : int
        From 1.

    Notes
    -----
    Noll 1976, "Zernike polynomials and atmospheric turbulence": within a radial order the terms run by rising |m|, and
    an even index is a cosine.
    """
    n = 0
    before = 0
    while before + n + 1 < index:
        before += n + 1
        n += 1
    k = index - before
    m = 2 * (k // 2) if n % 2 == 0 else 2 * ((k - 1) // 2) + 1
    return n, m if index % 2 == 0 else -m


@lru_cache(maxsize=64)
def zernike_polynomial(index: int) -> Floats:
    """Return one term, of root mean square 1 over the unit disc, as coefficients of powers of x and y.

    Parameters
    ----------
    index : int
        Noll's, 1 to 28.

    Returns
    -------
    ndarray, shape (7, 7)
        Coefficient of x^i y^j at [i, j].

    Notes
    -----
    r^n' cos(m t) and r^n' sin(m t) are the real and imaginary parts of (x + i y)^m times (x^2 + y^2)^((n' - m) / 2)
    (Noll 1976, equations 1 to 3; tests/optics/lens/test_surface_shape.py integrates their products).
    """
    n, signed = noll_order(index)
    m = abs(signed)
    norm = sqrt(n + 1.0) * (sqrt(2.0) if m else 1.0)
    total = np.zeros((MOST_DEGREE + 1, MOST_DEGREE + 1))
    for s in range((n - m) // 2 + 1):
        radial = (
            (-1) ** s * factorial(n - s) / (factorial(s) * factorial((n + m) // 2 - s) * factorial((n - m) // 2 - s))
        )
        power = (n - m) // 2 - s
        for a in range(power + 1):
            for b in range(m + 1):
                # i^b is 1, i, -1, -i: even b give the cosine, odd b the sine
                if (b % 2 == 1) != (signed < 0):
                    continue
                sign = -1.0 if b % 4 >= 2 else 1.0
                i, j = 2 * (power - a) + m - b, 2 * a + b
                total[i, j] += norm * radial * comb(power, a) * comb(m, b) * sign
    return total


def figure_polynomial(terms: tuple[tuple[int, float], ...]) -> Floats:
    """Return the sum of (index, amplitude) terms; shape (7, 7), in the amplitudes' unit."""
    total = np.zeros((MOST_DEGREE + 1, MOST_DEGREE + 1))
    for index, amplitude in terms:
        total += amplitude * zernike_polynomial(index)
    return total
