"""Bytes as text in a file: base64 of zlib."""

from __future__ import annotations

import base64
import zlib

# the last level makes texts 2 % shorter, and takes three to nine times as long
_LEVEL = 6
_REMEDY = "the file was changed by hand or made by another flarewright; make it anew (measure run)"


def told_bytes(whole: bytes) -> str:
    """Return bytes as text."""
    return base64.b64encode(zlib.compress(whole, _LEVEL)).decode("ascii")


def read_bytes(text: str, size: int, what: str) -> bytes:
    """Return the bytes that a text tells.

    Parameters
    ----------
    text : str
    size : int
        How many they must be.
    what : str
        Said when they are not.

    Raises
    ------
    ValueError
        When the text is broken, or tells more or fewer.
    """
    try:
        # a few bytes can stand for more than any memory holds
        whole = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), size + 1)
    except (ValueError, zlib.error):
        raise ValueError(f"{what} are not base64 of zlib: {_REMEDY}") from None
    if len(whole) != size:
        found = f"{len(whole)}" if len(whole) < size else f"more than {size}"
        raise ValueError(f"{what} hold {found} bytes instead of {size}: {_REMEDY}")
    return whole
