"""Light to the codes of a screen, in one sweep over the pixels."""

import numpy as np

from ._jit import compiled


@compiled
def encode_sum(ghosts, ghost_gain, rest, rest_gain, corner, codes, following, out):
    """Add two pictures and look their codes up.

    Parameters
    ----------
    ghosts : ndarray, shape (H, W, 3), float32
    ghost_gain, rest_gain : ndarray, shape (3,), float32
        Exposure included.
    rest : ndarray, shape (H', W', 3), float32
        At least as large.
    corner : tuple of int
        Row and column of `rest` that lie on the first pixel.
    codes : ndarray, shape (N + 1,), uint8
        Code at the lower end of each of N even cells of [0, 1].
    following : ndarray, shape (256,), float32
        Least value of the code after each; no cell holds more than two codes.
    out : ndarray, shape (H, W, 3), uint8
    """
    top, left = corner
    cells = np.float32(codes.shape[0] - 1)
    zero, one = np.float32(0.0), np.float32(1.0)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for c in range(3):
                light = ghosts[i, j, c] * ghost_gain[c] + rest[top + i, left + j, c] * rest_gain[c]
                # what is no number is dark
                light = min(light, one) if light > zero else zero
                code = codes[np.int64(light * cells)]
                out[i, j, c] = code + (light >= following[code])
