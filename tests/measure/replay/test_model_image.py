"""Replay: geometry, brightness, file and command."""

import ctypes
import json
import signal

import numpy as np
import OpenEXR
import pytest
from planted_residual import CAPTURED, TRUE
from planted_run import LARGEST, SIZE, views

from flarewright.cli.app import run
from flarewright.cli.common import end_as_interrupted
from flarewright.errors import FlarewrightError
from flarewright.io.images.exr import read_exr
from flarewright.io.images.half import rounded_to_half
from flarewright.io.measurement.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.replay.model_image import light_px, replay_model
from flarewright.measure.replay.placement import brightness_gain, constellation_of_light
from flarewright.model.measurement.ghost_model import AberrationGhost, BezierGhost, GhostModel, Halo, Reference, Star
from flarewright.model.measurement.replay_camera import ReplayCamera


def planted() -> GhostModel:
    """Return a model with a ghost of each kind, a halo and a star."""
    channels = []
    for m in range(3):
        numbers = np.zeros(NUMBERS)
        numbers[:4] = -60.0 - m, 1.0, 0.5, 4.0
        numbers[10:13] = 14.0 + m, 1.0, 0.3
        numbers[20:23] = 900.0 - 200.0 * m, 80.0, 0.0
        numbers[30:33] = 1.2, 0.1, 1.1
        channels.append(channel_of(numbers, 1))
    bezier = ((30.0, 25.0), (0.0,), (9.0, 0.5), (9.0,), (7.0,), (5.0,), (5.0,), (4.0,), (5.0,), (3.0,), (6.0,), (1.5,),
              (1.2,), (2.0,), (1.5,), (1.0,), (0.5,), (0.4,), (0.3,))  # fmt: skip
    return GhostModel(
        size_px=(160, 90), axis_px=(80.3, 44.6), focal_px=170.0, largest_deg=25.0, constellation_deg=(0.0, 25.0),
        ghosts=(
            AberrationGhost(
                name="1", red=channels[0], green=channels[1], blue=channels[2], visible_deg=(0.0, 25.0)
            ),
            BezierGhost(name="2", numbers=bezier, visible_deg=(5.0, 20.0)),
        ),
        halo=Halo(radius_px=(1.0, 10.0, 100.0), radiance=((9.0, 8.0, 7.0), (0.9, 0.8, 0.7), (0.01, 0.01, 0.01))),
        star=Star(
            spikes=6, first_deg=10.0, width_px=1.0, radius_px=(1.0, 60.0), radiance=((5.0, 5.0, 5.0), (0.1, 0.1, 0.1))
        ),
        reference=Reference(f_number=2.0, iso=100.0, exposure_s=0.5, luminance_cd_m2=1e5, solid_angle_sr=1e-4),
    )  # fmt: skip


def test_constellation_and_roll_are_equations_8_1_and_8_2():
    forward, up = (0.3, -0.2, -1.0), (0.1, 1.0, 0.2)
    light = (4.0, 2.0, -7.0)
    constellation, roll = constellation_of_light((1.0, 0.5, 0.2), forward, up, light)
    f, away = np.array(forward), np.array(light) - (1.0, 0.5, 0.2)
    cosine = f @ away / np.linalg.norm(f) / np.linalg.norm(away)
    assert constellation == pytest.approx(np.degrees(np.arccos(cosine)), abs=1e-9)
    z = -f / np.linalg.norm(f)
    x = np.cross(up, z) / np.linalg.norm(np.cross(up, z))
    assert roll == pytest.approx(np.degrees(np.arctan2(np.cross(z, x) @ away, x @ away)), abs=1e-9)
    assert constellation_of_light((0, 0, 0), (0, 0, -1), (0, 1, 0), (0, 1, -1)) == pytest.approx((45.0, 90.0))
    # the arc cosine of 8.1 gives 0 here
    assert constellation_of_light((0, 0, 0), (0, 0, -1), (0, 1, 0), (1e-9, 0, -1))[0] == pytest.approx(5.7296e-8)


@pytest.mark.parametrize(
    ("change", "factor"),
    [
        ({}, 1.0), ({"f_number": 4.0}, 0.25), ({"iso": 400.0}, 4.0), ({"exposure_s": 0.25}, 0.5),
        ({"luminance_cd_m2": 3e5, "solid_angle_sr": 2e-4}, 6.0), ({"f_number": 1.0, "iso": 50.0}, 2.0),
    ],
)  # fmt: skip
def test_brightness_is_equation_8_3(change, factor):
    assert brightness_gain(planted().reference, ReplayCamera(**change)) == pytest.approx(factor)


def test_a_setting_without_its_old_value_is_refused():
    with pytest.raises(FlarewrightError, match="iso"):
        brightness_gain(Reference(f_number=2.0), ReplayCamera(iso=100.0))


@pytest.mark.parametrize("change", [{"iso": 1e308, "exposure_s": 1e308}, {"f_number": 1e-300}, {"iso": 1e-300}])
def test_a_brightness_that_no_picture_holds_is_refused(change):
    with pytest.raises(FlarewrightError, match="check these settings"):
        brightness_gain(planted().reference, ReplayCamera(**change))


def test_a_camera_that_looks_nowhere_is_reported_as_such():
    with pytest.raises(FlarewrightError, match="forward has no length"):
        constellation_of_light((0, 0, 0), (0, 0, 0), (0, 1, 0), (0, 1, -1))
    with pytest.raises(FlarewrightError, match="light at the camera's own place"):
        constellation_of_light((0, 1, 0), (0, 0, -1), (0, 1, 0), (0, 1, 0))


def test_without_memory_a_replay_reports_what_its_own_flags_can_do(tmp_path, capsys, monkeypatch):
    def stop(*_, **__):
        raise MemoryError

    monkeypatch.setattr("flarewright.measure.replay.model_image.replay_model", stop)
    write_ghost_model(tmp_path / "model.json", planted())
    arguments = ["--constellation", "8", "--size", "80x45", "-o", str(tmp_path / "o.exr")]
    assert run(["measure", "replay", str(tmp_path / "model.json"), *arguments]) == 2
    reported = capsys.readouterr().err
    assert "not enough memory" in reported
    assert "leave --ghosts out" in reported
    assert "--brightest" not in reported


def test_ctrl_c_while_a_kernel_compiles_is_an_interrupt(tmp_path, capsys, monkeypatch, default_signals):
    """The compiler calls back from C, where an exception is lost; what it had not stored then is missing later."""

    def compiling(*_, **__):
        @ctypes.CFUNCTYPE(None)
        def callback():
            signal.raise_signal(signal.SIGINT)

        callback()
        raise RuntimeError("no compiled object yet for a kernel")

    monkeypatch.setattr("flarewright.measure.replay.model_image.replay_model", compiling)
    write_ghost_model(tmp_path / "model.json", planted())
    arguments = [
        "measure",
        "replay",
        str(tmp_path / "model.json"),
        "--constellation",
        "8",
        "-o",
        str(tmp_path / "o.exr"),
    ]
    end_as_interrupted()
    assert run(arguments) == 130
    assert capsys.readouterr().err == "flarewright: interrupted; nothing was left half-written\n"


def test_roll_turns_ghosts_and_the_other_side_is_half_a_turn():
    model = planted().replace(size_px=(161, 161), axis_px=(80.5, 80.5), halo=None, star=None)
    right, up, left = (replay_model(model, 15.0, roll_deg=roll)[0].pixels for roll in (0.0, 90.0, 180.0))
    assert right.max() > 0.0
    assert np.allclose(np.rot90(right), up, atol=1e-5 * right.max())
    whole = model.replace(constellation_deg=(-25.0, 25.0))
    assert np.allclose(replay_model(whole, 15.0, roll_deg=180.0)[0].pixels, left)
    ghost = whole.ghosts[0].replace(visible_deg=(-25.0, 25.0))
    mirrored = whole.replace(ghosts=(ghost,))
    assert np.allclose(replay_model(mirrored, -15.0)[0].pixels, replay_model(mirrored, 15.0, roll_deg=180.0)[0].pixels)


def test_what_is_seen_where_the_captures_end_is_seen_within_the_turntables_jitter():
    model = planted().replace(constellation_deg=(2.0, 20.0), halo=None, star=None)
    model = model.replace(ghosts=(model.ghosts[0].replace(visible_deg=(2.0, 20.0)),))
    last = replay_model(model, 20.0)[0].pixels
    assert replay_model(model, 20.04)[0].pixels.sum() == pytest.approx(last.sum(), rel=0.1)
    for nobody_saw in (1.9, 20.1):
        with pytest.raises(FlarewrightError, match="measured from 2 to 20"):
            replay_model(model, nobody_saw)


def test_light_lies_where_the_tangent_says():
    assert light_px(planted(), 20.0, 90.0) == pytest.approx((80.3, 44.6 - 170.0 * np.tan(np.radians(20.0))))


def test_a_finer_picture_shows_the_same_radiance():
    model = planted().replace(halo=None, star=None)
    coarse = replay_model(model, 12.0)[0].pixels
    fine = replay_model(model, 12.0, size_px=(480, 270))[0].pixels
    average = fine.reshape(90, 3, 160, 3, 3).mean(axis=(1, 3))
    assert np.abs(average - coarse).sum() < 0.02 * coarse.sum()


def test_layers_add_up_and_single_ghosts_too():
    model = planted()
    layers = {layer.name: layer for layer in replay_model(model, 12.0, single=True, gain=2.0)}
    parts = layers["ghosts"].pixels + layers["halo"].pixels + layers["starburst"].pixels
    assert np.allclose(layers["beauty"].pixels, parts, rtol=1e-6)
    total = np.zeros_like(parts)
    for name in ("ghost.1", "ghost.2"):
        x, y, w, h = layers[name].window
        total[y : y + h, x : x + w] += layers[name].pixels
    assert np.allclose(total, layers["ghosts"].pixels, atol=1e-6 * total.max())
    assert "ghost.2" not in {layer.name for layer in replay_model(model, 22.0, single=True)}


def test_a_ghost_at_the_border_has_a_layer_where_it_is_and_none_when_it_has_left():
    model = planted()
    for angle in (22.0, 23.5, 24.9):
        for layer in replay_model(model.replace(axis_px=(28.3, 44.6)), angle, single=True):
            if layer.name == "ghost.1":
                # rounding had left 1e-17 in rows across the whole picture
                assert layer.window[2] < 60
                assert layer.pixels.max() > 1e-6
    gone = replay_model(model.replace(axis_px=(-28.3, 44.6)), 24.9, single=True)
    assert "ghost.1" not in {layer.name for layer in gone}


def test_the_cameras_colours_become_rec709_by_its_matrix():
    model = planted()
    with pytest.raises(FlarewrightError, match="has no colour matrix of its camera"):
        replay_model(model, 12.0, colors="rec709")
    matrix = ((1.5, -0.4, -0.1), (-0.2, 1.4, -0.2), (0.0, -0.5, 1.5))
    known = model.replace(to_rec709=matrix)
    for own, seen in zip(
        replay_model(known, 12.0, single=True), replay_model(known, 12.0, single=True, colors="rec709"), strict=True
    ):
        assert (own.name, own.window) == (seen.name, seen.window)
        np.testing.assert_allclose(seen.pixels, own.pixels @ np.array(matrix).T, rtol=1e-4, atol=1e-6)


def test_file_and_command(tmp_path, capsys):
    model = planted()
    path, out, camera = tmp_path / "model.json", tmp_path / "o.exr", tmp_path / "camera.json"
    write_ghost_model(path, model)
    assert read_ghost_model(path) == model
    camera.write_text(json.dumps({"light": [0.2, 0.1, -1.0], "f_number": 4.0, "size_px": [80, 45]}))
    arguments = ["measure", "replay", str(path), "--camera", str(camera), "-o", str(out), "--json"]
    assert run([*arguments, "--float"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["brightness"] == 0.25
    expected = replay_model(
        model, reported["constellation_deg"], roll_deg=reported["roll_deg"], size_px=(80, 45), gain=0.25
    )
    assert np.array_equal(read_exr(out).layers[0].pixels, expected[0].pixels)
    # half floats by default, scaled for the camera's brightness as for a light of that intensity
    assert run(arguments) == 0
    assert json.loads(capsys.readouterr().out)["scale"] == 4096.0
    assert np.array_equal(read_exr(out).layers[0].pixels, rounded_to_half(expected[0].pixels * 4096) / 4096)


@pytest.mark.parametrize("size", [[0, 5], [-5, 5], [80, 70000]])
def test_a_camera_file_without_a_picture_is_refused(tmp_path, capsys, size):
    path, camera = tmp_path / "model.json", tmp_path / "camera.json"
    write_ghost_model(path, planted())
    camera.write_text(json.dumps({"size_px": size}))
    arguments = ["--constellation", "8", "--camera", str(camera), "-o", str(tmp_path / "o.exr")]
    assert run(["measure", "replay", str(path), *arguments]) == 2
    assert "camera.json: size_px[" in capsys.readouterr().err


def test_two_rolls_at_one_constellation_each_tell_a_halo(tmp_path):
    model = planted()
    twice = ((2.0, 1.0), (5.0, 0.9), (5.0, 0.8))
    reported = model.replace(halo=model.halo.replace(strength=twice), star=model.star.replace(strength=twice))
    write_ghost_model(tmp_path / "model.json", reported)
    assert read_ghost_model(tmp_path / "model.json") == reported


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("star", "radiance"), [[1, 1, 1]], "star: a star needs one radiance for each radius, not 1 for 2"),
        (("star", "radius_px"), [60.0, 1.0], "star: a star's radius_px must rise"),
        (("star", "strength"), [[5.0, 1.0], [2.0, 1.0]], "constellations of a star's strength must rise"),
        (("halo", "radius_px"), [0.0, 1.0, 2.0], "halo: a halo's radius_px must be above 0"),
        (("halo", "strength"), [[5.0, 1.0], [2.0, 1.0]], "constellations of a halo's strength must rise"),
        (("halo", "even"), [[5.0, [1, 1, 1]], [2.0, [1, 1, 1]]], "constellations of a halo's even must rise"),
        (("constellation_deg",), [25.0, 0.0], "constellation_deg 25 to 0: the smaller comes first"),
        (("ghosts", 1, "visible_deg"), [20.0, 5.0], "visible_deg 20 to 5: the smaller constellation must come first"),
    ],
)
def test_a_model_whose_numbers_do_not_fit_together_is_refused(tmp_path, capsys, place, value, message):
    data = planted().model_dump(mode="json")
    target = data
    for key in place[:-1]:
        target = target[key]
    target[place[-1]] = value
    (tmp_path / "model.json").write_text(json.dumps(data))
    arguments = ["--constellation", "8", "-o", str(tmp_path / "o.exr")]
    assert run(["measure", "replay", str(tmp_path / "model.json"), *arguments]) == 2
    reported = capsys.readouterr().err
    assert message in reported
    assert reported.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        ("{", ["--constellation", "3"], "not valid JSON"),
        ("[]", ["--constellation", "3"], "a JSON object was expected"),
        ('{"schema_version": 2}', ["--constellation", "3"], "newer than"),
        ('{"size_px": [3, 3]}', ["--constellation", "3"], "axis_px"),
        (None, [], "--constellation DEG"),
        (
            None,
            ["--constellation", "80"],
            "measured from 0 to 25 degrees and does not cover 80: choose degrees",
        ),
        (None, ["--constellation", "nan"], "does not cover nan"),
        (None, ["--constellation", "-10"], "choose 10 with roll 180, where the light stands as well"),
        (None, ["--constellation", "-10", "--roll", "200"], "choose 10 with roll 20"),
        (None, ["--constellation", "8", "--roll", "nan"], "roll nan is no direction"),
        (None, ["--constellation", "8", "--size", "8"], "--size"),
    ],
)
def test_bad_input_is_one_sentence(tmp_path, capsys, text, arguments, message):
    path = tmp_path / "model.json"
    path.write_text(planted().model_dump_json() if text is None else text)
    assert run(["measure", "replay", str(path), "-o", str(tmp_path / "o.exr"), *arguments]) == 2
    reported = capsys.readouterr().err
    assert message in reported
    assert "Traceback" not in reported
    assert not (tmp_path / "o.exr").exists()


def test_a_ghost_comes_and_goes_between_the_captures_that_show_it_and_those_that_do_not():
    seen = views(TRUE, angles=CAPTURED)
    one = TRUE[1]
    whole, some = (to_model([DetectedGhost((one, one, one), *ends)], seen)[0] for ends in ((0, 23), (5, 11)))
    assert (whole.visible_deg, whole.fade_deg) == ((1.0, 24.0), (0.0, 0.0))
    assert (some.visible_deg, some.fade_deg) == ((5.5, 12.5), (1.0, 1.0))
    model = GhostModel(
        size_px=SIZE, axis_px=(120.0, 80.0), focal_px=1e4, largest_deg=LARGEST, constellation_deg=(1.0, 24.0),
        ghosts=(some,),
    )  # fmt: skip
    always = model.replace(ghosts=(some.replace(visible_deg=(1.0, 24.0), fade_deg=(0.0, 0.0)),))
    for angle, part in ((5.0, 0.0), (5.25, 0.25), (5.5, 0.5), (6.0, 1.0), (12.0, 1.0), (12.75, 0.25), (13.0, 0.0)):
        there, all_of_it = (float(replay_model(each, angle)[0].pixels.sum()) for each in (model, always))
        assert there == pytest.approx(part * all_of_it, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("rec709", [False, True])
def test_only_a_converted_replay_states_rec709(tmp_path, rec709):
    """Other programs take stated primaries for true, and a camera's own colours have none."""
    write_ghost_model(tmp_path / "model.json", planted().replace(to_rec709=((1.1, -0.1, 0), (0, 1, 0), (0, 0, 1))))
    words = ["--constellation", "8", "--size", "80x45", "-o", str(tmp_path / "o.exr"), *(["--rec709"] * rec709)]
    assert run(["measure", "replay", str(tmp_path / "model.json"), *words]) == 0
    with OpenEXR.File(str(tmp_path / "o.exr")) as file:
        header = set(file.parts[0].header)
    assert ({"chromaticities", "colorInteropID"} <= header, "chromaticities" in header) == (rec709, rec709)
