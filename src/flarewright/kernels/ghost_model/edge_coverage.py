"""Exact pixel coverage by edges: each edge of a triangle mesh is drawn once, with the step in density across it.

An edge is drawn as differences along rows, and a prefix sum along the rows gives the picture, so that the cost depends
on the pixels an edge crosses and not on the area it bounds. When the ends of an edge move, only the pixels that it
crosses change, by the light in the swept area: the exact derivative of the exact coverage.
"""

from math import floor

from ..jit.decorators import borrowing, compiled


@borrowing
def _piece(row, x0, x1, dy, weight, left, width, plane):
    """Add the light to the right of a piece of an edge within one row."""
    if x0 > x1:
        x0, x1 = x1, x0
    x0, x1 = x0 - left, x1 - left
    if x1 <= 0.0:
        plane[row, 0] += weight * dy
        return
    if x0 >= width:
        return
    span = x1 - x0
    if span < 1e-12:
        c = int(x0)
        part = x0 - c
        plane[row, c] += weight * dy * (1.0 - part)
        plane[row, c + 1] += weight * dy * part
        return
    slope = weight * dy / span
    if x0 < 0.0:
        plane[row, 0] -= slope * x0
        x0 = 0.0
    x1 = min(x1, float(width))
    c = int(x0)
    while x0 < x1:
        end = min(c + 1.0, x1)
        light, part = slope * (end - x0), 0.5 * (x0 + end) - c
        plane[row, c] += light * (1.0 - part)
        plane[row, c + 1] += light * part
        x0 = end
        c += 1


@borrowing
def _add_inside(x, y0, y1, slope, weight, plane):
    """Add an edge that lies inside the window: the common case, mostly with one pixel in each row."""
    row = int(y0)
    # light per pixel of x where the edge crosses several pixels of a row
    spread = weight / max(abs(slope), 1e-12)
    while y0 < y1:
        end = min(row + 1.0, y1)
        x_end = x + (end - y0) * slope
        low, high = min(x, x_end), max(x, x_end)
        c = int(low)
        if high <= c + 1.0:
            light = weight * (end - y0)
            far = light * (0.5 * (low + high) - c)
            plane[row, c] += light - far
            plane[row, c + 1] += far
        else:
            while low < high:
                stop = min(c + 1.0, high)
                light = spread * (stop - low)
                far = light * (0.5 * (low + stop) - c)
                plane[row, c] += light - far
                plane[row, c + 1] += far
                low = stop
                c += 1
        x, y0 = x_end, end
        row += 1


@borrowing
def add_edge(x0, y0, x1, y1, weight, left, top, width, height, plane):
    """Add the light to the right of an edge that runs from (x0, y0) to (x1, y1), as differences along rows.

    `plane` has shape (height, width + 1), its first pixel at (left, top); pixel k spans [k, k + 1].
    """
    y0, y1 = y0 - top, y1 - top
    if y0 == y1 or weight == 0.0:
        return
    if y0 > y1:
        x0, y0, x1, y1, weight = x1, y1, x0, y0, -weight
    if y1 <= 0.0 or y0 >= height:
        return
    slope = (x1 - x0) / (y1 - y0)
    if y0 >= 0.0 and y1 < height and min(x0, x1) >= left and max(x0, x1) < left + width:
        _add_inside(x0 - left, y0, y1, slope, weight, plane)
        return
    if y0 < 0.0:
        x0 -= y0 * slope
        y0 = 0.0
    if y1 > height:
        y1 = float(height)
    row = int(y0)
    x = x0
    while y0 < y1:
        end = min(row + 1.0, y1)
        x_end = x + (end - y0) * slope
        _piece(row, x, x_end, end - y0, weight, left, width, plane)
        x, y0 = x_end, end
        row += 1


@borrowing
def _crossing(row, c, light, part, length, t, change, sweep, out):
    """Add the derivatives in one pixel: change of the step times the coverage, plus the step times the swept area."""
    near, far = light * (1.0 - part), light * part
    for q in range(change.size):
        moved = length * (sweep[0, q] + t * sweep[1, q])
        out[row, c, q] += change[q] * near - moved
        out[row, c + 1, q] += change[q] * far + moved


@borrowing
def add_edge_changes(x0, y0, x1, y1, weight, change, v0, v1, left, top, width, height, sweep, out):
    """Add the derivatives of `add_edge` by Q parameters.

    `change` (Q,) is the derivative of the weight, `v0` and `v1` (2, Q) those of the ends; `sweep` (2, Q) is scratch;
    `out` has shape (height, width + 1, Q).
    """
    y0, y1, x0, x1 = y0 - top, y1 - top, x0 - left, x1 - left
    dx, dy = x1 - x0, y1 - y0
    if max(y0, y1) <= 0.0 or min(y0, y1) >= height or min(x0, x1) >= width:
        return
    # the light swept at the first end of the edge, and its difference to the other end
    for q in range(change.size):
        sweep[0, q] = weight * (v0[0, q] * dy - v0[1, q] * dx)
        sweep[1, q] = weight * (v1[0, q] * dy - v1[1, q] * dx) - sweep[0, q]
    # t runs from 0 to 1 along the edge; clip it to the rows of the window and to the left of its right border
    t, last = 0.0, 1.0
    by_row, by_column = 1.0 / dy if dy != 0.0 else 0.0, 1.0 / dx if dx != 0.0 else 0.0
    down, right = dy > 0.0, dx > 0.0
    if dy != 0.0:
        above, below = -y0 * by_row, (height - y0) * by_row
        t, last = max(t, min(above, below)), min(last, max(above, below))
    if dx != 0.0:
        border = (width - x0) * by_column
        if right:
            last = min(last, border)
        else:
            t = max(t, border)
    y, x = y0 + t * dy, x0 + t * dx
    row, c = int(floor(y)), int(floor(max(x, -1.0)))
    if not down and y == row:
        row -= 1
    if not right and x == c:
        c -= 1
    row, c = min(max(row, 0), height - 1), min(max(c, -1), width - 1)
    # step from grid line to grid line; left of the window from row to row
    while t < last:
        t_row = ((row + 1.0 if down else float(row)) - y0) * by_row if dy != 0.0 else 2.0
        t_column = 2.0
        if dx != 0.0 and (right or c >= 0):
            t_column = ((c + 1.0 if right else float(c)) - x0) * by_column
        end = min(min(t_row, t_column), last)
        if end > t:
            middle, length = 0.5 * (t + end), end - t
            if c >= 0:
                part = x0 + middle * dx - c
                _crossing(row, c, length * dy, part, length, middle, change, sweep, out)
            else:
                for q in range(change.shape[0]):
                    out[row, 0, q] += change[q] * length * dy
            t = end
        if t_row <= t:
            row += 1 if down else -1
        if t_column <= t:
            c += 1 if right else -1
        if not (0 <= row < height and -1 <= c < width):
            break


@compiled
def sum_along_rows(plane):
    """Sum differences along rows to the picture, in place.

    Parameters
    ----------
    plane : ndarray, shape (H, W + 1), float64
    """
    for row in range(plane.shape[0]):
        total = 0.0
        for c in range(plane.shape[1]):
            total += plane[row, c]
            plane[row, c] = total


@compiled
def sum_into(planes, first, last, pixels):
    """Sum planes of differences along rows, and add them to some rows of a picture; clamp negative light to 0.

    Parameters
    ----------
    planes : ndarray, shape (4, H, W + 1), float64
        Red, green, blue, and second green.
    first, last : int
        Range of rows, without the last.
    pixels : ndarray, shape (H, W, 3), float64
    """
    for row in range(first, min(last, pixels.shape[0])):
        red, green, blue = 0.0, 0.0, 0.0
        for c in range(pixels.shape[1]):
            red += planes[0, row, c]
            green += planes[1, row, c] + planes[3, row, c]
            blue += planes[2, row, c]
            pixels[row, c, 0] = max(pixels[row, c, 0] + red, 0.0)
            pixels[row, c, 1] = max(pixels[row, c, 1] + green, 0.0)
            pixels[row, c, 2] = max(pixels[row, c, 2] + blue, 0.0)


@compiled
def sum_changes_along_rows(changes):
    """Sum the derivatives' differences along rows to derivatives, in place.

    Parameters
    ----------
    changes : ndarray, shape (H, W + 1, Q), float64
    """
    for row in range(changes.shape[0]):
        for c in range(1, changes.shape[1]):
            for q in range(changes.shape[2]):
                changes[row, c, q] += changes[row, c - 1, q]
