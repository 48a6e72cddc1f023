"""Averages of a table around a corner of the iris: over scales, for a band of colours, and over a pixel."""

from __future__ import annotations

import numpy as np

from ...typing import Floats, Pixels
from ..jit.decorators import compiled


@compiled
def average_corner(table: Pixels, first: int, ratios: Floats, shares: Floats, side: int, out: Pixels) -> None:
    """Average a table over scales about its corner, then over squares.

    Parameters
    ----------
    table : (R, C) float32
        Even about its first row; beyond its other borders it continues with their values.
    first : int
        Column of the corner, which is in the first row.
    ratios, shares : (K,) float64
        Distances from the corner at which the table is read, relative to those in `out`, and the weight of each.
    side : int
        Half the width of a square: it is 2 `side` + 1 samples wide.
    out : (R, C) float32
        Replaced.
    """
    rows, columns = table.shape
    band, row = np.empty((rows, columns), dtype=np.float32), np.empty(columns, dtype=np.float32)
    low, part = np.empty(columns, dtype=np.int64), np.empty(columns, dtype=np.float32)
    for k in range(len(ratios)):
        for c in range(columns):
            at = min(max((c - first) * ratios[k] + first, 0.0), columns - 1.0)
            low[c] = min(int(at), columns - 2)
            part[c] = at - low[c]
        for r in range(rows):
            at = min(r * ratios[k], rows - 1.0)
            above = min(int(at), rows - 2)
            below_share = np.float32((at - above) * shares[k])
            above_share = np.float32(shares[k]) - below_share
            for c in range(columns):
                row[c] = above_share * table[above, c] + below_share * table[above + 1, c]
            for c in range(columns):
                left = row[low[c]]
                value = left + part[c] * (row[low[c] + 1] - left)
                band[r, c] = value if k == 0 else band[r, c] + value
    inside = 1.0 / (2 * side + 1) ** 2
    # sums of a window of rows, the upper of which mirror the lower
    sums = np.empty(columns)
    for c in range(columns):
        sums[c] = 0.0
    for r in range(-side, side + 1):
        for c in range(columns):
            sums[c] += band[min(abs(r), rows - 1), c]
    for r in range(rows):
        total = (side + 1) * sums[0]
        for c in range(1, side + 1):
            total += sums[min(c, columns - 1)]
        for c in range(columns):
            out[r, c] = inside * total
            total += sums[min(c + side + 1, columns - 1)] - sums[max(c - side, 0)]
        for c in range(columns):
            sums[c] += band[min(r + side + 1, rows - 1), c] - band[min(abs(r - side), rows - 1), c]
