"""PNG files of 8-bit RGB, written with the standard library alone."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from .atomic import write_atomically

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def write_png(path: str | PathLike[str], rgb_uint8: NDArray[np.uint8], text: Mapping[str, str]) -> None:
    """Write an 8-bit sRGB picture with a few words about it.

    Parameters
    ----------
    path : path
    rgb_uint8 : ndarray, shape (height, width, 3), uint8
        sRGB-encoded; row 0 is the top.
    text : mapping of str to str
        Keyword (1 to 79 characters) and text: the stated view, the program's version.

    Raises
    ------
    OutputError
        When the file cannot be written.
    FlarewrightError
        When the picture has another shape or type.

    Notes
    -----
    PNG specification, third edition: chunks (5.3), filter type 2 "Up" (9.2), tEXt and iTXt (11.3.3).
    """
    data = encode_png(rgb_uint8, text)

    def write(temporary: Path) -> None:
        temporary.write_bytes(data)

    write_atomically(Path(path), write)


def encode_png(rgb_uint8: NDArray[np.uint8], text: Mapping[str, str]) -> bytes:
    """Return a picture as the bytes of a PNG file; parameters, errors and source as `write_png`."""
    rgb = rgb_uint8
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or rgb.size == 0:
        raise FlarewrightError(
            f"a PNG is made of 8-bit RGB pixels, shape (height, width, 3), not {rgb.dtype} {rgb.shape}"
        )
    height, width, _ = rgb.shape
    rows = rgb.reshape(height, width * 3)
    # The difference to the row above (modulo 256) is small in smooth pictures, so it packs well.
    filtered = np.empty((height, 1 + width * 3), np.uint8)
    filtered[:, 0] = 2
    filtered[0, 1:] = rows[0]
    filtered[1:, 1:] = rows[1:] - rows[:-1]
    chunks = [_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), _chunk(b"sRGB", b"\0")]
    chunks += [_text_chunk(keyword, words) for keyword, words in text.items()]
    chunks += [_chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)), _chunk(b"IEND", b"")]
    return _SIGNATURE + b"".join(chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _text_chunk(keyword: str, words: str) -> bytes:
    key = keyword.encode("latin-1", "replace")[:79]
    try:
        return _chunk(b"tEXt", key + b"\0" + words.encode("latin-1"))
    except UnicodeEncodeError:
        # iTXt: no compression, no language, no translated keyword, then UTF-8.
        return _chunk(b"iTXt", key + b"\0\0\0\0\0" + words.encode("utf-8"))
