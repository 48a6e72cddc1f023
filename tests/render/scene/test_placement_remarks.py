"""Remarks on lights outside the picture and on veils."""

import inspect
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

import flarewright as fw
from flarewright.model import Camera, Layer, Light, Output, Project, Quality
from flarewright.render.render import render
from flarewright.render.scene.placement_remarks import veil_remarks

SIZE = (64, 36)


def rendering(*fields, starburst=False, size=SIZE, step=1.0, **light):
    return render(
        Project(
            lens="tessar-brendel", lights=tuple(Light(field_deg=field, **light) for field in fields), f_number=8.0,
            camera=Camera(size_px=size), quality=Quality(mode="draft", wavelengths=3, source_step_deg=step),
            output=Output(layers="passes", starburst=starburst),
        )
    )  # fmt: skip


def remarks(*fields, **light):
    reported = rendering(*fields, **light).remarks
    return [remark for remark in reported if "the picture" in remark and "veil" not in remark]


def test_a_light_inside_has_no_remark():
    assert remarks((3.0, 2.0)) == []


SIDES = [((30.0, 0.0), "right of"), ((-30.0, 0.0), "left of"), ((0.0, 25.0), "above"), ((0.0, -25.0), "below")]


@pytest.mark.parametrize(("field", "side"), SIDES)
def test_a_remark_says_how_far_outside_a_light_is(field, side):
    """In pixels of its direct image beyond the border."""
    found = rendering(field)
    (reported,) = (remark for remark in found.remarks if remark.startswith("the light is"))
    assert reported.endswith(f"px {side} the picture")
    x, y = found.summary["lights"][0]["direct_position_mm"]
    pixels = SIZE[0] / found.project.camera.sensor[0]
    far = abs(x) * pixels - SIZE[0] / 2 if field[1] == 0.0 else abs(y) * pixels - SIZE[1] / 2
    assert int(reported.split()[3]) == pytest.approx(far, abs=0.51)


def test_corners_and_several_lights():
    (reported,) = remarks((30.0, 25.0))
    assert " px right of and " in reported
    assert " px above the picture" in reported
    assert remarks((3.0, 2.0), (30.0, 0.0))[0].startswith("light 1 (counted from 0) is ")
    many = remarks(*((30.0 + k, 0.0) for k in range(5)))
    assert len(many) == 4
    assert many[-1] == "2 more lights are outside the picture"


def test_the_nearest_part_of_a_large_light_counts():
    """Part of it is inside."""
    assert remarks((15.0, 0.0)) != []
    assert remarks((15.0, 0.0), diameter_deg=10.0, size=(16, 9), step=3.0) == []


def layer(pixels):
    return Layer("ghosts", np.asarray(pixels, np.float32), (0, 0, *SIZE))


def test_an_even_picture_is_a_veil():
    veil = np.full((36, 64, 3), 1e-3)
    assert "stop down" in veil_remarks(layer(veil))[0]
    veil[:6, :6] = 3e-3
    assert veil_remarks(layer(veil)) == []
    assert veil_remarks(layer(np.zeros((36, 64, 3)))) == []
    assert veil_remarks(Layer("ghosts", np.zeros((0, 0, 3), np.float32), (0, 0, 0, 0))) == []


def test_what_a_notebook_and_an_editor_ask():
    found = rendering((3.0, 2.0), starburst=True)
    shown = np.asarray(Image.open(BytesIO(found._repr_png_())))
    assert shown.shape == (36, 64, 3)
    assert shown.max() > 200
    assert [*inspect.signature(fw.render).parameters] == [*inspect.signature(render).parameters]


def test_an_exr_needs_no_metadata(tmp_path):
    found = rendering((3.0, 2.0))
    fw.write_exr(tmp_path / "a.exr", found.layers, SIZE)
    assert (tmp_path / "a.exr").exists()
