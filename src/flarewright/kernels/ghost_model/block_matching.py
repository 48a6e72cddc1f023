"""Block matching: find the displacement between two pictures, block by block."""

import numpy as np

from ..jit.decorators import compiled, inner

# part of the mean curvature that is added to a parabola's curvatures, for blocks along a straight edge
_EXTRA_CURVATURE = 0.01


@inner
def _widened(picture, down, along):
    """Return a picture as rows of numbers, extended by `down` and `along` cells to each side by its border cells."""
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
def _squared_difference(here, there, row, at, other_row, other_at, side):
    """Return the sum of squared differences of two blocks of `side` by `side` cells."""
    total = 0.0
    for r in range(side):
        for x in range(3 * side):
            apart = here[row + r, at + x] - there[other_row + r, other_at + x]
            total += apart * apart
    return total


@inner
def _squared_difference_halfway(before, after, row, column, half, down, along):
    """Return the sum of squared differences of two pictures a move apart around a cell; they are twice as fine."""
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
def _lowest(misfits, p, q, out):
    """Fill the offset from (p, q) of the minimum of a parabola through the values around it, at most half a step.

    Along a straight edge the minimum is a line; the extra curvature then selects the nearest of its points.
    """
    here = misfits[p, q]
    down = 0.5 * (misfits[p + 1, q] - misfits[p - 1, q])
    along = 0.5 * (misfits[p, q + 1] - misfits[p, q - 1])
    bend = misfits[p + 1, q] + misfits[p - 1, q] - 2.0 * here
    sway = misfits[p, q + 1] + misfits[p, q - 1] - 2.0 * here
    twist = 0.25 * (misfits[p + 1, q + 1] + misfits[p - 1, q - 1] - misfits[p + 1, q - 1] - misfits[p - 1, q + 1])
    stiff = _EXTRA_CURVATURE * (bend + sway)
    bend, sway = bend + stiff, sway + stiff
    space = bend * sway - twist * twist
    out[0], out[1] = 0.0, 0.0
    if space > 0.0 and bend > 0.0:
        out[0] = min(max((twist * along - sway * down) / space, -0.5), 0.5)
        out[1] = min(max((twist * down - bend * along) / space, -0.5), 0.5)


@compiled
def block_misfits(here, there, rows, columns, half, around, out):
    """Compare blocks of a picture with another picture at all moves around a central one.

    Parameters
    ----------
    here, there : ndarray, shape (H, W, 3), float32
        Continued beyond the border by the border cells.
    rows, columns : ndarray, shape (R,) and (C,), int64
        Central cells of the blocks.
    half : int
        Cells of a block to each side of its centre.
    around : ndarray, shape (R, C, 2), int64
        Central move of each block, cells down and along.
    out : ndarray, shape (R, C, 2 V + 1, 2 H + 1), float32
        Filled: sums of squared differences, for moves up to V cells down and H along from `around`.
    """
    down, along = (out.shape[2] - 1) // 2, (out.shape[3] - 1) // 2
    far = [0, 0]
    for m in range(2):
        for i in range(rows.size):
            for j in range(columns.size):
                far[m] = max(far[m], abs(around[i, j, m]))
    side, up, left = 2 * half + 1, down + far[0], along + far[1]
    wide, other = _widened(here, half, half), _widened(there, half + up, half + left)
    height, width = wide.shape[0], wide.shape[1] // 3
    squares, sums = np.empty((height, width), np.float32), np.empty(width, np.float32)
    for v in range(2 * down + 1):
        for h in range(2 * along + 1):
            row, at = v + far[0], 3 * (h + far[1])
            for r in range(height):
                for c in range(width):
                    red = wide[r, 3 * c] - other[r + row, 3 * c + at]
                    green = wide[r, 3 * c + 1] - other[r + row, 3 * c + 1 + at]
                    blue = wide[r, 3 * c + 2] - other[r + row, 3 * c + 2 + at]
                    squares[r, c] = red * red + green * green + blue * blue
            for i in range(rows.size):
                for c in range(width):
                    sums[c] = squares[rows[i], c]
                for r in range(rows[i] + 1, rows[i] + side):
                    for c in range(width):
                        sums[c] += squares[r, c]
                for j in range(columns.size):
                    total = np.float32(0.0)
                    for c in range(columns[j], columns[j] + side):
                        total += sums[c]
                    out[i, j, v, h] = total
    # most blocks have the central move (0, 0) and share their squared differences; compute the others separately
    for i in range(rows.size):
        for j in range(columns.size):
            if around[i, j, 0] == 0 and around[i, j, 1] == 0:
                continue
            for v in range(2 * down + 1):
                for h in range(2 * along + 1):
                    row = rows[i] + far[0] + around[i, j, 0] + v
                    at = 3 * (columns[j] + far[1] + around[i, j, 1] + h)
                    out[i, j, v, h] = _squared_difference(wide, other, rows[i], 3 * columns[j], row, at, side)


@compiled
def block_structure(picture, rows, columns, half, out):
    """Fill the sums of squared differences of blocks from their means, shape (R, C); blocks as in `block_misfits`."""
    last_row, last_column = picture.shape[0] - 1, picture.shape[1] - 1
    for i in range(rows.size):
        for j in range(columns.size):
            total = 0.0
            for m in range(3):
                light, squares = 0.0, 0.0
                for r in range(rows[i] - half, rows[i] + half + 1):
                    row = min(max(r, 0), last_row)
                    for c in range(columns[j] - half, columns[j] + half + 1):
                        value = picture[row, min(max(c, 0), last_column), m]
                        light += value
                        squares += value * value
                total += squares - light * light / (2 * half + 1) ** 2
            out[i, j] = total


@compiled
def refine_blocks(before, after, rows, columns, half, around, steps):
    """Refine the moves of blocks of a picture halfway between two others.

    Parameters
    ----------
    before, after : ndarray, shape (H, W, 3), float32
        Twice as fine as cells: cell (r, c) is at (2 r, 2 c). Continued beyond the border by the border cells.
    rows, columns : ndarray, shape (R,) and (C,), int64
        Central cells of the blocks.
    half : int
        Cells of a block to each side of its centre.
    around : int
        Search range around the known move, cells down and along.
    steps : ndarray, shape (R, C, 3), float64
        Changed: moves down and along, cells.

    Notes
    -----
    The two pictures are read half the move before and half the move after the block, so that blocks leave no gaps and
    do not overlap (bilateral motion estimation; Choi, Lee and Ko 2000, New frame rate up-conversion using
    bi-directional motion estimation). Fractions of a cell are those of a parabola's minimum.
    """
    side = 2 * around + 3
    misfits, off_middle = np.empty((side, side)), np.empty(2)
    for i in range(rows.size):
        for j in range(columns.size):
            v, h = int(round(steps[i, j, 0])), int(round(steps[i, j, 1]))
            for a in range(side):
                for b in range(side):
                    down, along = v + a - around - 1, h + b - around - 1
                    misfits[a, b] = _squared_difference_halfway(before, after, rows[i], columns[j], half, down, along)
            # keep the known move if no other is better
            p = q = around + 1
            for a in range(1, side - 1):
                for b in range(1, side - 1):
                    if misfits[a, b] < misfits[p, q]:
                        p, q = a, b
            _lowest(misfits, p, q, off_middle)
            steps[i, j, 0] = v + p - around - 1 + off_middle[0]
            steps[i, j, 1] = h + q - around - 1 + off_middle[1]
