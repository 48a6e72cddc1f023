"""Lights of USD stages against the projection of USD's own camera."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.errors import FileError, FlarewrightError
from flarewright.io.tracks.read_tracks import read_tracks


def test_without_the_library_one_sentence_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pxr", None)
    monkeypatch.setitem(__import__("sys").modules, "pxr.Usd", None)
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    with pytest.raises(
        FlarewrightError, match=r"needs the package pxr; install it with: pip install 'flarewright\[usd\]'"
    ):
        read_tracks(tmp_path / "a.usda")


@pytest.fixture
def stage(tmp_path):
    """A camera that pans and zooms past four lights, in a scene with another up axis and unit."""
    pytest.importorskip("pxr")
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

    file = str(tmp_path / "scene.usda")
    made = Usd.Stage.CreateNew(file)
    UsdGeom.SetStageUpAxis(made, UsdGeom.Tokens.z)
    made.SetStartTimeCode(1001)
    made.SetEndTimeCode(1003)
    made.SetTimeCodesPerSecond(25)
    rig = UsdGeom.Xform.Define(made, "/rig")
    rig.AddTranslateOp().Set(Gf.Vec3d(3, -20, 5))
    camera = UsdGeom.Camera.Define(made, "/rig/cam")
    turn = camera.AddRotateXYZOp()
    for k in range(3):
        turn.Set(Gf.Vec3f(80, 0, 4.0 * k), 1001 + k)
        camera.GetFocalLengthAttr().Set(35.0 + 5.0 * k, 1001 + k)
    camera.GetHorizontalApertureAttr().Set(24.0)
    camera.GetVerticalApertureAttr().Set(13.5)
    camera.GetHorizontalApertureOffsetAttr().Set(1.5)
    camera.GetVerticalApertureOffsetAttr().Set(-0.75)
    lamp = UsdLux.SphereLight.Define(made, "/lamp")
    lamp.AddTranslateOp().Set(Gf.Vec3d(2, 10, 8))
    lamp.GetRadiusAttr().Set(0.25)
    lamp.GetColorAttr().Set(Gf.Vec3f(1.0, 0.5, 0.25))
    flash = UsdLux.RectLight.Define(made, "/flash")
    flash.AddTranslateOp().Set(Gf.Vec3d(5, 15, 6))
    flash.GetIntensityAttr().Set(0.0, 1001)
    flash.GetIntensityAttr().Set(2.0, 1002)
    sun = UsdLux.DistantLight.Define(made, "/sun")
    sun.AddRotateXYZOp().Set(Gf.Vec3f(-95, 0, 0))
    sun.GetAngleAttr().Set(0.53)
    behind = UsdLux.DiskLight.Define(made, "/behind")
    behind.AddTranslateOp().Set(Gf.Vec3d(3, -90, 5))
    UsdLux.DomeLight.Define(made, "/sky")
    made.GetRootLayer().Save()
    return made, file, (Usd, UsdGeom, Gf, Sdf)


def test_lights_are_where_the_camera_of_usd_projects_them(stage):
    made, file, (usd, geom, gf, _) = stage
    found = read_tracks(file)
    assert (found.format, found.fps) == ("usd", 25.0)
    tracks = {track.name: track for track in found.tracks}
    assert sorted(tracks) == ["flash", "lamp", "sun"]
    for k, frame in enumerate((1001, 1002, 1003)):
        view = geom.Camera(made.GetPrimAtPath("/rig/cam")).GetCamera(usd.TimeCode(frame)).frustum
        project = view.ComputeViewMatrix() * view.ComputeProjectionMatrix()
        for name, point in (("lamp", gf.Vec3d(2, 10, 8)), ("flash", gf.Vec3d(5, 15, 6))):
            if tracks[name].hidden is not None and tracks[name].hidden[k]:
                continue
            x, y, _z = project.Transform(point)
            assert tracks[name].from_top_left((1.0, 1.0))[k] == pytest.approx((0.5 + 0.5 * x, 0.5 - 0.5 * y), abs=1e-5)
        # a distant light shines along its -z, turned by -95 degrees about x
        far = gf.Rotation(gf.Vec3d(1, 0, 0), -95).TransformDir(gf.Vec3d(0, 0, 1e9))
        x, y, _z = project.Transform(far)
        assert tracks["sun"].from_top_left((1.0, 1.0))[k] == pytest.approx((0.5 + 0.5 * x, 0.5 - 0.5 * y), abs=1e-5)
    np.testing.assert_allclose(tracks["lamp"].rgb, np.tile([1.0, 0.5, 0.25], (3, 1)))
    assert tracks["sun"].diameter_deg == pytest.approx(0.53)
    assert tracks["flash"].hidden.tolist() == [True, False, False]
    remarks = " ".join(found.remarks)
    assert all(word in remarks for word in ("'behind' is never in front", "sky have no place", "intensities of flash"))


def test_a_light_whose_colour_passes_through_black_keeps_its_colours_and_is_off_there(stage):
    """One black frame made the light white in all frames, and lit in the black one."""
    made, file, (usd, _geom, gf, _) = stage
    colour = made.GetPrimAtPath("/lamp").GetAttribute("inputs:color")
    for frame, value in ((1001, (1.0, 0.2, 0.1)), (1002, (0.0, 0.0, 0.0)), (1003, (0.1, 0.2, 1.0))):
        colour.Set(gf.Vec3f(*value), usd.TimeCode(frame))
    made.GetRootLayer().Save()
    lamp = next(track for track in read_tracks(file).tracks if track.name == "lamp")
    assert lamp.hidden.tolist() == [False, True, False]
    np.testing.assert_allclose(lamp.rgb, [[1.0, 0.2, 0.1], [1.0, 0.2, 0.1], [0.1, 0.2, 1.0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#usda 1.0\n", "has no camera"),
        ("#usda 1.0\ndef Camera \"a\" {}\ndef Camera \"b\" {}\n", "2 cameras (/a, /b)"),
        ("#usda 1.0\ndef Camera \"a\" {}\n", "has no light with a place"),
        ("#usda 1.0\n(\n", "cannot be read as a USD stage"),
        ("no stage", "cannot be read as a USD stage"),
        (
            "#usda 1.0\n(startTimeCode = 1\nendTimeCode = 1e9)\ndef Camera \"a\" {}\ndef SphereLight \"b\" (\n"
            "prepend apiSchemas = [\"LightAPI\"]) {}\n", "give a range of 1 to 10000 frames",
        ),
        (
            "#usda 1.0\ndef Camera \"a\" {\nfloat focalLength = 0\n}\ndef SphereLight \"b\" {}\n",
            "a focal length or an aperture of 0",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_one_sentence(tmp_path, text, said):
    pytest.importorskip("pxr")
    (tmp_path / "a.usda").write_text(text)
    with pytest.raises(FileError) as error:
        read_tracks(tmp_path / "a.usda")
    assert said in str(error.value)
    assert "\n" not in str(error.value)
