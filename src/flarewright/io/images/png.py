"""PNG files of 8-bit RGB with a few words about them."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from io import BytesIO
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ..files.atomic_write import write_bytes_atomically
from ..files.door import printable

# the rendering intent "perceptual" of the sRGB chunk
_PERCEPTUAL = b"\0"


def write_png(path: str | PathLike[str], rgb_uint8: NDArray[np.uint8], text: Mapping[str, str]) -> None:
    """Write an 8-bit sRGB picture.

    Parameters
    ----------
    path : path
    rgb_uint8 : ndarray, shape (height, width, 3), uint8
        sRGB-encoded; row 0 is the top.
    text : mapping of str to str
        Keyword (1 to 79 characters) and text: the view, the version of the program.

    Raises
    ------
    OutputError
        When the file cannot be written.
    FlarewrightError
        When the picture has another shape or type.
    """
    data = encode_png(rgb_uint8, text)

    write_bytes_atomically(Path(path), data)


def encode_png(rgb_uint8: NDArray[np.uint8], text: Mapping[str, str]) -> bytes:
    """Return a picture as the bytes of a PNG file; parameters and errors as `write_png`."""
    rgb = rgb_uint8
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or rgb.size == 0:
        raise FlarewrightError(
            f"a PNG is made of 8-bit RGB pixels, shape (height, width, 3), not {rgb.dtype} {rgb.shape}"
        )
    # a second's start counts: commands that write no PNG do not load it
    from PIL import Image, PngImagePlugin

    info = PngImagePlugin.PngInfo()
    info.add(b"sRGB", _PERCEPTUAL)
    for keyword, words in text.items():
        info.add_text(keyword[:79], printable(words))
    data = BytesIO()
    Image.fromarray(rgb).save(data, "PNG", pnginfo=info)
    return data.getvalue()


def png_address(picture: NDArray[np.uint8] | bytes) -> str:
    """Return a picture, as pixels or as a PNG file, as a data URL."""
    data = picture if isinstance(picture, bytes) else encode_png(picture, {})
    return f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}"
