"""The Cryptomatte of a shot's frames: of the mean over the open shutter, and no layer of light for other commands."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import OpenEXR
import pytest

from flarewright import Camera, Light, LightKey, Output, Project, Quality, shot
from flarewright.io.images.exr import read_exr
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.workflow.nuke_script import nuke_script

OUTPUT = Output(layers="ghosts", starburst=False, pixel_type="float", matte="ghosts", matte_ranks=16)


def project(output=OUTPUT):
    keys = (LightKey(at_s=0.0, field_deg=(-6.0, 3.0)), LightKey(at_s=0.25, field_deg=(6.0, 3.0)))
    return Project(
        lens="triplet-pestrecov", f_number=11, lights=[Light(field_deg=(0.0, 3.0), keyframes=keys)],
        camera=Camera(size_px=(64, 36)), quality=Quality(mode="draft", wavelengths=3), output=output,
    )  # fmt: skip


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    folder = tmp_path_factory.mktemp("matte")
    shot(project(), folder / "f.####.exr", frames="3", shutter_deg=180, subframes=4, processes=1)
    return folder / "f.0003.exr"


def mattes(path):
    """Return the coverage of each object, and all ranks' coverage."""
    file = OpenEXR.File(str(path), separate_channels=True)
    channels = {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}
    manifest = json.loads(next(v for k, v in file.parts[0].header.items() if k.endswith("/manifest")))
    layers = sorted({name.partition(".")[0] for name in channels if name.startswith("CryptoGhost")})
    ids, parts = ([channels[f"{n}.{c}"] for n in layers for c in pair] for pair in ("RB", "GA"))
    own = {name: np.uint32(int(text, 16)).view(np.float32) for name, text in manifest.items()}
    return {n: sum(np.where(i == one, p, 0) for i, p in zip(ids, parts, strict=True)) for n, one in own.items()}, parts


def test_a_blurred_matte_times_the_picture_is_the_blurred_ghost(frame):
    found, ranks = mattes(frame)
    beauty, *layers = read_exr(frame).layers
    weights = luminance_weights("rec709")
    light = beauty.pixels @ weights
    singles = [layer for layer in layers if layer.name.startswith("ghost_")]
    assert len(singles) == len(found) == 15
    for layer in singles:
        name = "-".join(str(int(row)) for row in layer.name.split("_")[1:])
        np.testing.assert_allclose(found[name] * light, layer.pixels @ weights, atol=2e-6 * light.max(), rtol=1e-3)
    assert all(np.all(later <= sooner + 1e-6) for sooner, later in pairwise(ranks))


def test_other_commands_see_the_layers_of_light_alone(frame):
    assert not any(layer.name.startswith("Crypto") for layer in read_exr(frame).layers)
    script = nuke_script(str(frame))
    assert "Pass_ghosts" in script.text
    assert "Crypto" not in script.text


def test_a_frame_with_another_matte_is_drawn_again(frame, tmp_path):
    names = tmp_path / "f.####.exr"
    settings = {"frames": "3", "processes": 1}
    few = project(OUTPUT.replace(matte_ranks=4, layers="passes"))
    assert shot(few, names, **settings).frames[0].drawn
    assert not shot(few, names, **settings).frames[0].drawn
    assert shot(project(OUTPUT.replace(matte="none", layers="passes")), names, **settings).frames[0].drawn
