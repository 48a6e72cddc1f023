"""Read a picture in colour, a photograph in linear numbers or an image for a screen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from .photo import open_photo

SCREEN = (".png", ".jpg", ".jpeg", ".webp")


def read_picture(path: Path) -> NDArray[np.float32]:
    """Read a picture as linear red, green and blue.

    Parameters
    ----------
    path : Path
        What `io.photo.open_photo` reads, or an image of eight bits (PNG, JPEG, WebP), whose sRGB is undone.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Row 0 up, black taken off.

    Raises
    ------
    FlarewrightError
        When the file is missing or no picture.
    """
    if path.suffix.lower() not in SCREEN:
        photo = open_photo(path)
        pixels = photo.rows(0, photo.size_px[1]) - np.array(photo.black_level, dtype=np.float32)
        return np.asarray(np.nan_to_num(pixels), dtype=np.float32)
    if not path.is_file():
        raise FlarewrightError(f"{path} does not exist: check the path and the spelling")
    from PIL import Image

    try:
        with Image.open(path) as image:
            coded = np.asarray(image.convert("RGB"), dtype=np.float32) / np.float32(255.0)
    except (OSError, ValueError, SyntaxError) as error:
        raise FlarewrightError(f"{path}: this cannot be read as an image ({error}); give PNG, JPEG or EXR") from None
    # IEC 61966-2-1
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4).astype(np.float32)
