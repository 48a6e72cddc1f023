"""Average pictures over blocks of pixels."""

from __future__ import annotations

from functools import partial, reduce
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ...typing import Floats


def binned(pixels: NDArray[Any], block: int, dtype: DTypeLike = np.float64) -> Floats:
    """Average a picture, shape (H, W, ...), over blocks of pixels; incomplete blocks at the border are dropped."""
    height, width = (side // block * block for side in pixels.shape[:2])
    added = partial(np.add, dtype=dtype)
    # rows first, then columns: several times as fast as NumPy's mean over both
    rows = reduce(added, (pixels[k:height:block, :width] for k in range(block)))
    return np.asarray(reduce(added, (rows[:, k::block] for k in range(block))) / block**2, dtype=dtype)
