"""Follow light from the leaves of an adaptive grid into coarser cells beside them, whose own rays all fail."""

import numpy as np

from ..jit.decorators import borrowing, inner
from .ray_failures import passes
from .sequential import X, Y

# states of a grid's cells; a FLAT leaf is drawn without the midpoints of its edges, a LEAF with them
UNKNOWN, LEAF, SPLIT, EMPTY, FLAT = 0, 1, 2, 3, 4


@borrowing
def quarter_of(a, b, height, m):
    """Return the number, among the cells of the next level, of the m-th quarter of a cell; `height` cells are in b."""
    return (2 * a + m // 2) * (2 * height) + 2 * b + m % 2


@borrowing
def known_level(state, offsets, ny, level, a, b):
    """Return the level of the finest cell with a known state that covers the cell a, b of a level; -1 for none."""
    up = level
    while up >= 0 and state[offsets[up] + (a >> (level - up)) * (ny << up) + (b >> (level - up))] == UNKNOWN:
        up -= 1
    return up


@borrowing
def _is_lit(data, k, crossings, iris_radius, limits):
    """Return whether a node's ray passes at any wavelength and lands in the picture."""
    radius = min(iris_radius, limits.faint_radius)
    for v in range(data.shape[0]):
        x, y = data[v, k, X], data[v, k, Y]
        if x * x + y * y <= limits.view_radius**2 and passes(data[v], k, crossings, radius):
            return True
    return False


@borrowing
def has_lit_side(data, lattice, a, b, level, depth, crossings, iris_radius, limits):
    """Return whether the ray of any node on the sides of a cell passes and lands in the picture.

    Parameters
    ----------
    data : ndarray, shape (V, N, 5 + 2 C)
        Nodes traced at V wavelengths.
    lattice : ndarray of int
        Numbers of the nodes + 1 at all possible places, 0 where there is none.
    a, b, level : int
        Column and row of the cell among the cells of its level.
    depth : int
        Finest level of the lattice.
    crossings, iris_radius, limits
        As in `adaptive_grid.build_mesh`.
    """
    size = 2 << (depth - level)
    for m in range(size + 1):
        for side in range(4):
            i = a * size + (m if side < 2 else (side - 2) * size)
            j = b * size + (side * size if side < 2 else m)
            if lattice[i, j] > 0 and _is_lit(data, lattice[i, j] - 1, crossings, iris_radius, limits):
                return True
    return False


@inner
def halve_neighbours(
    state, offsets, data, lattice, cell, level, depth, nx, ny, crossings, iris_radius, limits, entered, n_entered
):
    """Halve the coarser left-out cells that share a lit node with a leaf.

    Light that reaches the side of such a cell continues in it, though its own rays all fail.

    Parameters
    ----------
    state : ndarray of int
        State of every cell of all levels; halved cells become SPLIT.
    offsets : ndarray of int
        Where each level begins in `state`.
    cell, level : int
        Number and level of the leaf.
    nx, ny : int
        Number of coarsest cells in x and in y.
    data, lattice, depth, crossings, iris_radius, limits
        As in `has_lit_side`.
    entered : ndarray of int, shape (>= n_entered, 2)
        Levels and numbers of cells to classify, to which those of the quarters are added.
    n_entered : int

    Returns
    -------
    entered, n_entered
        A longer array if the quarters need it.
    """
    width, height = nx << level, ny << level
    a, b = cell // height, cell % height
    half = 1 << (depth - level)
    for m in range(4):
        da, db = (1 if m == 0 else (-1 if m == 1 else 0)), (1 if m == 2 else (-1 if m == 3 else 0))
        i, j = a + da, b + db
        if not (0 <= i < width and 0 <= j < height):
            continue
        up = known_level(state, offsets, ny, level, i, j)
        i, j = i >> (level - up), j >> (level - up)
        if up == level or state[offsets[up] + i * (ny << up) + j] != EMPTY:
            continue
        for n in range(-1, 2):
            node = lattice[(2 * a + 1 + (da if da != 0 else n)) * half, (2 * b + 1 + (db if db != 0 else n)) * half] - 1
            if not _is_lit(data, node, crossings, iris_radius, limits):
                continue
            state[offsets[up] + i * (ny << up) + j] = SPLIT
            if n_entered + 4 > entered.shape[0]:
                entered = _longer(entered, n_entered)
            for q in range(4):
                entered[n_entered, 0], entered[n_entered, 1] = up + 1, quarter_of(i, j, ny << up, q)
                n_entered += 1
            break
    return entered, n_entered


@inner
def _longer(pairs, count):
    """Return a copy of the first pairs with room for as many again."""
    longer = np.empty((2 * pairs.shape[0], 2), dtype=np.int64)
    for k in range(count):
        longer[k, 0], longer[k, 1] = pairs[k, 0], pairs[k, 1]
    return longer
