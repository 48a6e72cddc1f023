"""OpenImageIO, which compositing and texture tools use, reads the EXR files with the same pixels, windows and names."""

from fractions import Fraction

import numpy as np
import pytest

from flarewright.io.images.exr import CHROMATICITIES, read_exr, write_exr
from flarewright.io.images.exr_attributes import shot_attributes
from flarewright.model import Layer

oiio = pytest.importorskip("OpenImageIO", reason="the wheel OpenImageIO is not installed (extra: oracle)")

SIZE = (48, 27)


def layer(name, window=(0, 0, *SIZE), scale=1.0):
    rng = np.random.default_rng(len(name))
    return Layer(name, (scale * rng.standard_normal((window[3], window[2], 3))).astype(np.float32), window, {})


LAYERS = (layer("beauty"), layer("starburst", scale=300.0), layer("ghosts"), layer("ghost_04_01", (10, 5, 20, 9)),
          layer("ghost_02_00", (-4, -3, 30, 12)))  # fmt: skip


def parts(path):
    """Return name, spec and pixels of each part."""
    file = oiio.ImageInput.open(str(path))
    assert file, oiio.geterror()
    found = []
    while file.seek_subimage(len(found), 0):
        spec = file.spec()
        name = spec.getattribute("oiio:subimagename") or ""
        found.append((name, spec, file.read_image(len(found), 0, 0, spec.nchannels, oiio.FLOAT)))
    file.close()
    return found


def window(spec):
    return spec.x, spec.y, spec.width, spec.height


@pytest.mark.parametrize("full", [False, True], ids=["cropped", "full"])
@pytest.mark.parametrize("kind", ["half", "float"])
def test_parts_have_the_pixels_windows_and_names_that_we_read(tmp_path, kind, full):
    path = tmp_path / "a.exr"
    write_exr(path, LAYERS, SIZE, pixel_type=kind, full_windows=full, metadata={"version": "1"})
    ours, theirs = read_exr(path), parts(path)
    assert [name for name, *_ in theirs] == [one.name for one in ours.layers]
    for one, (name, spec, pixels) in zip(ours.layers, theirs, strict=True):
        assert window(spec) == one.window
        assert (spec.full_x, spec.full_y, spec.full_width, spec.full_height) == (0, 0, *SIZE)
        prefix = "" if name == "beauty" else f"{name}."
        assert spec.channelnames == tuple(f"{prefix}{channel}" for channel in "RGB")
        scale = spec.getattribute("flarewright.scale")
        np.testing.assert_array_equal(pixels / scale, one.pixels)
        assert spec.getattribute("chromaticities") == pytest.approx(CHROMATICITIES["rec709"])
        assert spec.getattribute("colorInteropID") == "lin_rec709_scene"
    assert theirs[0][1].getattribute("flarewright.version") == "1"


@pytest.mark.parametrize("kind", ["half", "float"])
def test_one_part_has_the_channels_of_all_layers(tmp_path, kind):
    path = tmp_path / "a.exr"
    write_exr(path, LAYERS, SIZE, pixel_type=kind, one_part=True, metadata={})
    ((_, spec, pixels),) = parts(path)
    ours = read_exr(path)
    assert sorted(spec.channelnames) == sorted(
        f"{'' if one.name == 'beauty' else f'{one.name}.'}{channel}" for one in LAYERS for channel in "RGB"
    )
    for one in ours.layers:
        prefix = "" if one.name == "beauty" else f"{one.name}."
        places = [spec.channelindex(f"{prefix}{channel}") for channel in "RGB"]
        np.testing.assert_array_equal(pixels[..., places] / spec.getattribute("flarewright.scale"), one.pixels)


def test_lossy_files_are_decoded_alike(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, LAYERS[:3], SIZE, compression="dwaa")
    ours, theirs = read_exr(path), parts(path)
    for one, (_, spec, pixels) in zip(ours.layers, theirs, strict=True):
        np.testing.assert_allclose(pixels / spec.getattribute("flarewright.scale"), one.pixels, rtol=1e-3, atol=1e-6)
    assert theirs[0][1].getattribute("compression").startswith("dwaa")


def test_attributes_of_a_shot_are_the_standard_ones(tmp_path):
    path = tmp_path / "a.exr"
    attributes = shot_attributes(
        frame=1001, fps=Fraction(24000, 1001), shutter_s=1 / 48, focal_length=50.0, f_number=4.0, lens="Tessar",
    )  # fmt: skip
    write_exr(path, LAYERS[:1], SIZE, metadata={"frame": "1001"}, attributes=attributes, pixel_aspect=2.0)
    ((_, spec, _),) = parts(path)
    assert spec.getattribute("PixelAspectRatio") == 2.0
    assert spec.getattribute("FramesPerSecond") == (24000, 1001)
    assert spec.getattribute("ExposureTime") == pytest.approx(1 / 48)
    assert spec.getattribute("FNumber") == 4.0
    assert spec.getattribute("smpte:TimeCode") is not None
    assert spec.getattribute("flarewright.frame") == "1001"
