"""The scene of the add-on against Blender: places in the picture, what hides lights, animation, instances."""

from __future__ import annotations

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the wheel of Blender: docs/blender.md")

from blender_objects import camera, finished, keyed, lamp, material, plane  # noqa: E402
from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Vector  # noqa: E402

from flarewright.io.tracks.scene_json import read_scene  # noqa: E402

pytestmark = pytest.mark.blender


def tracks(addon):
    """Return the export, and its tracks as the program reads them, by name."""
    export = finished(addon.scene.read_scene(bpy.context))
    return export, {track.name: track for track in read_scene(json.dumps(export.data), "s.json").tracks}


@pytest.mark.parametrize(
    ("render", "values"),
    [
        ({}, {}),
        ({"resolution_x": 720, "resolution_y": 1280}, {}),
        ({}, {"sensor_fit": "VERTICAL", "sensor_height": 20.0}),
        ({"resolution_x": 720, "resolution_y": 1280}, {"sensor_fit": "HORIZONTAL"}),
        ({}, {"shift_x": 0.13, "shift_y": -0.21}),
        ({"resolution_x": 720, "resolution_y": 1280}, {"shift_x": 0.13, "shift_y": -0.21}),
        ({}, {"sensor_fit": "VERTICAL", "shift_x": 0.1, "shift_y": 0.2}),
        ({"pixel_aspect_x": 2.0}, {"shift_x": 0.1}),
        ({"pixel_aspect_y": 3.0}, {"shift_y": 0.1}),
        ({"resolution_percentage": 50}, {}),
    ],
)
def test_a_light_lies_where_blender_projects_it_in_every_frame(registered, scene, render, values):
    scene.frame_end = 24
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    scene.unit_settings.scale_length = 0.01
    for key, value in render.items():
        setattr(scene.render, key, value)
    eye = camera(scene, lens=35.0, **values)
    # a scaled camera sees as one without scale
    eye.scale = (2.0, 0.5, 3.0)
    for frame in (1, 24):
        eye.location = (0.1 * frame, -0.05 * frame, 5.0)
        eye.rotation_euler = (0.01 * frame, 0.002 * frame, 0.015 * frame)
        eye.keyframe_insert("location", frame=frame)
        eye.keyframe_insert("rotation_euler", frame=frame)
    eye.data.keyframe_insert("lens", frame=1)
    eye.data.lens = 42.0
    eye.data.keyframe_insert("lens", frame=24)
    place = Vector((1.0, 0.7, -3.0))
    lamp(scene, "POINT", place)
    export, found = tracks(registered)
    share = scene.render.resolution_percentage / 100
    whole = np.array([scene.render.resolution_x, scene.render.resolution_y]) * share
    window = export.window
    # the window of the flare begins left of and below the picture
    drawn = found["Lamp"].from_top_left(window.size_px)
    drawn[:, 1] = window.size_px[1] - drawn[:, 1]
    drawn += (window.left, window.bottom)
    assert found["Lamp"].frames.tolist() == list(range(1, 25))
    for k, frame in enumerate(range(1, 25)):
        scene.frame_set(frame)
        seen = world_to_camera_view(scene, scene.camera, place)
        assert drawn[k] == pytest.approx(np.array(seen[:2]) * whole, abs=0.02)
    # the axis of the lens is the middle of the window in the first frame
    state = export.data["camera"]["frames"][0]
    assert np.abs((np.array(state["axis"]) - 0.5) * window.size_px).max() <= 0.5


def test_cameras_bound_to_markers_follow_each_other(registered, scene):
    scene.frame_end = 2
    near, far = camera(scene, lens=20.0), camera(scene, lens=80.0)
    for frame, eye in ((1, near), (2, far)):
        scene.timeline_markers.new(f"F{frame}", frame=frame).camera = eye
    lamp(scene, "POINT", (1.0, 0.0, -9.0))
    export, found = tracks(registered)
    assert [state["focal_mm"] for state in export.data["camera"]["frames"]] == [20.0, 80.0]
    places = found["Lamp"].places[:, 0] - 0.5
    assert places[1] / places[0] == pytest.approx(4.0)


def test_a_sun_lies_where_a_far_point_of_its_direction_does(registered, scene):
    camera(scene, (0, 0, 0), (0.3, 0.1, 0.2), lens=40.0, shift_x=0.05)
    sun = lamp(scene, "SUN", (5, 6, 7), (2.9, 0.15, -0.1), angle=0.01, energy=3.0)
    bpy.context.view_layer.update()
    export, found = tracks(registered)
    far = Vector(sun.matrix_world.col[2][:3]) * 1e6
    seen = world_to_camera_view(scene, scene.camera, far)
    place = found["Lamp"].from_top_left(export.window.size_px)[0]
    place = place[0] + export.window.left, export.window.size_px[1] - place[1] + export.window.bottom
    assert place == pytest.approx((seen[0] * scene.render.resolution_x, seen[1] * scene.render.resolution_y), abs=0.1)
    assert found["Lamp"].diameter_deg == pytest.approx(np.degrees(0.01))
    assert found["Lamp"].intensity.tolist() == pytest.approx([3.0], rel=1e-6)


def test_the_drawn_window_holds_the_rendered_part_and_has_the_size_that_blender_renders(registered, scene, tmp_path):
    camera(scene, shift_x=0.1)
    lamp(scene, "POINT", (0, 0, -5))
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 101, 67, 90
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.23, 0.71, 0.11, 0.83
    render.engine = "CYCLES"
    scene.cycles.samples = 1
    render.image_settings.file_format = "PNG"
    render.filepath = str(tmp_path / "a.png")
    bpy.ops.render.render(write_still=True)
    rendered = bpy.data.images.load(str(tmp_path / "a.png"))
    window = finished(registered.scene.read_scene(bpy.context)).window
    view = registered.scene._camera_view(scene, scene.camera)
    assert view.size_px == (90, 60)
    left, bottom, right, top = view.region
    assert (right - left, top - bottom) == tuple(rendered.size)
    assert window.left <= left
    assert window.left + window.size_px[0] >= right
    assert (window.size_px[0] - (right - left)) % 2 == 0
    assert (window.size_px[1] - (top - bottom)) % 2 == 0


def test_a_wall_hides_a_lamp_and_half_a_wall_half_of_it(registered, scene):
    scene.frame_end = 4
    camera(scene)
    lamp(scene, "POINT", (0, 0, -10), shadow_soft_size=1.0, energy=100.0)
    wall = plane(scene, (0, 0, -5), half=5.0)
    # beside the lamp, over its left half, over all of it, and behind it
    keyed(wall, "location", (-9.0, 0, -5), (-5.0, 0, -5), (0.0, 0, -5), (0.0, 0, -20))
    scene.flarewright.rays = 128
    levels = tracks(registered)[1]["Lamp"].intensity
    assert levels[0] == levels[3] > 0.0
    assert levels[1] == pytest.approx(0.5 * levels[0], rel=0.03)
    assert levels[2] == 0.0
    scene.flarewright.occlusion = False
    assert len(set(tracks(registered)[1]["Lamp"].intensity.tolist())) == 1


def test_lamps_of_a_collection_that_is_not_rendered_and_portals_are_left_out(registered, scene):
    camera(scene)
    lamp(scene, "POINT", (0, 0, -9), name="Kept")
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    dark = lamp(scene, "POINT", (1, 0, -9), name="Dark")
    scene.collection.objects.unlink(dark)
    hidden.objects.link(dark)
    hidden.hide_render = True
    lamp(scene, "AREA", (0, 0, -9), (3.14, 0, 0), name="Portal", size=1.0).data.cycles.is_portal = True
    assert sorted(tracks(registered)[1]) == ["Kept"]


@pytest.mark.parametrize("mark", ["passes", "hide_render", "visible_camera"])
def test_what_is_not_seen_hides_nothing(registered, scene, mark):
    camera(scene)
    lamp(scene, "SUN", energy=2.0)
    wall = plane(scene, (0, 0, -5), (0.0, 0.0, 0.3), half=5.0)
    bpy.data.objects["Lamp"].rotation_euler = (0.0, 3.1416, 0.0)
    with pytest.raises(registered.errors.FlareError, match="no light of the scene reaches the camera"):
        tracks(registered)
    if mark == "passes":
        wall.flarewright.passes = True
    else:
        setattr(wall, mark, mark == "hide_render")
    assert tracks(registered)[1]["Lamp"].intensity.tolist() == pytest.approx([2.0])


def test_a_lamp_that_is_switched_off_or_not_rendered_is_dark(registered, scene):
    scene.frame_end = 3
    camera(scene)
    bulb = lamp(scene, "POINT", (0, 0, -10), energy=50.0)
    keyed(bulb.data, "energy", 50.0, 0.0, 50.0)
    keyed(bulb, "hide_render", False, False, True)
    levels = tracks(registered)[1]["Lamp"].intensity
    assert levels[0] == pytest.approx(50.0 / (4 * np.pi * 100.0), rel=1e-3)
    assert levels[1:].tolist() == [0.0, 0.0]


def test_lamps_of_instances_are_lights_of_their_own(registered, scene):
    camera(scene)
    posts = bpy.data.collections.new("Posts")
    data = bpy.data.lights.new("Bulb", "POINT")
    data.energy = 10.0
    bulb = bpy.data.objects.new("Bulb", data)
    posts.objects.link(bulb)
    for k in range(3):
        empty = bpy.data.objects.new(f"Post{k}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", posts
        empty.location = (k - 1.0, 0.0, -10.0)
        scene.collection.objects.link(empty)
    found = tracks(registered)[1]
    assert sorted(found) == ["Post0/Bulb", "Post1/Bulb", "Post2/Bulb"]
    xs = [found[f"Post{k}/Bulb"].places[0, 0] for k in range(3)]
    assert xs[0] < xs[1] < xs[2]
    assert xs[1] == pytest.approx(0.5)


def test_a_collection_and_marks_choose_the_lights(registered, scene):
    camera(scene)
    keys = bpy.data.collections.new("Keys")
    scene.collection.children.link(keys)
    for k, name in enumerate(("A", "B", "C")):
        item = lamp(scene, "POINT", (k, 0, -9), name=name)
        if name != "C":
            keys.objects.link(item)
    scene.flarewright.collection = keys
    bpy.data.objects["B"].flarewright.ignored = True
    assert sorted(tracks(registered)[1]) == ["A"]


def test_a_glowing_panel_has_its_irradiance_its_place_and_its_size(registered, scene):
    camera(scene)
    panel = plane(scene, (2.0, 0.0, -20.0), half=0.5)
    material(panel, "ShaderNodeEmission", Color=(1.0, 0.5, 0.25, 1.0), Strength=8.0)
    panel.flarewright.glows = True
    track = tracks(registered)[1]["Plane"]
    # radiance times solid angle, with the cosine at the panel
    distance = np.hypot(2.0, 20.0)
    omega = 20.0 / distance / distance**2
    luminance = 8.0 * (np.array([1.0, 0.5, 0.25]) @ registered.document.LUMINANCE)
    assert track.intensity[0] == pytest.approx(luminance * omega, rel=0.01)
    assert track.rgb[0].tolist() == pytest.approx([1.0, 0.5, 0.25])
    assert track.diameter_deg == pytest.approx(np.degrees(2 * np.sqrt(omega / np.pi)), rel=0.01)
    wall = plane(scene, (0.5, 0.0, -10.0), half=0.5, name="Wall")
    half = tracks(registered)[1]["Plane"]
    assert wall.name == "Wall"
    assert half.intensity[0] == pytest.approx(0.5 * track.intensity[0], rel=0.1)
    assert half.places[0, 0] > track.places[0, 0]
    scene.flarewright.occlusion = False
    assert tracks(registered)[1]["Plane"].intensity[0] == track.intensity[0]


def test_a_glowing_ball_hides_its_own_back(registered, scene):
    camera(scene)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=(0, 0, -20), segments=64, ring_count=32)
    ball = bpy.context.object
    material(ball, "ShaderNodeEmission", Strength=2.0)
    ball.flarewright.glows = True
    assert tracks(registered)[1][ball.name].intensity[0] == pytest.approx(2.0 * np.pi / 400.0, rel=0.03)
    # also where it hides nothing else
    ball.flarewright.passes, ball.visible_camera = True, False
    assert tracks(registered)[1][ball.name].intensity[0] == pytest.approx(2.0 * np.pi / 400.0, rel=0.03)


def test_what_has_no_lens_or_no_light_is_one_sentence(registered, scene):
    def said():
        with pytest.raises(registered.errors.FlareError) as error:
            tracks(registered)
        return str(error.value)

    assert said() == "the scene has no camera; add one, and make it the active camera"
    eye = camera(scene)
    assert said().startswith("the scene has no light; add a lamp")
    panel = plane(scene, (0, 0, -5))
    panel.flarewright.glows = True
    assert said() == "'Plane' has no material; give its radiance in its properties under Flarewright"
    eye.data.type = "ORTHO"
    assert said() == "the camera 'Camera' has no perspective, which a lens has; choose Perspective"
    assert scene.frame_current == 1
