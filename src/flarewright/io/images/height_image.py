"""Read an image of a surface's figure error."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import LensError, raised_as
from ...typing import Floats
from ..files.door import no_file
from .mask_image import LARGEST, read_grey

MOST_KNOTS = 128
"""Samples per side; detail finer than 1/128 of the diameter is scatter, not figure, and is averaged."""


def read_heights(path: str | Path) -> tuple[tuple[float, ...], ...]:
    """Read a grey image as normalized heights, black 0 and white 1.

    Parameters
    ----------
    path : str or Path
        PNG, TIFF, JPEG (by Pillow) or EXR; colour is averaged. Seen from behind the camera, row 0 at the top. The image
        is stretched to the square around the surface.

    Returns
    -------
    tuple of tuple of float
        Square; [i][j] is sample i from the left and j from the bottom.

    Raises
    ------
    LensError
        When the file is missing, not an image, or too large.
    """
    place = Path(path)
    if not place.is_file():
        raise LensError(f"the figure image {place} {no_file(place)}; give the path of a PNG or EXR file")
    with raised_as(LensError):
        grey = read_grey(place)
    if min(grey.shape) < 4 or max(grey.shape) > LARGEST:
        raise LensError(
            f"{place}: a figure image has 4 to {LARGEST} pixels a side, this one is {grey.shape[1]}x{grey.shape[0]}"
        )
    if not np.isfinite(grey).all():
        raise LensError(f"{place}: the figure image has infinite or NaN values; give finite ones")
    side = min(MOST_KNOTS, max(grey.shape))
    even = _mean_over(_mean_over(np.clip(grey, 0.0, 1.0), side).T, side)
    # transpose and flip: image rows run from the top down, samples from the left, then from the bottom
    return tuple(tuple(column.tolist()) for column in even[:, ::-1])


def _mean_over(rows: Floats, side: int) -> Floats:
    """Resample the first axis to `side` samples by area averaging."""
    count = rows.shape[0]
    cumulative = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    edges = np.linspace(0.0, count, side + 1)
    low = np.minimum(edges.astype(np.int64), count - 1)
    at = cumulative[low] + (edges - low)[:, None] * rows[low]
    mean: Floats = np.diff(at, axis=0) * (side / count)
    return mean
