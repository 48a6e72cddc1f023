"""Weights, residuals and cost of a fit: a drawn picture compared with a photographed one."""

from ..jit.decorators import borrowing, compiled


@borrowing
def _weigh_row(differences, pixels, known, error, weight, residual):
    """Fill a row's residuals and weights, before outliers and background; return the sums of w and of w r."""
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
    """Compute `weigh_misfit`, for calls from kernels."""
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
    """Fill the residuals of a drawn picture and their weights.

    Parameters
    ----------
    plane : ndarray, shape (H, W + 1), float64
        The drawn picture, as differences along rows.
    pixels : ndarray, shape (H, W), float64
        The photographed picture.
    known : ndarray, shape (H, W), float64
        Inverse variances of the pixels, 0 where nothing was measured.
    error : float
        Relative model error of the drawn light, added to the noise.
    outlier : float
        Residual in standard deviations beyond which weights fall; infinite to keep all weights.
    offset : bool
        Whether to subtract the weighted mean of the residuals: a constant background that no ghost explains.
    weight, residual : ndarray, shape (H, W), float64
        Filled.

    Returns
    -------
    cost : float
        Weighted sum of squared residuals.
    total : float
        Sum of the weights.
    count : int
        Number of pixels with weight.
    """
    return misfit_of(plane, pixels, known, error, outlier, offset, weight, residual)
