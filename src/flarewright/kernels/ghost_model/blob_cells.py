"""Sparse linear map from fine pictures of blobs to pixels, and its transpose, for a least-squares fit of the pictures.

The fine pictures belong to constellations; a pixel interpolates between the two nearest.
"""

from ..jit.decorators import compiled


@compiled
def read_cells(cells, weights, before, part, confidence, pictures, out):
    """Compute pixels from the cells of pictures, interpolated between two constellations.

    Parameters
    ----------
    cells : ndarray, shape (P, T), int64
        Cells that each pixel reads.
    weights : ndarray, shape (P, T), float64
        Weights of these cells.
    before : ndarray, shape (P,), int64
        Index of the picture below each pixel's constellation.
    part : ndarray, shape (P,), float64
        Fraction of the way to the next picture, 0 to 1.
    confidence : ndarray, shape (P,), float64
        Factor of each pixel.
    pictures : ndarray, shape (K, cells, 3), float64
    out : ndarray, shape (P, 3), float64
        Filled.
    """
    for p in range(cells.shape[0]):
        low, high = confidence[p] * (1.0 - part[p]), confidence[p] * part[p]
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
def gather_cells(cells, weights, before, part, confidence, pixels, out):
    """Add pixels to the cells of pictures: the transpose of `read_cells`.

    Parameters
    ----------
    cells, weights, before, part, confidence
        As in `read_cells`.
    pixels : ndarray, shape (P, 3), float64
    out : ndarray, shape (K, cells, 3), float64
        Added to.
    """
    for p in range(cells.shape[0]):
        low, high = confidence[p] * (1.0 - part[p]), confidence[p] * part[p]
        k = before[p]
        for t in range(cells.shape[1]):
            c = cells[p, t]
            a, b = low * weights[p, t], high * weights[p, t]
            for m in range(3):
                out[k, c, m] += a * pixels[p, m]
                out[k + 1, c, m] += b * pixels[p, m]


@compiled
def square_cells(cells, weights, before, part, confidence, out):
    """Sum the squared weights of each cell of each picture over all pixels.

    Parameters
    ----------
    cells, weights, before, part, confidence
        As in `read_cells`.
    out : ndarray, shape (K, cells), float64
        Added to.

    Notes
    -----
    If a pixel reads a cell more than once, the weights are squared separately, which is enough for scaling the cells.
    """
    for p in range(cells.shape[0]):
        low, high = confidence[p] * (1.0 - part[p]), confidence[p] * part[p]
        for t in range(cells.shape[1]):
            out[before[p], cells[p, t]] += (low * weights[p, t]) ** 2
            out[before[p] + 1, cells[p, t]] += (high * weights[p, t]) ** 2
