"""Read pixels from pictures finer than they are, and put back what pixels tell of such pictures."""

from ._jit import compiled


@compiled
def read_cells(cells, weights, before, part, sure, pictures, out):
    """Read pixels from pictures of two constellations.

    Parameters
    ----------
    cells : ndarray, shape (P, T), int64
        Which cells each pixel reads.
    weights : ndarray, shape (P, T), float64
        What each counts.
    before : ndarray, shape (P,), int64
        The picture below each pixel's constellation.
    part : ndarray, shape (P,), float64
        How far it is to the next picture, 0 to 1.
    sure : ndarray, shape (P,), float64
        Each pixel's factor.
    pictures : ndarray, shape (K, cells, 3), float64
    out : ndarray, shape (P, 3), float64
        Filled.
    """
    for p in range(cells.shape[0]):
        low, high = sure[p] * (1.0 - part[p]), sure[p] * part[p]
        k = before[p]
        red, green, blue = 0.0, 0.0, 0.0
        for t in range(cells.shape[1]):
            c = cells[p, t]
            a, b = low * weights[p, t], high * weights[p, t]
            red += a * pictures[k, c, 0] + b * pictures[k + 1, c, 0]
            green += a * pictures[k, c, 1] + b * pictures[k + 1, c, 1]
            blue += a * pictures[k, c, 2] + b * pictures[k + 1, c, 2]
        out[p, 0], out[p, 1], out[p, 2] = red, green, blue


@compiled
def gather_cells(cells, weights, before, part, sure, pixels, out):
    """Put pixels back into pictures: the transpose of `read_cells`.

    Parameters
    ----------
    cells, weights, before, part, sure
        As of `read_cells`.
    pixels : ndarray, shape (P, 3), float64
    out : ndarray, shape (K, cells, 3), float64
        Added to.
    """
    for p in range(cells.shape[0]):
        low, high = sure[p] * (1.0 - part[p]), sure[p] * part[p]
        k = before[p]
        for t in range(cells.shape[1]):
            c = cells[p, t]
            a, b = low * weights[p, t], high * weights[p, t]
            for m in range(3):
                out[k, c, m] += a * pixels[p, m]
                out[k + 1, c, m] += b * pixels[p, m]


@compiled
def square_cells(cells, weights, before, part, sure, out):
    """Add up the squares of what each cell of each picture counts in all pixels.

    Parameters
    ----------
    cells, weights, before, part, sure
        As of `read_cells`.
    out : ndarray, shape (K, cells), float64
        Added to.

    Notes
    -----
    A pixel may read a cell more than once; these are squared one by one, for a measure of size needs no more.
    """
    for p in range(cells.shape[0]):
        low, high = sure[p] * (1.0 - part[p]), sure[p] * part[p]
        for t in range(cells.shape[1]):
            out[before[p], cells[p, t]] += (low * weights[p, t]) ** 2
            out[before[p] + 1, cells[p, t]] += (high * weights[p, t]) ** 2
