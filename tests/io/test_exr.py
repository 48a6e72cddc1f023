"""EXR files: what goes in comes back, every program finds the beauty, nothing half-written stays."""

import numpy as np
import OpenEXR
import pytest

from flarewright.errors import FlarewrightError, OutputError
from flarewright.io.exr import CHROMATICITIES, read_exr, write_exr
from flarewright.model import Layer

SIZE = (64, 36)


def layer(name, window=(0, 0, *SIZE), scale=1.0, **about):
    rng = np.random.default_rng(len(name))
    _, _, w, h = window
    return Layer(name, (scale * rng.standard_normal((h, w, 3))).astype(np.float32), window, about)


@pytest.fixture
def layers():
    return (
        layer("beauty"),
        layer("ghosts", (4, 4, 8, 8)),
        layer("ghost.4-1", (10, 20, 30, 5), first_reflection=4.0, glass="LAKN7 ä"),
        layer("ghost.2-0", (-5, -3, 30, 12)),
    )


def test_layers_windows_and_metadata_come_back(tmp_path, layers):
    path = tmp_path / "a.exr"
    said = write_exr(path, layers, SIZE, pixel_type="float", metadata={"project": 'lens = "ä"\n', "version": "1"})
    back = read_exr(path)
    assert said == ()
    assert back.size_px == SIZE
    assert back.pixel_type == "float"
    assert back.metadata == {"project": 'lens = "ä"\n', "version": "1"}
    assert [x.name for x in back.layers] == [x.name for x in layers]
    for k in (0, 2, 3):
        assert back.layers[k].window == layers[k].window
        np.testing.assert_array_equal(back.layers[k].pixels, layers[k].pixels)
    assert back.layers[2].about == {"first_reflection": 4.0, "glass": "LAKN7 ä"}
    # A pass covers the picture, black around what it held.
    assert back.layers[1].window == (0, 0, *SIZE)
    np.testing.assert_array_equal(back.layers[1].pixels[4:12, 4:12], layers[1].pixels)
    assert np.count_nonzero(back.layers[1].pixels) == layers[1].pixels.size


def test_layers_are_not_held_twice_to_be_written(monkeypatch, tmp_path, layers):
    """351 layers of floats fill a memory once; planes by channel would be as many bytes again."""
    parts, make = [], OpenEXR.Part

    def part(header, channels, name):
        # the library puts objects of its own into what it is given
        parts.append(dict(channels))
        return make(header, channels, name)

    monkeypatch.setattr(OpenEXR, "Part", part)
    write_exr(tmp_path / "a.exr", layers, SIZE, pixel_type="float", metadata={})
    assert all(np.shares_memory(parts[k][layers[k].name], layers[k].pixels) for k in (2, 3))


def test_first_part_has_the_plain_channels_that_every_program_opens(tmp_path, layers):
    path = tmp_path / "a.exr"
    write_exr(path, layers, SIZE, pixel_type="half", metadata={}, colorspace="acescg", pixel_aspect=2.0)
    file = OpenEXR.File(str(path), separate_channels=True)
    assert sorted(file.parts[0].channels) == ["B", "G", "R"]
    assert sorted(file.parts[2].channels) == ["ghost.4-1.B", "ghost.4-1.G", "ghost.4-1.R"]
    assert [part.name() for part in file.parts] == [x.name for x in layers]
    header = file.parts[0].header
    np.testing.assert_allclose(header["chromaticities"], CHROMATICITIES["acescg"], rtol=1e-6)
    assert header["colorInteropID"] == "lin_ap1_scene"
    assert header["pixelAspectRatio"] == 2.0
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION


def test_full_windows_put_every_layer_at_the_size_of_the_picture(tmp_path, layers):
    write_exr(tmp_path / "a.exr", layers, SIZE, pixel_type="float", metadata={}, full_windows=True)
    back = read_exr(tmp_path / "a.exr")
    assert all(x.pixels.shape == (36, 64, 3) for x in back.layers)
    np.testing.assert_array_equal(back.layers[3].pixels[:9, :25], layers[3].pixels[3:, 5:])


def test_half_floats_are_clipped_and_told_never_infinite(tmp_path):
    bright = layer("beauty")
    bright.pixels[0, 0] = (1e6, -1e6, 65504.0)
    said = write_exr(tmp_path / "a.exr", [bright], SIZE, pixel_type="half", metadata={})
    back = read_exr(tmp_path / "a.exr").layers[0].pixels
    assert len(said) == 1
    assert said[0].startswith("2 values above 65504 were clipped")
    np.testing.assert_array_equal(back[0, 0], (65504.0, -65504.0, 65504.0))
    np.testing.assert_allclose(back[1:], bright.pixels[1:], rtol=1e-3, atol=1e-6)


def test_one_layer_makes_an_ordinary_single_part_file(tmp_path):
    write_exr(tmp_path / "a.exr", [layer("beauty")], SIZE, pixel_type="half", metadata={})
    data = (tmp_path / "a.exr").read_bytes()
    assert data[5] & 0x10 == 0  # bit 12 of the version field: multi-part


@pytest.mark.parametrize("count", [1, 2])
def test_a_full_disk_is_told_of_the_wanted_file(tmp_path, layers, count):
    resource = pytest.importorskip("resource", reason="only POSIX limits how long files may become")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    try:
        with pytest.raises(OutputError) as told:
            write_exr(tmp_path / "a.exr", layers[:count], SIZE, pixel_type="float", metadata={})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    where = tmp_path / "a.exr"
    assert str(told.value) == f"cannot write {where}: file too large; check the free space and the permissions"
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_or_read_is_one_sentence(tmp_path, layers):
    with pytest.raises(OutputError, match="does not exist"):
        write_exr(tmp_path / "no" / "a.exr", layers, SIZE, pixel_type="half", metadata={})
    with pytest.raises(FlarewrightError, match="no name twice"):
        write_exr(tmp_path / "a.exr", [layers[0], layers[0]], SIZE, pixel_type="half", metadata={})
    (tmp_path / "junk.exr").write_bytes(b"junk")
    with pytest.raises(OutputError, match="cannot be read as an EXR"):
        read_exr(tmp_path / "junk.exr")
    assert [file.name for file in tmp_path.iterdir()] == ["junk.exr"]
