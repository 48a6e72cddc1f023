"""Predictions of a measured flare: curves and scenes from a ghost model."""

import json
import pickle
from functools import cache
from html import unescape

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.errors import FlarewrightError
from flarewright.io.files.file_kind import is_ghost_model_file
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.measure.replay.model_image import light_px, replay_model
from flarewright.measure.replay.placement import over_clipping
from flarewright.model.measurement.ghost_model import BezierGhost, GhostModel, Halo, Reference, Star
from flarewright.model.measurement.replay_camera import ReplayCamera
from flarewright.model.project.scene import Lamp, SceneCamera
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.workflow.measured_camera import model_in_scene
from flarewright.workflow.measured_flares import Counting, model_flare, model_flares
from flarewright.workflow.searches.flare_targets import project_of_model

# light of the captures: 1e5 cd/m2 over 1e-4 sr give 10 lx
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


@cache
def summed(model, constellation_deg, roll_deg=0.0, around=1.0 / 18.0, finer=4):
    """Return the mean luminance of a replay without the disc around the light, from fine binary pixels."""
    width, height = model.size_px
    size = width * finer, height * finer
    layers = {one.name: one.pixels for one in replay_model(model, constellation_deg, roll_deg=roll_deg, size_px=size)}
    x, y = light_px(model, constellation_deg, roll_deg)
    down, right = np.mgrid[: size[1], : size[0]] + 0.5
    inside = np.hypot(right / finer - x, down / finer - y) < around * width
    counted = np.where(inside[..., None], layers["ghosts"], layers["beauty"])
    return float((counted @ luminance_weights("rec709")).mean())


def mean_of(model, constellation_deg, roll_deg=0.0, **counting):
    flare = model_flare(model, "camera.json", 36.0, 0.02, 192, Counting(**counting))
    return float((flare.picture(constellation_deg, roll_deg) @ luminance_weights("rec709")).mean())


def test_its_flare_is_the_replayed_flare_per_lux_without_the_light(file):
    assert is_ghost_model_file(str(file))
    flare = model_flare(planted(), "camera.json", 36.0, 0.02, 192, Counting())
    assert (flare.least_deg, flare.reach_deg) == (2.0, 25.0)
    assert (flare.sensor.width, flare.sensor.height) == (36.0, 20.25)
    # light in the picture, half outside
    for angle in (12.0, 25.0):
        expected = summed(planted(), angle, 40.0) / 10.0
        assert mean_of(planted(), angle, 40.0) == pytest.approx(expected, rel=2e-3)
    ghosts = next(one for one in replay_model(planted(), 12.0, size_px=(480, 270)) if one.name == "ghosts").pixels
    alone = float((ghosts @ luminance_weights("rec709")).mean()) / 10.0
    assert mean_of(planted(), 12.0, ghosts_only=True) == pytest.approx(alone, rel=2e-3)
    assert mean_of(planted(), 12.0) > 1.2 * alone


def test_the_sensor_is_that_of_the_captures_unless_given(tmp_path):
    paths = []
    for width in (None, 22.5):
        paths.append(str(tmp_path / f"{width}.json"))
        write_ghost_model(tmp_path / f"{width}.json", planted().replace(sensor_width_mm=width))
    assert [model_flares(path, None, None, Counting()).frame.width for path in paths] == [36.0, 22.5]
    assert model_flares(paths[1], (32.0, 18.0), None, Counting()).frame.width == 32.0


def test_the_disc_around_the_light_is_as_large_as_asked_for():
    for around in (0.0, 0.02, 0.2):
        expected = summed(planted(), 12.0, 40.0, around) / 10.0
        found = mean_of(planted(), 12.0, 40.0, around_light=around)
        assert found == pytest.approx(expected, rel=0.01 if around == 0.0 else 2e-3)


def test_ghosts_count_over_the_light_too():
    """A ghost over the light's image is visible there as without the halo."""
    over = planted().ghosts[0]
    at = light_px(planted(), 12.0)[0] - planted().axis_px[0]
    there = planted().replace(ghosts=(over.replace(numbers=((at,), *over.numbers[1:])),))
    flare = model_flare(there, "camera.json", 36.0, 0.02, 192, Counting())
    ghosts = model_flare(there, "camera.json", 36.0, 0.02, 192, Counting(ghosts_only=True))
    x, y = (1.2 * place for place in light_px(there, 12.0))
    down, right = np.mgrid[:108, :192] + 0.5
    inside = np.hypot(right - x, down - y) < 192.0 / 18.0 - 1.5
    assert ghosts.picture(12.0)[inside].min() > 0.0
    np.testing.assert_array_equal(flare.picture(12.0)[inside], ghosts.picture(12.0)[inside])


@pytest.mark.parametrize("width_px", [None, 0.6, pytest.param(1.0, marks=pytest.mark.slow)])
def test_statistics_do_not_jump_as_the_light_moves_by_a_tenth_of_a_pixel(width_px):
    """Neither at the disc's border nor where narrow spikes along rows and columns pass between pixel centres."""
    star = None if width_px is None else Star(
        spikes=4, first_deg=0.0, width_px=width_px, radius_px=(1.0, 900.0), radiance=((60.0,) * 3, (1.0,) * 3)
    )  # fmt: skip
    model = planted().replace(size_px=(720, 405), axis_px=(360.0, 202.5), focal_px=765.0, ghosts=(), star=star)
    flare = model_flare(model, "camera.json", 36.0, 0.02, 192, Counting())
    means = []
    # a pixel, or half of one, after which positions repeat mirrored
    for step in range(6 if width_px == 0.6 else 11):
        tangent = 0.1 + 0.1 * step * (720.0 / 192.0) / 765.0
        light = flare.picture(float(np.degrees(np.arctan(tangent))), 30.0) @ luminance_weights("rec709")
        means.append(light.mean())
    assert np.abs(np.diff(means)).max() < 0.002 * np.mean(means)


def test_angles_of_many_digits_are_not_asked_for_beyond_the_last(tmp_path):
    measured = planted().replace(constellation_deg=(2.0987654321, 25.2003999999))
    write_ghost_model(tmp_path / "camera.json", measured)
    assert run(["predict", str(tmp_path / "camera.json"), "--samples", "5", "-o", str(tmp_path / "m.html")]) == 0


def test_curves_of_a_measured_flare(file, tmp_path, capsys):
    arguments = ["predict", str(file), "--unit-per-cd-m2", "0.02", "--luminance", "1,100", "--illuminance", "5"]
    assert run([*arguments, "-o", str(tmp_path / "m.html"), "--samples", "8", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["quality"] == "measured"
    assert data["constellation_deg"][0] == 2.0
    assert data["constellation_deg"][-1] == 25.0
    # 5 lx at a camera that was measured with 10
    k = 3
    light = summed(planted(), data["constellation_deg"][k])
    assert data["veil_cd_m2"][k] == pytest.approx(light / 10.0 * 5.0 / 0.02, rel=2e-3)
    assert data["k_ratio"][k] == pytest.approx(101.0 / (101.0 + 2.0 * data["veil_cd_m2"][k]))


def test_an_unknown_f_number_is_reported_as_unknown(tmp_path, capsys):
    write_ghost_model(tmp_path / "camera.json", planted(Reference()))
    page = tmp_path / "m.html"
    assert run(["predict", str(tmp_path / "camera.json"), "--samples", "5", "-o", str(page)]) == 0
    assert "f-number unknown" in capsys.readouterr().out
    assert "f/nan" not in page.read_text()


def test_values_of_a_model_that_does_not_know_its_light_are_reported_in_its_own_unit(file, tmp_path, capsys):
    write_ghost_model(tmp_path / "own.json", planted(Reference()))
    arguments = ["predict", str(tmp_path / "own.json"), "--samples", "5", "--unit-per-cd-m2", "0.02"]
    assert run([*arguments, "-o", str(tmp_path / "m.html"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["unit"] == "radiance in the captures' unit, with the light that was photographed"
    assert data["illuminance_lx"] is None
    # values are not scaled by an unknown illuminance
    np.testing.assert_allclose(data["veil_cd_m2"], np.array(data["statistics"]["mean"]["values"]) / 0.02)
    page = (tmp_path / "m.html").read_text("utf-8")
    assert data["unit"] in unescape(page)
    assert "illuminance that the light gives" not in page
    assert "The light that was photographed lights the sensor" in page
    assert run(arguments) == 0
    assert "over the light's illuminance" not in capsys.readouterr().out
    assert run([*arguments, "--illuminance", "5"]) == 2
    assert "it lacks luminance_cd_m2 and solid_angle_sr" in capsys.readouterr().err
    assert run(["predict", str(file), "--samples", "5", "--json"]) == 0
    assert "over the illuminance" in json.loads(capsys.readouterr().out)["unit"]


@pytest.mark.parametrize("text", ['{"frames": [], "axis_px": [1, 2]}', "[1, 2]", "no JSON"])
def test_json_that_is_no_model_is_reported_as_such(tmp_path, capsys, text):
    (tmp_path / "merged.json").write_text(text)
    assert run(["predict", str(tmp_path / "merged.json")]) == 2
    reported = capsys.readouterr().err
    assert "merged.json is no ghost model: predict takes" in reported
    assert reported.count("\n") == 1


def test_without_a_unit_there_is_no_veil_to_tell(file, tmp_path, capsys):
    assert run(["predict", str(file), "-o", str(tmp_path / "m.html"), "--samples", "5", "--json"]) == 0
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
    lux = 2000.0 / (100.0 * (1.0 + np.tan(np.radians(14.0)) ** 2))
    veil = summed(planted(), 14.0) / 10.0 * lux / 0.02
    assert data["ranking"][0]["worst_veil_cd_m2"] == pytest.approx(veil, rel=2e-3)
    # without a white level the clipping level is unknown
    assert data["ranking"][0]["brightest_stops_from_clipping"] is None
    assert any("to clipping is not known: the model does not know" in remark for remark in data["remarks"])


def test_a_camera_of_a_scene_says_what_counts(file, tmp_path, capsys):
    scene, x = tmp_path / "scene.toml", 10.0 * np.tan(np.radians(14.0))
    lux = 2000.0 / (100.0 * (1.0 + np.tan(np.radians(14.0)) ** 2))

    def reported(words):
        scene.write_text(SCENE.format(x=x).replace("unit_per_cd_m2", f"{words}\nunit_per_cd_m2"))
        assert run(["predict", str(scene), "--json"]) == 0
        data = json.loads(capsys.readouterr().out)
        return data["ranking"][0]["worst_veil_cd_m2"] * 10.0 * 0.02 / lux, " ".join(data["remarks"])

    veil, words = reported("around_light = 0.2")
    assert veil == pytest.approx(summed(planted(), 14.0, around=0.2), rel=2e-3)
    # atan(0.2 * 160 / 170)
    assert "only farther than 0.2 of the width from the light's image (11 degrees on the axis)" in words
    veil, words = reported('count = "ghosts"')
    assert veil == pytest.approx(summed(planted().replace(halo=None), 14.0), rel=2e-3)
    assert "only ghosts are counted" in words
    scene.write_text(SCENE.format(x=x).replace("unit_per_cd_m2", "around_light = 0.6\nunit_per_cd_m2"))
    assert run(["predict", str(scene)]) == 2
    assert "around_light 0.6 is no part of the picture's width" in capsys.readouterr().err


def test_a_sensor_of_other_proportions_than_the_captures_is_refused_where_it_is_reported(file, tmp_path, capsys):
    scene = tmp_path / "scene.toml"

    def sum_of(lines):
        scene.write_text(SCENE.format(x=2.0).replace("unit_per_cd_m2", f"{lines}\nunit_per_cd_m2"))
        assert run(["predict", str(scene), "--json"]) == 0
        return json.loads(capsys.readouterr().out)["cameras"][0]["lights"][0]["statistics_lx"]["sum_mm2"][0]

    # default: 36 mm wide, with the captures' aspect ratio
    assert sum_of("sensor_mm = [36, 20.25]") == sum_of("")
    assert sum_of("sensor_mm = [18, 10.1]") == pytest.approx(0.25 * sum_of(""))
    scene.write_text(SCENE.format(x=2.0).replace("unit_per_cd_m2", "sensor_mm = [36, 24]\nunit_per_cd_m2"))
    assert run(["predict", str(scene)]) == 2
    assert (
        "camera A: sensor_mm = [36, 24] has other proportions than the captures, which have 160 x 90 pixels; give "
        "sensor_mm = [36, 20.25]"
    ) in capsys.readouterr().err


def test_two_cameras_of_one_model_differ_in_settings_and_remarks(tmp_path, capsys):
    """Equation 8.3 by hand: the captures clip first in green, at 4, at ISO 100, 0.5 s and f/2."""
    clipping = CAPTURED.replace(clipping=(8.0, 4.0, 5.0))
    write_ghost_model(tmp_path / "camera.json", planted(clipping))
    scene = tmp_path / "scene.toml"
    first = SCENE.format(x=2.0).replace("aim_m", "iso = 400\nexposure_s = 0.25\naim_m")
    camera = first[first.index("[[cameras]]") : first.index("[[lights]]")]
    second = camera.replace('"A"', '"B"').replace("iso = 400", "iso = 100\nf_number = 4.0")
    scene.write_text(first.replace("[[lights]]", second + "[[lights]]"))
    assert run(["predict", str(scene), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    stops = {one["camera"]: one["brightest_stops_from_clipping"] for one in data["ranking"]}
    peak = max(data["cameras"][0]["lights"][0]["statistics_lx"]["maximum"])
    assert stops["A"] == pytest.approx(np.log2(peak * (400 / 100) * (0.25 / 0.5) / 4.0))
    # a quarter of the ISO, and two stops less light
    assert stops["B"] == pytest.approx(stops["A"] - 4.0)
    assert any(one.startswith("B: measured at f/2") for one in data["remarks"])
    assert not any(one.startswith("A: measured at f/2") for one in data["remarks"])
    write_ghost_model(tmp_path / "camera.json", planted(clipping.replace(f_number=None)))
    assert run(["predict", str(scene), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    unsure = {one["camera"]: one["brightest_stops_from_clipping"] for one in data["ranking"]}
    assert unsure == {"A": pytest.approx(stops["A"]), "B": None}
    assert any("B: how near its brightest spot is to clipping is not known: the model does not know the f_number" in one
               for one in data["remarks"])  # fmt: skip


def test_white_light_clips_in_the_colour_that_is_filled_first():
    """White of luminance 1 is (0.5, 1, 0.4) in this camera: green clips at 2, red at 1.5, blue at 3."""
    matrix = ((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 2.5))
    model = planted(CAPTURED.replace(clipping=(1.5, 2.0, 3.0))).replace(to_rec709=matrix)
    assert over_clipping(model, ReplayCamera()) == pytest.approx(0.5)
    assert over_clipping(model, ReplayCamera(iso=200.0, exposure_s=0.25, f_number=4.0)) == pytest.approx(0.125)
    # red with a white balance of 0.2 clips first: 0.5 / 0.2
    red = model.replace(reference=CAPTURED.replace(clipping=(0.2, 2.0, 3.0)))
    assert over_clipping(red, ReplayCamera()) == pytest.approx(2.5)
    with pytest.raises(FlarewrightError, match="does not know at which radiance the sensor of its captures clips"):
        over_clipping(planted(), ReplayCamera())


def test_a_spectrum_that_makes_no_difference_is_reported(file, tmp_path, capsys):
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


def test_beyond_what_was_measured_is_reported(file, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(x=10.0))
    assert run(["predict", str(scene), "--json"]) == 0
    reported = capsys.readouterr()
    assert "was measured from 2 to 25 degrees; lamp stands elsewhere in 100% of the times" in reported.err
    data = json.loads(reported.out)
    assert data["cameras"][0]["lights"][0]["known"] == [False]
    assert data["cameras"][0]["veil_cd_m2"] == [None]
    assert data["ranking"][0]["mean_veil_cd_m2"] is data["ranking"][0]["contrast_left"] is None
    assert data["ranking"][0]["known_share"] == 0.0
    assert run(["predict", str(scene), "--near", "A", "--radius", "60"]) == 0
    reported = capsys.readouterr()
    assert "not known" in reported.out
    assert "100 %" not in reported.out


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--fstop", "8"], "--fstop has no meaning for a measured flare"),
        (["--unit-per-cd-m2", "0"], "--unit-per-cd-m2 0 is no unit"),
        (["--luminance", "1,100"], "--luminance 1,100 has no effect without --unit-per-cd-m2"),
        (["--to", "50"], "up to 25"),
        (["--glare"], "--glare has no meaning"),
        (["--check", "3"], "--check has no meaning for a measured flare"),
        (["--around-light", "-0.1"], "--around-light -0.1 is no part of the picture's width"),
        (["--around-light", "nan"], "--around-light nan is no part of the picture's width"),
        # half the diagonal of 16:9
        (["--around-light", "0.574"], "give a number from 0 to below 0.574, or count ghosts only"),
        (["--count", "ghosts", "--around-light", "0.1"], "--around-light has no meaning for --count ghosts"),
        (["--quality", "draft"], "--quality has no meaning for a measured flare"),
        (
            ["--sensor", "36x24"],
            "has other proportions than the captures, which have 160 x 90 pixels; give --sensor 36x20.25",
        ),
    ],
)
def test_bad_flags_for_a_measured_flare(flags, words, file, capsys):
    assert run(["predict", str(file), *flags]) == 2
    reported = capsys.readouterr().err
    assert words in reported


@pytest.mark.parametrize("flags", [["--around-light", "0.1"], ["--count", "all"]])
def test_what_counts_of_a_lens_is_no_choice(flags, tmp_path, capsys):
    assert run(["predict", "heliar-tronnier", *flags]) == 2
    assert f"{flags[0]} has no meaning for a lens" in capsys.readouterr().err
    (tmp_path / "scene.toml").write_text(SCENE.format(x=2.0))
    assert run(["predict", str(tmp_path / "scene.toml"), *flags]) == 2
    assert f"{flags[0]} has no meaning for a scene" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("around_light = -0.1", "around_light"),
        ('count = "ghosts"\naround_light = 0.1', "around_light has no effect with count"),
        ('count = "halo"', "count"),
    ],
)
def test_mistakes_about_what_counts_are_reported_of_a_scene(lines, words, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(x=2.0).replace("unit_per_cd_m2", f"{lines}\nunit_per_cd_m2"))
    assert run(["scene", "check", str(scene)]) == 2
    assert words in capsys.readouterr().err
    one = lines.partition("\n")[0].replace("-", "")
    scene.write_text(SCENE.format(x=2.0).replace('model = "camera.json"', f'lens = "heliar-tronnier"\n{one}')
                     .replace("unit_per_cd_m2 = 0.02\n", ""))  # fmt: skip
    assert run(["scene", "check", str(scene)]) == 2
    assert one.split()[0] in capsys.readouterr().err


def test_a_page_reports_what_is_left_out(file, tmp_path, capsys):
    page = tmp_path / "m.html"
    for flags, words in (
        ([], "the light's own image is left out"),
        (["--count", "ghosts"], "only ghosts are drawn"),
        (["--around-light", "0"], "the light's own image is in it"),
    ):
        assert run(["predict", str(file), "--samples", "5", "-o", str(page), *flags]) == 0
        text = unescape(page.read_text("utf-8"))
        assert words in text
        assert ("image is left out" in text) == (not flags)
        assert words in " ".join(capsys.readouterr().out.split())


def test_what_was_drawn_otherwise_is_not_taken_from_a_cache(file, tmp_path, capsys):
    kept = ["predict", str(file), "--samples", "5", "--cache", str(tmp_path / "c.npz"), "--json"]
    means = []
    for flags in ([], ["--around-light", "0.2"], ["--count", "ghosts"], []):
        assert run([*kept, *flags]) == 0
        means.append(json.loads(capsys.readouterr().out)["statistics"]["mean"]["values"][0])
    assert means[0] == means[3] > means[1] > means[2] > 0.0


def test_a_model_with_nothing_in_it_says_so_instead_of_what_counts(tmp_path, capsys):
    path = tmp_path / "camera.json"
    lit = planted().halo
    for change, flags, words in (
        ({"halo": None}, [], "there is nothing in the model: it has no ghosts, halo, star or sprites"),
        ({"halo": None}, ["--count", "ghosts"], "there is nothing in the model"),
        ({"halo": lit}, ["--count", "ghosts"], "nothing is counted: only ghosts were requested"),
        ({"halo": lit}, [], None),
    ):
        write_ghost_model(path, planted().replace(ghosts=(), **change))
        assert run(["predict", str(path), "--samples", "5", *flags]) == 0
        reported = capsys.readouterr().err
        assert ("are counted" in reported) == (words is None)
        assert words is None or words in reported


def test_a_model_that_does_not_know_its_light_cannot_stand_in_a_scene(tmp_path, capsys):
    write_ghost_model(tmp_path / "camera.json", planted(Reference(f_number=2.0)))
    (tmp_path / "scene.toml").write_text(SCENE.format(x=2.0))
    assert run(["predict", str(tmp_path / "scene.toml")]) == 2
    reported = capsys.readouterr().err
    assert "does not know luminance_cd_m2 and solid_angle_sr" in reported
    assert "write both into the camera.json beside the captures" in reported
    # curves in the model's unit are still possible
    assert run(["predict", str(tmp_path / "camera.json"), "--samples", "5", "--json"]) == 0
    assert "values are in its unit" in capsys.readouterr().err


def test_another_process_makes_the_same_flares_again(file):
    flares = model_flares(str(file), None, 0.02, Counting(around_light=0.1))
    camera = SceneCamera.model_validate(
        {"name": "A", "model": str(file), "unit_per_cd_m2": 0.02, "position_m": (0, 0, 0), "aim_m": (0, 10, 0)}
    )
    lamp = Lamp.model_validate({"kind": "lamp", "name": "a", "position_m": (4, 10, 0), "intensity_cd": 2e3})
    in_scene, _ = model_in_scene(camera, lamp, 48)
    made = []
    for flare in (flares.sampled, flares.shown, in_scene):
        again = pickle.loads(pickle.dumps(flare.recipe))(1)
        assert again.fingerprint == flare.fingerprint
        assert again.size_px == flare.size_px
        assert np.array_equal(again.picture(12.0, 40.0), flare.picture(12.0, 40.0))
        made.append(again.fingerprint)
    assert len(set(made)) == 3


@pytest.mark.parametrize(("low", "high", "covered"), [(-25.0, -2.0, (2.0, 25.0)), (-25.0, 3.0, (0.0, 25.0))])
def test_a_flare_that_was_measured_on_the_other_side(tmp_path, low, high, covered):
    """Half a turn away it is the same; the angles of the other side used to be refused or ignored."""
    always = (planted().ghosts[0].replace(visible_deg=(-26.0, 26.0)),)
    model = planted().replace(constellation_deg=(low, high), ghosts=always)
    flare = model_flare(model, "left.json", 36.0, 0.02, 80, Counting())
    assert (flare.least_deg, flare.reach_deg) == covered
    (drawn, *_) = flare.draw(12.0, 30.0)
    whole = model.replace(constellation_deg=(-25.0, 25.0))
    (other, *_) = model_flare(whole, "both.json", 36.0, 0.02, 80, Counting()).draw(-12.0, 210.0)
    assert np.array_equal(drawn.pixels, other.pixels)
    file = tmp_path / "left.json"
    write_ghost_model(file, model)
    project = project_of_model(file, [(12.0, 0.0)], None, 4)
    assert project.design is not None
