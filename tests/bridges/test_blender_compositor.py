"""From the scene to the compositor: the program draws the flare, and Blender adds it, in step and in place."""

from __future__ import annotations

import shutil

import numpy as np
import OpenEXR
import pytest

bpy = pytest.importorskip("bpy", reason="needs the wheel of Blender: docs/blender.md")

from blender_objects import camera, lamp, material, plane  # noqa: E402

from flarewright.io.images.exr import read_exr  # noqa: E402

pytestmark = [
    pytest.mark.blender,
    pytest.mark.skipif(shutil.which("flarewright") is None, reason="needs the program flarewright on PATH"),
]


def moving(scene, folder):
    """Give a scene a glowing ball that moves, and settings of a small flare."""
    scene.frame_start, scene.frame_end = 1001, 1003
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.15, segments=32, ring_count=16)
    ball = bpy.context.object
    material(ball, "ShaderNodeEmission", Color=(1.0, 0.8, 0.6, 1.0), Strength=500.0)
    ball.flarewright.glows = True
    for frame, x in ((1001, -1.1), (1003, 1.1)):
        ball.location = (x, 0.4, -10.0)
        ball.keyframe_insert("location", frame=frame)
    settings = scene.flarewright
    settings.lens, settings.f_number, settings.output = "heliar-tronnier", 8.0, str(folder / "out" / "f.####.exr")
    settings.options = "--processes 1 --wavelengths 3"
    return ball


def pictures(scene, folder, frames):
    """Return what Blender renders at frames: colour and alpha."""
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = 16, False, 1
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.image_settings.color_mode = "RGBA"
    found = []
    for frame in frames:
        scene.frame_set(frame)
        scene.render.filepath = str(folder / "r.exr")
        bpy.ops.render.render(write_still=True)
        found.append(np.array(OpenEXR.File(scene.render.filepath).channels()["RGBA"].pixels))
    return found


def flare(folder, frame):
    """Return the passes of a frame that the program drew, by name."""
    return {layer.name: layer.pixels for layer in read_exr(folder / "out" / f"f.{frame}.exr").layers}


def middle(pixels):
    """Return the centre of the light in a picture, pixels from the top left corner."""
    light = np.clip(pixels.sum(axis=2), 0.0, None)
    rows, columns = np.mgrid[: light.shape[0], : light.shape[1]] + 0.5
    return np.array([(columns * light).sum(), (rows * light).sum()]) / light.sum()


def test_the_flare_is_added_in_step_and_on_its_light(registered, scene, tmp_path):
    moving(scene, tmp_path)
    camera(scene, lens=100.0)
    assert bpy.ops.flarewright.render() == {"FINISHED"}
    frames = [1001, 1002, 1003]
    assert sorted(each.name for each in (tmp_path / "out").iterdir()) == [
        *(f"f.{frame}.exr" for frame in frames), "f.scene.json",
    ]  # fmt: skip
    scene.render.film_transparent = True
    with_flare = pictures(scene, tmp_path, frames)
    scene.render.use_compositing = False
    without = pictures(scene, tmp_path, frames)
    for k, frame in enumerate(frames):
        passes = flare(tmp_path, frame)
        added = with_flare[k][..., :3] - without[k][..., :3]
        expected = passes["starburst"] + passes["ghosts"]
        assert np.abs(added - expected).max() < 1e-3 * expected.max()
        assert np.abs(expected - passes["beauty"]).max() < 1e-2 * expected.max()
        assert np.array_equal(with_flare[k][..., 3], without[k][..., 3])
        # the direct image lies on the ball that Blender draws, and has its light
        star = passes["starburst"]
        near = np.hypot(*(np.indices(star.shape[:2]) + 0.5 - middle(without[k][..., :3])[::-1, None, None])) < 6.0
        assert middle(star * near[..., None]) == pytest.approx(middle(without[k][..., :3]), abs=0.1)
        # some of it lies beyond the picture
        assert star.sum() == pytest.approx(without[k][..., :3].sum(), rel=0.08)
    # a gain of one stop doubles a pass, and a second call keeps it
    scene.render.use_compositing = True
    tree = registered.compositor._compositor_tree(scene)[0]
    node = next(each for each in tree.nodes if each.label == "Flarewright")
    node.inputs["ghosts"].default_value = 1.0
    assert bpy.ops.flarewright.composite() == {"FINISHED"}
    assert [each.label for each in tree.nodes].count("Flarewright") == 1
    doubled = pictures(scene, tmp_path, [1002])[0][..., :3] - with_flare[1][..., :3]
    ghosts = flare(tmp_path, 1002)["ghosts"]
    # pixels of the ball itself are rounded to its light
    assert np.abs(doubled - ghosts).max() < 1e-2 * ghosts.max() + 1e-6 * with_flare[1].max()


def test_a_shifted_and_cropped_picture_has_its_flare_in_place(registered, scene, tmp_path):
    moving(scene, tmp_path)
    scene.frame_start = scene.frame_end = 1002
    camera(scene, lens=100.0, shift_x=0.11, shift_y=-0.07)
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.1, 0.83, 0.2, 1.0
    assert bpy.ops.flarewright.render() == {"FINISHED"}
    (with_flare,) = pictures(scene, tmp_path, [1002])
    scene.render.use_compositing = False
    (without,) = pictures(scene, tmp_path, [1002])
    added = with_flare[..., :3] - without[..., :3]
    bright = np.where(added > 0.05 * added.max(), added, 0.0)
    assert middle(bright) == pytest.approx(middle(without[..., :3]), abs=0.15)
    # whole pixels: the added picture is a part of the drawn one
    drawn = sum(flare(tmp_path, 1002)[name] for name in ("starburst", "ghosts"))
    rows, columns = added.shape[:2]
    parts = [
        drawn[y : y + rows, x : x + columns]
        for y in range(drawn.shape[0] - rows + 1)
        for x in range(drawn.shape[1] - columns + 1)
    ]
    assert min(np.abs(part - added).max() for part in parts) < 1e-3 * drawn.max()


def test_nodes_that_are_there_stay_before_the_flare(registered, scene, tmp_path):
    moving(scene, tmp_path)
    camera(scene, lens=100.0)
    (tmp_path / "out").mkdir()
    OpenEXR.File({}, {"RGB": np.ones((54, 96, 3), np.float32)}).write(str(tmp_path / "out" / "f.1001.exr"))
    tree, output = registered.compositor._compositor_tree(scene)
    layers, exposure = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeExposure")
    tree.links.new(layers.outputs["Image"], exposure.inputs["Image"])
    tree.links.new(exposure.outputs[0], output.inputs[0])
    scene.frame_end = 1001
    for _ in range(2):
        assert bpy.ops.flarewright.composite() == {"FINISHED"}
    node = output.inputs[0].links[0].from_node
    assert node.label == "Flarewright"
    assert node.inputs["Image"].links[0].from_node == exposure
    assert [socket.name for socket in node.inputs] == ["Image", "beauty"]


def test_motion_blur_is_the_scenes(registered, scene, tmp_path):
    moving(scene, tmp_path)
    camera(scene, lens=100.0)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    assert bpy.ops.flarewright.export() == {"FINISHED"}
    assert bpy.ops.flarewright.copy_command() == {"FINISHED"}
    assert bpy.ops.flarewright.render() == {"FINISHED"}
    # the ball moves by half of its step in a frame; before the first one too
    for frame in (1001, 1002, 1003):
        columns = flare(tmp_path, frame)["starburst"].sum(axis=(0, 2))
        wide = (columns > 0.3 * columns.max()).sum()
        assert wide == pytest.approx(0.5 * 1.1 * 100.0 / 10.0 * 96 / 36.0, abs=8)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"output": "//f.####.exr"}, "lies beside the scene, which has no file yet; save it first"),
        ({"output": "/tmp/f.exr"}, "has no place for the number of a frame; name it flare.####.exr"),
        ({"lens": " "}, "no lens is given"),
        ({"lens": "no-such-lens"}, "Flarewright: "),
        ({"options": "--blades x"}, "Flarewright: "),
        ({"options": "'"}, "have an open quotation mark; close it"),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(registered, scene, tmp_path, change, words):
    moving(scene, tmp_path)
    camera(scene)
    lamp(scene, "SUN", turn=(3.1, 0, 0))
    for key, value in change.items():
        setattr(scene.flarewright, key, value)
    with pytest.raises(RuntimeError) as error:
        bpy.ops.flarewright.render()
    sentence = str(error.value).strip()
    assert words in sentence
    assert "\n" not in sentence
    assert "Traceback" not in sentence


def test_a_program_that_is_missing_is_one_sentence(registered, scene, tmp_path, monkeypatch):
    moving(scene, tmp_path)
    plane(scene)
    monkeypatch.setenv("FLAREWRIGHT", "no-such-program")
    with pytest.raises(RuntimeError, match="the program 'no-such-program' was not found; install it with"):
        bpy.ops.flarewright.render()
    with pytest.raises(RuntimeError, match="the program 'no-such-program' was not found"):
        bpy.ops.flarewright.check()
    monkeypatch.setenv("FLAREWRIGHT", "flarewright")
    assert bpy.ops.flarewright.check() == {"FINISHED"}
    assert "heliar-tronnier" in registered.panels._State.lenses
