"""Read an image that stands for the iris."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from .exr import read_exr_plane

# a finer mask only costs time: its edges are antialiased
LARGEST = 4096


def read_mask(path: str | Path, what: str = "iris") -> NDArray[np.float64]:
    """Read a grey image as transmittance.

    Parameters
    ----------
    path : str or Path
        PNG, TIFF, JPEG (by Pillow) or EXR; colour is averaged, white transmits (`read_grey`).
    what : str
        What it is an image of, for messages.

    Returns
    -------
    ndarray, shape (A, B), float64
        In [0, 1], row 0 up.

    Raises
    ------
    ProjectError
        When the file is missing, no image, too large, or transmits nothing.
    """
    place = Path(path)
    if not place.is_file():
        raise ProjectError(f"{place}: there is no such {what} image; give the path of a PNG or EXR file")
    try:
        grey = read_grey(place)
    except (OSError, ValueError, SyntaxError) as error:
        raise ProjectError(f"{place}: this cannot be read as an image ({error}); give a PNG or EXR file") from error
    if min(grey.shape) < 2 or max(grey.shape) > LARGEST:
        raise ProjectError(
            f"{place}: an image of the {what} has 2 to {LARGEST} pixels a side, "
            f"this one is {grey.shape[1]}x{grey.shape[0]}"
        )
    grey = np.clip(grey, 0.0, 1.0)
    if not np.isfinite(grey).all() or grey.max() <= 0.0:
        raise ProjectError(f"{place}: the {what} image is black or not finite, so no light passes; white transmits")
    return grey


def read_grey(path: Path) -> NDArray[np.float64]:
    """Read a picture as grey, white 1; whatever the reader raises goes on to the caller, who knows what it is for.

    Where all that is not clear has one colour, alpha is the picture: a shape is told by it alone. The colour of what is
    clear is seen by nobody and says nothing. Else alpha is not looked at.
    """
    grey, alpha = _read_exr(path) if path.suffix.lower() == ".exr" else _read_picture(path)
    if alpha is None or np.ptp(alpha) == 0.0:
        return grey
    return alpha if np.ptp(grey[alpha > 0.0]) == 0.0 else grey


def _read_picture(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    from PIL import Image

    with Image.open(path) as image:
        deep = image.mode in ("I;16", "I", "F")
        grey = np.asarray(image if deep else image.convert("L"), dtype=np.float64)
        top = 1.0 if image.mode == "F" else (65535.0 if deep else 255.0)
        alpha = None
        if image.has_transparency_data and not deep:
            alpha = np.asarray(image.convert("RGBA").getchannel("A"), dtype=np.float64) / 255.0
    return grey / top, alpha


def _read_exr(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    # a matte may have one channel, or grey with alpha
    grey = read_exr_plane(path, (("R", "G", "B"), ("Y",), ("R",), ("A",)))
    try:
        alpha = read_exr_plane(path, (("A",),))
    except ValueError:
        return grey, None
    return grey, alpha if alpha.shape == grey.shape else None
