"""Means of a strip of pixels under small masks that slide along it."""

from ..jit.decorators import compiled


@compiled
def means_along(strip, masks, means):
    """Fill the mean of a strip under each mask, at every position where the whole mask lies inside the strip.

    Parameters
    ----------
    strip : ndarray, shape (R, N), float64
    masks : ndarray, shape (M, R, T), bool
        T odd; none is empty.
    means : ndarray, shape (M, N), float64
        Filled except for the first and the last T // 2 columns, which are unchanged.
    """
    half = masks.shape[2] // 2
    for m in range(masks.shape[0]):
        count = 0
        inner = means[m, half : means.shape[1] - half]
        inner[:] = 0.0
        for r in range(masks.shape[1]):
            for t in range(masks.shape[2]):
                if masks[m, r, t]:
                    count += 1
                    for n in range(inner.size):
                        inner[n] += strip[r, t + n]
        for n in range(inner.size):
            inner[n] /= count
