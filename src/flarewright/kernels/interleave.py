"""From planes of flux to pixels of irradiance."""

import numpy as np

from ._jit import compiled


@compiled
def lit_window(plane):
    """Bound the pixels that hold light.

    Parameters
    ----------
    plane : ndarray, shape (3, H, W)

    Returns
    -------
    tuple of int
        x0, y0, x1, y1; x1 = x0 when all is black.
    """
    height, width = plane.shape[1], plane.shape[2]
    x0, y0, x1, y1 = width, height, 0, 0
    for row in range(height):
        first, last = width, 0
        for channel in range(3):
            c = 0
            while c < first and plane[channel, row, c] == 0.0:
                c += 1
            first = min(first, c)
            c = width
            while c > last and plane[channel, row, c - 1] == 0.0:
                c -= 1
            last = max(last, c)
        if last > first:
            x0, x1, y0, y1 = min(x0, first), max(x1, last), min(y0, row), row + 1
    return (0, 0, 0, 0) if x1 <= x0 else (x0, y0, x1, y1)


@compiled
def interleave(plane, x0, y0, scale, pixels):
    """Fill pixels from planes.

    Parameters
    ----------
    plane : ndarray, shape (3, H, W)
        Flux per pixel.
    x0, y0 : int
        Corner of the window to take.
    scale : float
        1 / area of a pixel.
    pixels : ndarray, shape (h, w, 3), float32
        Filled.
    """
    for row in range(pixels.shape[0]):
        for c in range(pixels.shape[1]):
            for channel in range(3):
                pixels[row, c, channel] = np.float32(plane[channel, y0 + row, x0 + c] * scale)
