"""What an image in front of a light leaves of its shape."""

from __future__ import annotations

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from .border import END, START, WEIGHT, content, points

Floats = NDArray[np.float64]

# a shape is cut by no more cells of the image a side: finer ones are averaged
FINEST = 64
# a difference of transmittance that nobody sees
SAME = 1e-6

__all__ = ["FINEST", "behind", "hidden_at"]


def hidden_at(hidden: NDArray[np.floating], place: Floats) -> float:
    """Tell what an image hides of a point.

    Parameters
    ----------
    hidden : ndarray, shape (H, W)
        Part of the light that each pixel takes.
    place : ndarray, shape (2,)
        Column and row, of whose integers the image's pixels begin.

    Returns
    -------
    float
        Linear between the middles of pixels; nothing outside the image.
    """
    total = 0.0
    first = np.floor(place - 0.5).astype(int)
    for column, row in first + np.array([[0, 0], [1, 0], [0, 1], [1, 1]]):
        if 0 <= row < hidden.shape[0] and 0 <= column < hidden.shape[1]:
            near = 1.0 - np.abs(place - 0.5 - np.array([column, row]))
            total += float(near[0] * near[1] * hidden[row, column])
    return total


def behind(border: Floats, hidden: NDArray[np.floating]) -> Floats:
    """Cut a shape by what an image hides of it.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
        Of a plain polygon, `content` above 0: columns and rows of the image.
    hidden : ndarray, shape (H, W)
        Part of the light that each pixel takes; nothing is hidden outside the image.

    Returns
    -------
    ndarray, shape (M, 5)
        The border of what is seen, by pixels where the shape is no wider than FINEST of them, else by cells of their
        means; the border itself where nothing hides it, empty where all is hidden.
    """
    columns, rows = (_lines(border, axis) for axis in (0, 1))
    seen = 1.0 - _means(hidden, columns, rows)
    if (np.abs(seen - 1.0) < SAME).all():
        return border
    edges = [_own_edges(border, columns, rows, seen)]
    # inside the shape, edges between cells that differ; the shape is on the left of an edge
    across, down = -np.diff(seen, axis=1).T, np.diff(seen, axis=0)
    edges += [_between_cells(border, 0, float(at), rows, across[k]) for k, at in enumerate(columns[1:-1])]
    edges += [_between_cells(border, 1, float(at), columns, down[k]) for k, at in enumerate(rows[1:-1])]
    found = np.concatenate(edges)
    found = found[np.abs(found[:, WEIGHT]) > SAME]
    return found if len(found) and content(found) > SAME * content(border) else np.zeros((0, 5))


def _lines(border: Floats, axis: int) -> Floats:
    """Return where cells of the image end along an axis, round the shape."""
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
        # the sum over the image up to each line: straight within a pixel, constant outside
        at = np.clip(lines - low, 0.0, len(total) - 1.0)
        k = np.minimum(at.astype(int), max(len(total) - 2, 0))
        up_to = total[k] + (at - k)[:, None] * (total[np.minimum(k + 1, len(total) - 1)] - total[k])
        table = np.moveaxis(np.diff(up_to, axis=0) / np.diff(lines)[:, None], 0, axis)
    return np.asarray(table, dtype=np.float64)


def _own_edges(border: Floats, columns: Floats, rows: Floats, seen: Floats) -> Floats:
    """Divide the shape's own edges where they cross cells, each piece as bright as its cell."""
    pieces = []
    for edge in border:
        start, along = edge[START], edge[END] - edge[START]
        cuts = [np.array([0.0, 1.0])]
        for axis, lines in ((0, columns), (1, rows)):
            if along[axis] != 0.0:
                t = (lines - start[axis]) / along[axis]
                cuts.append(t[(t > 0.0) & (t < 1.0)])
        ends = start + np.unique(np.concatenate(cuts))[:, None] * along
        # what runs along a line between cells belongs to the farther one, as crossings of that line have it too
        middle = 0.5 * (ends[1:] + ends[:-1])
        column, row = (
            np.clip(np.searchsorted(lines, middle[:, axis], side="right") - 1, 0, len(lines) - 2)
            for axis, lines in ((0, columns), (1, rows))
        )
        pieces.append(np.column_stack([ends[:-1], ends[1:], seen[row, column]]))
    return np.concatenate(pieces)


def _between_cells(border: Floats, axis: int, at: float, along: Floats, steps: Floats) -> Floats:
    """Return the edges on one line between cells, as far as it lies in the shape.

    `axis` is across the line, which lies at `at`; `along` are the cells' ends on it and `steps` the weights of edges
    that run upward on it.
    """
    across, other = border[:, axis], border[:, 1 - axis]
    across_end, other_end = border[:, 2 + axis], border[:, 3 - axis]
    met = (across < at) != (across_end < at)
    t = (at - across[met]) / (across_end[met] - across[met])
    crossings = np.sort(other[met] + t * (other_end[met] - other[met]))
    # cells in a row that differ alike make one edge
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
