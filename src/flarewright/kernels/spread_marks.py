"""Spread what a picture of differences holds over a shape, without a transform: only edges meet edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._jit import compiled

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@compiled
def spread_marks(
    marks: Floats, rows: Integers, columns: Integers, values: Floats, reach: Integers, out: Floats
) -> None:
    """Convolve the differences of a picture with those of a kernel.

    Parameters
    ----------
    marks : (H + 2 a, W + 2 b, 3) float64
        Differences along the rows of a picture with a border (`raster.fill_polygon`); 0 when it is done, so that one
        sheet serves many spreads.
    rows, columns : (N,) int64
        Where the kernel's differences along its rows are not 0, from its upper left corner.
    values : (N,) float64
        What they are.
    reach : (2,) int64
        a and b: the kernel has 2 a + 1 rows and 2 b + 1 columns.
    out : (H, W, 3) float64
        Added to: second differences along the rows, which `raster.sum_rows` turns into the picture when applied twice.

    Notes
    -----
    A sum of sums commutes with a convolution: sum(m) * sum(k) = sum(sum(m * k)). Light of even density has differences
    at its edges alone, and so has an even kernel. What stands left of the picture comes into it as a ramp: 1 - x at
    column 0 and x at column 1 have the sums of 1 at column x.
    """
    height, width = out.shape[0], out.shape[1]
    up, back = 2 * reach[0], 2 * reach[1]
    for r in range(marks.shape[0]):
        for c in range(marks.shape[1]):
            red, green, blue = marks[r, c, 0], marks[r, c, 1], marks[r, c, 2]
            if red == 0.0 and green == 0.0 and blue == 0.0:
                continue
            marks[r, c, 0] = marks[r, c, 1] = marks[r, c, 2] = 0.0
            for e in range(rows.size):
                y, x, v = r + rows[e] - up, c + columns[e] - back, values[e]
                if y < 0 or y >= height or x >= width:
                    continue
                if x >= 0:
                    out[y, x, 0] += red * v
                    out[y, x, 1] += green * v
                    out[y, x, 2] += blue * v
                    continue
                one, two = v * (1.0 - x), v * x
                out[y, 0, 0] += red * one
                out[y, 0, 1] += green * one
                out[y, 0, 2] += blue * one
                if width > 1:
                    out[y, 1, 0] += red * two
                    out[y, 1, 1] += green * two
                    out[y, 1, 2] += blue * two
