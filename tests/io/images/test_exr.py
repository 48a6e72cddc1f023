"""EXR files: round trips, a first part that every program opens, atomic writing."""

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from flarewright.errors import FileError, FlarewrightError, OutputError
from flarewright.io.images.exr import CHROMATICITIES, read_exr, write_exr
from flarewright.io.images.foreign_exr import read_exr_layer, read_exr_plane
from flarewright.io.images.half import rounded_to_half
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
    assert (back.pixel_type, back.scale) == ("float", 1.0)
    assert back.metadata == {"project": 'lens = "ä"\n', "version": "1"}
    assert [x.name for x in back.layers] == [x.name for x in layers]
    for k in (0, 2, 3):
        assert back.layers[k].window == layers[k].window
        np.testing.assert_array_equal(back.layers[k].pixels, layers[k].pixels)
    assert back.layers[2].about == {"first_reflection": 4.0, "glass": "LAKN7 ä"}
    # a pass covers the picture, black around its window
    assert back.layers[1].window == (0, 0, *SIZE)
    np.testing.assert_array_equal(back.layers[1].pixels[4:12, 4:12], layers[1].pixels)
    assert np.count_nonzero(back.layers[1].pixels) == layers[1].pixels.size


def test_layers_are_not_held_twice_to_be_written(monkeypatch, tmp_path, layers):
    """351 layers of floats fit the memory once; separate planes per channel would double them."""
    parts, make = [], OpenEXR.Part

    def part(header, channels, name):
        # the library adds objects to its argument
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


def faint(name="ghosts"):
    """Return a layer with values from 1e-7 to 1e-2 of both signs."""
    rng = np.random.default_rng(7)
    shape = (SIZE[1], SIZE[0], 3)
    pixels = rng.choice([-1.0, 1.0], shape) * 10.0 ** rng.uniform(-7.0, -2.0, shape)
    return Layer(name, pixels.astype(np.float32), (0, 0, *SIZE))


def stored(path, part, names="RGB"):
    """Return the data and header of a part as OpenEXR reads it."""
    found = OpenEXR.File(str(path), separate_channels=True).parts[part]
    return np.stack([found.channels[name].pixels for name in names], axis=-1), found.header


@pytest.mark.parametrize("scale", [None, 1024.0, 2.0**-7, 2.0**63])
def test_a_half_file_holds_light_times_a_scale_that_reading_undoes(tmp_path, scale):
    path, by = tmp_path / "a.exr", scale or 1024.0
    # the same ghosts for the light's intensity
    wanted = Layer("ghosts", faint().pixels * np.float32(1024.0 / by), (0, 0, *SIZE))
    said = write_exr(path, [wanted], SIZE, scale=scale)
    assert said == (
        f"the EXR holds irradiances times {by:.9g}, its attribute flarewright.scale; --float writes them as they are",
    )
    held, header = stored(path, 0)
    assert held.dtype == np.float16
    assert header["flarewright.scale"] == by
    np.testing.assert_array_equal(held, np.ldexp(wanted.pixels, int(np.log2(by))).astype(np.float16))
    back = read_exr(path)
    assert (back.scale, back.pixel_type, back.metadata) == (by, "half", {})
    for channel in range(3):
        there, here = back.layers[0].pixels[..., channel], wanted.pixels[..., channel]
        normal = np.abs(here) * by >= 2.0**-14
        assert normal.mean() > 0.5
        np.testing.assert_allclose(there[normal], here[normal], rtol=2.0**-11)
        np.testing.assert_allclose(there, here, rtol=2.0**-11, atol=2.0**-25 / by)


def test_a_layer_with_a_star_s_core_is_rounded_not_clipped_and_packs_well(tmp_path):
    """The other layer of the file stays in half floats, and both add up under one scale."""
    yy, xx = np.mgrid[: SIZE[1], : SIZE[0]]
    disc = 4e4 / (1.0 + (xx - 30.0) ** 2 + (yy - 20.0) ** 2)
    tints = np.array([1.0, 0.7, -0.3])  # saturated light has negative channels
    star = Layer("starburst", (disc[..., None] * tints).astype(np.float32), (0, 0, *SIZE))
    write_exr(tmp_path / "a.exr", [star, faint()], SIZE)
    held, header = stored(tmp_path / "a.exr", 0)
    other, other_header = stored(tmp_path / "a.exr", 1, [f"ghosts.{name}" for name in "RGB"])
    assert (held.dtype, other.dtype) == (np.float32, np.float16)
    assert header["flarewright.scale"] == other_header["flarewright.scale"] == 1024.0
    np.testing.assert_array_equal(held, rounded_to_half(star.pixels * np.float32(1024.0)))
    back = read_exr(tmp_path / "a.exr")
    for channel in range(3):
        wanted = star.pixels[..., channel]
        assert np.abs(wanted).max() > 1e4
        np.testing.assert_allclose(back.layers[0].pixels[..., channel], wanted, rtol=2.0**-11)
    write_exr(tmp_path / "half.exr", [star], SIZE)
    write_exr(tmp_path / "float.exr", [star], SIZE, pixel_type="float")
    assert (tmp_path / "half.exr").stat().st_size < 0.6 * (tmp_path / "float.exr").stat().st_size


def test_numbers_of_every_size_survive_the_compression_of_bright_layers(tmp_path):
    """PXR24 drops bits of full 32-bit floats, but not of those rounded to 11 bits."""
    rng = np.random.default_rng(5)
    sizes = rng.choice([-1.0, 1.0], (SIZE[1], SIZE[0], 3)) * 2.0 ** rng.uniform(-40.0, 90.0, (SIZE[1], SIZE[0], 3))
    wide = Layer("beauty", sizes.astype(np.float32), (0, 0, *SIZE))
    wide.pixels[0, 0] = 0.0, np.inf, -np.inf
    write_exr(tmp_path / "a.exr", [wide], SIZE, scale=1.0)
    held, header = stored(tmp_path / "a.exr", 0)
    assert header["compression"] == OpenEXR.PXR24_COMPRESSION
    np.testing.assert_array_equal(held, rounded_to_half(wide.pixels))


def test_variances_keep_all_bits_under_the_scale_squared(tmp_path):
    variance = Layer("ghosts.variance", faint().pixels ** 2, (0, 0, *SIZE))
    for scale in (1024.0, 2.0**-7):
        write_exr(tmp_path / "a.exr", [faint(), variance], SIZE, scale=scale)
        held, header = stored(tmp_path / "a.exr", 1, [f"ghosts.variance.{name}" for name in "RGB"])
        assert held.dtype == np.float32
        assert header["flarewright.scale"] == scale**2
        np.testing.assert_array_equal(held, variance.pixels * np.float32(scale**2))
        np.testing.assert_array_equal(read_exr(tmp_path / "a.exr").layers[1].pixels, variance.pixels)


def test_a_picture_of_ours_is_read_in_its_own_units_as_a_plate_too(tmp_path):
    dark = faint()
    for kind, error in (("half", 2.0**-25 / 1024.0), ("float", 0.0)):
        write_exr(tmp_path / "a.exr", [dark], SIZE, pixel_type=kind)
        tolerance = {"rtol": 2.0**-11 if error else 0.0, "atol": error}
        np.testing.assert_allclose(read_exr_layer(tmp_path / "a.exr", None)[0], dark.pixels, **tolerance)
        for k, channel in enumerate("RGB"):
            plane = read_exr_plane(tmp_path / "a.exr", ((channel,),))
            np.testing.assert_allclose(plane, dark.pixels[..., k], **tolerance)
        assert read_exr(tmp_path / "a.exr").scale == (1024.0 if error else 1.0)


def test_openimageio_finds_the_scale(tmp_path):
    oiio = pytest.importorskip("OpenImageIO")
    write_exr(tmp_path / "a.exr", [faint("beauty"), faint("ghosts")], SIZE)
    for part in range(2):
        image = oiio.ImageBuf(str(tmp_path / "a.exr"), part, 0)
        scale = image.spec().getattribute("flarewright.scale")
        pixels = image.get_pixels(oiio.FLOAT) / scale
        assert scale == 1024.0
        np.testing.assert_allclose(pixels, faint().pixels, rtol=2.0**-11, atol=2.0**-25 / 1024.0)


@pytest.mark.parametrize("scale", [1000.0, 0.0, -2.0, float("inf"), float("nan"), 2.0**64])
def test_a_scale_that_would_round_is_refused(tmp_path, scale):
    with pytest.raises(FlarewrightError, match=r"is no power of two .*; give exr_scale\(project\)"):
        write_exr(tmp_path / "a.exr", [layer("beauty")], SIZE, scale=scale)


@pytest.mark.parametrize("scale", ["much", -1.0, float("inf")])
def test_a_damaged_scale_is_one_sentence(tmp_path, scale):
    planes = {name: np.ones((4, 4), np.float32) for name in "RGB"}
    OpenEXR.File({"flarewright.scale": scale}, planes).write(str(tmp_path / "a.exr"))
    words = "its attribute flarewright.scale is no number above 0"
    with pytest.raises(OutputError, match=words):
        read_exr(tmp_path / "a.exr")
    with pytest.raises(FileError, match=words):
        read_exr_layer(tmp_path / "a.exr", None)
    with pytest.raises(FileError, match=words):
        read_exr_plane(tmp_path / "a.exr", (("R",),))


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
        with pytest.raises(OutputError) as reported:
            write_exr(tmp_path / "a.exr", layers[:count], SIZE, pixel_type="float", metadata={})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    where = tmp_path / "a.exr"
    assert str(reported.value) == f"cannot write {where}: file too large; check the free space and the permissions"
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_or_read_is_one_sentence(tmp_path, layers):
    with pytest.raises(OutputError, match="does not exist"):
        write_exr(tmp_path / "no" / "a.exr", layers, SIZE, pixel_type="half", metadata={})
    with pytest.raises(FlarewrightError, match="no name twice"):
        write_exr(tmp_path / "a.exr", [layers[0], layers[0]], SIZE, pixel_type="half", metadata={})
    with pytest.raises(FlarewrightError, match="would replace the file's own"):
        write_exr(tmp_path / "a.exr", layers, SIZE, metadata={"scale": "2"})
    (tmp_path / "junk.exr").write_bytes(b"junk")
    with pytest.raises(OutputError, match="cannot be read as an EXR"):
        read_exr(tmp_path / "junk.exr")
    assert [file.name for file in tmp_path.iterdir()] == ["junk.exr"]


def test_other_channels_of_a_picture_by_others_are_left_out(tmp_path):
    import OpenEXR

    rng = np.random.default_rng(1)
    channels = {name: rng.random((4, 6), dtype=np.float32) for name in ("R", "G", "B", "depth.Z")}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    # the library replaces the arrays of a given dictionary
    OpenEXR.File(header, dict(channels)).write(str(tmp_path / "photo.exr"))
    [picture] = read_exr(tmp_path / "photo.exr").layers
    np.testing.assert_array_equal(picture.pixels[..., 1], channels["G"])


def smooth(name, scale=1.0):
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    pixels = scale * (0.5 + 0.4 * np.sin(x / 9.0) * np.cos(y / 7.0))[..., None] * np.array([1.0, 0.6, 0.3])
    return Layer(name, pixels.astype(np.float32), (0, 0, *SIZE), {})


@pytest.mark.parametrize("one_part", [False, True], ids=["parts", "one part"])
def test_dwaa_changes_pixels_less_than_anyone_sees_and_keeps_large_values(tmp_path, one_part):
    layers = [smooth("beauty"), smooth("ghosts"), smooth("beauty.variance", 1e-4)]
    layers += [] if one_part else [smooth("starburst", 1e6)]
    write_exr(tmp_path / "a.exr", layers, SIZE, compression="dwaa", one_part=one_part)
    back = {one.name: one.pixels for one in read_exr(tmp_path / "a.exr").layers}
    for one in layers:
        np.testing.assert_allclose(back[one.name], one.pixels, rtol=0.01)
    kinds = [part.header["compression"] for part in OpenEXR.File(str(tmp_path / "a.exr"), header_only=True).parts]
    lossy, lossless = OpenEXR.DWAA_COMPRESSION, (OpenEXR.ZIP_COMPRESSION, OpenEXR.PXR24_COMPRESSION)
    # a variance has 32 bits, and so have values beyond half's range
    assert kinds == [OpenEXR.ZIP_COMPRESSION] if one_part else [lossy, lossy, *lossless]


def test_dwaa_files_are_smaller(tmp_path):
    rng = np.random.default_rng(3)
    noise = (1.0 + 0.01 * rng.standard_normal((*SIZE[::-1], 3))).astype(np.float32)
    noisy = Layer("beauty", smooth("beauty").pixels * noise, (0, 0, *SIZE), {})
    for kind in ("zip", "dwaa"):
        write_exr(tmp_path / f"{kind}.exr", [noisy], SIZE, compression=kind)
    assert (tmp_path / "dwaa.exr").stat().st_size < 0.7 * (tmp_path / "zip.exr").stat().st_size


def test_dwaa_of_32_bits_is_refused(tmp_path):
    with pytest.raises(FlarewrightError, match="compression dwaa keeps 16 bits"):
        write_exr(tmp_path / "a.exr", [smooth("beauty")], SIZE, pixel_type="float", compression="dwaa")
    assert list(tmp_path.iterdir()) == []


def test_a_compressor_without_memory_is_a_lack_of_memory_and_leaves_no_file(tmp_path, monkeypatch):
    class Full:
        def __init__(self, parts):
            pass

        def write(self, name):
            Path(name).write_bytes(b"begun")
            raise RuntimeError(f'Failed to write pixel data to image file "{name}". unable to run compression routine.')

    monkeypatch.setattr(OpenEXR, "File", Full)
    with pytest.raises(MemoryError):
        write_exr(tmp_path / "a.exr", [Layer("a", np.ones((4, 4, 3), np.float32), (0, 0, 4, 4))], (4, 4))
    assert list(tmp_path.iterdir()) == []


def test_an_exr_is_not_written_under_the_name_of_another_format(tmp_path, layers):
    """`write_exr("a.png")` used to write an EXR that no program opens by its name."""
    for name in ("a.png", "a", "exr"):
        with pytest.raises(OutputError, match=r"must be named \*\.exr"):
            write_exr(tmp_path / name, layers, SIZE)
    assert list(tmp_path.iterdir()) == []
