"""Read an image that stands for the figure error of a surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import LensError
from .mask_image import LARGEST, read_grey

Floats = NDArray[np.float64]

MOST_KNOTS = 128
"""Heights a side: finer detail than 1/128 of the diameter is scatter, not figure, and is averaged."""


def read_heights(path: str | Path) -> tuple[tuple[float, ...], ...]:
    """Read a grey image as heights, black 0 and white 1.

    Parameters
    ----------
    path : str or Path
        PNG, TIFF, JPEG (by Pillow) or EXR; colour is averaged. Seen from behind the camera, row 0 up; a picture that is
        not square is stretched over the square around the surface.

    Returns
    -------
    tuple of tuple of float
        Square: [i][j] lies at x from the left and y from the bottom.

    Raises
    ------
    LensError
        When the file is missing, no image, or too large.
    """
    place = Path(path)
    if not place.is_file():
        raise LensError(f"{place}: there is no such figure image; give the path of a PNG or EXR file")
    try:
        grey = read_grey(place)
    except (OSError, ValueError, SyntaxError) as error:
        raise LensError(f"{place}: this cannot be read as an image ({error}); give a PNG or EXR file") from error
    if min(grey.shape) < 4 or max(grey.shape) > LARGEST:
        raise LensError(
            f"{place}: a figure image has 4 to {LARGEST} pixels a side, this one is {grey.shape[1]}x{grey.shape[0]}"
        )
    if not np.isfinite(grey).all():
        raise LensError(f"{place}: the figure image holds values that are no numbers")
    side = min(MOST_KNOTS, max(grey.shape))
    even = _mean_over(_mean_over(np.clip(grey, 0.0, 1.0), side).T, side)
    # its rows are the picture's columns now, left to right; the picture's rows run from the top down
    return tuple(tuple(column.tolist()) for column in even[:, ::-1])


def _mean_over(rows: Floats, side: int) -> Floats:
    """Resample the first axis to `side` samples, each the mean over what it covers."""
    count = rows.shape[0]
    cumulative = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    edges = np.linspace(0.0, count, side + 1)
    low = np.minimum(edges.astype(np.int64), count - 1)
    at = cumulative[low] + (edges - low)[:, None] * rows[low]
    mean: Floats = np.diff(at, axis=0) * (side / count)
    return mean
