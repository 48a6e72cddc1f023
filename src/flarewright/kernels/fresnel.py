"""Turn the frequencies of an opening by a band of light."""

from math import sqrt

import numpy as np

from ._jit import compiled


@compiled
def sum_turns(rows, columns, table):
    """Sum the products of two steps' turns over a band's colours.

    Parameters
    ----------
    rows, columns : ndarray, shape (K, N), complex128
        Of each colour the turns at the first step of each row, times its share, and at the steps of the first row.
    table : ndarray, shape (N * N,), complex64
        Filled with the turns at all steps, row by row.
    """
    colors, count = rows.shape
    real, imaginary = np.empty(count), np.empty(count)
    for i in range(count):
        real[:] = 0.0
        imaginary[:] = 0.0
        for k in range(colors):
            a, b = rows[k, i].real, rows[k, i].imag
            for j in range(count):
                c, d = columns[k, j].real, columns[k, j].imag
                real[j] += a * c - b * d
                imaginary[j] += a * d + b * c
        for j in range(count):
            table[i * count + j] = np.complex64(complex(real[j], imaginary[j]))


@compiled
def turn_frequencies(spectrum, across, down, area_x, area_y, side, ends, table, fades, to_step, turned):
    """Multiply an opening's spectrum by the real and by the imaginary part of a band's turn.

    Parameters
    ----------
    spectrum : ndarray, shape (Ny, Nx // 2 + 1), complex64
        Of a real opening, Nx even.
    across, down : ndarray, shape (C,) and (Ny,)
        Squares of its frequencies, 1/mm^2; those across as far as there is anything.
    area_x, area_y : float
        |lambda L|, mm^2.
    side : float
        1 where both have one sign, else -1: then the turn knows the difference of both, the fade the sum.
    ends : tuple of float
        Between these frequencies everything ends softly, 1/mm; infinite where nothing has to.
    table : ndarray, shape (S,), complex64
        Turn, by steps of f^2 times the area.
    fades : ndarray, shape (S,), float32
        What is left, by the same steps; 0 at the last and beyond.
    to_step : float
    turned : ndarray, shape (2, Ny, C), complex64
        Filled.

    Returns
    -------
    float
        Sum of |spectrum * turn|^2 over all frequencies, those left of 0 too.
    """
    last = fades.size - 1
    first, beyond = ends
    light = 0.0
    for i in range(down.size):
        y = area_y * down[i]
        row = 0.0
        for j in range(across.size):
            x = area_x * across[j]
            far = (x + y) * to_step + 0.5
            left = np.float32(0.0)
            if far < last:
                left = fades[np.int64(far)]
            f2 = across[j] + down[i]
            if left > 0.0 and f2 > first * first:
                part = min(max((beyond - sqrt(f2)) / (beyond - first), 0.0), 1.0)
                left *= np.float32(part * part * (3.0 - 2.0 * part))
            turn = table[np.int64(min(abs(x + side * y) * to_step + 0.5, last * 1.0))]
            real, imaginary = left * turn.real, left * turn.imag
            if x + side * y < 0.0:
                imaginary = -imaginary
            wave = spectrum[i, j]
            turned[0, i, j], turned[1, i, j] = wave * real, wave * imaginary
            own = (wave.real * wave.real + wave.imag * wave.imag) * (real * real + imaginary * imaginary)
            # those in between stand for their mirror images too
            row += own if j == 0 or j == spectrum.shape[1] - 1 else np.float32(2.0) * own
        light += row
    return light
