"""Find by how much two pictures differ in place, block by block."""

from math import sqrt

import numpy as np

from ._jit import compiled, inner


@inner
def _apart(before, after, row, column, half, down, along, enough):
    """Add up the squares by which two pictures differ around a cell that moves by (down, along) from one to the other.

    Pictures are twice as fine as cells, so that half of a move is a place in both. Adds no further than `enough`.
    """
    last_row, last_column = before.shape[0] - 1, before.shape[1] - 1
    total = 0.0
    for r in range(row - half, row + half + 1):
        ra = min(max(2 * r - down, 0), last_row)
        rb = min(max(2 * r + down, 0), last_row)
        for c in range(column - half, column + half + 1):
            ca = min(max(2 * c - along, 0), last_column)
            cb = min(max(2 * c + along, 0), last_column)
            for m in range(3):
                off = before[ra, ca, m] - after[rb, cb, m]
                total += off * off
        if total > enough:
            break
    return total


@inner
def _vertex(low, middle, high):
    """Return where the parabola through three values at -1, 0 and 1 is least, at most half a step off."""
    bend = low + high - 2.0 * middle
    return min(max(0.5 * (low - high) / bend, -0.5), 0.5) if bend > 0.0 else 0.0


@compiled
def match_blocks(before, after, rows, columns, half, reach, stiff, noise, out):
    """Find for blocks of a picture halfway between two others how what is there moves from the one to the other.

    Parameters
    ----------
    before, after : ndarray, shape (H, W, 3), float32
        Twice as fine as cells: cell (r, c) is at (2 r, 2 c). Beyond the border as at the border.
    rows, columns : ndarray, shape (R,) and (C,), int64
        Cells in the middle of blocks.
    half : int
        A block goes so many cells to each side of its middle.
    reach : ndarray, shape (2,), int64
        Farthest moves down and along, cells.
    stiff : float
        By which part of itself a misfit is larger for each cell of the move.
    noise : float
        Sum of squares that is added to every misfit, so that a block without light stays.
    out : ndarray, shape (R, C, 2), float64
        Filled: moves down and along, in cells. Of moves that do as well, the shortest.

    Notes
    -----
    Both pictures are read half the move away from the block, each on its side, so that blocks do not gape or overlap
    (bilateral motion estimation; Choi, Lee and Ko 2000, New frame rate up-conversion using bi-directional motion
    estimation). Between whole cells, the vertex of a parabola.
    """
    down, along = reach[0], reach[1]
    count = (2 * down + 1) * (2 * along + 1)
    moves = np.empty((count, 2), np.int64)
    lengths = np.empty(count)
    for n in range(count):
        moves[n, 0], moves[n, 1] = n // (2 * along + 1) - down, n % (2 * along + 1) - along
        lengths[n] = sqrt(moves[n, 0] ** 2 + moves[n, 1] ** 2)
    order = np.argsort(lengths, kind="mergesort")
    for i in range(rows.size):
        for j in range(columns.size):
            best, chosen = np.inf, 0
            for n in order:
                factor = 1.0 + stiff * lengths[n]
                enough = best / factor - noise
                misfit = _apart(before, after, rows[i], columns[j], half, moves[n, 0], moves[n, 1], enough)
                cost = (misfit + noise) * factor
                if cost < best:
                    best, chosen = cost, n
            v, h = moves[chosen, 0], moves[chosen, 1]
            here = _apart(before, after, rows[i], columns[j], half, v, h, np.inf)
            sides = np.empty(4)
            for n in range(4):
                dv, dh = (2 * n - 1, 0) if n < 2 else (0, 2 * n - 5)
                sides[n] = _apart(before, after, rows[i], columns[j], half, v + dv, h + dh, np.inf)
            out[i, j, 0] = v + _vertex(sides[0], here, sides[1])
            out[i, j, 1] = h + _vertex(sides[2], here, sides[3])
