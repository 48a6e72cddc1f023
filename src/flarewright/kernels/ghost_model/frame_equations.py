"""Joint fit of all ghosts of a view: derivatives by brightness, place and size, and their normal equations.

A view has dozens of ghosts whose windows overlap in hundreds of mostly small pairs. As NumPy arrays each product would
take longer to set up than to sum.
"""

from ..jit.decorators import compiled, inner
from .ghost_mesh import ghost_window
from .jacobian import draw_changes


@inner
def ghost_changes(plane, changes, shift, growth, pixels):
    """Fill a ghost's light in each pixel of its window, and the derivatives by its place and its size.

    Parameters
    ----------
    plane : ndarray, shape (H, W + 1), float64
        The ghost's picture, as differences along rows.
    changes : ndarray, shape (H, W + 1, 1 + Q), float64
        Its derivatives by the first parameter of its place, then by those of its size, as differences along rows.
    shift : float
        Factor of the derivative by place.
    growth : ndarray, shape (Q,), float64
        Factors of the derivatives by size.
    pixels : ndarray, shape (H * W, 3), float64
        Filled: the picture, its derivative by place, its derivative by size.
    """
    height, width = plane.shape[0], plane.shape[1] - 1
    for y in range(height):
        light, moved, grown = 0.0, 0.0, 0.0
        for x in range(width):
            light += plane[y, x]
            moved += shift * changes[y, x, 0]
            for q in range(growth.size):
                grown += growth[q] * changes[y, x, 1 + q]
            at = y * width + x
            pixels[at, 0], pixels[at, 1], pixels[at, 2] = light, moved, grown


@compiled
def windows_together(parameters, disc_counts, sigma, frame, width, height, windows):
    """Fill the window of each ghost in a view; see `window_of`.

    Parameters
    ----------
    parameters : ndarray, shape (G, N), float64
    disc_counts : ndarray, shape (G,), int64
    sigma : float
    frame : ndarray, shape (5,), float64
    width, height : int
        Size of the view.
    windows : ndarray, shape (G, 6), int64
        Filled for the visible ghosts, from the first row: index of the ghost, index of its first pixel, and top, left,
        height and width in the view.

    Returns
    -------
    seen, pixels, largest : int
        Number of visible ghosts, number of pixels of all windows, and size of the largest window's plane.
    """
    seen, start, largest = 0, 0, 0
    for g in range(parameters.shape[0]):
        left, top, w, h = ghost_window(parameters[g], disc_counts[g], sigma, frame, width, height)
        if w > 0:
            row = windows[seen]
            row[0], row[1], row[2], row[3], row[4], row[5] = g, start, top, left, h, w
            seen += 1
            start += h * w
            largest = max(largest, h * (w + 1))
    return seen, start, largest


@compiled
def draw_together(parameters, disc_counts, sigma, frame, free, windows, shifts, growths, room, pixels):
    """Draw the ghosts of a view with their derivatives by place and size; see `ghost_changes`.

    Parameters
    ----------
    parameters, disc_counts, sigma, frame
        As in `windows_together`.
    free : ndarray, shape (1 + Q,), int64
        Indices of the first parameter of the place and of those of the size.
    windows : ndarray, shape (S, 6), int64
        Windows of the visible ghosts.
    shifts : ndarray, shape (G,), float64
    growths : ndarray, shape (G, Q), float64
        Factors of the derivatives, as in `ghost_changes`.
    room : ndarray, float64
        Scratch, at least height (width + 1) (2 + Q) of the largest window.
    pixels : ndarray, shape (P, 3), float64
        Filled.
    """
    for k in range(windows.shape[0]):
        g, start, top, left, height, width = windows[k]
        size = height * (width + 1)
        room[: size * (free.size + 1)] = 0.0
        plane = room[:size].reshape((height, width + 1))
        changes = room[size : size * (free.size + 1)].reshape((height, width + 1, free.size))
        draw_changes(parameters[g], disc_counts[g], sigma, free, frame, left, top, plane, changes)
        ghost_changes(plane, changes, shifts[g], growths[g], pixels[start : start + height * width])


@compiled
def add_together(pixels, windows, weight, residual, even, matrix, side):
    """Add one colour of a view to the normal equations of all ghosts in it.

    Parameters
    ----------
    pixels : ndarray, shape (P, 3), float64
        From `ghost_changes`, one ghost after another.
    windows : ndarray, shape (G, 6), int64
        Index of the ghost, index of its first pixel, and top, left, height and width in the view; each ghost once.
    weight, residual : ndarray, shape (H, W), float64
        Weights of the view's pixels, and their light that the ghosts must explain.
    even : int
        Index of the unknown for a constant background.
    matrix : ndarray, shape (N, N), float64
        Added to: three unknowns for each ghost, then the others.
    side : ndarray, shape (N,), float64
        Added to.
    """
    for y in range(weight.shape[0]):
        for x in range(weight.shape[1]):
            matrix[even, even] += weight[y, x]
            side[even] += weight[y, x] * residual[y, x]
    for a in range(windows.shape[0]):
        row, start, top, first, height, width = windows[a]
        row *= 3
        s0, s1, s2, m0, m1, m2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for y in range(height):
            for x in range(width):
                at, w = start + y * width + x, weight[top + y, first + x]
                lit = w * residual[top + y, first + x]
                s0 += lit * pixels[at, 0]
                s1 += lit * pixels[at, 1]
                s2 += lit * pixels[at, 2]
                m0 += w * pixels[at, 0]
                m1 += w * pixels[at, 1]
                m2 += w * pixels[at, 2]
        side[row] += s0
        side[row + 1] += s1
        side[row + 2] += s2
        matrix[row, even] += m0
        matrix[row + 1, even] += m1
        matrix[row + 2, even] += m2
        for k in range(3):
            matrix[even, row + k] = matrix[row + k, even]
        for b in range(a, windows.shape[0]):
            _add_pair(pixels, windows, weight, a, b, matrix)


@inner
def _add_pair(pixels, windows, weight, a, b, matrix):
    """Add the products of two ghosts' derivatives where their windows overlap."""
    row, start_a, top_a, left_a, height_a, width_a = windows[a]
    column, start_b, top_b, left_b, height_b, width_b = windows[b]
    top, bottom = max(top_a, top_b), min(top_a + height_a, top_b + height_b)
    first, end = max(left_a, left_b), min(left_a + width_a, left_b + width_b)
    if top >= bottom or first >= end:
        return
    p00, p01, p02, p10, p11, p12, p20, p21, p22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for y in range(top, bottom):
        at_a = start_a + (y - top_a) * width_a - left_a
        at_b = start_b + (y - top_b) * width_b - left_b
        for x in range(first, end):
            w = weight[y, x]
            a0, a1, a2 = w * pixels[at_a + x, 0], w * pixels[at_a + x, 1], w * pixels[at_a + x, 2]
            b0, b1, b2 = pixels[at_b + x, 0], pixels[at_b + x, 1], pixels[at_b + x, 2]
            p00 += a0 * b0
            p01 += a0 * b1
            p02 += a0 * b2
            p10 += a1 * b0
            p11 += a1 * b1
            p12 += a1 * b2
            p20 += a2 * b0
            p21 += a2 * b1
            p22 += a2 * b2
    found = ((p00, p01, p02), (p10, p11, p12), (p20, p21, p22))
    for j in range(3):
        for k in range(3):
            matrix[3 * row + j, 3 * column + k] += found[j][k]
            if a != b:
                matrix[3 * column + k, 3 * row + j] += found[j][k]
