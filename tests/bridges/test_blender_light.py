"""Irradiance of lamps: what the add-on computes against what Cycles renders."""

from __future__ import annotations

from math import pi

import numpy as np
import OpenEXR
import pytest

bpy = pytest.importorskip("bpy", reason="needs the wheel of Blender: docs/blender.md")

from blender_objects import added, lamp, material, plane  # noqa: E402

pytestmark = pytest.mark.blender

PLACE = (0.4, -0.3, 3.0)


def rendered_irradiance(scene, path):
    """Return the irradiance of a white, small, diffuse plane at the origin that faces +z, times 1 for each channel."""
    material(plane(scene, half=0.01), "ShaderNodeBsdfDiffuse", Color=(1.0, 1.0, 1.0, 1.0))
    # a camera from the side, behind which no lamp is
    data = bpy.data.cameras.new("Eye")
    data.type, data.ortho_scale, data.clip_start = "ORTHO", 0.01, 0.01
    scene.camera = added(scene, "Eye", data, (0.5, 0.0, 0.5), (0.0, pi / 4, 0.0))
    render = scene.render
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", 8, 8
    scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.use_denoising = 256, 0, False
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    pixels = next(iter(OpenEXR.File(str(path)).channels().values())).pixels
    return pixels[..., :3].mean(axis=(0, 1)) * pi


@pytest.mark.parametrize(
    ("kind", "turn", "scale", "values"),
    [
        ("SUN", (0.3, 0.2, 0.0), 1, {"energy": 2.0, "angle": 0.0}),
        ("SUN", (0.3, 0.2, 0.0), 1, {"energy": 2.0, "angle": 0.2, "normalize": False}),
        ("POINT", (0, 0, 0), 1, {"shadow_soft_size": 0.0}),
        ("POINT", (0, 0, 0), 2, {"shadow_soft_size": 0.7}),
        ("POINT", (0, 0, 0), 1, {"shadow_soft_size": 0.7, "use_soft_falloff": False}),
        ("POINT", (0, 0, 0), 2, {"shadow_soft_size": 0.3, "normalize": False}),
        ("POINT", (0, 0, 0), 1, {"shadow_soft_size": 0.0, "normalize": False}),
        ("POINT", (0, 0, 0), 1, {"shadow_soft_size": 0.0, "exposure": 1.5, "color": (1.0, 0.5, 0.2)}),
        ("POINT", (0, 0, 0), 1, {"shadow_soft_size": 0.0, "use_temperature": True, "temperature": 3000.0}),
        ("SPOT", (0.2, 0.1, 0), 1, {"shadow_soft_size": 0.0, "spot_size": 1.0, "spot_blend": 0.0}),
        ("SPOT", (0.3, 0.1, 0), 1, {"shadow_soft_size": 0.0, "spot_size": 1.0, "spot_blend": 0.7}),
        ("SPOT", (0.3, 0.1, 0), (0.6, 1.4, 0.8), {"shadow_soft_size": 0.1, "spot_size": 1.0, "spot_blend": 1.0}),
        ("AREA", (0.1, 0.1, 0), 1, {"shape": "SQUARE", "size": 0.5}),
        ("AREA", (0.5, -0.3, 0), (2.0, 0.5, 1.0), {"shape": "RECTANGLE", "size": 0.3, "size_y": 0.7}),
        ("AREA", (0.5, -0.3, 0), (2.0, 0.5, 1.0), {"shape": "ELLIPSE", "size": 0.3, "size_y": 0.7, "normalize": False}),
        ("AREA", (0.2, 0.0, 0), 1, {"shape": "DISK", "size": 0.4, "spread": 1.2}),
        ("AREA", (0, 0, 0), 1, {"shape": "DISK", "size": 1.2, "spread": 0.0}),
    ],
)
def test_the_irradiance_of_a_lamp_is_what_cycles_renders(registered, scene, tmp_path, kind, turn, scale, values):
    item = lamp(scene, kind, PLACE, turn, **{"energy": 100.0, **values})
    item.scale = (scale,) * 3 if isinstance(scale, int) else scale
    bpy.context.view_layer.update()
    remarks = {}
    found, colour = registered.scene._lamp(item.data, item.matrix_world, "Lamp", remarks)
    samples = registered.light.lamp_samples(found, (0.0, 0.0, 0.0), 256)
    # the plane faces +z, and the add-on's irradiance is that of a plane which faces the lamp, or a parallel beam
    parallel = kind == "SUN" or found.spread == 0.0
    facing = np.sum([each.direction for each in samples], axis=0) if parallel else np.array(PLACE)
    facing = facing / np.linalg.norm(facing)
    bent = sum(each.irradiance * each.direction[2] / (each.direction @ facing) for each in samples)
    expected = np.array(colour) * bent
    assert rendered_irradiance(scene, tmp_path / "a.exr") == pytest.approx(expected, rel=0.01)
    assert remarks == {}


def test_the_emission_of_a_lamp_with_nodes_counts(registered, scene):
    item = lamp(scene, "POINT", PLACE, energy=10.0, color=(1.0, 0.5, 1.0))
    item.data.use_nodes = True
    node = next(each for each in item.data.node_tree.nodes if each.type == "EMISSION")
    node.inputs["Strength"].default_value = 3.0
    remarks = {}
    _, colour = registered.scene._lamp(item.data, item.matrix_world, "Lamp", remarks)
    assert colour == pytest.approx((3.0, 1.5, 3.0))
    tree = item.data.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeBlackbody").outputs[0], node.inputs["Color"])
    _, colour = registered.scene._lamp(item.data, item.matrix_world, "Lamp", remarks)
    assert colour == pytest.approx((1.0, 0.5, 1.0))
    assert list(remarks) == ["the nodes of Lamp are more than an Emission with fixed values, so they are left out"]
