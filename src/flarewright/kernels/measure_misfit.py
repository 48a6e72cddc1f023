"""How a drawn picture misses a photographed one: weights, residuals and cost of a fit, in one pass or two."""

from ._jit import borrowing, compiled


@borrowing
def _weigh_row(differences, pixels, known, error, weight, residual):
    """Fill a row's residuals and weights, outliers and background not yet looked at; return sums."""
    drawn = 0.0
    for x in range(pixels.size):
        drawn += differences[x]
        residual[x] = drawn
    total, off = 0.0, 0.0
    for x in range(pixels.size):
        drawn = residual[x]
        level = error * max(abs(drawn), abs(pixels[x]))
        weight[x] = known[x] / (1.0 + known[x] * (level * level))
        residual[x] = pixels[x] - drawn
        total += weight[x]
        off += weight[x] * residual[x]
    return total, off


@borrowing
def misfit_of(plane, pixels, known, error, outlier, offset, weight, residual):
    """Do what `weigh_misfit` does, for kernels."""
    total, off = 0.0, 0.0
    for y in range(pixels.shape[0]):
        more, less = _weigh_row(plane[y], pixels[y], known[y], error, weight[y], residual[y])
        total += more
        off += less
    off = off / total if offset and total > 0.0 else 0.0
    scale = 1.0 / outlier**2
    cost, total, count = 0.0, 0.0, 0
    for y in range(pixels.shape[0]):
        w, r = weight[y], residual[y]
        for x in range(w.size):
            r[x] -= off
            w[x] /= 1.0 + w[x] * (r[x] * r[x] * scale)
            total += w[x]
            cost += w[x] * r[x] * r[x]
            count += w[x] > 0.0
    return cost, total, count


@compiled
def weigh_misfit(plane, pixels, known, error, outlier, offset, weight, residual):
    """Weigh what a picture misses.

    Parameters
    ----------
    plane : ndarray, shape (H, W + 1), float64
        Differences along rows of the drawn picture.
    pixels : ndarray, shape (H, W), float64
        Photographed.
    known : ndarray, shape (H, W), float64
        Inverse variances, 0 where nothing was measured.
    error : float
        Part of the light that the drawing may miss: it counts as noise.
    outlier : float
        Standard deviations beyond which a pixel counts less and less; infinite: never.
    offset : bool
        An even background is nobody's: the weighted mean is taken off the residuals.
    weight, residual : ndarray, shape (H, W), float64
        Filled.

    Returns
    -------
    cost : float
        Weighted squares.
    total : float
        Sum of the weights.
    count : int
        Pixels that have weight.
    """
    return misfit_of(plane, pixels, known, error, outlier, offset, weight, residual)
