"""Read an image of the iris or of dirt as transmittance."""

from __future__ import annotations

from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import ProjectError, raised_as
from ...typing import Floats
from ..files.door import no_file, outside
from .foreign_exr import read_exr_grey

# finer masks cost time without benefit: edges are antialiased
LARGEST = 4096


def read_mask(path: str | Path, what: str = "iris") -> Floats:
    """Read a grey image as transmittance.

    Parameters
    ----------
    path : str or Path
        PNG, TIFF, JPEG (by Pillow) or EXR; colour is averaged, white transmits (`read_grey`).
    what : str
        Subject of the image, for messages.

    Returns
    -------
    ndarray, shape (A, B), float64
        In [0, 1], row 0 up.

    Raises
    ------
    ProjectError
        When the file is missing, not an image, too large, or black.
    """
    place = Path(path)
    if not place.is_file():
        raise ProjectError(f"the {what} image {place} {no_file(place)}; give the path of a PNG or EXR file")
    with raised_as(ProjectError):
        read = read_grey(place)
    if min(read.shape) < 2 or max(read.shape) > LARGEST:
        raise ProjectError(
            f"{place}: an image of the {what} has 2 to {LARGEST} pixels a side, "
            f"this one is {read.shape[1]}x{read.shape[0]}"
        )
    grey: Floats = np.clip(read, 0.0, 1.0)
    if not np.isfinite(grey).all() or grey.max() <= 0.0:
        raise ProjectError(f"{place}: the {what} image is black or not finite, so no light passes; white transmits")
    return grey


def read_grey(path: Path, dtype: type[np.floating[Any]] = np.float64) -> NDArray[Any]:
    """Read a picture as grey of a floating-point type, white 1; raises FileError for a file that is no picture.

    An alpha channel is the picture when all pixels that are not transparent have one colour: then only alpha holds the
    shape. Otherwise alpha is ignored. The colour of transparent pixels never counts.
    """
    if path.suffix.lower() == ".exr":
        grey, alpha = _read_exr(path, dtype)
    else:
        claim = 2 * np.dtype(dtype).itemsize
        with outside(path, "an image", pixel_bytes=claim, remedy="give a PNG or EXR file") as file:
            grey, alpha = _read_picture(file, dtype)
    if alpha is None or np.ptp(alpha) == 0.0:
        return grey
    return alpha if np.ptp(grey[alpha > 0.0]) == 0.0 else grey


def _read_picture(file: BinaryIO, dtype: type[np.floating[Any]]) -> tuple[NDArray[Any], NDArray[Any] | None]:
    from PIL import Image

    with Image.open(file) as image:
        deep = image.mode in ("I;16", "I", "F")
        grey = np.asarray(image if deep else image.convert("L"), dtype=dtype)
        top = 1.0 if image.mode == "F" else (65535.0 if deep else 255.0)
        alpha = None
        if image.has_transparency_data and not deep:
            alpha = np.asarray(image.convert("RGBA").getchannel("A"), dtype=dtype) / dtype(255.0)
    return np.divide(grey, dtype(top), out=grey if grey.flags.writeable else None), alpha


def _read_exr(path: Path, dtype: type[np.floating[Any]]) -> tuple[NDArray[Any], NDArray[Any] | None]:
    # a matte can have one channel, or grey with alpha
    grey, alpha = read_exr_grey(path, (("R", "G", "B"), ("Y",), ("R",), ("A",)))
    kept = None if alpha is None or alpha.shape != grey.shape else alpha.astype(dtype, copy=False)
    return grey.astype(dtype, copy=False), kept
