"""Smoothness of block motion: costs of moves, aggregated so that neighbouring blocks agree."""

from math import log, sqrt

import numpy as np

from ..jit.decorators import compiled, inner


@inner
def _least_costs(costs, step, leap, work, out):
    """Fill the least cost of a move if the neighbour may have another: one cell apart for `step`, any for `leap`.

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
    """Fill the cost of each block's moves, without its neighbours.

    Parameters
    ----------
    misfits : ndarray, shape (R, C, 2 V + 1, 2 H + 1), float32
        Sums of squared differences of a block, for moves up to V cells down and H along from `around`.
    around : ndarray, shape (R, C, 2), int64
        Central move of each block, cells down and along.
    noise : float
        Sum of squares from noise.
    stiff : float
        Relative increase of the misfit with each cell of the move: among more long moves some fit by chance.
    out : ndarray, shape (R, C, 2 V + 1, 2 H + 1), float32
        Filled: logarithms of misfits, 0 for no misfit and no move.
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
    """Aggregate the costs of moves along lines from eight directions.

    Parameters
    ----------
    costs : ndarray, shape (R, C, V, H), float32
        Cost of each block and move.
    around : ndarray, shape (R, C, 2), int64
        Central move of each block, cells down and along.
    step, leap : float
        Cost of a difference of one cell, for each direction, between neighbours' moves; cost of any larger difference.
    out : ndarray, shape (R, C, V, H), float32
        Filled. The lowest item of a block is the move that best suits the block and the blocks on its eight lines.

    Notes
    -----
    Semi-global matching (Hirschmueller 2008, Stereo processing by semiglobal matching and mutual information, equation
    13), for moves in two dimensions.
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
                    least = _least_costs(line[q] if down == 0 else last[q], step, leap, work, eased)
                    v, h = around[i, j, 0] - around[p, q, 0], around[i, j, 1] - around[p, q, 1]
                    for a in range(height):
                        for b in range(width):
                            inside = 0 <= a + v < height and 0 <= b + h < width
                            passed = eased[a + v, b + h] - least if inside else leap
                            line[j, a, b] = costs[i, j, a, b] + passed
                else:
                    for a in range(height):
                        for b in range(width):
                            line[j, a, b] = costs[i, j, a, b]
                # loops: an assignment of whole arrays compiles Numba's text of its error message as well
                for a in range(height):
                    for b in range(width):
                        out[i, j, a, b] += line[j, a, b]
            if down != 0:
                line, last = last, line
