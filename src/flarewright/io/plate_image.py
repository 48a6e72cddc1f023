"""Read images in the picture's frame: mattes and depth plates."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from .exr import read_exr_plane
from .half import HALF_MAX
from .mask_image import read_grey

# pixels a side
LARGEST = 16384
# names of depth, in the order in which they are looked for
DEPTH_NAMES = (("Z",), ("depth",), ("depth.Z",), ("Depth.Z",), ("R",))

__all__ = ["read_depth", "read_matte"]


def read_matte(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """Read a grey image; white is 1.

    Parameters
    ----------
    path : path
        PNG, TIFF, JPEG (by Pillow) or EXR; colour is averaged, an EXR of one channel may call it what it likes.

    Returns
    -------
    ndarray, shape (H, W), float32
        In [0, 1], row 0 up.

    Raises
    ------
    ProjectError
        When the file is missing, no image, too large, or holds what is no number.
    """
    place = Path(path)
    _check(place, "image", "give the path of a PNG or EXR file")
    return _matte(str(place), place.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _matte(path: str, _: int) -> NDArray[np.float32]:
    try:
        grey = read_grey(Path(path))
    except (OSError, ValueError, SyntaxError) as error:
        raise ProjectError(f"{path}: this cannot be read as an image ({error}); give a PNG or EXR file") from error
    if not np.isfinite(grey).all():
        raise ProjectError(f"{path}: the holdout image holds values that are no numbers; give 0 to 1")
    return _sized(path, np.clip(grey, 0.0, 1.0))


def read_depth(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """Read a depth plate.

    Parameters
    ----------
    path : path
        EXR with a channel Z or depth, or a single one.

    Returns
    -------
    ndarray, shape (H, W), float32
        In its own unit, row 0 up; infinite where nothing is.

    Raises
    ------
    ProjectError
        When the file is missing, no EXR file, too large, or has no depth.
    """
    place = Path(path)
    _check(place, "depth plate", "give the path of an EXR file")
    return _depth(str(place), place.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _depth(path: str, _: int) -> NDArray[np.float32]:
    try:
        depth = read_exr_plane(path, DEPTH_NAMES)
    except (OSError, ValueError) as error:
        raise ProjectError(f"{path}: this cannot be read as a depth plate ({error}); give an EXR file") from error
    nothing = ~np.isfinite(depth) | (depth <= 0.0) | (depth == HALF_MAX)
    return _sized(path, np.where(nothing, np.inf, depth))


def _check(place: Path, what: str, remedy: str) -> None:
    if not place.is_file():
        raise ProjectError(f"{place}: there is no such holdout {what}; {remedy}")


def _sized(path: str, pixels: NDArray[np.floating]) -> NDArray[np.float32]:
    if max(pixels.shape) > LARGEST:
        raise ProjectError(
            f"{path}: a holdout has no more than {LARGEST} pixels a side, this one is "
            f"{pixels.shape[1]}x{pixels.shape[0]}; give a smaller one"
        )
    plane = np.asarray(pixels, dtype=np.float32)
    plane.flags.writeable = False
    return plane
