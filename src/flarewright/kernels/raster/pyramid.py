"""Convert pictures stored in blocks, at several resolutions, to one picture of pixels."""

import numpy as np

from ..jit.decorators import compiled
from .polygons import BLOCK


@compiled
def collect(plane, pixels):
    """Copy a picture stored in blocks to pixels.

    Parameters
    ----------
    plane : ndarray, shape (H, B, 3, BLOCK), float32
    pixels : ndarray, shape (H, W, 3), float32
        Filled; W <= B * BLOCK.
    """
    for row in range(pixels.shape[0]):
        for c in range(pixels.shape[1]):
            block, m = c // BLOCK, c % BLOCK
            for channel in range(3):
                pixels[row, c, channel] = plane[row, block, channel, m]


@compiled
def add_doubled(coarse, pixels):
    """Add a picture of half the resolution by bilinear interpolation of irradiance, which conserves the flux.

    Parameters
    ----------
    coarse : ndarray, shape (ceil(H / 2), ceil(W / 2), 3), float32
        Flux per pixel.
    pixels : ndarray, shape (H, W, 3), float32
        Added to.
    """
    # the fine pixels' centres lie a quarter coarse pixel from the coarse centre in each direction, so the weights are
    # products of 3/4 and 1/4 over the four fine pixels of a coarse one
    own, mixed, other = np.float32(0.140625), np.float32(0.046875), np.float32(0.015625)
    last_row, last_column = coarse.shape[0] - 1, coarse.shape[1] - 1
    for row in range(pixels.shape[0]):
        r = row // 2
        beside = min(max(r + 2 * (row % 2) - 1, 0), last_row)
        for c in range(pixels.shape[1]):
            k = c // 2
            next_to = min(max(k + 2 * (c % 2) - 1, 0), last_column)
            for channel in range(3):
                pixels[row, c, channel] += (
                    own * coarse[r, k, channel]
                    + mixed * (coarse[beside, k, channel] + coarse[r, next_to, channel])
                    + other * coarse[beside, next_to, channel]
                )
