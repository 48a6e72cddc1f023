"""A merged run: light, axis and angles as planted; resuming changes nothing; RAW files work like any others."""

import pickle
from dataclasses import replace as changed

import numpy as np
import pytest
from camera_raw import camera_to_rec709
from measured_run import SETUP, Measured
from star_run import ANGLES, CAMERA, KNOWN, MANY, light_px, shoot, shoot_raw, star
from synthetic_camera import expose

from flarewright.errors import FlarewrightError
from flarewright.io.measurement.captures import read_captures
from flarewright.io.measurement.merged import read_frame, read_run
from flarewright.measure.merging.camera_geometry import SightingInput, solve_geometry
from flarewright.measure.merging.light_position import find_light
from flarewright.measure.merging.noise import noise_of
from flarewright.measure.merging.settings import MergeSettings
from flarewright.measure.pipeline.merge_stage import merge_captures, merge_frame
from flarewright.measure.pipeline.provenance import run_digest
from flarewright.measure.pipeline.search_images import reference_of
from flarewright.model.measurement.capture import CameraNoise


def test_the_light_is_found_within_a_third_of_a_pixel_though_it_is_clipped(measured: Measured):
    for frame, pose in zip(measured.run.frames, measured.truth["poses"], strict=True):
        assert frame.light_found
        assert frame.light_px == pytest.approx(pose["light_px"], abs=0.3)
        assert frame.clipped_share > 0.0


def test_the_axis_is_found_within_a_third_of_a_pixel_though_the_camera_nods(measured: Measured):
    nod = np.tan(np.radians(SETUP.pitch_deg)) * measured.run.px_per_rad
    assert nod > 1.0
    for found, error, planted in zip(measured.run.axis_px, measured.run.axis_error_px, SETUP.axis_px, strict=True):
        assert found == pytest.approx(planted, abs=0.3)
        assert abs(found - planted) < 4.0 * error


def test_the_turntables_jitter_is_taken_out(measured: Measured):
    true = np.array([pose["constellation_deg"] for pose in measured.truth["poses"]])
    nominal = np.array([frame.nominal_deg for frame in measured.run.frames])
    found = np.array([frame.constellation_deg for frame in measured.run.frames])
    assert np.std(found - true) < 0.5 * np.std(nominal - true)
    assert np.abs(found - true).max() < 0.05


def test_each_mirror_line_runs_from_the_axis_to_the_light(measured: Measured):
    for frame in measured.run.frames:
        away = np.subtract(frame.light_px, frame.axis_px)
        if np.hypot(*away) > 10.0:
            sign = 1.0 if frame.constellation_deg > 0.0 else -1.0
            assert sign * away / np.hypot(*away) == pytest.approx(frame.direction, abs=1e-9)
            assert frame.horizon_deg == pytest.approx(frame.roll_deg - frame.nominal_roll_deg, abs=1e-9)


def test_frames_are_the_truth_within_their_variance_and_the_camera_is_found(measured: Measured):
    chi2 = []
    for k, info in enumerate(measured.run.frames):
        frame = read_frame(measured.folder, info)
        truth = np.load(measured.photographs / f"truth-{k:03d}.npy")
        chi2.append(((frame.radiance - truth) ** 2 / frame.variance)[frame.valid].mean())
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.03)
    camera = measured.run.camera
    assert abs(camera.electrons_per_unit - SETUP.electrons_per_unit) < 4.0 * camera.electrons_per_unit_error
    assert abs(camera.read_noise - SETUP.read_noise) < 4.0 * camera.read_noise_error
    assert read_run(measured.folder) == measured.run


def stamps(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "frames").glob("*.exr")}


def test_a_stopped_run_resumes_with_the_same_result(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in MANY}))
    whole = merge_captures(captures, tmp_path, tmp_path / "whole", camera=KNOWN)

    def stop(part, _words):
        if part > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, progress=stop, threads=1)
    started = stamps(tmp_path / "run")
    assert 0 < len(started) < len(MANY)
    again = merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, threads=2)
    assert again == whole
    ended = stamps(tmp_path / "run")
    assert started.items() <= ended.items()
    for a, b in zip(whole.frames, again.frames, strict=True):
        one, other = read_frame(tmp_path / "whole", a), read_frame(tmp_path / "run", b)
        assert np.array_equal(one.radiance, other.radiance)
        assert np.array_equal(one.variance, other.variance)
    # another photograph or setting: only its frame is merged again
    np.save(tmp_path / "2-1.npy", np.load(tmp_path / "2-1.npy"))
    merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN)
    third = stamps(tmp_path / "run")
    assert {name for name, stamp in third.items() if stamp != ended[name]} == {"frame-002.exr"}
    balance = MergeSettings(white_balance=(2.0, 1.0, 1.5))
    merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, settings=balance)
    assert not stamps(tmp_path / "run").items() & third.items()


def frame_bytes(folder):
    return {path.name: path.read_bytes() for path in (folder / "frames").glob("*.exr")}


def test_frames_that_are_merged_elsewhere_are_the_same(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    whole = merge_captures(captures, tmp_path, tmp_path / "whole", camera=KNOWN)

    def elsewhere(plan, numbers, workers):
        assert workers == 2
        for number in reversed(numbers):
            yield pickle.loads(pickle.dumps(merge_frame(pickle.loads(pickle.dumps(plan)), number)))

    again = merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, threads=2, spread=elsewhere)
    assert again == whole
    assert frame_bytes(tmp_path / "run") == frame_bytes(tmp_path / "whole")


@pytest.mark.slow
def test_frames_that_a_cluster_merges_are_the_same(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    from flarewright.workflow.measure_merge import merge_on

    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    whole = merge_on(None, captures, tmp_path, tmp_path / "whole", camera=KNOWN)
    again = merge_on("local:2", captures, tmp_path, tmp_path / "run", camera=KNOWN)
    assert again == whole
    assert frame_bytes(tmp_path / "run") == frame_bytes(tmp_path / "whole")


def test_a_damaged_or_truncated_frame_is_reported_and_merged_again(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES[:3]}))
    run, said = tmp_path / "run", []
    merged = merge_captures(captures, tmp_path, run, camera=KNOWN)
    frame, index = run / "frames" / "frame-001.exr", (run / "merged.json").read_bytes()
    whole, before = frame.read_bytes(), stamps(run)
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 4
    for damaged in (bytes(flipped), b"", whole[: len(whole) // 2], whole[:-9]):
        said.clear()
        frame.write_bytes(damaged)
        assert merge_captures(captures, tmp_path, run, camera=KNOWN, report=said.append) == merged
        assert said == [f"{frame} is damaged or was changed; it is merged again"]
        assert frame.read_bytes() == whole
        assert (run / "merged.json").read_bytes() == index
    assert {name for name, stamp in stamps(run).items() if stamp != before[name]} == {"frame-001.exr"}


def test_a_folder_is_for_the_run_of_one_camera(tmp_path):
    for name in ("mine", "other"):
        (tmp_path / name).mkdir()
    mine = shoot(tmp_path / "mine", {angle: star(light_px(angle)) for angle in ANGLES})
    other = shoot(tmp_path / "other", {angle: star(light_px(angle), level=0.06) for angle in ANGLES})
    run = tmp_path / "run"
    merge_captures(read_captures(mine), mine.parent, run, camera=KNOWN)
    (run / "found.json").write_text("by hand")
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}

    def refused():
        with pytest.raises(FlarewrightError, match=r"run holds the run of other photographs \("):
            merge_captures(read_captures(other), other.parent, run, camera=KNOWN)
        assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before

    # the same names in another folder, or other names in the same folder
    refused()
    for path in sorted(other.parent.glob("*.npy")):
        path.rename(mine.parent / f"b{path.name}")
    other = mine.parent / "other.csv"
    other.write_text(mine.read_text().replace("\n", "\nb").removesuffix("b"))
    refused()
    # moved photographs are recognised
    mine.parent.rename(tmp_path / "moved")
    mine = tmp_path / "moved" / "captures.csv"
    stamp = stamps(run)
    merge_captures(read_captures(mine), mine.parent, run, camera=KNOWN)
    assert stamps(run) == stamp


def test_frames_of_lines_that_are_gone_go_too(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    run = tmp_path / "run"
    merge_captures(captures, tmp_path, run, camera=KNOWN, settings=MergeSettings(upright=True))
    (run / "frames" / "frame-mine.txt").write_text("kept")
    merge_captures(captures[:-4], tmp_path, run, camera=KNOWN)
    left = [f"frame-{k:03d}.{kind}" for k in range(len(ANGLES) - 2) for kind in ("exr", "json")]
    assert sorted(path.name for path in (run / "frames").iterdir()) == [*left, "frame-mine.txt"]
    assert sorted(path.name for path in (run / "upright").iterdir()) == left


@pytest.mark.parametrize("camera", [KNOWN, KNOWN.replace(electrons_per_unit=None, read_noise=None)])
@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        ("swapped", r"2-1\.npy and 2-0\.npy .* more than 100 times"),
        ("cap on", r"2-0\.npy and 2-1\.npy .* more than 100 times"),
        ("cap on the short one", r"2-0\.npy and 2-1\.npy .* less than a hundredth"),
        ("ten times as long", r"0-0\.npy and 0-1\.npy .* should have 0\.0031 .* and has 10 times"),
        ("half as long", r"0-0\.npy and 0-1\.npy .* and has 0\.5. times"),
    ],
)
def test_exposures_that_contradict_the_list_are_reported(tmp_path, camera, mistake, words):
    listed = shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    text = listed.read_text()
    match mistake:
        case "swapped":
            listed.write_text(text.replace("2-0.npy", "@").replace("2-1.npy", "2-0.npy").replace("@", "2-1.npy"))
        case "cap on" | "cap on the short one":
            dark = expose(CAMERA, np.zeros((64, 96, 3), np.float32), 1.0, 1.0, (7,))
            np.save(tmp_path / ("2-1.npy" if mistake == "cap on" else "2-0.npy"), dark)
        case _:
            listed.write_text(text.replace(",0.125,", ",1.25," if mistake.startswith("ten") else ",0.0625,"))
    with pytest.raises(FlarewrightError, match=words):
        merge_captures(read_captures(listed), tmp_path, tmp_path / "run", camera=camera)


def test_the_light_and_clipping_enter_models_and_change_no_frame(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    balance = MergeSettings(white_balance=(2.0, 1.0, 1.5))
    merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, settings=balance)
    started = stamps(tmp_path / "run")
    lit = KNOWN.replace(luminance_cd_m2=2e6, solid_angle_sr=1e-5)
    run = merge_captures(captures, tmp_path, tmp_path / "run", camera=lit, settings=balance)
    assert stamps(tmp_path / "run") == started
    reported = reference_of(run)
    assert (reported.luminance_cd_m2, reported.solid_angle_sr) == (2e6, 1e-5)
    assert reported.clipping == (2.0, 1.0, 1.5)
    # a value clipped in every exposure is at least the clipping level of the shortest
    frame = read_frame(tmp_path / "run", run.frames[2])
    assert reported.exposure_s is not None
    for m in range(3):
        clipped = frame.radiance[..., m][~frame.valid[..., m]] * frame.info.gain
        least = reported.clipping[m] * reported.exposure_s / min(one.exposure_s for one in captures)
        assert clipped.size
        np.testing.assert_allclose(clipped, least, rtol=0.05)
    assert reference_of(run.replace(camera=KNOWN.replace(white_level=None))).clipping is None


def test_a_light_that_flickers_and_a_shutter_that_lies_are_put_right(tmp_path):
    listed = shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    listed.write_text(listed.read_text().replace(",0.125,", ",0.15,"))
    run = merge_captures(read_captures(listed), tmp_path, tmp_path / "run", camera=KNOWN)
    assert run.px_per_rad == pytest.approx(400.0, rel=0.01)


def test_a_person_may_point_at_the_light(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle), (80.0, 10.0)) for angle in ANGLES}))
    with pytest.raises(FlarewrightError, match="two lights were found"):
        merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN)
    pointed = []
    for one in captures:
        x, y = light_px(one.constellation_deg)
        pointed.append(one.replace(light_x_px=x, light_y_px=y))
    run = merge_captures(pointed, tmp_path, tmp_path / "run", camera=KNOWN)
    assert run.frames[2].light_px == pytest.approx(light_px(2.0))
    assert run.px_per_rad == pytest.approx(400.0, rel=0.01)


UNTOLD = KNOWN.replace(black_level=None)


def add_dark(folder, level, kind="dark", count=1):
    """Add uniform photographs to a list."""
    for k in range(count):
        np.save(folder / f"{kind}-{k}.npy", np.full((64, 96, 3), level, np.uint16))
        with (folder / "captures.csv").open("a") as listed:
            listed.write(f"{kind}-{k}.npy,,0.125,100,8,{kind}\n")


@pytest.mark.parametrize(
    ("camera", "extra", "words"),
    [
        (KNOWN.replace(black_level=9e3), None, r"black level is 9000, which is more than most of .*-0\.npy"),
        (KNOWN.replace(black_level=600.0), None, "black level is 600, which is more than most"),
        (KNOWN.replace(white_level=600.0), None, "white_level is 600, but the photographs have numbers up to 16383"),
        (KNOWN, (3000, "dark"), r"dark-0\.npy, a dark frame, has 3000 where black_level is 512"),
        (UNTOLD, (3000, "dark"), r"dark-0\.npy, a dark frame, has 3000, which is more than most"),
        (UNTOLD, (16383, "dark"), r"dark-0\.npy, a dark frame, has 16383, .*where the sensor clips"),
        (UNTOLD, (16383, "dark", 4), "a dark frame, has 16383, .*where the sensor clips"),
        (KNOWN, (16383, "flat"), r"flat-0\.npy is saturated, so it is no flat"),
    ],
)
def test_impossible_levels_are_reported(tmp_path, camera, extra, words):
    shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    if extra is not None:
        add_dark(tmp_path, *extra)
    with pytest.raises(FlarewrightError, match=words):
        merge_captures(read_captures(tmp_path / "captures.csv"), tmp_path, tmp_path / "run", camera=camera)


def test_a_file_with_a_hole_is_named(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    pixels = np.load(tmp_path / "3-0.npy")
    pixels[40:, :] = 0
    np.save(tmp_path / "3-0.npy", pixels)
    with pytest.raises(FlarewrightError, match=r"3-0\.npy has numbers far below black over 3[78]% of the picture"):
        merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN)


def test_a_missing_white_balance_is_reported(tmp_path):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    with pytest.raises(FlarewrightError, match=r"0-0\.npy holds no white balance of its camera"):
        merge_captures(captures, tmp_path, tmp_path / "run", settings=MergeSettings(white_balance="camera"))


def pointing(listed, scale=1.0):
    """Add the light's position to a list."""
    head, *rows = listed.read_text().splitlines()
    k = head.split(",").index("constellation_deg")
    places = [np.multiply(light_px(float(row.split(",")[k])), scale) for row in rows]
    rows = [f"{row},{x:.2f},{y:.2f}\n" for row, (x, y) in zip(rows, places, strict=True)]
    listed.write_text(f"{head},light_x_px,light_y_px\n" + "".join(rows))
    return read_captures(listed)


@pytest.mark.parametrize(
    ("block", "raw"),
    [
        (1, False),
        (2, True),
        pytest.param(1, True, marks=pytest.mark.slow),
        pytest.param(2, False, marks=pytest.mark.slow),
    ],
)
def test_what_a_person_says_in_pixels_means_those_of_the_file(tmp_path, raw, block):
    if raw:
        lines = ["file,constellation_deg\n"]
        for k, angle in enumerate(ANGLES):
            for j, time in enumerate(CAMERA.exposures_s):
                shoot_raw(tmp_path, star(light_px(angle)), f"{k}-{j}.dng", time, 10 * k + j)
                lines.append(f"{k}-{j}.dng,{angle:g}\n")
        (tmp_path / "captures.csv").write_text("".join(lines))
    else:
        shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    side = 2 if raw else 1
    captures = pointing(tmp_path / "captures.csv", scale=side)
    camera, settings = KNOWN.replace(pitch_um=125.0 / side), MergeSettings(block=block)
    run = merge_captures(captures, tmp_path, tmp_path / "run", camera=camera, settings=settings)
    assert run.px_per_rad == pytest.approx(400.0 / block, rel=0.01)
    assert run.frames[3].light_px == pytest.approx(np.divide(light_px(3.0), block), abs=0.01)
    # 96 pixels of 0.125 mm, whatever was averaged
    assert run.sensor_width_mm == pytest.approx(12.0)
    assert read_run(tmp_path / "run").sensor_width_mm == run.sensor_width_mm
    # a pixel of a merged frame covers the pixels of the file that were averaged
    alone = [one.replace(constellation_deg=0.0, focal_mm=50.0) for one in captures[:2]]
    run = merge_captures(alone, tmp_path, tmp_path / "alone", camera=camera, settings=settings)
    assert run.px_per_rad == pytest.approx(400.0 / block)
    beyond = [one.replace(light_x_px=96.5 * side) for one in captures]
    size = f"{96 * side}x{64 * side}"
    with pytest.raises(FlarewrightError, match=rf"0-\d\.\w+ is \(.*outside of its {size} pixels"):
        merge_captures(beyond[:2], tmp_path, tmp_path / "beyond", camera=camera, settings=settings)


def faint(angle, place, part):
    """Return the light with a second spot of a part of its light."""
    return star(light_px(angle)) + part * (star(place) - star())


@pytest.mark.parametrize("part", [pytest.param(0.1, marks=pytest.mark.slow), 0.003])
@pytest.mark.parametrize(
    ("angles", "away"),
    [
        pytest.param(MANY, (-30.0, 20.0), marks=pytest.mark.slow),
        (MANY[-2:], (10.0, -20.0)),
        (MANY, (-25.0, 0.2)),
    ],
)
def test_a_faint_second_light_is_detected_as_fixed_in_the_room(tmp_path, part, angles, away):
    scenes = {angle: star(light_px(angle)) for angle in MANY}
    scenes |= {angle: faint(angle, np.add(light_px(angle), away), part) for angle in angles}
    with pytest.raises(FlarewrightError, match=r"two lights were found, at .* of the frame at"):
        merge_captures(read_captures(shoot(tmp_path, scenes)), tmp_path, tmp_path / "run", camera=KNOWN)


@pytest.mark.parametrize("part", [0.1, pytest.param(0.01, marks=pytest.mark.slow)])
@pytest.mark.parametrize("pace", [-1.0, *(pytest.param(pace, marks=pytest.mark.slow) for pace in (-0.5, 0.3))])
def test_bright_ghosts_are_no_second_light(tmp_path, part, pace):
    def ghost(angle):
        return [middle + pace * (x - middle) for x, middle in zip(light_px(angle), (40.3, 31.6), strict=True)]

    scenes = {angle: faint(angle, ghost(angle), part) for angle in MANY}
    run = merge_captures(read_captures(shoot(tmp_path, scenes)), tmp_path, tmp_path / "run", camera=KNOWN)
    assert run.px_per_rad == pytest.approx(400.0, rel=0.01)


def test_raw_files_with_dark_frames_and_flats_merge_to_the_scene(tmp_path):
    scene = {angle: star(light_px(angle)) for angle in ANGLES}
    lines = ["file,constellation_deg,kind\n"]
    for k, (angle, light) in enumerate(scene.items()):
        for j, time in enumerate(CAMERA.exposures_s):
            shoot_raw(tmp_path, light, f"{k}-{j}.dng", time, 10 * k + j)
            lines.append(f"{k}-{j}.dng,{angle:g},\n")
    for k in range(4):
        shoot_raw(tmp_path, np.zeros_like(light), f"dark-{k}.dng", 1 / 8, 100 + k)
        shoot_raw(tmp_path, np.full_like(light, 5.0), f"flat-{k}.dng", 1 / 8, 200 + k)
        lines += [f"dark-{k}.dng,,dark\n", f"flat-{k}.dng,,flat\n"]
    (tmp_path / "captures.csv").write_text("".join(lines))
    run = merge_captures(read_captures(tmp_path / "captures.csv"), tmp_path, tmp_path / "run")
    assert run.size_px == (96, 64)
    assert run.camera.black_level == pytest.approx(CAMERA.black, abs=0.05)
    assert abs(run.camera.read_noise - CAMERA.read_noise) < 4.0 * run.camera.read_noise_error
    assert abs(run.camera.electrons_per_unit - CAMERA.electrons_per_unit) < 4.0 * run.camera.electrons_per_unit_error
    frame = read_frame(tmp_path / "run", run.frames[3])
    truth = scene[3.0]
    assert frame.light_px == pytest.approx(light_px(3.0), abs=0.3)
    # four flats and dark frames have noise that all frames share: a few per cent of the variance
    # the file's colour matrix is kept
    np.testing.assert_allclose(run.to_rec709, camera_to_rec709(), rtol=2e-3, atol=2e-3)
    chi2 = ((frame.radiance - truth) ** 2 / frame.variance)[frame.valid].mean()
    assert 0.95 < chi2 < 1.6
    green, red = (frame.variance[..., c][frame.valid[..., c]].mean() / truth[..., c][frame.valid[..., c]].mean()
                  for c in (1, 0))  # fmt: skip
    assert green < 0.75 * red


def test_levels_and_noise_are_found_without_given_values(tmp_path):
    listed = shoot(tmp_path, {angle: star(light_px(angle), level=1.0) for angle in ANGLES})
    (tmp_path / "camera.json").unlink()
    run = merge_captures(read_captures(listed), tmp_path, tmp_path / "run")
    assert run.camera.black_level == pytest.approx(CAMERA.black, abs=0.5)
    assert run.camera.white_level == CAMERA.white
    assert any("black level" in remark for remark in run.remarks)


def test_one_angle_alone_needs_the_focal_length(tmp_path):
    captures = read_captures(shoot(tmp_path, {3.0: star(light_px(3.0))}))
    run = merge_captures(captures, tmp_path, tmp_path / "run")
    assert run.axis_px == (48.0, 32.0)
    assert any("one angle only" in remark for remark in run.remarks)
    straight = [one.replace(constellation_deg=0.0, focal_mm=50.0) for one in captures]
    with pytest.raises(FlarewrightError, match="pitch_um"):
        merge_captures(straight, tmp_path, tmp_path / "other")
    run = merge_captures(straight, tmp_path, tmp_path / "third", camera=CameraNoise(pitch_um=100.0, black_level=512))
    assert run.px_per_rad == pytest.approx(500.0)


def test_a_path_that_does_not_fit_the_angles_is_refused():
    places = [(50.0 + 7.0 * k, 30.0) for k in range(6)]
    straight = [SightingInput(float(k), 0.0, place, 0.05) for k, place in enumerate(places)]
    assert solve_geometry(straight, (96, 64)).px_per_rad == pytest.approx(7.0 * 180 / np.pi, rel=0.01)
    crossed = [changed(one, light_px=(places[k][0], 30.0 + 20.0 * (k % 2))) for k, one in enumerate(straight)]
    with pytest.raises(FlarewrightError, match="does not move as the angles say"):
        solve_geometry(crossed, (96, 64))
    backwards = [changed(one, nominal_deg=-one.nominal_deg) for one in straight]
    with pytest.raises(FlarewrightError, match="against the angles"):
        solve_geometry(backwards, (96, 64))
    for roll in (90.0, -90.0, 60.0, 270.0):
        with pytest.raises(FlarewrightError, match=rf"towards 0 deg .* where roll_deg says {roll:g}: correct"):
            solve_geometry([changed(one, nominal_roll_deg=roll) for one in straight], (96, 64))
    leaning = solve_geometry([changed(one, nominal_roll_deg=30.0) for one in straight], (96, 64))
    assert leaning.px_per_rad == pytest.approx(7.0 * 180 / np.pi, rel=0.01)
    for roll in (0.0, 90.0):
        still = [changed(one, nominal_roll_deg=roll, light_px=(50.0, 30.0)) for one in straight]
        with pytest.raises(FlarewrightError, match="does not move in the picture"):
            solve_geometry(still, (96, 64))


@pytest.mark.parametrize(("zero_deg", "roll"), [(3.0, 0.0), (-2.0, 90.0)])
def test_a_wrong_zero_of_the_turntable_is_reported_with_its_numbers(zero_deg, roll):
    """The axis then lies far from the picture's middle; with the zero corrected it does not, and no remark remains."""
    focal, turn = 480.0, np.radians(roll)

    def frames(zero):
        return [
            SightingInput(
                float(angle + zero), roll,
                (240.0 + focal * np.tan(np.radians(angle)) * np.cos(turn),
                 160.0 - focal * np.tan(np.radians(angle)) * np.sin(turn)), 0.05,
            )
            for angle in np.arange(-8.0, 9.0)
        ]  # fmt: skip

    assert solve_geometry(frames(0.0), (480, 320)).remarks == ()
    (remark,) = solve_geometry(frames(zero_deg), (480, 320)).remarks
    assert f"nearest to the middle at {zero_deg:+.2f} deg" in remark
    assert f"the axis lies {focal * np.tan(np.radians(abs(zero_deg))):.1f} px" in remark.replace("25.0", "25.2")
    assert f"subtract {zero_deg:.2f} from constellation_deg" in remark


def test_two_rolls_fix_the_axis_without_a_mirror():
    axis, frames = (50.3, 30.8), []
    for roll in (0.0, 90.0):
        for angle in range(1, 7):
            step = 400.0 * np.tan(np.radians(angle))
            u = np.cos(np.radians(roll)), -np.sin(np.radians(roll))
            frames.append(SightingInput(float(angle), roll, (axis[0] + step * u[0], axis[1] + step * u[1]), 0.02))
    found = solve_geometry(frames, (96, 64))
    assert found.axis_px == pytest.approx(axis, abs=0.02)
    assert all(one.constellation_deg == pytest.approx(seen.nominal_deg, abs=0.01)
               for one, seen in zip(found.placed, frames, strict=True))  # fmt: skip


def test_an_unclipped_light_is_found_too_and_a_hot_pixel_is_none():
    scene = star((50.37, 30.81))
    scene[10, 12] = 200.0
    noise = np.random.default_rng(0).normal(size=scene.shape) * 0.01
    found = find_light((scene + noise).astype(np.float32), np.full(scene.shape, 1e-4, np.float32))
    assert found.position_px == pytest.approx((50.37, 30.81), abs=0.05)
    assert found.rival_px is None


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_ghosts_that_go_along_with_the_light_do_not_draw_it_to_their_side(side: float):
    """They are as bright as the star where they begin, on one side only; without them the middle is clipped."""
    place = 50.37, 30.81
    scene = star(place)
    x, y = np.arange(96) + 0.5 - place[0], np.arange(64)[:, None] + 0.5 - place[1]
    beside = np.hypot(side * x - 9.0, y) < 7.0
    scene[beside] += scene[np.hypot(side * x - 9.0, y) < 0.8].mean()
    variance = np.full(scene.shape, 1e-8, np.float32)
    variance[np.hypot(x, y) < 3.0] = np.inf
    found = find_light(scene.astype(np.float32), variance)
    assert found.position_px == pytest.approx(place, abs=0.12)
    assert np.hypot(*np.subtract(found.position_px, place)) < 4.0 * found.error_px


def test_the_law_of_the_lights_place_has_as_many_powers_as_it_shows():
    rng = np.random.default_rng(4)
    nominal = np.arange(0.0, 30.0, 0.6)
    true = nominal + 0.02 * rng.normal(size=nominal.size)
    t = np.tan(np.radians(true))
    for law in ((500.0,), (500.0, -90.0), (500.0, -90.0, 120.0)):
        far = sum(each * t ** (2 * k + 1) for k, each in enumerate(law))
        frames = [SightingInput(float(a), 0.0, (363.0 + x, 238.0), 0.02) for a, x in zip(nominal, far, strict=True)]
        found = solve_geometry(frames, (720, 480))
        assert len(found.law_px) == len(law)
        assert found.px_per_rad == pytest.approx(500.0, rel=0.01)
        assert found.jitter_deg == pytest.approx(0.02, rel=0.4)
        angles = np.array([one.constellation_deg for one in found.placed])
        # the common error of the turntable remains
        assert np.std(angles - true) < 0.4 * np.std(nominal - true)
        assert [one.light_px[0] for one in found.placed] == pytest.approx(363.0 + far)


def test_beyond_the_picture_the_lights_path_goes_on_as_it_ended():
    """Higher powers alone would turn back: 500 t - 90 t^3 - 300 t^5 does, before 40 degrees."""
    seen = np.arange(0.0, 30.0, 0.6)
    t = np.tan(np.radians(seen))
    far = 500.0 * t - 90.0 * t**3 - 300.0 * t**5
    frames = [SightingInput(float(a), 0.0, (363.0 + x, 238.0), 0.02) for a, x in zip(seen, far, strict=True)]
    gone = [SightingInput(angle, 0.0, None, 0.0) for angle in (35.0, 45.0, 60.0)]
    placed = solve_geometry([*frames, *gone], (720, 480)).placed[-3:]
    assert [one.constellation_deg for one in placed] == pytest.approx([35.0, 45.0, 60.0], abs=0.05)
    end = 500.0 - 3 * 90.0 * t[-1] ** 2 - 5 * 300.0 * t[-1] ** 4
    beyond = [363.0 + far[-1] + end * (np.tan(np.radians(angle)) - t[-1]) for angle in (35.0, 45.0, 60.0)]
    assert [one.light_px[0] for one in placed] == pytest.approx(beyond, abs=2.0)


def test_where_the_lights_image_leaves_its_law_the_turntable_is_believed():
    """Rims that cut the light's image move it; that is not jitter."""
    rng = np.random.default_rng(5)
    nominal = np.arange(0.0, 30.0, 0.6)
    true = nominal + 0.02 * rng.normal(size=nominal.size)
    far = 500.0 * np.tan(np.radians(true))
    far[-4:] -= (2.0, 4.0, 6.0, 9.0)
    frames = [SightingInput(float(a), 0.0, (363.0 + x, 238.0), 0.02) for a, x in zip(nominal, far, strict=True)]
    angles = np.array([one.constellation_deg for one in solve_geometry(frames, (720, 480)).placed])
    # half a degree and more with the detected position alone
    assert np.abs(angles - true)[-4:].max() < 0.15
    assert np.std((angles - true)[:-4]) < 0.5 * np.std((nominal - true)[:-4])


def test_upright_frames_are_turned_about_the_axis(tmp_path):
    def leaning(angle):
        x = light_px(angle)[0]
        return x, 31.6 - 0.2 * (x - 40.3)  # seen by a camera tilted by 11 degrees

    captures = read_captures(shoot(tmp_path, {angle: star(leaning(angle)) for angle in ANGLES}))
    plain = merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN)
    run = merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, settings=MergeSettings(upright=True))
    assert any("turned upright" in remark for remark in run.remarks)
    assert plain.frames[3].horizon_deg > 5.0
    for before, info in zip(plain.frames[2:], run.frames[2:], strict=True):
        assert info.horizon_deg == 0.0
        assert info.light_px[1] == pytest.approx(info.axis_px[1], abs=0.05)
        # the light's image is at its nominal position and keeps its light
        frame, old = read_frame(tmp_path / "run", info), read_frame(tmp_path / "run", before)
        ring = [np.hypot(np.arange(96) + 0.5 - i.light_px[0], np.arange(64)[:, None] + 0.5 - i.light_px[1]) for i in
                (info, before)]  # fmt: skip
        core = np.where(ring[0] < 6.0, frame.radiance[..., 1], 0.0)
        middle = [(core * (at + 0.5)).sum() / core.sum() for at in (np.arange(96), np.arange(64)[:, None])]
        assert middle == pytest.approx(info.light_px, abs=0.3)
        sums = [one.radiance[(r > 9.0) & (r < 20.0)].mean() for one, r in zip((frame, old), ring, strict=True)]
        assert sums[0] == pytest.approx(sums[1], rel=0.02)
    corner = read_frame(tmp_path / "run", run.frames[0]).variance[0, -1]
    assert np.isinf(corner).all()
    # the original frames are kept and reused
    again = merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN)
    assert again == plain


def test_a_merge_that_fails_leaves_no_index_of_other_pixels(tmp_path):
    """Later stages would pair the angles and lights of the earlier merge with the pixels of this one."""
    scenes = {angle: star(light_px(angle)) for angle in ANGLES}
    run = tmp_path / "run"
    merge_captures(read_captures(shoot(tmp_path, scenes)), tmp_path, run, camera=KNOWN)
    assert read_run(run).frames
    turned = dict(zip(ANGLES, reversed(scenes.values()), strict=True))
    with pytest.raises(FlarewrightError):
        merge_captures(read_captures(shoot(tmp_path, turned)), tmp_path, run, camera=KNOWN)
    with pytest.raises(FlarewrightError, match=r"merged\.json does not exist"):
        read_run(run)


def test_upright_frames_are_kept(tmp_path):
    """Every merge wrote them again, so every later stage began from the start."""
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    run, settings = tmp_path / "run", MergeSettings(upright=True)
    first = merge_captures(captures, tmp_path, run, camera=KNOWN, settings=settings)
    before = [run_digest(run, first, {}), *(path.stat().st_mtime_ns for path in sorted((run / "upright").iterdir()))]
    again = merge_captures(captures, tmp_path, run, camera=KNOWN, settings=settings)
    after = [run_digest(run, again, {}), *(path.stat().st_mtime_ns for path in sorted((run / "upright").iterdir()))]
    assert after == before
    # a damaged one is written again
    (run / first.frames[1].file).write_bytes(b"")
    merge_captures(captures, tmp_path, run, camera=KNOWN, settings=settings)
    assert read_frame(run, first.frames[1]).radiance.any()


def test_a_faint_light_whose_place_is_given_is_found(tmp_path):
    """The columns that the message asks for did not help."""
    x, y = np.arange(96) + 0.5, np.arange(64)[:, None] + 0.5
    scenes = {}
    for angle in ANGLES:
        at = light_px(angle)
        light = 0.5 + 3.0 * np.exp(-0.5 * (np.hypot(x - at[0], y - at[1]) / 1.2) ** 2)
        scenes[angle] = (light[..., None] * np.ones(3)).astype(np.float32)
    captures = read_captures(shoot(tmp_path, scenes))
    with pytest.raises(FlarewrightError, match="give light_x_px and light_y_px"):
        merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN)
    placed = [
        one.replace(light_x_px=light_px(one.constellation_deg)[0], light_y_px=light_px(one.constellation_deg)[1])
        for one in captures
    ]
    run = merge_captures(placed, tmp_path, tmp_path / "run", camera=KNOWN)
    assert all(frame.light_found for frame in run.frames)
    assert run.frames[-1].light_px == pytest.approx(light_px(ANGLES[-1]), abs=0.2)


def test_dark_frames_of_another_iso_do_not_enter_the_noise(tmp_path):
    captures = shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    unknown = KNOWN.replace(electrons_per_unit=None, read_noise=None)
    alone = merge_captures(read_captures(captures), tmp_path, tmp_path / "alone", camera=unknown).camera
    for k in range(2):
        dark = expose(CAMERA, np.zeros((64, 96, 3), np.float32), 0.125, 1.0, (7, k))
        # the noise of a fourfold ISO
        np.save(tmp_path / f"dark-{k}.npy", np.clip(4 * (dark.astype(int) - CAMERA.black) + CAMERA.black, 0, 65535))
        with captures.open("a") as listed:
            listed.write(f"dark-{k}.npy,,0.125,400,8,dark\n")
    with_darks = merge_captures(read_captures(captures), tmp_path, tmp_path / "darks", camera=unknown).camera
    assert with_darks.electrons_per_unit == pytest.approx(alone.electrons_per_unit, rel=0.05)
    assert with_darks.read_noise == pytest.approx(alone.read_noise, rel=0.2)


def test_a_simulation_without_noise_merges(tmp_path):
    """Dark pixels had an infinite weight."""
    camera = CameraNoise(electrons_per_unit=100.0, read_noise=0.0, iso=100.0)
    assert noise_of(camera, 100.0, 0.0).floor > 0.0
