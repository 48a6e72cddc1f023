"""Find by how much two pictures differ in place, block by block."""

from math import sqrt

import numpy as np

from ._jit import compiled, inner

# how far a bowl's bends may differ before it is a valley
_VALLEY = 0.01
# what rounding may make of a bound that is none below the misfit
_ROUNDED = 0.999


@inner
def _widened(picture, down, along):
    """Return a picture as rows of numbers, with so many more cells to each side, as at the border."""
    height, width = picture.shape[0], picture.shape[1]
    out = np.empty((height + 2 * down, 3 * (width + 2 * along)), np.float32)
    for r in range(out.shape[0]):
        row = min(max(r - down, 0), height - 1)
        for c in range(width + 2 * along):
            column = min(max(c - along, 0), width - 1)
            for m in range(3):
                out[r, 3 * c + m] = picture[row, column, m]
    return out


@inner
def _sums(wide, side):
    """Return the sum of each colour in each block of `side` by `side` cells, by its first row and number."""
    rows, numbers = wide.shape[0] - side + 1, wide.shape[1] - 3 * (side - 1)
    columns = np.zeros((rows, wide.shape[1]))
    for r in range(rows):
        for k in range(side):
            for x in range(wide.shape[1]):
                columns[r, x] += wide[r + k, x]
    out = np.zeros((rows, numbers))
    for r in range(rows):
        for k in range(side):
            for x in range(numbers):
                out[r, x] += columns[r, x + 3 * k]
    return out


@inner
def _apart(here, there, row, at, other_row, other_at, rows, count, enough):
    """Add up the squares by which two blocks of `rows` rows of `count` numbers differ, no further than `enough`."""
    total = 0.0
    for r in range(rows):
        squares = 0.0
        for x in range(count):
            apart = here[row + r, at + x] - there[other_row + r, other_at + x]
            squares += apart * apart
        total += squares
        if total > enough:
            break
    return total


@inner
def _apart_halfway(before, after, row, column, half, down, along):
    """Add up the squares by which two pictures, twice as fine as cells, differ a move apart around a cell."""
    last_row, last_column = before.shape[0] - 1, before.shape[1] - 1
    total = 0.0
    for r in range(row - half, row + half + 1):
        ra = min(max(2 * r - down, 0), last_row)
        rb = min(max(2 * r + down, 0), last_row)
        for c in range(column - half, column + half + 1):
            ca = min(max(2 * c - along, 0), last_column)
            cb = min(max(2 * c + along, 0), last_column)
            for m in range(3):
                apart = before[ra, ca, m] - after[rb, cb, m]
                total += apart * apart
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
    side = 2 * half + 1
    wide, other = _widened(here, half, half), _widened(there, half + down, half + along)
    # blocks differ by no less than their means do: most moves are told by that (Li and Salari 1995, Successive
    # elimination algorithm for motion estimation)
    own, others, per = _sums(wide, side), _sums(other, side), _ROUNDED / side**2
    for i in range(rows.size):
        for j in range(columns.size):
            best, chosen, still = np.inf, 0, 0.0
            for n in order:
                factor = 1.0 + stiff * lengths[n]
                enough = best / factor - noise
                row, at, x = rows[i] + down + moves[n, 0], 3 * (columns[j] + along + moves[n, 1]), 3 * columns[j]
                red, green = own[rows[i], x] - others[row, at], own[rows[i], x + 1] - others[row, at + 1]
                blue = own[rows[i], x + 2] - others[row, at + 2]
                if per * (red * red + green * green + blue * blue) > enough:
                    continue
                misfit = _apart(wide, other, rows[i], x, row, at, side, 3 * side, enough)
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
                    misfits[a, b] = _apart_halfway(before, after, rows[i], columns[j], half, down, along)
            # as it was, where nothing is better
            p = q = around + 1
            for a in range(1, side - 1):
                for b in range(1, side - 1):
                    if misfits[a, b] < misfits[p, q]:
                        p, q = a, b
            _lowest(misfits, p, q, off_middle)
            steps[i, j, 0] = v + p - around - 1 + off_middle[0]
            steps[i, j, 1] = h + q - around - 1 + off_middle[1]
