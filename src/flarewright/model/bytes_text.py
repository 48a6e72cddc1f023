"""Bytes as text for JSON files: zlib, then base64."""

from __future__ import annotations

import base64
import zlib

# level 9 shortens the text by 2 % and takes three to nine times as long
_LEVEL = 6
_REMEDY = "the file was edited or written by another flarewright version; run measure run again"


def encode_bytes(whole: bytes) -> str:
    """Return bytes as base64 text of their zlib stream."""
    return base64.b64encode(zlib.compress(whole, _LEVEL)).decode("ascii")


def decode_bytes(text: str, size: int, what: str) -> bytes:
    """Return the bytes that `encode_bytes` encoded.

    Parameters
    ----------
    text : str
    size : int
        Expected number of bytes.
    what : str
        Plural noun for error messages.

    Raises
    ------
    ValueError
        When the text is not base64 of zlib, or holds another number of bytes.
    """
    try:
        # limit the output: a few bytes can decompress to more than the memory holds
        whole = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), size + 1)
    except (ValueError, zlib.error):
        raise ValueError(f"{what} are not base64 of zlib: {_REMEDY}") from None
    if len(whole) != size:
        found = f"{len(whole)}" if len(whole) < size else f"more than {size}"
        raise ValueError(f"{what} hold {found} bytes instead of {size}: {_REMEDY}")
    return whole
