"""Spread a picture over a shape: what a source's extent, or a plane out of focus, makes of points."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def disc_kernel(radius_px: tuple[float, float]) -> Floats:
    """Return the weights of pixels under an upright ellipse, sum 1.

    Parameters
    ----------
    radius_px : tuple of float
        Half its width and half its height, pixels.

    Returns
    -------
    ndarray, shape (2 a + 1, 2 b + 1)
        The ellipse's middle is that of the middle pixel.
    """
    reach = [math.ceil(r) + 1 for r in radius_px]
    parts = 8
    fine = [(np.arange((2 * k + 1) * parts) + 0.5) / parts - k - 0.5 for k in reach]
    inside = (fine[0] / radius_px[0]) ** 2 + (fine[1][:, None] / radius_px[1]) ** 2 <= 1.0
    disc: Floats = inside.reshape(2 * reach[1] + 1, parts, 2 * reach[0] + 1, parts).mean(axis=(1, 3))
    if disc.sum() == 0.0:
        disc[reach[1], reach[0]] = 1.0
    return np.asarray(disc / disc.sum())


def spread(picture: NDArray[np.floating], kernel: Floats) -> Floats:
    """Spread every pixel's light over a kernel, by Fourier transforms.

    Parameters
    ----------
    picture : ndarray, shape (H, W, C)
    kernel : ndarray, shape (2 a + 1, 2 b + 1)

    Returns
    -------
    ndarray, shape (H, W, C)
        What lands outside is lost to the picture.
    """
    height, width = picture.shape[:2]
    reach = [side // 2 for side in kernel.shape]
    rows, columns = _smooth_size(height + 2 * reach[0]), _smooth_size(width + 2 * reach[1])
    transfer = np.fft.rfft2(kernel, (rows, columns))
    out = np.empty(picture.shape)
    for c in range(picture.shape[2]):
        wide = np.fft.irfft2(
            np.fft.rfft2(picture[..., c].astype(np.float64), (rows, columns)) * transfer, (rows, columns)
        )
        out[..., c] = wide[reach[0] : reach[0] + height, reach[1] : reach[1] + width]
    return out


def joined(one: Floats, other: Floats) -> Floats:
    """Return the kernel that spreads like one kernel after another.

    Parameters
    ----------
    one, other : ndarray, shapes (2 a + 1, 2 b + 1)

    Returns
    -------
    ndarray
    """
    rows, columns = (one.shape[k] + other.shape[k] - 1 for k in (0, 1))
    size = (_smooth_size(rows), _smooth_size(columns))
    both = np.fft.irfft2(np.fft.rfft2(one, size) * np.fft.rfft2(other, size), size)[:rows, :columns]
    return np.asarray(np.maximum(both, 0.0))


def _smooth_size(least: int) -> int:
    """Return the next length whose transform is fast."""
    found = least
    while True:
        rest = found
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return found
        found += 1
