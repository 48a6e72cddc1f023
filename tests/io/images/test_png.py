"""PNG files, decoded here by the specification's rules with zlib alone."""

import struct
import zlib

import numpy as np
import pytest

from flarewright.errors import FlarewrightError, OutputError
from flarewright.io.images.png import write_png


def chunks(data):
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, found = 8, []
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        found.append((kind, body))
        at += 12 + length
    return found


def decoded(data, shape):
    """Undo the filters of an image's rows (PNG specification, third edition, 9.2)."""
    height, width, channels = shape
    pixels = np.zeros((height + 1, width + 1, channels), np.int64)
    rows = np.frombuffer(data, np.uint8).reshape(height, 1 + width * channels)
    for y, row in enumerate(rows, 1):
        for x, part in enumerate(row[1:].reshape(width, channels).astype(np.int64), 1):
            left, above, corner = pixels[y, x - 1], pixels[y - 1, x], pixels[y - 1, x - 1]
            estimate = left + above - corner
            distances = np.abs(estimate - np.stack([left, above, corner]))
            paeth = np.choose(distances.argmin(axis=0), [left, above, corner])
            guess = (np.zeros(channels, np.int64), left, above, (left + above) // 2, paeth)[row[0]]
            pixels[y, x] = (part + guess) % 256
    return pixels[1:, 1:].astype(np.uint8)


@pytest.mark.parametrize("shape", [(1, 1, 3), (7, 5, 3), (12, 40, 3)])
def test_pixels_and_text_come_back(tmp_path, shape):
    rgb = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    write_png(tmp_path / "a.png", rgb, {"Description": "exposure +1.00 stops", "Comment": "λ = 550 nm"})
    found = chunks((tmp_path / "a.png").read_bytes())
    assert [kind for kind, _ in found] == [b"IHDR", b"sRGB", b"tEXt", b"iTXt", b"IDAT", b"IEND"]
    assert struct.unpack(">IIBBBBB", found[0][1]) == (shape[1], shape[0], 8, 2, 0, 0, 0)
    assert found[2][1] == b"Description\0exposure +1.00 stops"
    assert found[3][1] == b"Comment\0\0\0\0\0" + "λ = 550 nm".encode()
    np.testing.assert_array_equal(decoded(zlib.decompress(found[4][1]), shape), rgb)


def test_wrong_pictures_and_places_are_one_sentence(tmp_path):
    with pytest.raises(FlarewrightError, match="8-bit RGB"):
        write_png(tmp_path / "a.png", np.zeros((2, 2, 3), np.float32), {})
    with pytest.raises(OutputError, match="does not exist"):
        write_png(tmp_path / "no" / "a.png", np.zeros((2, 2, 3), np.uint8), {})
