"""Convolve a picture with a flat shape, both stored as differences along rows: only edges cost time."""

from __future__ import annotations

from ...typing import Floats, Indices
from ..jit.decorators import compiled


@compiled
def spread_marks(marks: Floats, rows: Indices, columns: Indices, values: Floats, reach: Indices, out: Floats) -> None:
    """Convolve the row differences of a picture with those of a convolution kernel.

    Parameters
    ----------
    marks : (H + 2 a, W + 2 b, 3) float64
        Differences along the rows of a picture with a border (`polygons.fill_polygon`); set to 0, so that the caller
        can reuse the array.
    rows, columns : (N,) int64
        Rows and columns, from the upper left corner, at which the kernel's differences along rows are not 0.
    values : (N,) float64
        The differences there.
    reach : (2,) int64
        a and b: the kernel has 2 a + 1 rows and 2 b + 1 columns.
    out : (H, W, 3) float64
        Added to: second differences along the rows; `polygons.sum_rows` applied twice gives the picture.

    Notes
    -----
    Prefix sums commute with convolution: sum(m) * sum(k) = sum(sum(m * k)). Light of constant density has differences
    at its edges only, and so has a flat kernel. A difference left of the picture enters it as a ramp: the values 1 - x
    at column 0 and x at column 1 have the same double sum as 1 at column x.
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
