"""PNG files of samples: another reader sees the same numbers."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from flarewright.errors import FlarewrightError
from flarewright.io.images.sample_png import encode_samples

RANDOM = np.random.default_rng(3)


@pytest.mark.parametrize(("dtype", "shape"), [("u1", (5, 7)), ("u1", (6, 4, 3)), ("u2", (5, 7)), ("u1", (1, 1, 3))])
def test_pillow_reads_what_was_written(dtype, shape):
    samples = RANDOM.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    with Image.open(io.BytesIO(encode_samples(samples))) as image:
        assert np.array_equal(np.asarray(image), samples)


def test_colours_of_sixteen_bits_keep_all_bits():
    samples = RANDOM.integers(0, 65535, (9, 5, 3), np.uint16, endpoint=True)
    data = encode_samples(samples)
    # Pillow keeps the upper byte of RGB
    with Image.open(io.BytesIO(data)) as image:
        assert np.array_equal(np.asarray(image), samples >> 8)
    width, height, bits, colour = struct.unpack(">IIBB", data[16:26])
    assert (width, height, bits, colour) == (5, 9, 16, 2)
    start = data.index(b"IDAT")
    (size,) = struct.unpack(">I", data[start - 4 : start])
    lines = np.frombuffer(zlib.decompress(data[start + 4 : start + 4 + size]), np.uint8).reshape(9, -1)
    assert set(lines[:, 0]) == {1}
    # undo the filter: each byte adds to that of the pixel on its left
    rows = np.cumsum(lines[:, 1:].reshape(9, 5, 6), axis=1, dtype=np.uint8)
    assert np.array_equal(np.ascontiguousarray(rows).view(">u2").reshape(9, 5, 3), samples)


@pytest.mark.parametrize("samples", [np.zeros((2, 2, 4), np.uint8), np.zeros((2, 2)), np.zeros(3, np.uint8)])
def test_other_shapes_and_types_are_refused(samples):
    with pytest.raises(FlarewrightError, match="8- or 16-bit grey or RGB samples"):
        encode_samples(samples)
