"""Read a colour picture: a photograph with linear values, or an sRGB image."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...typing import Pixels
from ..files.door import outside
from .photo import open_photo

SCREEN = (".png", ".jpg", ".jpeg", ".webp")


def read_picture(path: Path) -> Pixels:
    """Read a picture as linear red, green and blue.

    Parameters
    ----------
    path : Path
        A file that `io.images.photo.open_photo` reads, or an 8-bit image (PNG, JPEG, WebP), which is decoded from sRGB.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Row 0 at the top, black level subtracted.

    Raises
    ------
    FlarewrightError
        When the file is missing or not a picture.
    """
    if path.suffix.lower() not in SCREEN:
        photo = open_photo(path)
        pixels = photo.rows(0, photo.size_px[1]) - np.array(photo.black_level, dtype=np.float32)
        return np.asarray(np.nan_to_num(pixels), dtype=np.float32)
    from PIL import Image

    with outside(path, "an image", pixel_bytes=16, remedy="give PNG, JPEG or EXR") as file, Image.open(file) as image:
        coded = np.asarray(image.convert("RGB"), dtype=np.float32) / np.float32(255.0)
    return decode_srgb(coded)


def decode_srgb(coded: Pixels) -> Pixels:
    """Return the linear values of an sRGB image of codes from 0 to 1 (IEC 61966-2-1)."""
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4).astype(np.float32)
