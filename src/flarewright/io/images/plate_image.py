"""Read images in the frame of the rendered picture: mattes and depth plates, cached by path and time."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import ProjectError, raised_as
from ...typing import Pixels
from ..files.door import no_file, outside
from .foreign_exr import read_exr_plane
from .half import HALF_MAX
from .mask_image import read_grey

# pixels a side
LARGEST = 16384
# names of depth channels, in order of preference
DEPTH_NAMES = (("Z",), ("depth",), ("depth.Z",), ("Depth.Z",), ("R",))


def check_header(path: str | os.PathLike[str]) -> None:
    """Raise ProjectError for a file that is missing, no picture or too large, by its header alone."""
    with raised_as(ProjectError), outside(path, "a holdout", pixel_bytes=4, remedy="give a PNG or EXR file"):
        pass


def read_matte(path: str | os.PathLike[str]) -> Pixels:
    """Read a grey image as transmittance; white is 1.

    Parameters
    ----------
    path : path
        PNG, TIFF, JPEG (by Pillow) or EXR; colour is averaged; a single EXR channel can have any name.

    Returns
    -------
    ndarray, shape (H, W), float32
        In [0, 1], row 0 at the top.

    Raises
    ------
    ProjectError
        When the file is missing, not an image, too large, or has values that are not finite.
    """
    place = Path(path)
    _check(place, "image", "give the path of a PNG or EXR file")
    return _matte(str(place), place.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _matte(path: str, _: int) -> Pixels:
    with raised_as(ProjectError):
        grey = read_grey(Path(path), np.float32)
    if not np.isfinite(grey).all():
        raise ProjectError(f"{path}: the holdout image has infinite or NaN values; give 0 to 1")
    return _sized(path, np.clip(grey, 0.0, 1.0, out=grey))


def read_depth(path: str | os.PathLike[str]) -> Pixels:
    """Read a depth plate.

    Parameters
    ----------
    path : path
        EXR with a channel Z or depth, or a single channel.

    Returns
    -------
    ndarray, shape (H, W), float32
        In the file's unit, row 0 at the top; infinite where there is no object.

    Raises
    ------
    ProjectError
        When the file is missing, not an EXR file, too large, or has no depth channel.
    """
    place = Path(path)
    _check(place, "depth plate", "give the path of an EXR file")
    return _depth(str(place), place.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _depth(path: str, _: int) -> Pixels:
    with raised_as(ProjectError):
        depth = read_exr_plane(path, DEPTH_NAMES, "a depth plate")
    empty = ~np.isfinite(depth) | (depth <= 0.0) | (depth == HALF_MAX)
    return _sized(path, np.where(empty, np.inf, depth))


def _check(place: Path, what: str, remedy: str) -> None:
    if not place.is_file():
        raise ProjectError(f"the holdout {what} {place} {no_file(place)}; {remedy}")


def _sized(path: str, pixels: NDArray[np.floating]) -> Pixels:
    if max(pixels.shape) > LARGEST:
        raise ProjectError(
            f"{path}: a holdout has no more than {LARGEST} pixels a side, this one is "
            f"{pixels.shape[1]}x{pixels.shape[0]}; give a smaller one"
        )
    plane = np.asarray(pixels, dtype=np.float32)
    plane.flags.writeable = False
    return plane
