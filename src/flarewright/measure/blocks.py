"""Pictures in larger pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def reduced(pixels: NDArray[np.generic], block: int) -> Floats:
    """Return a picture averaged over blocks of pixels, shape (H, W, 3); what fills no whole block is left out."""
    height, width = pixels.shape[0] // block, pixels.shape[1] // block
    part = pixels[: height * block, : width * block].astype(np.float64)
    return np.asarray(part.reshape(height, block, width, block, 3).mean(axis=(1, 3)))
