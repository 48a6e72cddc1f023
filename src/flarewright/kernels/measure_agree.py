"""Find out what moves of blocks cost when neighbours' moves should agree."""

from math import log, sqrt

import numpy as np

from ._jit import compiled, inner


@inner
def _eased(costs, step, leap, work, out):
    """Fill what a move costs when a neighbour may have another one: a cell apart for `step`, any for `leap`.

    Returns the lowest of `costs`.
    """
    height, width = costs.shape
    least = costs[0, 0]
    for a in range(height):
        for b in range(width):
            least = min(least, costs[a, b])
            best = costs[a, b]
            if b > 0:
                best = min(best, costs[a, b - 1] + step)
            if b < width - 1:
                best = min(best, costs[a, b + 1] + step)
            work[a, b] = best
    for a in range(height):
        for b in range(width):
            best = work[a, b]
            if a > 0:
                best = min(best, work[a - 1, b] + step)
            if a < height - 1:
                best = min(best, work[a + 1, b] + step)
            out[a, b] = min(best, least + leap)
    return least


@compiled
def move_costs(misfits, around, noise, stiff, out):
    """Fill what moves of blocks cost by themselves.

    Parameters
    ----------
    misfits : ndarray, shape (R, C, 2 V + 1, 2 H + 1), float32
        Sums of squares by which a block differs, for moves up to V cells down and H along from `around`.
    around : ndarray, shape (R, C, 2), int64
        Move in the middle of each block's, cells down and along.
    noise : float
        Squares by which blocks differ in any case.
    stiff : float
        By which part a misfit is taken for larger with each cell of the move, for longer ones have more choice.
    out : ndarray, shape (R, C, 2 V + 1, 2 H + 1), float32
        Filled: logarithms of misfits, 0 for none and no move.
    """
    rows, columns, height, width = misfits.shape
    for i in range(rows):
        for j in range(columns):
            for a in range(height):
                down = around[i, j, 0] + a - height // 2
                for b in range(width):
                    along = around[i, j, 1] + b - width // 2
                    longer = 1.0 + stiff * sqrt(down * down + along * along)
                    out[i, j, a, b] = log((1.0 + misfits[i, j, a, b] / noise) * longer)


@compiled
def agree(costs, around, step, leap, out):
    """Add up what moves of blocks cost along lines from eight sides.

    Parameters
    ----------
    costs : ndarray, shape (R, C, V, H), float32
        Of each block and move.
    around : ndarray, shape (R, C, 2), int64
        Move in the middle of each block's, cells down and along.
    step, leap : float
        What it costs when a neighbour's move differs by a cell along each side, and by more.
    out : ndarray, shape (R, C, V, H), float32
        Filled. The lowest of a block is the move that suits it and, through them all, the blocks on all eight lines.

    Notes
    -----
    Semi-global matching (Hirschmueller 2008, Stereo processing by semiglobal matching and mutual information, equation
    13), of moves along both sides.
    """
    rows, columns, height, width = costs.shape
    step, leap = np.float32(step), np.float32(leap)
    line, last = np.empty((columns, height, width), np.float32), np.empty((columns, height, width), np.float32)
    work, eased = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    out[:] = 0.0
    for down, along in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1)):
        for m in range(rows):
            i = m if down >= 0 else rows - 1 - m
            for n in range(columns):
                j = n if along >= 0 else columns - 1 - n
                p, q = i - down, j - along
                if 0 <= p < rows and 0 <= q < columns:
                    least = _eased(line[q] if down == 0 else last[q], step, leap, work, eased)
                    v, h = around[i, j, 0] - around[p, q, 0], around[i, j, 1] - around[p, q, 1]
                    for a in range(height):
                        for b in range(width):
                            inside = 0 <= a + v < height and 0 <= b + h < width
                            passed = eased[a + v, b + h] - least if inside else leap
                            line[j, a, b] = costs[i, j, a, b] + passed
                else:
                    line[j] = costs[i, j]
                out[i, j] += line[j]
            if down != 0:
                line, last = last, line
