"""Plates of all kinds of files: layers, data windows, display codes, and what the files state."""

from __future__ import annotations

import struct
import zlib
from fractions import Fraction

import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from flarewright.errors import FileError
from flarewright.io.images.exr import CHROMATICITIES
from flarewright.io.images.plate_picture import read_plate

PIXELS = np.random.default_rng(1).uniform(0.0, 3.0, (6, 8, 3)).astype(np.float32)


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_layers_of_an_exr_file_are_parts_or_beginnings_of_channel_names(tmp_path):
    path = tmp_path / "p.exr"
    channels = {"RGB": PIXELS, "diffuse": 2 * PIXELS}
    OpenEXR.File([OpenEXR.Part({}, channels, "beauty"), OpenEXR.Part({}, {"RGB": 3 * PIXELS}, "sky")]).write(str(path))
    assert np.array_equal(read_plate(path).pixels, PIXELS)
    assert np.array_equal(read_plate(path, layer="diffuse").pixels, 2 * PIXELS)
    assert np.array_equal(read_plate(path, layer="sky").pixels, 3 * PIXELS)
    with pytest.raises(
        FileError, match="no layer 'light' with R, G and B: its layers are beauty, diffuse, sky; choose"
    ):
        read_plate(path, layer="light")


def test_an_exr_file_states_its_rate_time_shape_and_primaries(tmp_path):
    path = tmp_path / "p.exr"
    code = OpenEXR.TimeCode(1, 2, 3, 4, *([0] * 14))
    header = {
        "framesPerSecond": Fraction(24000, 1001), "timeCode": code, "pixelAspectRatio": 2.0,
        "chromaticities": CHROMATICITIES["acescg"], "displayWindow": ((0, 0), (9, 7)), "dataWindow": ((1, 2), (8, 7)),
    }  # fmt: skip
    OpenEXR.File(header, {"RGB": PIXELS.astype(np.float16)}).write(str(path))
    plate = read_plate(path)
    assert (plate.size_px, plate.fps, plate.pixel_aspect) == ((10, 8), Fraction(24000, 1001), 2.0)
    assert (plate.colorspace, plate.white, plate.transfer) == ("acescg", None, "linear")
    assert str(plate.header["timeCode"]) == str(code)
    assert plate.pixels[2:8, 1:9] == pytest.approx(PIXELS, rel=1e-3)
    assert not plate.pixels[:2].any()
    assert plate.window == (slice(2, 8), slice(1, 9))
    strange = {"chromaticities": (0.7, 0.3, 0.2, 0.7, 0.1, 0.05, 0.3127, 0.329)}
    OpenEXR.File(strange, {"RGB": PIXELS}).write(str(path))
    assert "neither Rec.709 nor ACEScg" in read_plate(path).remarks[0]


def test_a_sun_beyond_half_floats_is_bright_and_what_is_no_number_is_black(tmp_path):
    pixels = PIXELS.astype(np.float16)
    pixels[2, 3], pixels[4, 5] = np.inf, np.nan
    OpenEXR.File({}, {"RGB": pixels}).write(str(tmp_path / "p.exr"))
    tifffile.imwrite(tmp_path / "p.tif", pixels.astype(np.float32), photometric="rgb")
    for name in ("p.exr", "p.tif"):
        plate = read_plate(tmp_path / name)
        assert (plate.pixels[2, 3] == 65504.0).all()
        assert not plate.pixels[4, 5].any()
        assert np.array_equal(plate.pixels[:2], pixels[:2].astype(np.float32))
        assert "2 pixels of the plate are infinite or no number" in plate.remarks[0]


def test_display_pictures_are_decoded_and_say_so(tmp_path):
    codes = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)
    Image.fromarray(codes).save(tmp_path / "p.png")
    tifffile.imwrite(tmp_path / "p.tif", codes)
    tifffile.imwrite(tmp_path / "deep.tif", codes.astype(np.uint16) * 257)
    Image.fromarray(codes).save(tmp_path / "p.jpg", quality=100, subsampling=0)
    plates = {name: read_plate(tmp_path / name) for name in ("p.png", "p.tif", "deep.tif", "p.jpg")}
    for name, plate in plates.items():
        assert srgb(plate.pixels) * 255 == pytest.approx(codes, abs=4 if name == "p.jpg" else 0.01)
        assert (plate.white, plate.transfer) == (1.0, "srgb")
        assert "display codes, decoded from sRGB; --plate-transfer linear" in plate.remarks[0]
    linear = read_plate(tmp_path / "p.png", transfer="linear")
    assert linear.pixels * 255 == pytest.approx(codes)
    assert linear.remarks == ()


def test_floating_point_tiffs_are_linear_and_deep_pngs_say_what_is_lost(tmp_path):
    tifffile.imwrite(tmp_path / "p.tif", PIXELS, photometric="rgb")
    plate = read_plate(tmp_path / "p.tif")
    assert np.array_equal(plate.pixels, PIXELS)
    assert plate.white is None
    rows = b"".join(b"\0" + row.tobytes() for row in np.full((2, 3, 3), 0x8000, ">u2"))
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", 3, 2, 16, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    data = b"\x89PNG\r\n\x1a\n"
    for kind, body in chunks:
        data += struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    (tmp_path / "deep.png").write_bytes(data)
    deep = read_plate(tmp_path / "deep.png")
    assert srgb(deep.pixels) == pytest.approx(0.5, abs=0.01)
    assert "16 bits, of which a PNG's first 8 are read" in deep.remarks[0]


@pytest.mark.parametrize(("name", "words"), [("p.dng", "develop a RAW file first"), ("p.png", "does not exist")])
def test_other_files_are_refused_in_one_sentence(tmp_path, name, words):
    if name == "p.dng":
        (tmp_path / name).write_bytes(b"II*\0")
    with pytest.raises(FileError, match=words):
        read_plate(tmp_path / name)


def test_a_layer_of_a_file_without_layers_is_refused(tmp_path):
    Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "p.png")
    with pytest.raises(FileError, match="has no layers"):
        read_plate(tmp_path / "p.png", layer="diffuse")


@pytest.mark.parametrize(
    ("photometric", "shape", "words"),
    [
        ("separated", (12, 16, 4), "holds the inks of a print (CMYK), no light; save it as an RGB TIFF"),
        ("miniswhite", (12, 16), "holds grey with white at 0, no light"),
        ("palette", (12, 16), "holds a palette, no light"),
    ],
)
def test_a_tiff_of_inks_is_no_light(tmp_path, photometric, shape, words):
    """Their numbers were read as light: a negative, and a grey picture of indices."""
    more = {"colormap": np.zeros((3, 256), np.uint16)} if photometric == "palette" else {}
    tifffile.imwrite(tmp_path / "p.tif", np.full(shape, 200, np.uint8), photometric=photometric, **more)
    with pytest.raises(FileError) as error:
        read_plate(tmp_path / "p.tif")
    assert words in str(error.value)
