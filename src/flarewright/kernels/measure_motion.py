"""Find by how much two pictures differ in place, block by block."""

from math import sqrt

import numpy as np

from ._jit import compiled, inner

# how far a bowl's bends may differ before it is a valley
_VALLEY = 0.01


@inner
def _apart(here, there, fine, row, column, half, off, enough):
    """Add up the squares by which two pictures differ around a cell, each read at a place off it.

    Pictures have `fine` places to a cell; `off` has rows and columns for the one and then for the other. Adds no
    further than `enough`.
    """
    last_row, last_column = here.shape[0] - 1, here.shape[1] - 1
    total = 0.0
    for r in range(row - half, row + half + 1):
        ra = min(max(fine * r + off[0], 0), last_row)
        rb = min(max(fine * r + off[2], 0), last_row)
        for c in range(column - half, column + half + 1):
            ca = min(max(fine * c + off[1], 0), last_column)
            cb = min(max(fine * c + off[3], 0), last_column)
            for m in range(3):
                apart = here[ra, ca, m] - there[rb, cb, m]
                total += apart * apart
        if total > enough:
            break
    return total


@inner
def _structure(picture, row, column, half):
    """Add up the squares by which a block differs from its mean."""
    last_row, last_column = picture.shape[0] - 1, picture.shape[1] - 1
    total = 0.0
    for m in range(3):
        light, squares = 0.0, 0.0
        for r in range(row - half, row + half + 1):
            ra = min(max(r, 0), last_row)
            for c in range(column - half, column + half + 1):
                value = picture[ra, min(max(c, 0), last_column), m]
                light += value
                squares += value * value
        total += squares - light * light / (2 * half + 1) ** 2
    return total


@inner
def _lowest(misfits, p, q, out):
    """Fill by how much the lowest point of a bowl through the values around (p, q) is off that, at most half a step.

    Along a straight border a move tells nothing; there the bowl is a valley, and the nearest of its lowest points
    counts.
    """
    here = misfits[p, q]
    down = 0.5 * (misfits[p + 1, q] - misfits[p - 1, q])
    along = 0.5 * (misfits[p, q + 1] - misfits[p, q - 1])
    bend = misfits[p + 1, q] + misfits[p - 1, q] - 2.0 * here
    sway = misfits[p, q + 1] + misfits[p, q - 1] - 2.0 * here
    twist = 0.25 * (misfits[p + 1, q + 1] + misfits[p - 1, q - 1] - misfits[p + 1, q - 1] - misfits[p - 1, q + 1])
    stiff = _VALLEY * (bend + sway)
    bend, sway = bend + stiff, sway + stiff
    space = bend * sway - twist * twist
    out[0], out[1] = 0.0, 0.0
    if space > 0.0 and bend > 0.0:
        out[0] = min(max((twist * along - sway * down) / space, -0.5), 0.5)
        out[1] = min(max((twist * down - bend * along) / space, -0.5), 0.5)


@compiled
def match_blocks(here, there, rows, columns, half, reach, stiff, noise, out):
    """Find where blocks of a picture are in another one.

    Parameters
    ----------
    here, there : ndarray, shape (H, W, 3), float32
        Beyond the border as at the border.
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
    out : ndarray, shape (R, C, 3), float64
        Filled: moves down and along, in whole cells, and by how much the misfit is less than without, but not more than
        the squares by which the block differs from its mean. Of moves that do as well, the shortest.

    Notes
    -----
    Full search (Jain and Jain 1981, Displacement measurement and its application in interframe image coding).
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
            best, chosen, still = np.inf, 0, 0.0
            for n in order:
                factor = 1.0 + stiff * lengths[n]
                enough = best / factor - noise
                off = (0, 0, moves[n, 0], moves[n, 1])
                misfit = _apart(here, there, 1, rows[i], columns[j], half, off, enough)
                cost = (misfit + noise) * factor
                if n == order[0]:
                    still = cost
                if cost < best:
                    best, chosen = cost, n
            out[i, j, 0], out[i, j, 1] = moves[chosen, 0], moves[chosen, 1]
            # darkness finds darkness where light was before, and that is nothing that moves
            out[i, j, 2] = min(still - best, _structure(here, rows[i], columns[j], half))


@compiled
def refine_blocks(before, after, rows, columns, half, around, steps):
    """Find better moves near known ones, for blocks of a picture halfway between two others.

    Parameters
    ----------
    before, after : ndarray, shape (H, W, 3), float32
        Twice as fine as cells: cell (r, c) is at (2 r, 2 c). Beyond the border as at the border.
    rows, columns : ndarray, shape (R,) and (C,), int64
        Cells in the middle of blocks.
    half : int
        A block goes so many cells to each side of its middle.
    around : int
        Cells by which a better move is another one, down and along.
    steps : ndarray, shape (R, C, 3), float64
        Changed: moves down and along, cells.

    Notes
    -----
    Both pictures are read half the move away from the block, each on its side, so that blocks do not gape or overlap
    (bilateral motion estimation; Choi, Lee and Ko 2000, New frame rate up-conversion using bi-directional motion
    estimation). Between whole cells, the lowest point of a bowl.
    """
    side = 2 * around + 3
    misfits, off_middle = np.empty((side, side)), np.empty(2)
    for i in range(rows.size):
        for j in range(columns.size):
            v, h = int(round(steps[i, j, 0])), int(round(steps[i, j, 1]))
            for a in range(side):
                for b in range(side):
                    down, along = v + a - around - 1, h + b - around - 1
                    off = (-down, -along, down, along)
                    misfits[a, b] = _apart(before, after, 2, rows[i], columns[j], half, off, np.inf)
            # as it was, where nothing is better
            p = q = around + 1
            for a in range(1, side - 1):
                for b in range(1, side - 1):
                    if misfits[a, b] < misfits[p, q]:
                        p, q = a, b
            _lowest(misfits, p, q, off_middle)
            steps[i, j, 0] = v + p - around - 1 + off_middle[0]
            steps[i, j, 1] = h + q - around - 1 + off_middle[1]
