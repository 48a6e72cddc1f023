"""A measured flare goes where a lens goes: curves and scenes from a ghost model."""

import json
from html import unescape

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.cli.predict_flares import model_flare
from flarewright.io.ghost_model_file import names_ghost_model, write_ghost_model
from flarewright.measure.replay import replay
from flarewright.model.ghost_model import BezierGhost, GhostModel, Halo, Reference
from flarewright.optics.color import luminance_weights

# the captures' light: 1e5 cd/m2 on 1e-4 sr give 10 lx
CAPTURED = Reference(f_number=2.0, iso=100.0, exposure_s=0.5, luminance_cd_m2=1e5, solid_angle_sr=1e-4)


def planted(reference=CAPTURED):
    numbers = ((30.0, 25.0), (0.0,), (9.0, 0.5), (9.0,), (7.0,), (5.0,), (5.0,), (4.0,), (5.0,), (3.0,), (6.0,), (1.5,),
               (1.2,), (2.0,), (1.5,), (1.0,), (0.5,), (0.4,), (0.3,))  # fmt: skip
    return GhostModel(
        size_px=(160, 90), axis_px=(80.0, 45.0), focal_px=170.0, largest_deg=25.0, constellation_deg=(2.0, 25.0),
        ghosts=(BezierGhost(name="1", numbers=numbers, visible_deg=(0.0, 26.0)),),
        halo=Halo(radius_px=(1.0, 100.0), radiance=((9.0, 8.0, 7.0), (0.1, 0.1, 0.1))), reference=reference,
    )  # fmt: skip


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "camera.json"
    write_ghost_model(path, planted())
    return path


def test_its_flare_is_the_replayed_ghosts_per_lux(file):
    assert names_ghost_model(str(file))
    flare = model_flare(planted(), "camera.json", 36.0, 0.02, 160)
    ghosts = next(layer for layer in replay(planted(), 12.0, roll_deg=40.0) if layer.name == "ghosts")
    np.testing.assert_allclose(flare.picture(12.0, 40.0), ghosts.pixels / 10.0, rtol=1e-5, atol=1e-12)
    assert (flare.least_deg, flare.reach_deg) == (1.0, 26.0)
    assert (flare.sensor.width, flare.sensor.height) == (36.0, 20.25)


def test_angles_of_many_digits_are_not_asked_for_beyond_the_last(tmp_path):
    measured = planted().replace(constellation_deg=(2.0987654321, 25.2003999999))
    write_ghost_model(tmp_path / "camera.json", measured)
    assert run(["predict", str(tmp_path / "camera.json"), "--samples", "12", "-o", str(tmp_path / "m.html")]) == 0


def test_curves_of_a_measured_flare(file, tmp_path, capsys):
    arguments = ["predict", str(file), "--unit-per-cd-m2", "0.02", "--luminance", "1,100", "--illuminance", "5"]
    assert run([*arguments, "-o", str(tmp_path / "m.html"), "--samples", "20", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["quality"] == "measured"
    assert data["constellation_deg"][0] == 1.0
    assert data["constellation_deg"][-1] == 26.0
    # 5 lx on a camera that was measured with 10
    k = 3
    layers = replay(planted(), data["constellation_deg"][k], size_px=(192, 108))
    light = next(one for one in layers if one.name == "ghosts").pixels @ luminance_weights("rec709")
    assert data["veil_cd_m2"][k] == pytest.approx(light.mean() / 10.0 * 5.0 / 0.02, rel=1e-3)
    assert data["k_ratio"][k] == pytest.approx(101.0 / (101.0 + 2.0 * data["veil_cd_m2"][k]))


def test_an_f_number_that_nobody_told_is_not_made_up(tmp_path, capsys):
    write_ghost_model(tmp_path / "camera.json", planted(Reference()))
    page = tmp_path / "m.html"
    assert run(["predict", str(tmp_path / "camera.json"), "--samples", "12", "-o", str(page)]) == 0
    assert "f-number not told" in capsys.readouterr().out
    assert "f/nan" not in page.read_text()


def test_values_of_a_model_that_does_not_know_its_light_are_told_in_its_own_unit(file, tmp_path, capsys):
    write_ghost_model(tmp_path / "own.json", planted(Reference()))
    arguments = ["predict", str(tmp_path / "own.json"), "--samples", "12", "--unit-per-cd-m2", "0.02"]
    assert run([*arguments, "-o", str(tmp_path / "m.html"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["unit"] == "radiance in the captures' unit, with the light that was photographed"
    assert data["illuminance_lx"] is None
    # no lux that nobody gave
    np.testing.assert_allclose(data["veil_cd_m2"], np.array(data["statistics"]["mean"]["values"]) / 0.02)
    page = (tmp_path / "m.html").read_text("utf-8")
    assert data["unit"] in unescape(page)
    assert "illuminance that the light gives" not in page
    assert "The light that was photographed lights the sensor" in page
    assert run(arguments) == 0
    assert "over the light's illuminance" not in capsys.readouterr().out
    assert run([*arguments, "--illuminance", "5"]) == 2
    assert "it does not tell luminance_cd_m2 and solid_angle_sr" in capsys.readouterr().err
    assert run(["predict", str(file), "--samples", "12", "--json"]) == 0
    assert "over the illuminance" in json.loads(capsys.readouterr().out)["unit"]


@pytest.mark.parametrize("text", ['{"frames": [], "axis_px": [1, 2]}', "[1, 2]", "no JSON"])
def test_json_that_is_no_model_is_told_as_such(tmp_path, capsys, text):
    (tmp_path / "merged.json").write_text(text)
    assert run(["predict", str(tmp_path / "merged.json")]) == 2
    told = capsys.readouterr().err
    assert "merged.json is no ghost model: predict takes" in told
    assert told.count("\n") == 1


def test_without_a_unit_there_is_no_veil_to_tell(file, tmp_path, capsys):
    assert run(["predict", str(file), "-o", str(tmp_path / "m.html"), "--samples", "14", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert set(data["veil_cd_m2"]) == {None}
    assert "no scene" in (tmp_path / "m.html").read_text("utf-8")


SCENE = """
schema_version = 1
luminance_cd_m2 = [1.0, 100.0]
[[cameras]]
name = "A"
model = "camera.json"
unit_per_cd_m2 = 0.02
position_m = [0.0, 0.0, 0.0]
aim_m = [0.0, 10.0, 0.0]
[[lights]]
name = "lamp"
position_m = [{x}, 10.0, 0.0]
intensity_cd = 2000.0
"""


def test_scene_with_a_measured_camera(file, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(x=10.0 * np.tan(np.radians(14.0))))
    assert run(["predict", str(scene), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    light = next(one for one in replay(planted(), 14.0, size_px=(192, 108)) if one.name == "ghosts")
    lux = 2000.0 / (100.0 * (1.0 + np.tan(np.radians(14.0)) ** 2))
    veil = (light.pixels @ luminance_weights("rec709")).mean() / 10.0 * lux / 0.02
    assert data["ranking"][0]["worst_veil_cd_m2"] == pytest.approx(veil, rel=1e-3)
    assert data["ranking"][0]["brightest_stops_from_clipping"] is None


def test_a_spectrum_that_makes_no_difference_is_told(file, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(x=1.0))
    assert run(["predict", str(scene), "--json"]) == 0
    plain = json.loads(capsys.readouterr().out)
    assert plain["cameras"][0]["k_ideal"] == pytest.approx(99.0 / 101.0)
    (veil,), (real,) = plain["cameras"][0]["veil_cd_m2"], plain["cameras"][0]["k_real"]
    assert real == pytest.approx(99.0 / (101.0 + 2.0 * veil))
    scene.write_text(SCENE.format(x=1.0) + 'spectrum = "black-body:3000"\n')
    assert run(["predict", str(scene), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert "A: measured in its captures' light: the spectrum of lamp makes no difference" in data["remarks"]
    assert data["ranking"] == plain["ranking"]


def test_beyond_what_was_measured_is_told(file, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(x=10.0))
    assert run(["predict", str(scene), "--json"]) == 0
    told = capsys.readouterr()
    assert "was measured from 1 to 26 degrees; lamp stands elsewhere in 100% of the times" in told.err
    data = json.loads(told.out)
    assert data["cameras"][0]["lights"][0]["known"] == [False]
    assert data["cameras"][0]["veil_cd_m2"] == [None]
    assert data["ranking"][0]["mean_veil_cd_m2"] is data["ranking"][0]["contrast_left"] is None
    assert data["ranking"][0]["known_share"] == 0.0
    assert run(["predict", str(scene), "--near", "A", "--radius", "60"]) == 0
    told = capsys.readouterr()
    assert "not known" in told.out
    assert "100 %" not in told.out


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--fstop", "8"], "--fstop has no meaning for a measured flare"),
        (["--unit-per-cd-m2", "0"], "--unit-per-cd-m2 0 is no unit"),
        (["--luminance", "1,100"], "--luminance 1,100 tells nothing without --unit-per-cd-m2"),
        (["--to", "50"], "up to 26"),
        (["--glare"], "--glare has no meaning"),
        (["--check", "3"], "--check has no meaning for a measured flare"),
        (["--quality", "draft"], "--quality has no meaning for a measured flare"),
        (
            ["--sensor", "36x24"],
            "has other proportions than the captures, which have 160 x 90 pixels; give --sensor 36x20.25",
        ),
    ],
)
def test_bad_flags_for_a_measured_flare(flags, words, file, capsys):
    assert run(["predict", str(file), *flags]) == 2
    told = capsys.readouterr().err
    assert words in told


def test_a_model_that_does_not_know_its_light_cannot_stand_in_a_scene(tmp_path, capsys):
    write_ghost_model(tmp_path / "camera.json", planted(Reference(f_number=2.0)))
    (tmp_path / "scene.toml").write_text(SCENE.format(x=2.0))
    assert run(["predict", str(tmp_path / "scene.toml")]) == 2
    assert "does not tell luminance_cd_m2 and solid_angle_sr" in capsys.readouterr().err
    # curves in its own unit are told all the same
    assert run(["predict", str(tmp_path / "camera.json"), "--samples", "13", "--json"]) == 0
    assert "values are in its own unit" in capsys.readouterr().err
