"""Visible part of a light's shape behind an image that hides it."""

from __future__ import annotations

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from ...typing import Floats
from .polygon import END, START, WEIGHT, content, points

# largest number of image cells per side of a shape; finer images are averaged
FINEST = 64
# differences of transmittance below this are invisible
SAME = 1e-6


def hidden_part(hidden: NDArray[np.floating], place: Floats) -> float:
    """Return how much an image hides of a point.

    Parameters
    ----------
    hidden : ndarray, shape (H, W)
        Fraction of the light that each pixel blocks.
    place : ndarray, shape (2,)
        Column and row; pixels begin at integers.

    Returns
    -------
    float
        Linear between pixel centres; 0 outside the image.
    """
    total = 0.0
    first = np.floor(place - 0.5).astype(int)
    for column, row in first + np.array([[0, 0], [1, 0], [0, 1], [1, 1]]):
        if 0 <= row < hidden.shape[0] and 0 <= column < hidden.shape[1]:
            near = 1.0 - np.abs(place - 0.5 - np.array([column, row]))
            total += float(near[0] * near[1] * hidden[row, column])
    return total


def visible_shape(border: Floats, hidden: NDArray[np.floating]) -> Floats:
    """Return the visible part of a shape behind an image.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
        Border of a plain polygon with positive `content`, in columns and rows of the image.
    hidden : ndarray, shape (H, W)
        Fraction of the light that each pixel blocks; outside the image it is 0.

    Returns
    -------
    ndarray, shape (M, 5)
        Border of the visible part, by pixels if the shape is at most FINEST pixels wide, else by averaged cells. The
        input border when nothing is hidden, empty when all is hidden.
    """
    columns, rows = (_lines(border, axis) for axis in (0, 1))
    seen = 1.0 - _means(hidden, columns, rows)
    if (np.abs(seen - 1.0) < SAME).all():
        return border
    edges = [_own_edges(border, columns, rows, seen)]
    # inside the shape, edges between cells of different values; the shape is on the left of an edge
    across, down = -np.diff(seen, axis=1).T, np.diff(seen, axis=0)
    edges += [_between_cells(border, 0, float(at), rows, across[k]) for k, at in enumerate(columns[1:-1])]
    edges += [_between_cells(border, 1, float(at), columns, down[k]) for k, at in enumerate(rows[1:-1])]
    found = np.concatenate(edges)
    found = found[np.abs(found[:, WEIGHT]) > SAME]
    return found if len(found) and content(found) > SAME * content(border) else np.zeros((0, 5))


def _lines(border: Floats, axis: int) -> Floats:
    """Return the cell boundaries along an axis that cover the shape."""
    ends = points(border)[:, axis]
    low, high = floor(float(ends.min())), ceil(float(ends.max()))
    if high - low <= FINEST:
        return np.arange(low, max(high, low + 1) + 1, dtype=np.float64)
    return np.linspace(float(ends.min()), float(ends.max()), FINEST + 1)


def _means(hidden: NDArray[np.floating], columns: Floats, rows: Floats) -> Floats:
    """Average an image over cells, shape (rows - 1, columns - 1)."""
    table: NDArray[np.floating] = hidden
    for axis, lines in ((0, rows), (1, columns)):
        low, high = (int(np.clip(f(at), 0, table.shape[axis])) for f, at in ((floor, lines[0]), (ceil, lines[-1])))
        part = np.moveaxis(table, axis, 0)[low:high]
        total = np.concatenate([np.zeros((1, part.shape[1])), np.cumsum(part, axis=0, dtype=np.float64)])
        # cumulative sum up to each boundary: linear within a pixel, constant outside
        at = np.clip(lines - low, 0.0, len(total) - 1.0)
        k = np.minimum(at.astype(int), max(len(total) - 2, 0))
        up_to = total[k] + (at - k)[:, None] * (total[np.minimum(k + 1, len(total) - 1)] - total[k])
        table = np.moveaxis(np.diff(up_to, axis=0) / np.diff(lines)[:, None], 0, axis)
    return np.asarray(table, dtype=np.float64)


def _own_edges(border: Floats, columns: Floats, rows: Floats, seen: Floats) -> Floats:
    """Split the shape's own edges at cell boundaries, each piece weighted by its cell."""
    pieces = []
    for edge in border:
        start, along = edge[START], edge[END] - edge[START]
        cuts = [np.array([0.0, 1.0])]
        for axis, lines in ((0, columns), (1, rows)):
            if along[axis] != 0.0:
                t = (lines - start[axis]) / along[axis]
                cuts.append(t[(t > 0.0) & (t < 1.0)])
        ends = start + np.unique(np.concatenate(cuts))[:, None] * along
        # an edge along a boundary belongs to the farther cell, as do crossings of that boundary
        middle = 0.5 * (ends[1:] + ends[:-1])
        column, row = (
            np.clip(np.searchsorted(lines, middle[:, axis], side="right") - 1, 0, len(lines) - 2)
            for axis, lines in ((0, columns), (1, rows))
        )
        pieces.append(np.column_stack([ends[:-1], ends[1:], seen[row, column]]))
    return np.concatenate(pieces)


def _between_cells(border: Floats, axis: int, at: float, along: Floats, steps: Floats) -> Floats:
    """Return the edges on one boundary between cells, within the shape.

    `axis` is perpendicular to the boundary, which lies at `at`; `along` are the cells' ends on it, and `steps` the
    weights of edges that run upward on it.
    """
    across, other = border[:, axis], border[:, 1 - axis]
    across_end, other_end = border[:, 2 + axis], border[:, 3 - axis]
    met = (across < at) != (across_end < at)
    t = (at - across[met]) / (across_end[met] - across[met])
    crossings = np.sort(other[met] + t * (other_end[met] - other[met]))
    # adjacent cells with equal differences make one edge
    first = np.concatenate([[0], np.flatnonzero(np.abs(np.diff(steps)) > SAME) + 1])
    last = np.append(first[1:], len(steps))
    found = []
    for a, b in zip(first, last, strict=True):
        if abs(steps[a]) > SAME:
            for low, high in zip(crossings[::2], crossings[1::2], strict=True):
                begin, end = max(float(along[a]), float(low)), min(float(along[b]), float(high))
                if begin < end:
                    ends = ((at, begin), (at, end)) if axis == 0 else ((begin, at), (end, at))
                    found.append((*ends[0], *ends[1], float(steps[a])))
    return np.array(found).reshape(-1, 5)
