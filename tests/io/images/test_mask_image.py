"""Grey pictures: shapes in the colour, and shapes in the alpha channel alone."""

import json

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from flarewright.cli.app import run
from flarewright.io.images.mask_image import read_grey, read_mask
from flarewright.io.images.plate_image import read_matte

SHAPE = np.zeros((6, 8))
SHAPE[1:4, 2:7] = 1.0
# a soft corner
SHAPE[1, 2] = 0.4


def pixels(colour, alpha=SHAPE, beneath=None):
    """A picture of one colour; `beneath` is the colour of its transparent pixels."""
    out = np.zeros((*SHAPE.shape, 4))
    out[..., :3] = colour
    out[..., 3] = alpha
    if beneath is not None:
        out[SHAPE == 0.0, :3] = beneath
    return out


def png(path, rgba, mode="RGBA"):
    Image.fromarray(np.round(255.0 * rgba).astype(np.uint8), "RGBA").convert(mode).save(path)
    return path


def exr(path, rgba):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    planes = {name: np.ascontiguousarray(rgba[..., k], dtype=np.float32) for k, name in enumerate("RGBA")}
    with OpenEXR.File(header, planes) as file:
        file.write(str(path))
    return path


@pytest.mark.parametrize("colour", [0.0, 1.0])
@pytest.mark.parametrize("beneath", [None, 0.0, 1.0])
def test_a_shape_in_the_alpha_alone_is_the_picture(colour, beneath, tmp_path):
    found = [
        read_grey(png(tmp_path / "a.png", pixels(colour, beneath=beneath))),
        read_grey(png(tmp_path / "la.png", pixels(colour, beneath=beneath), "LA")),
        read_grey(exr(tmp_path / "a.exr", pixels(colour, beneath=beneath))),
        read_mask(tmp_path / "a.png"),
        read_matte(tmp_path / "a.png"),
    ]
    for grey in found:
        np.testing.assert_allclose(grey, SHAPE, atol=1e-3)


def test_a_shape_in_the_colour_is_the_picture_whatever_the_alpha(tmp_path):
    ramp = np.linspace(0.0, 1.0, SHAPE.shape[1]) * np.ones_like(SHAPE)
    even = np.full_like(SHAPE, 0.6)
    for colour, alpha in ((ramp, SHAPE), (SHAPE, 1.0 - 0.5 * ramp), (SHAPE, even), (even, even), (even, 0.0 * even)):
        rgba = pixels(colour[..., None], alpha)
        np.testing.assert_allclose(read_grey(png(tmp_path / "a.png", rgba)), colour, atol=3e-3)
        np.testing.assert_allclose(read_grey(exr(tmp_path / "a.exr", rgba)), colour, atol=1e-3)


def test_an_exr_mask_is_opened_once(tmp_path, monkeypatch):
    from flarewright.io.images import exr as reader

    opened, real = [], reader.outside
    monkeypatch.setattr(reader, "outside", lambda path, *rest, **more: opened.append(path) or real(path, *rest, **more))
    read_grey(exr(tmp_path / "a.exr", pixels(1.0)))
    assert opened == [tmp_path / "a.exr"]


def test_pictures_without_alpha_are_what_they_were(tmp_path):
    Image.fromarray(np.round(255.0 * SHAPE).astype(np.uint8)).save(tmp_path / "l.png")
    Image.fromarray(np.round(65535.0 * SHAPE).astype(np.uint16)).save(tmp_path / "deep.png")
    # one 16-bit grey level that means transparent
    Image.fromarray(np.round(65535.0 * SHAPE).astype(np.uint16)).save(tmp_path / "keyed.png", transparency=65535)
    for name in ("l", "deep", "keyed"):
        np.testing.assert_allclose(read_grey(tmp_path / f"{name}.png"), SHAPE, atol=2e-3)


def test_the_command_hides_a_light_behind_a_matte_of_alpha_alone(tmp_path, capsys):
    alpha = np.ones((40, 60))
    alpha[:, 30:] = 0.0
    rgba = np.zeros((40, 60, 4))
    rgba[..., 3] = alpha
    png(tmp_path / "m.png", rgba)
    words = ["render", "heliar-tronnier", "--size", "60x40", "--quality", "draft", "--holdout", str(tmp_path / "m.png")]
    words += ["--fstop", "16", "--wavelengths", "1"]
    seen = []
    for x in (-4, 4):
        assert run([*words, "--light", f"{x},0", "--json", "-o", str(tmp_path / "a.exr")]) == 0
        seen.append(json.loads(capsys.readouterr().out)["lights"][0]["visible"])
    assert seen == [1.0, 0.0]
