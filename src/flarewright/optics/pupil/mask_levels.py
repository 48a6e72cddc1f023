"""Resolution pyramid of an iris image for the kernels, with a table of its uniform areas."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...kernels.raster.stop_pattern import AT_X, AT_Y, COLUMNS, CORNERS, FIRST, PER_MM_X, PER_MM_Y, ROWS, TABLE_COLUMNS
from ...typing import Floats, Indices, Pixels

Kind = TypeVar("Kind", np.float32, np.float64)
MaskLevels = tuple[Pixels, Floats, Indices]

# least number of samples per side of a level
FEWEST = 4


def mask_levels(mask: Floats, half: float) -> MaskLevels:
    """Build the resolution pyramid of a mask.

    Parameters
    ----------
    mask : ndarray, shape (A, B)
        Transmittance, row 0 at the top.
    half : float
        The mask spans [-half, half] in the stop, mm.

    Returns
    -------
    values : ndarray, shape (P,), float32
        All levels, concatenated.
    levels : ndarray, shape (L, TABLE_COLUMNS)
        Their positions (`kernels.raster.stop_pattern`).
    changes : ndarray, shape (A, B), int64
        At [r, c], the number of samples above r and left of c that differ from their neighbour on the right, below, or
        below on the right: where a rectangle has none, the mask is uniform.

    Notes
    -----
    Each sample is the mean of four; an odd side repeats its last sample.
    `tests/kernels/raster/test_iris_mask.py` compares with means over pixels.
    """
    rows, columns = mask.shape
    per_mm = 0.5 * columns / half, -0.5 * rows / half
    middle = 0.5 * columns - 0.5, 0.5 * rows - 0.5
    parts: list[Pixels] = []
    table: list[Floats] = []
    first = 0
    level = np.asarray(mask, dtype=np.float32)
    while True:
        row, times = np.zeros(TABLE_COLUMNS), 2.0 ** len(table)
        row[[FIRST, ROWS, COLUMNS, CORNERS]] = first, *level.shape, -1.0
        row[[PER_MM_X, PER_MM_Y]] = np.array(per_mm) / times
        row[[AT_X, AT_Y]] = (np.array(middle) + 0.5) / times - 0.5
        table.append(row)
        parts.append(level.ravel())
        first += level.size
        if min(level.shape) < 2 * FEWEST:
            break
        level = halved(level)
    return np.concatenate(parts), np.stack(table), _changes(mask)


def halved(level: NDArray[Kind]) -> NDArray[Kind]:
    """Return means of two by two samples; an odd side repeats its last sample."""
    level = (
        np.pad(level, [(0, side % 2) for side in level.shape], mode="edge") if any(np.mod(level.shape, 2)) else level
    )
    mean = level[0::2] + level[1::2]
    mean = mean[:, 0::2] + mean[:, 1::2]
    mean *= np.asarray(0.25, dtype=mean.dtype)
    return mean


def _changes(mask: Floats) -> Indices:
    here = mask[:-1, :-1]
    differs = (here != mask[:-1, 1:]) | (here != mask[1:, :-1]) | (here != mask[1:, 1:])
    sums = np.zeros(mask.shape, dtype=np.int64)
    np.cumsum(differs, axis=1, out=sums[1:, 1:])
    np.cumsum(sums[1:], axis=0, out=sums[1:])
    return sums
