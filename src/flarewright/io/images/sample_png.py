"""PNG files of training data: 8 or 16 bits a sample, grey or RGB, quickly.

Pillow writes no RGB of 16 bits, and takes seven times as long for a noisy picture.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from ...errors import FlarewrightError

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_GREY, _RGB = 0, 2
# filter type "Sub": each byte less that of the pixel on its left
_SUB = 1


def encode_samples(samples: NDArray[Any]) -> bytes:
    r"""Return a picture as the bytes of a PNG file.

    Parameters
    ----------
    samples : ndarray, shape (height, width) or (height, width, 3), uint8 or uint16
        Row 0 is the top.

    Raises
    ------
    FlarewrightError
        The picture has another shape or type.

    Notes
    -----
    ISO/IEC 15948, filter "Sub". ISA-L packs a noisy picture in a third of the time of zlib's run lengths, 5 % larger,
    and a smooth one in a fifth, 10 % smaller.

    Examples
    --------
    >>> import numpy as np
    >>> encode_samples(np.zeros((2, 2, 3), np.uint16))[:4]
    b'\x89PNG'
    """
    grey = samples.ndim == 2
    if not (grey or (samples.ndim == 3 and samples.shape[2] == 3)) or samples.dtype not in (np.uint8, np.uint16):
        raise FlarewrightError(
            f"a PNG is made of 8- or 16-bit grey or RGB samples, not of {samples.dtype} {samples.shape}"
        )
    height, width = samples.shape[:2]
    # big-endian, as a row of bytes
    rows = np.ascontiguousarray(samples, samples.dtype.newbyteorder(">")).view(np.uint8).reshape(height, -1)
    step = samples.dtype.itemsize * (1 if grey else 3)
    lines = np.empty((height, 1 + rows.shape[1]), np.uint8)
    lines[:, 0] = _SUB
    lines[:, 1 : 1 + step] = rows[:, :step]
    np.subtract(rows[:, step:], rows[:, :-step], out=lines[:, 1 + step :])
    data = isal_zlib.compress(lines, 1)
    head = struct.pack(">IIBBBBB", width, height, 8 * samples.dtype.itemsize, _GREY if grey else _RGB, 0, 0, 0)
    return _SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", isal_zlib.crc32(data, isal_zlib.crc32(kind)))
