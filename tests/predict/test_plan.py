"""Scenes: light at a camera, ranking, choice of cameras and better positions, in cases that can be checked by hand."""

import itertools
import json
import os
import re
import threading
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from painted import painted
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.cli.common import remembered
from flarewright.errors import FlarewrightError, OutputError, ProjectError
from flarewright.io.project.file_of_kind import example_file
from flarewright.io.project.scene_file import scene_from_data
from flarewright.io.render_state.flare_cache import read_cache, write_cache
from flarewright.model.project.scene import Lamp, LampKey, Scene
from flarewright.optics.lens.field_angles import brightness_scale
from flarewright.predict.flare import Frame
from flarewright.predict.photometry import beam, disc_illuminance, exposure_level, point_illuminance
from flarewright.predict.plan import plan_scene, ranking
from flarewright.predict.scene_data import found_words
from flarewright.predict.scene_page import scene_page
from flarewright.predict.search import best_position
from flarewright.predict.switching import choose_cameras, switching
from flarewright.predict.tracks import camera_track, lamp_places, moments, sightings

FRAME = Frame(36.0, 24.0)


def camera(**changes):
    fields = {"name": "A", "lens": "heliar-tronnier", "position_m": (0.0, 0.0, 0.0), "aim_m": (0.0, 10.0, 0.0)}
    return {**fields, **changes}


def lamp(**changes):
    fields = {"kind": "lamp", "name": "lamp", "position_m": (10.0, 10.0, 0.0), "intensity_cd": 2000.0}
    return {**fields, **changes}


def scene(cameras=None, lights=None, **changes):
    return Scene.model_validate({"cameras": cameras or [camera()], "lights": lights or [lamp()], **changes})


def seen(given):
    times, dates = moments(given)
    tracks = [camera_track(one, times, one.name) for one in given.cameras]
    return sightings(given, tracks, times, dates)


def plan(given, **painting):
    flare = painted(**painting)
    return plan_scene(given, lambda *_: (flare, FRAME), lambda _: lambda *_: None)


# ---------------------------------------------------------------------------------------------------------------------
# light at a camera


def test_inverse_square():
    assert point_illuminance(2000.0, np.array([1.0, 10.0])).tolist() == [2000.0, 20.0]


def test_disc_is_luminance_times_solid_angle_far_away_and_pi_l_close():
    far = disc_illuminance(1e6, 0.5, np.array([100.0]))[0]
    assert far == pytest.approx(1e6 * np.pi * 0.25**2 / 100.0**2, rel=1e-5)
    assert disc_illuminance(1e6, 0.5, np.array([1e-6]))[0] == pytest.approx(np.pi * 1e6, rel=1e-9)
    # the sun: 1.6e9 cd/m2 on 0.53 degrees give 1.07e5 lx
    across = 2.0 * np.tan(np.radians(0.265))
    assert disc_illuminance(1.6e9, across, np.array([1.0]))[0] == pytest.approx(1.075e5, rel=0.01)


def test_beam_has_half_at_its_edge_and_nothing_behind():
    np.testing.assert_allclose(beam(np.array([0.0, 20.0, 90.0, 150.0]), 40.0), [1.0, 0.5, 0.0, 0.0], atol=1e-12)


def test_exposure_clips_at_78_lux_seconds_over_iso_and_follows_equation_8_3():
    assert exposure_level(78.0, 100.0, 0.01) == pytest.approx(1.0)
    ratio = exposure_level(5.0, 800.0, 0.002) / exposure_level(5.0, 100.0, 0.01)
    assert ratio == pytest.approx(brightness_scale({"iso": 8.0, "exposure_s": 0.2}))


def test_a_lamp_at_the_side():
    found = seen(scene())[0][0]
    assert found.constellation_deg[0] == pytest.approx(45.0)
    assert found.roll_deg[0] == pytest.approx(0.0, abs=1e-9)
    assert found.illuminance_lx[0] == pytest.approx(2000.0 / 200.0)
    assert found.distance_m[0] == pytest.approx(np.sqrt(200.0))


def test_an_aimed_lamp_gives_half_at_the_edge_of_its_beam():
    # seen from (10, 10) the camera at the origin is 45 degrees off an aim along -x
    found = seen(scene(lights=[lamp(aim_m=(0.0, 10.0, 0.0), beam_deg=90.0)]))[0][0]
    assert found.illuminance_lx[0] == pytest.approx(5.0)


def test_keyframes_are_straight_lines_and_stand_still_beyond():
    keys = [
        {"at_s": 10.0, "position_m": (0.0, 20.0, 0.0), "gain": 0.0},
        {"at_s": 20.0, "position_m": (0.0, 10.0, 0.0), "gain": 1.0},
    ]
    given = scene(lights=[lamp(position_m=(0.0, 40.0, 0.0), keyframes=keys)], time={"duration_s": 30.0, "step_s": 5.0})
    found = seen(given)[0][0]
    np.testing.assert_allclose(found.distance_m, [40.0, 30.0, 20.0, 15.0, 10.0, 10.0, 10.0])
    gain = np.array([1.0, 0.5, 0.0, 0.5, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(found.illuminance_lx, 2000.0 / found.distance_m**2 * gain, atol=1e-12)


def test_distant_light_and_north():
    east = {"kind": "distant", "name": "moon", "azimuth_deg": 90.0, "elevation_deg": 30.0, "illuminance_lx": 0.2}
    found = seen(scene(lights=[east]))[0][0]
    # east of a camera that looks north, 30 degrees up: 90 degrees off its axis
    assert found.constellation_deg[0] == pytest.approx(90.0)
    assert found.roll_deg[0] == pytest.approx(30.0)
    # y of the plan points east: the light is ahead
    found = seen(scene(lights=[east], north_deg=90.0))[0][0]
    assert found.constellation_deg[0] == pytest.approx(30.0)
    assert found.roll_deg[0] == pytest.approx(90.0)


def test_the_sun_is_dark_below_the_horizon_that_hides_it():
    pytest.importorskip("astral")
    given = scene(
        lights=[{"kind": "sun", "horizon_deg": 20.0}],
        site={"latitude_deg": 0.0, "longitude_deg": 0.0},
        time={"start": "2024-03-20T06:00:00+00:00", "duration_s": 21600.0, "step_s": 3600.0},
    )
    lux = seen(given)[0][0].illuminance_lx
    # at the equator the sun climbs 15 degrees per hour from six to noon
    assert (lux > 0.0).tolist() == [False, False, True, True, True, True, True]
    assert lux[-1] == pytest.approx(1.03e5, rel=0.02)


@pytest.mark.parametrize(
    ("cameras", "lights", "words"),
    [
        ([camera(aim_m=(0.0, 0.0, 0.0))], None, "aims at its own place"),
        ([camera(aim_m=(0.0, 0.0, 9.0))], None, "up is along its view"),
        (None, [lamp(position_m=(0.0, 0.0, 0.0))], "stands at the camera's place"),
        (None, [lamp(aim_m=(10.0, 10.0, 0.0), beam_deg=30.0)], "the lamp aims at its own place"),
    ],
)
def test_places_that_do_not_fit_are_reported(cameras, lights, words):
    with pytest.raises(ProjectError, match=words):
        seen(scene(cameras, lights))


# ---------------------------------------------------------------------------------------------------------------------
# plan


def test_veil_is_the_mean_flare_as_luminance_of_the_scene():
    """At 20 degrees, a node of the table: 0.25e-3 of 10 lx on a disc of 36 pi mm^2, over 0.05 lx per cd/m^2."""
    position = tuple(np.sqrt(200.0) * np.array([np.sin(np.radians(20.0)), np.cos(np.radians(20.0)), 0.0]))
    given = scene(lights=[lamp(position_m=position)], luminance_cd_m2=(0.0, 0.02))
    found = plan(given)
    veil = 0.25e-3 * 10.0 * 36.0 * np.pi / FRAME.area / 0.05
    assert found.veil(0)[0] == pytest.approx(veil, rel=0.02)
    assert found.contrast_left(found.veil(0))[0] == pytest.approx(0.02 / (0.02 + 2.0 * veil), rel=0.02)
    one = ranking(found)[0]
    assert one.worst_constellation_deg == pytest.approx(20.0)
    assert one.worst_veil_cd_m2 == one.mean_veil_cd_m2 == found.veil(0)[0]
    # 0.0025 lx for 0.01 s at ISO 100, clipping at 78
    assert one.brightest_stops == pytest.approx(np.log2(0.0025 * 0.01 * 100.0 / 78.0), abs=0.01)


def test_lights_add_and_the_brighter_ranks_first():
    lights = [lamp(name="dim"), lamp(name="bright", intensity_cd=6000.0)]
    found = plan(scene(lights=lights))
    assert found.veil(0)[0] == pytest.approx(4.0 * found.veil(0, 0)[0])
    assert [found.scene.lights[one.light].name for one in ranking(found)] == ["bright", "dim"]


def test_glare_indicator_is_over_the_log_average_of_the_scene():
    given = scene(luminance_cd_m2=(1.0, 100.0))
    expected = plan(given).pairs[0][0].column("log_average")[0] / 0.05
    assert plan(given).glare_indicator(0, 0)[0] == pytest.approx(expected / 10.0)
    assert plan(scene(luminance_cd_m2=(1.0, 100.0), key_cd_m2=5.0)).glare_indicator(0, 0)[0] == pytest.approx(
        expected / 5.0
    )


def test_a_light_behind_makes_no_flare():
    found = plan(scene(lights=[lamp(position_m=(0.0, -10.0, 0.0))]))
    assert found.veil(0)[0] == 0.0


def measured_plan(given, reach_deg):
    """Return a plan whose cameras' flare is known up to a constellation."""
    flare = replace(painted(), reach_deg=reach_deg, dark_beyond=False)
    return plan_scene(given, lambda *_: (flare, FRAME), lambda _: lambda *_: None)


def test_pairs_beyond_the_measured_range_are_unknown_and_rank_last():
    aside = lamp(name="aside", position_m=(10.0, 1.0, 0.0), intensity_cd=1e6)
    found = measured_plan(scene(lights=[lamp(position_m=(3.0, 10.0, 0.0)), aside], luminance_cd_m2=(1.0, 9.0)), 30.0)
    assert found.veil(0, 0)[0] > 0.0
    assert np.isnan(found.veil(0, 1)[0])
    assert np.isnan(found.veil(0)[0])
    known, unknown = ranking(found)
    assert (known.light, unknown.light) == (0, 1)
    assert (known.known_share, unknown.known_share) == (1.0, 0.0)
    assert unknown.mean_veil_cd_m2 is unknown.contrast_left is unknown.worst is None
    shown = scene_page(found, [known, unknown], (), None, ())
    assert "<td>aside</td><td>not known</td>" in shown
    assert "without flare" not in shown


def test_names_of_a_scene_are_escaped_on_its_page():
    found = plan(scene(cameras=[camera(name='<b>&"')], lights=[lamp(name="<i>")], name="</title>"))
    shown = scene_page(found, ranking(found), (), None, ())
    assert "<td>&lt;b&gt;&amp;&#34;</td><td>&lt;i&gt;</td>" in shown
    assert "<title>Flare plan: &lt;/title&gt;</title>" in shown
    assert "<b>" not in shown
    assert "<i>" not in shown
    assert "&amp;lt;" not in shown


def test_a_mean_is_of_the_times_that_are_known():
    keys = [{"at_s": 20.0, "position_m": (40.0, 1.0, 0.0)}]
    given = scene(lights=[lamp(position_m=(0.0, 10.0, 0.0), keyframes=keys)], time={"duration_s": 20.0, "step_s": 5.0})
    found = measured_plan(given, 60.0)
    (one,) = ranking(found)
    assert one.known_share == pytest.approx(0.4)
    assert one.mean_veil_cd_m2 == pytest.approx(found.veil(0)[:2].mean())


# ---------------------------------------------------------------------------------------------------------------------
# which camera when


@cache
def orders(cameras, count, shortest):
    """Return all orders without shorter shots, shape (N, count)."""
    every = itertools.product(range(cameras), repeat=count)
    lengths = ((order, [len(list(shot)) for _, shot in itertools.groupby(order)]) for order in every)
    return np.array([order for order, runs in lengths if min(runs) >= min(shortest, count)])


def all_orders(cost, shortest):
    """Return the least cost of all orders without shorter shots, by exhaustive search."""
    cameras, count = cost.shape
    return cost[orders(cameras, count, shortest), np.arange(count)].sum(axis=1).min()


@pytest.mark.parametrize("shortest", [1, 2, 3, 4, 9])
def test_switching_is_the_best_of_all_orders(shortest):
    rng = np.random.default_rng(shortest)
    for _ in range(20):
        cost = rng.exponential(size=(2 if shortest % 2 else 3, 7))
        shots = switching(cost, shortest)
        assert [shots[0].first, shots[-1].until] == [0, 7]
        assert all(a.until == b.first and a.camera != b.camera for a, b in itertools.pairwise(shots))
        assert all(shot.until - shot.first >= min(shortest, 7) for shot in shots)
        total = sum(cost[shot.camera, shot.first : shot.until].sum() for shot in shots)
        assert total == pytest.approx(all_orders(cost, shortest), rel=1e-12)


def test_equal_cameras_are_not_switched():
    assert len(switching(np.ones((3, 8)))) == 1


def test_shots_last_as_long_as_asked():
    veil = np.array([[0.0, 0.0, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 1.0, 1.0]])
    times = np.arange(5) * 60.0
    assert len(choose_cameras(veil, times, 181.0)) == 1
    assert choose_cameras(veil[:1], times, 0.0) == ()


def test_a_camera_whose_flare_is_not_known_is_taken_only_where_no_other_is_known():
    dark, times = np.nan, np.arange(5) * 60.0
    shots = choose_cameras(np.array([[9.0, 9.0, 9.0, 9.0, dark], [1.0, dark, dark, dark, dark]]), times, 0.0)
    assert {shot.camera for shot in shots if shot.first < 3} == {0}
    assert len(choose_cameras(np.full((2, 5), dark), times, 0.0)) == 1


# ---------------------------------------------------------------------------------------------------------------------
# a better position


def test_search_does_not_go_where_nothing_is_known():
    """The known range of a measured camera ends at 25 degrees; its real flare does not."""
    given = scene([camera(aim_m=(0.0, 10.0, 0.0))], [lamp(position_m=(4.0, 10.0, 0.0))])
    found = best_position(measured_plan(given, 25.0), 0, 6.0)
    best = found.veils_cd_m2[found.best]
    assert np.isnan(found.veils_cd_m2).any()
    assert best == np.nanmin(found.veils_cd_m2) > 0.0
    words = found_words(measured_plan(given, 25.0), found)
    assert "are where its flare is not known" in words
    lost = best_position(measured_plan(given, 10.0), 0, 6.0)
    assert not lost.better
    assert "is not known" in found_words(measured_plan(given, 10.0), lost)
    assert "is not known" in scene_page(measured_plan(given, 10.0), [], (), lost, ())


def test_search_finds_where_the_lamp_leaves_the_view():
    """Flare halves every ten degrees and ends at 60: at the best place in the disc the lamp is farthest off axis."""
    given = scene([camera(aim_m=(0.0, 10.0, 0.0))], [lamp(position_m=(4.0, 10.0, 0.0))])
    found = best_position(plan(given), 0, 3.0)
    assert found.better
    assert np.hypot(*found.offsets_m[found.best, :2]) <= 3.0 + 1e-9
    assert found.veils_cd_m2[found.best] < 0.9 * found.veils_cd_m2[0]
    # within a tenth of the best on a fine grid over the disc
    grid = [(x, y) for x in np.linspace(-3.0, 3.0, 25) for y in np.linspace(-3.0, 3.0, 25) if np.hypot(x, y) <= 3.0]
    flare = painted(100)
    least = min(
        plan_scene(
            scene([camera(position_m=(x, y, 0.0))], [lamp(position_m=(4.0, 10.0, 0.0))]),
            lambda *_: (flare, FRAME),
            lambda _: lambda *_: None,
        ).veil(0)[0]
        for x, y in grid[::4]
    )
    assert found.veils_cd_m2[found.best] < 1.1 * least


def test_positions_are_compared_at_the_times_that_are_known_where_the_camera_stands():
    keys = [{"at_s": 10.0, "position_m": (4.0, 10.0, 0.0)}, {"at_s": 20.0, "position_m": (40.0, 1.0, 0.0)}]
    light = lamp(position_m=(4.0, 10.0, 0.0), keyframes=keys)
    given = scene([camera()], [light], time={"duration_s": 20.0, "step_s": 5.0})
    found = best_position(measured_plan(given, 30.0), 0, 2.0)
    assert (found.moments, found.unknown) == (3, 2)
    assert found.veils_cd_m2[0] == pytest.approx(measured_plan(given, 30.0).veil(0)[0])
    words = found_words(measured_plan(given, 30.0), found)
    assert "at the 3 of 5 times at which the flare at its position is known" in words


def test_search_says_when_nothing_is_better():
    moon = {"kind": "distant", "name": "m", "azimuth_deg": 20.0, "elevation_deg": 0.0, "illuminance_lx": 1.0}
    # its aim point is so far away that nothing changes within a metre
    found = best_position(plan(scene([camera(aim_m=(0.0, 1e6, 0.0))], [moon])), 0, 1.0)
    assert not found.better
    behind = best_position(plan(scene([camera()], [{**moon, "azimuth_deg": 180.0}])), 0, 1.0)
    assert not behind.better
    assert behind.veils_cd_m2.max() == 0.0


# ---------------------------------------------------------------------------------------------------------------------
# files and commands


def test_pictures_come_back_from_a_file(tmp_path):
    rng = np.random.default_rng(3)
    memory = {"ab": {(1.5, 0.0): rng.random((4, 5)).astype(np.float32)}, "cd": {(0.1, -15.0): np.zeros((2, 2), "f4")}}
    write_cache(tmp_path / "kept.npz", memory)
    back = read_cache(tmp_path / "kept.npz")
    assert {name: set(drawn) for name, drawn in back.items()} == {"ab": {(1.5, 0.0)}, "cd": {(0.1, -15.0)}}
    assert np.array_equal(back["ab"][1.5, 0.0], memory["ab"][1.5, 0.0])


def test_damaged_pictures_are_drawn_again(tmp_path):
    rng = np.random.default_rng(4)
    memory = {"ab": {(float(k), 0.0): rng.random((4, 5)).astype(np.float32) for k in range(3)}}
    file = tmp_path / "kept.npz"
    write_cache(file, memory)
    whole = file.read_bytes()
    for at in (*rng.integers(0, 8 * len(whole), 40), *range(32)):
        data = bytearray(whole)
        data[at // 8] ^= 1 << at % 8
        file.write_bytes(data)
        said = []
        back = read_cache(file, said.append)
        for key, picture in back.get("ab", {}).items():
            assert np.array_equal(picture, memory["ab"][key])
        # a bit of a date changes nothing
        assert len(back.get("ab", {})) == 3 or (len(said) == 1 and str(file) in said[0])
    for size in (0, 3, 30, 500, len(whole) - 1):
        file.write_bytes(whole[:size])
        said.clear()
        assert read_cache(file, said.append) == {}
        assert len(said) == 1


def test_a_file_of_another_kind_is_not_taken_for_a_damaged_cache(tmp_path):
    for name, data in (("text.npz", b"lens = 'heliar'\n" * 20), ("zip.npz", b"PK\x03\x04" + bytes(300))):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(FlarewrightError, match="holds no flares"):
            read_cache(tmp_path / name)
    if hasattr(os, "mkfifo"):
        # waited for a writer without end
        os.mkfifo(tmp_path / "pipe.npz")
        with pytest.raises(FlarewrightError, match="is not a regular file"):
            read_cache(tmp_path / "pipe.npz")
    np.savez(tmp_path / "other.npz", weights=np.ones(3))
    with pytest.raises(FlarewrightError, match="holds no flares"), remembered(tmp_path / "other.npz"):
        pass


def test_a_full_disk_loses_the_cache_and_not_the_prediction(tmp_path, monkeypatch, capsys):
    def full(path, _pictures):
        raise OutputError(f"cannot write {path}: no space left on device")

    monkeypatch.setattr("flarewright.io.render_state.flare_cache.write_cache", full)
    with remembered(tmp_path / "kept.npz") as memory:
        memory["ab"] = {(1.0, 0.0): np.ones((2, 2), "f4")}
    said = capsys.readouterr().err
    assert str(tmp_path / "kept.npz") in said
    assert said.count("\n") == 1


def test_pictures_are_stored_while_the_work_goes_on(tmp_path, monkeypatch):
    """So that a killed run resumes; here the block itself waits for the file."""
    monkeypatch.setattr("flarewright.workflow.kept_work.checkpoints.CHECKPOINT_S", 0.01)
    stored = threading.Event()
    write = write_cache

    def noted(path, pictures):
        write(path, pictures)
        stored.set()

    monkeypatch.setattr("flarewright.io.render_state.flare_cache.write_cache", noted)
    with remembered(None, tmp_path / "page.html") as memory:
        memory["ab"] = {(1.0, 0.0): np.ones((2, 2), "f4")}
        assert stored.wait(30.0)
        assert read_cache(tmp_path / "page.partial.npz")["ab"][1.0, 0.0].sum() == 4.0
    assert not (tmp_path / "page.partial.npz").exists()


def test_drawn_pictures_are_kept_after_ctrl_c(tmp_path):
    file = tmp_path / "kept.npz"

    def interrupted():
        with remembered(file) as memory:
            memory["ab"] = {(1.0, 0.0): np.ones((2, 2), "f4")}
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with remembered(file) as memory:
        assert memory["ab"][1.0, 0.0].tolist() == [[1.0, 1.0], [1.0, 1.0]]


def changed(**places):
    """Return the example with values replaced, by dotted path; None removes one."""
    data = tomllib.loads(example_file("scene"))
    for place, value in places.items():
        *way, last = (int(key) if key.isdigit() else key for key in place.split("__"))
        target = data
        for key in way:
            target = target[key]
        if value is None:
            del target[last]
        else:
            target[last] = value
    return data


MISTAKES = {
    "newer version": ({"schema_version": 2}, "newer than this program's"),
    "unknown key": ({"camera": 1}, "did you mean 'cameras'"),
    "no cameras": ({"cameras": []}, "cameras"),
    "no lights": ({"lights": None}, "lights is missing"),
    "luminance upside down": ({"luminance_cd_m2": [200.0, 1.0]}, "luminance_cd_m2: give the darkest first"),
    "key of nothing": ({"key_cd_m2": 0.0}, "key_cd_m2"),
    "north beyond a turn": ({"north_deg": 720.0}, "north_deg"),
    "latitude beyond the pole": ({"site__latitude_deg": 91.0}, "site.latitude_deg"),
    "longitude beyond a turn": ({"site__longitude_deg": 200.0}, "site.longitude_deg"),
    "no site for the sun": ({"site": None}, "the sun needs [site]"),
    "no date for the sun": ({"time__start": None}, "the sun needs time.start"),
    "no offset from UTC": ({"time__start": "2024-06-21T18:00:00"}, "offset from UTC"),
    "no duration": ({"time__duration_s": -1.0}, "time.duration_s"),
    "no step": ({"time__step_s": 0.0}, "time.step_s"),
    "too many steps": ({"time__step_s": 0.001}, "choose a longer step_s"),
    "camera without a name": ({"cameras__0__name": ""}, "cameras[0].name"),
    "two cameras of one name": ({"cameras__1__name": "east stand"}, "two cameras are called 'east stand'"),
    "lens and model": ({"cameras__0__model": "m.json"}, "a lens or a measured model"),
    "neither lens nor model": ({"cameras__0__lens": None}, "a lens or a measured model"),
    "unit of a lens": ({"cameras__0__unit_per_cd_m2": 1.0}, "is for a measured model"),
    "place of two numbers": ({"cameras__0__position_m": [1.0, 2.0]}, "cameras[0].position_m[2] is missing"),
    "aim of words": ({"cameras__0__aim_m": "north"}, "cameras[0].aim_m"),
    "up of nan": ({"cameras__0__up": [0.0, 0.0, float("nan")]}, "cameras[0].up[2]"),
    "f-number": ({"cameras__0__f_number": 0.0}, "cameras[0].f_number"),
    "zoom": ({"cameras__0__zoom": -1.0}, "cameras[0].zoom"),
    "focus": ({"cameras__0__focus_m": 0.0}, "cameras[0].focus_m"),
    "coating": ({"cameras__0__coating": "shiny"}, "cameras[0].coating"),
    "sensor": ({"cameras__0__sensor_mm": [36.0, 0.0]}, "cameras[0].sensor_mm[1]"),
    "iso": ({"cameras__0__iso": 0.0}, "cameras[0].iso"),
    "exposure": ({"cameras__0__exposure_s": -1.0}, "cameras[0].exposure_s"),
    "camera's keyframe before the start": ({"cameras__1__keyframes__0__at_s": -1.0}, "cameras[1].keyframes[0].at_s"),
    "camera's keyframe with light": ({"cameras__1__keyframes__0__gain": 1.0}, "cameras[1].keyframes[0].gain"),
    "unknown kind of light": ({"lights__1__kind": "moon"}, "lights[1].kind should be lamp, distant or sun"),
    "lamp without a name": ({"lights__1__name": None}, "lights[1].name is missing"),
    "two lights of one name": ({"lights__1__name": "sun"}, "two lights are called 'sun'"),
    "lamp without brightness": ({"lights__1__intensity_cd": None}, "needs intensity_cd, or luminance_cd_m2"),
    "lamp of two brightnesses": ({"lights__1__luminance_cd_m2": 1e6}, "not both"),
    "intensity": ({"lights__1__intensity_cd": -3.0}, "lights[1].intensity_cd"),
    "diameter": ({"lights__1__diameter_m": 0.0}, "lights[1].diameter_m"),
    "beam": ({"lights__1__beam_deg": 180.0}, "lights[1].beam_deg"),
    "beam without an aim": ({"lights__1__aim_m": None}, "aim_m and beam_deg go together"),
    "spectrum": ({"lights__1__spectrum": "red"}, "lights[1].spectrum"),
    "lamp's keyframes fall": ({"lights__1__keyframes": [{"at_s": 3.0}, {"at_s": 1.0}]}, "must rise in time"),
    "sun's illuminance": ({"lights__0__illuminance_lx": 0.0}, "lights[0].illuminance_lx"),
    "sun's horizon": ({"lights__0__horizon_deg": 95.0}, "lights[0].horizon_deg"),
    "sun with a place": ({"lights__0__position_m": [0.0, 0.0, 1.0]}, "lights[0].position_m is not a known key"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_in_a_scene_are_reported_with_their_place(case):
    places, words = MISTAKES[case]
    with pytest.raises(ProjectError, match=re.escape(words)) as reported:
        scene_from_data(changed(**places), folder=Path(), where="match.toml")
    assert str(reported.value).startswith(("match.toml", "the scene file match.toml"))


def test_all_mistakes_are_reported_at_once():
    data = changed(cameras__0__iso=0.0, lights__1__spectrum="red", site__latitude_deg=91.0)
    with pytest.raises(ProjectError) as reported:
        scene_from_data(data, folder=Path(), where="match.toml")
    assert len(reported.value.problems) == 3


def test_distant_lights_are_checked_too():
    moon = {"kind": "distant", "name": "moon", "azimuth_deg": 10.0, "elevation_deg": 20.0, "illuminance_lx": 0.2}
    assert scene(lights=[moon]).lights[0].kind == "distant"
    for key, value in [
        ("azimuth_deg", 400.0),
        ("elevation_deg", 91.0),
        ("illuminance_lx", 0.0),
        ("diameter_deg", -1.0),
    ]:
        data = changed()
        data["lights"][1] = {**moon, key: value}
        with pytest.raises(ProjectError, match=rf"lights\[1\]\.{key}"):
            scene_from_data(data, folder=Path(), where="match.toml")


def test_schema_accepts_the_example_and_refuses_what_the_reader_refuses():
    jsonschema = pytest.importorskip("jsonschema")
    from flarewright.io.project.scene_file import scene_json_schema

    validator = jsonschema.Draft202012Validator(scene_json_schema())
    data = changed()
    data["time"]["start"] = data["time"]["start"].isoformat()
    assert list(validator.iter_errors(data)) == []
    data["cameras"][0]["iso"] = 0.0
    assert len(list(validator.iter_errors(data))) == 1


SCENE = """
schema_version = 1
luminance_cd_m2 = [1.0, 1000.0]
[time]
duration_s = 20.0
step_s = 10.0
[[cameras]]
name = "A"
lens = "triplet-pestrecov"
position_m = [0.0, -20.0, 2.0]
aim_m = [0.0, 0.0, 2.0]
[[cameras]]
name = "B"
lens = "triplet-pestrecov"
position_m = [5.0, -20.0, 2.0]
aim_m = [0.0, 0.0, 2.0]
[[lights]]
name = "lamp"
position_m = [-3.0, 10.0, 4.0]
luminance_cd_m2 = 1e7
diameter_m = 0.4
[[lights.keyframes]]
at_s = 20.0
position_m = [4.0, 10.0, 4.0]
"""


@pytest.mark.parametrize("step_s", [20.0, pytest.param(10.0, marks=pytest.mark.slow)])
def test_command_plans_a_scene_and_its_veil_is_that_of_a_final_render(step_s, tmp_path, capsys, monkeypatch):
    # bare glass reflects all colours almost alike
    monkeypatch.setattr("flarewright.workflow.lens_flares.JUDGED_NM", 3)
    file, page, cache = tmp_path / "s.toml", tmp_path / "s.html", tmp_path / "s.npz"
    given = SCENE.replace("triplet-pestrecov", "singlet.toml" if step_s > 10.0 else "triplet-pestrecov")
    singlet_file(tmp_path)
    file.write_text(given.replace("position_m = [0.0, -20.0, 2.0]", "f_number = 8.0\nposition_m = [0.0, -20.0, 2.0]")
                    .replace("position_m = [5.0", "f_number = 8.0\nposition_m = [5.0")
                    .replace("step_s = 10.0", f"step_s = {step_s}"))  # fmt: skip
    arguments = [
        "predict",
        str(file),
        "-o",
        str(page),
        "--near",
        "A",
        "--radius",
        "0.5",
        "--cache",
        str(cache),
        "--json",
    ]
    assert run(arguments) == 0
    first = capsys.readouterr().out
    data = json.loads(first)
    assert {one["camera"] for one in data["ranking"]} == {"A", "B"}
    for one in data["ranking"]:
        assert one["worst_veil_cd_m2"] == pytest.approx(one["rendered_veil_cd_m2"], rel=0.08)
        assert 0.0 <= one["washed_share"] <= 1.0
    distance = np.sqrt(3.0**2 + 30.0**2 + 2.0**2)
    lux = data["cameras"][0]["lights"][0]["illuminance_lx"][0]
    assert lux == pytest.approx(np.pi * 1e7 * 0.04 / (0.04 + distance**2))
    assert data["which_camera_when"][0]["from_s"] == 0.0
    assert data["which_camera_when"][-1]["to_s"] == 20.0
    assert data["better_position"]["camera"] == "A"
    text = page.read_text("utf-8")
    assert set(re.findall(r"https?://[^\s\"'<>]+", text)) <= {"http://www.w3.org/2000/svg"}
    # again from the cached pictures: identical
    assert run(arguments) == 0
    assert capsys.readouterr().out == first


def test_a_lamp_moves_on_straight_lines_and_stays_where_its_last_keyframe_puts_it():
    keys = (LampKey(at_s=10.0, position_m=(4.0, 0.0, 1.0)),)
    lamp = Lamp(name="car", position_m=(-4.0, 0.0, 1.0), intensity_cd=1.0, keyframes=keys)
    places = lamp_places(lamp, np.array([0.0, 5.0, 10.0, 20.0]))
    assert places.tolist() == [[-4.0, 0.0, 1.0], [0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [4.0, 0.0, 1.0]]


def test_scene_init_is_a_scene_that_checks(tmp_path, capsys):
    pytest.importorskip("astral")
    assert run(["scene", "init", "-o", str(tmp_path / "s.toml")]) == 0
    assert run(["scene", "check", str(tmp_path / "s.toml")]) == 0
    assert "2 cameras, 2 lights, 16 times" in capsys.readouterr().out
    assert run(["scene", "schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Flarewright scene"


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--fstop", "8"], "--fstop has no meaning for a scene"),
        (["--luminance", "1,2"], "--luminance has no meaning for a scene"),
        (["--near", "C"], "is no camera of the scene"),
        (["--near", "A", "--radius", "0"], "--radius 0 is out of range"),
        (["--near", "A", "--height", "-1"], "--height -1 is out of range"),
        (["--radius", "3"], "add --near CAMERA"),
        (["--shortest-shot", "nan"], "--shortest-shot nan"),
        (["--cache", "kept.zip"], "*.npz"),
    ],
)
def test_bad_flags_for_a_scene(flags, words, tmp_path, capsys):
    file = tmp_path / "s.toml"
    file.write_text(SCENE)
    assert run(["predict", str(file), *flags]) == 2
    reported = capsys.readouterr().err
    assert words in reported
    assert reported.count("\n") == 1


def test_a_cache_of_another_kind_and_a_lens_that_is_not_there_are_reported(tmp_path, capsys):
    file, cache = tmp_path / "s.toml", tmp_path / "s.npz"
    file.write_text(SCENE)
    cache.write_bytes(b"PK nothing")
    assert run(["predict", str(file), "--cache", str(cache)]) == 2
    assert "holds no flares" in capsys.readouterr().err
    file.write_text(SCENE.replace("triplet-pestrecov", "no-such-lens"))
    assert run(["predict", str(file)]) == 2
    assert f"{file}: camera A: " in capsys.readouterr().err
    file.write_text(SCENE.replace("[0.0, 0.0, 2.0]", "[0.0, -20.0, 2.0]"))
    assert run(["predict", str(file)]) == 2
    assert f"{file}: cameras[0] (A): the camera aims at its own place" in capsys.readouterr().err
    assert run(["predict", "heliar-tronnier", "--near", "A"]) == 2
    assert "--near has no meaning for a lens" in capsys.readouterr().err
