"""`flarewright scene check` reports the errors of `flarewright predict`, each with its camera and key."""

import json

import pytest

from flarewright.cli.app import run
from flarewright.io.measurement.ghost_model_file import write_ghost_model, write_ghost_tracks
from flarewright.model.measurement.ghost_model import GhostModel, Halo, Reference
from flarewright.model.measurement.ghost_tracks import Tracks
from flarewright.model.project.scene import Lamp, SceneCamera
from flarewright.workflow.lens_flares import camera_project

LIT = Reference(luminance_cd_m2=1e5, solid_angle_sr=1e-4)


@pytest.fixture
def scene(tmp_path):
    """Return a function that writes a scene with these cameras and a lamp 10 m before them."""
    whole = GhostModel(
        size_px=(160, 90), axis_px=(80.0, 45.0), focal_px=170.0, largest_deg=25.0, constellation_deg=(2.0, 25.0),
        halo=Halo(radius_px=(1.0, 100.0), radiance=((9.0, 8.0, 7.0), (0.1, 0.1, 0.1))), reference=LIT,
    )  # fmt: skip
    write_ghost_model(tmp_path / "whole.json", whole)
    write_ghost_model(tmp_path / "unlit.json", whole.replace(reference=Reference()))
    text = (tmp_path / "whole.json").read_text()
    (tmp_path / "cut.json").write_text(text[: text.index('"reference"')])
    write_ghost_tracks(tmp_path / "tracks.json", Tracks(ghosts=()))

    def write(*cameras, aim="[0, 10, 0]", lamp="[2, 10, 0]"):
        parts = [
            f'[[cameras]]\nname = "{name}"\nposition_m = [0, 0, 0]\naim_m = {aim}\n{lines}\n'
            for name, lines in zip("ABCDEFGH", cameras, strict=False)
        ]
        path = tmp_path / "scene.toml"
        path.write_text("".join(parts) + f'[[lights]]\nname = "lamp"\nposition_m = {lamp}\nintensity_cd = 100\n')
        return path

    return write


def measured(file, more=""):
    return f'model = "{file}"\nunit_per_cd_m2 = 0.02\n{more}'


WRONG = {
    "no file": (measured("nope.json"), "model", "nope.json does not exist"),
    "half a file": (measured("cut.json"), "model", "cut.json is not valid JSON"),
    "another file": (measured("tracks.json"), "model", "tracks.json is no ghost model: a camera's model is"),
    "no light": (measured("unlit.json"), "model", "does not know luminance_cd_m2 and solid_angle_sr"),
    "nothing left": (measured("whole.json", "around_light = 9"), "around_light", "around_light 9 is no part"),
    "other sensor": (measured("whole.json", "sensor_mm = [36, 24]"), "sensor_mm", "give sensor_mm = [36, 20.25]"),
    "no lens": ('lens = "nope"', "lens", "'nope' is neither a shipped lens nor a file"),
    "too fast": ('lens = "heliar-tronnier"\nf_number = 1.0', "f_number", "f/1 is faster than"),
    "no zoom": ('lens = "heliar-tronnier"\nzoom = 70.0', "zoom", "no positions to zoom to"),
    "no such coating": ('lens = "heliar-tronnier"\ncoating = "preset:shiny"', "coating", "no coating preset 'shiny'"),
    "no such focus": ('lens = "heliar-tronnier"\nfocus_m = 1e306', "focus_m", "focus_distance should be a finite"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_check_refuses_what_predict_refuses(case, scene, capsys):
    lines, key, words = WRONG[case]
    file = scene(lines)
    assert run(["scene", "check", str(file)]) == 2
    reported = capsys.readouterr().err
    assert f"scene.toml: cameras[0].{key} (A): " in reported
    assert words in reported
    assert run(["predict", str(file)]) == 2
    reported = capsys.readouterr().err
    assert "camera A: " in reported
    assert words in reported


@pytest.mark.parametrize("camera", ['lens = "heliar-tronnier"\n', measured("whole.json")])
@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        ("[1e-300, 1e300]", "1e-300x1e+300"), ("[36, 0.05]", "36x0.05"), ("[36, 1e-200]", "36x1e-200"),
        ("[0.001, 24]", "0.001x24"), ("[1, 1000]", "1x1000"), ("[36, 3.5]", "36x3.5"), ("[2000, 1500]", "2000x1500"),
    ],
)  # fmt: skip
def test_sensors_that_no_camera_has_are_refused(camera, sensor, words, scene, capsys):
    file = scene(f"{camera}sensor_mm = {sensor}")
    remedy = "give sides of 0.1 to 1000 mm, the longer at most 10 times the shorter"
    for command in (["scene", "check"], ["predict"]):
        assert run([*command, str(file)]) == 2
        assert f"scene.toml: cameras[0].sensor_mm: {words} mm is no sensor; {remedy}" in capsys.readouterr().err


@pytest.mark.parametrize("sensor", [(36.0, 3.6), (3.6, 36.0), (3.0, 0.3), (0.1, 0.1), (1000.0, 562.5)])
def test_pixels_of_a_scene_are_square(sensor):
    spot = Lamp(name="spot", position_m=(0.0, 9.0, 0.0), intensity_cd=1.0)
    seen = SceneCamera(
        name="A", lens="heliar-tronnier", position_m=(0.0, 0.0, 0.0), aim_m=(0.0, 1.0, 0.0), sensor_mm=sensor
    )
    camera = camera_project(seen, spot, 0.0).camera
    assert camera.sensor_mm == sensor
    assert camera.pixel_aspect == pytest.approx(1.0, rel=0.02)


def test_everything_that_is_wrong_with_all_cameras_is_reported_at_once(scene, capsys):
    file = scene(
        measured("unlit.json", "around_light = 9\nsensor_mm = [36, 24]"),
        'lens = "heliar-tronnier"',
        'lens = "heliar-tronnier"\nf_number = 1.0\nzoom = 70.0\ncoating = "preset:shiny"\niso = 400',
        'lens = "nope"',
        measured("whole.json"),
    )
    assert run(["scene", "check", str(file), "--json"]) == 2
    reported = json.loads(capsys.readouterr().out)
    assert reported["usable"] is False
    assert [one.partition(": ")[0] for one in reported["problems"]] == [
        "cameras[0].model (A)", "cameras[0].around_light (A)", "cameras[0].sensor_mm (A)", "cameras[2].zoom (C)",
        "cameras[2].f_number (C)", "cameras[2].coating (C)", "cameras[3].lens (D)",
    ]  # fmt: skip


def test_every_finding_in_a_lens_file_is_reported_with_its_camera(scene, tmp_path, capsys):
    (tmp_path / "own.toml").write_text('schema_version = 1\nname = "own"\nf_number = "fast"\nrows = "none"\n')
    assert run(["scene", "check", str(scene('lens = "own.toml"')), "--json"]) == 2
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert len(problems) == 2
    assert all(one.startswith("cameras[0].lens (A): ") and "own.toml: " in one for one in problems)


def test_a_lamp_in_a_lens_is_reported_before_anything_is_drawn(scene, capsys):
    file = scene('lens = "heliar-tronnier"', lamp="[0.01, 0.1, 0]")
    assert run(["scene", "check", str(file)]) == 2
    reported = capsys.readouterr().err
    assert "lights[0] (lamp) and cameras[0] (A): a light" in reported
    assert "stands in or right at the lens" in reported
    # the distance does not matter for a measured flare
    assert run(["scene", "check", str(scene(measured("whole.json"), lamp="[0.01, 0.1, 0]"))]) == 0


def test_every_light_without_visible_light_is_reported(scene, capsys):
    file = scene(measured("whole.json"))
    infrared = 'spectrum = { kind = "table", wavelength_nm = [1200, 1300], power = [1, 1] }\n'
    more = "".join(
        f'[[lights]]\nname = "{name}"\nposition_m = [3, 10, 0]\nintensity_cd = 100\n{spectrum}'
        for name, spectrum in (("beacon", infrared), ("spot", 'spectrum = "black-body:3000"\n'), ("heater", infrared))
    )
    file.write_text(file.read_text() + more)
    assert run(["scene", "check", str(file), "--json"]) == 2
    remedy = "the spectrum (table) has no visible light; give it power between 380 and 780 nm"
    problems = [f"lights[1].spectrum (beacon): {remedy}", f"lights[3].spectrum (heater): {remedy}"]
    assert json.loads(capsys.readouterr().out)["problems"] == problems
    assert run(["predict", str(file)]) == 2
    assert f"scene.toml has 2 problems, the first: {problems[0]}" in capsys.readouterr().err


def test_cameras_that_can_be_used_are_usable(scene, capsys):
    file = scene(
        measured("whole.json"),
        measured("whole.json", 'count = "ghosts"\nsensor_mm = [18, 10.1]'),
        'lens = "canon-28-80"\nf_number = 8\nfocus_m = 3\ncoating = "preset:staggered"',
    )
    assert run(["scene", "check", str(file)]) == 0
    assert "usable, 3 cameras, 1 light" in capsys.readouterr().out
