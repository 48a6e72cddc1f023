"""PNG files, decoded here by the specification's rules with zlib alone."""

import struct
import zlib

import numpy as np
import pytest

from flarewright.errors import FlarewrightError, OutputError
from flarewright.io.png import write_png


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


@pytest.mark.parametrize("shape", [(1, 1, 3), (7, 5, 3), (40, 300, 3)])
def test_pixels_and_text_come_back(tmp_path, shape):
    rgb = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    write_png(tmp_path / "a.png", rgb, {"Description": "exposure +1.00 stops", "Comment": "λ = 550 nm"})
    found = chunks((tmp_path / "a.png").read_bytes())
    assert [kind for kind, _ in found] == [b"IHDR", b"sRGB", b"tEXt", b"iTXt", b"IDAT", b"IEND"]
    assert struct.unpack(">IIBBBBB", found[0][1]) == (shape[1], shape[0], 8, 2, 0, 0, 0)
    assert found[2][1] == b"Description\0exposure +1.00 stops"
    assert found[3][1] == b"Comment\0\0\0\0\0" + "λ = 550 nm".encode()
    rows = np.frombuffer(zlib.decompress(found[4][1]), np.uint8).reshape(shape[0], -1)
    assert (rows[:, 0] == 2).all()
    decoded = np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(shape)
    np.testing.assert_array_equal(decoded, rgb)


def test_wrong_pictures_and_places_are_one_sentence(tmp_path):
    with pytest.raises(FlarewrightError, match="8-bit RGB"):
        write_png(tmp_path / "a.png", np.zeros((2, 2, 3), np.float32), {})
    with pytest.raises(OutputError, match="does not exist"):
        write_png(tmp_path / "no" / "a.png", np.zeros((2, 2, 3), np.uint8), {})
