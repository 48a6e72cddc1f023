"""Photographs are read with the numbers of the sensor: RAW through the real decoder, TIFF, EXR, NPY."""

import numpy as np
import pytest
import tifffile
from camera_raw import BLACK, WHITE, camera_to_rec709, write_dng

from flarewright.errors import FlarewrightError
from flarewright.io.images.exr import write_exr
from flarewright.io.images.photo import open_photo, photo_facts
from flarewright.model import Layer


@pytest.fixture
def mosaic():
    rng = np.random.default_rng(7)
    return rng.integers(BLACK, WHITE, (40, 60), dtype=np.uint16)


def test_a_raw_file_keeps_its_photosites(tmp_path, mosaic):
    mosaic[10, 13] = WHITE  # one of the two greens of a block
    write_dng(tmp_path / "a.dng", mosaic)
    photo = open_photo(tmp_path / "a.dng")
    assert photo.size_px == (30, 20)
    assert photo.black_level == (BLACK,) * 3
    assert photo.white_level == WHITE
    assert photo.samples == (1, 2, 1)
    assert photo.white_balance == pytest.approx((2.0, 1.0, 1.5))
    pixels = photo.rows(0, 20)
    assert np.array_equal(pixels[..., 0], mosaic[::2, ::2])
    assert np.array_equal(pixels[..., 2], mosaic[1::2, 1::2])
    greens = (mosaic[::2, 1::2].astype(np.float32) + mosaic[1::2, ::2]) / 2
    greens[5, 6] = WHITE  # a block is clipped when any of its pixels is
    assert np.array_equal(pixels[..., 1], greens)
    assert np.array_equal(photo.rows(3, 9), pixels[3:9])
    assert photo_facts(tmp_path / "a.dng") == pytest.approx(
        {"exposure_s": 0.125, "iso": 200.0, "f_number": 2.8, "focal_mm": 50.0}
    )


@pytest.mark.parametrize("damage", ["cut", "noise", "empty"])
def test_a_damaged_raw_file_is_one_sentence(tmp_path, capfd, mosaic, damage):
    path = tmp_path / "a.dng"
    write_dng(path, mosaic)
    data = path.read_bytes()
    path.write_bytes({"cut": data[: len(data) // 2], "noise": bytes(range(256)) * 20, "empty": b""}[damage])
    with pytest.raises(FlarewrightError, match=r"a\.dng cannot be read as a RAW file"):
        open_photo(path).rows(0, 20)
    assert capfd.readouterr() == ("", "")


def test_tiff_exr_and_npy_hold_the_same_numbers(tmp_path):
    rng = np.random.default_rng(3)
    numbers = rng.integers(0, 60000, (30, 40, 3), dtype=np.uint16)
    np.save(tmp_path / "a.npy", numbers)
    tifffile.imwrite(tmp_path / "a.tif", numbers, photometric="rgb")
    tifffile.imwrite(tmp_path / "packed.tif", numbers, photometric="rgb", compression="zlib")
    layer = Layer("beauty", numbers.astype(np.float32), (0, 0, 40, 30))
    write_exr(tmp_path / "a.exr", [layer], (40, 30), pixel_type="float", metadata={})
    for name in ("a.npy", "a.tif", "packed.tif", "a.exr"):
        photo = open_photo(tmp_path / name)
        assert photo.size_px == (40, 30)
        assert np.array_equal(photo.rows(4, 21), numbers[4:21]), name
        assert photo.white_level == (None if name == "a.exr" else 65535.0)
        assert photo.step == (0.0 if name == "a.exr" else 1.0)


@pytest.mark.parametrize("damage", ["cut", "hole"])
@pytest.mark.parametrize("name", ["a.exr", "packed.tif"])
def test_damaged_packed_pixels_are_one_sentence(tmp_path, capfd, name, damage):
    numbers = np.random.default_rng(3).integers(0, 60000, (64, 96, 3), dtype=np.uint16)
    path = tmp_path / name
    if name.endswith(".exr"):
        layer = Layer("beauty", numbers.astype(np.float32), (0, 0, 96, 64))
        write_exr(path, [layer], (96, 64), pixel_type="float", metadata={})
    else:
        tifffile.imwrite(path, numbers, photometric="rgb", compression="zlib")
    data = path.read_bytes()
    half = len(data) // 2
    path.write_bytes(data[:half] if damage == "cut" else data[:half] + bytes(300) + data[half + 300 :])
    with pytest.raises(FlarewrightError, match=rf"{name} cannot be read as an? \w+ file"):
        open_photo(path).rows(0, 64)
    assert capfd.readouterr() == ("", "")


def test_blocks_are_means_and_clipped_when_any_pixel_is(tmp_path):
    rng = np.random.default_rng(3)
    numbers = rng.integers(0, 900, (13, 17, 3), dtype=np.uint16)
    numbers[4, 5, 1] = 1000
    np.save(tmp_path / "a.npy", numbers)
    photo = open_photo(tmp_path / "a.npy", white_level=1000.0, block=3)
    assert photo.size_px == (5, 4)
    assert photo.samples == (9, 9, 9)
    means = numbers[:12, :15].reshape(4, 3, 5, 3, 3).mean(axis=(1, 3))
    found = photo.rows(0, 4)
    assert found[1, 1, 1] == 1000.0
    means[1, 1, 1] = 1000.0
    assert found == pytest.approx(means, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("a.npy", np.zeros((4, 5, 3), np.uint8), "8 bits"),
        ("a.npy", np.zeros((4, 5, 2), np.uint16), "no picture"),
        ("a.npy", np.zeros(7), "no picture"),
        ("a.npy", b"junk", "cannot be read as an NPY"),
        ("a.tif", b"junk", "cannot be read as a TIFF"),
        ("a.exr", b"junk", "cannot be read as an EXR"),
        ("a.jpg", b"junk", "no photograph with linear values"),
    ],
)
def test_a_file_that_is_no_linear_photograph_is_refused(tmp_path, name, content, word):
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.save(path, content)
    with pytest.raises(FlarewrightError, match=word):
        open_photo(path)
    with pytest.raises(FlarewrightError, match="does not exist"):
        open_photo(tmp_path / "other.npy")


def test_pixels_that_are_not_finite_are_refused(tmp_path):
    pixels = np.ones((4, 5, 3), np.float32)
    pixels[2, 1, 0] = np.nan
    np.save(tmp_path / "a.npy", pixels)
    photo = open_photo(tmp_path / "a.npy")
    assert photo.rows(0, 2).shape == (2, 5, 3)
    with pytest.raises(FlarewrightError, match="infinite or NaN"):
        photo.rows(0, 4)
    pixels[2, 1, 0] = 1e38
    np.save(tmp_path / "b.npy", pixels)
    with pytest.raises(FlarewrightError, match=r"pixels above 1e\+12"):
        open_photo(tmp_path / "b.npy").rows(0, 4)


def test_an_x_trans_mosaic_is_refused(tmp_path, mosaic):
    # Fujifilm's pattern of six by six; 0 red, 1 green, 2 blue
    rows = ("110112", "112110", "201021", "112110", "110112", "021201")
    write_dng(tmp_path / "x.dng", mosaic, pattern=tuple(tuple(map(int, row)) for row in rows))
    with pytest.raises(FlarewrightError, match=r"x\.dng has an X-Trans mosaic.* linear 16-bit TIFF") as reported:
        open_photo(tmp_path / "x.dng")
    assert "\n" not in str(reported.value)


def test_the_decoder_returns_the_colour_matrix(tmp_path, mosaic):
    write_dng(tmp_path / "a.dng", mosaic)
    found = open_photo(tmp_path / "a.dng").to_rec709
    np.testing.assert_allclose(found, camera_to_rec709(), rtol=1e-3, atol=1e-3)
    np.save(tmp_path / "a.npy", mosaic)
    assert open_photo(tmp_path / "a.npy").to_rec709 is None
