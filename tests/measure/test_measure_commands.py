"""`flarewright measure merge` and `run`: JSON, a picture, and one sentence for every error."""

import errno
import json
import os
import shutil

import numpy as np
import pytest
from star_run import ANGLES, CAMERA, light_px, shoot, star

from flarewright.cli.app import run
from flarewright.io.measurement.merged import read_run


@pytest.fixture
def listed(tmp_path):
    return shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})


def refused(capsys, *arguments):
    """Run a command that must fail with one sentence; return it."""
    assert run([str(word) for word in arguments]) == 2
    out, reported = capsys.readouterr()
    assert out == ""
    lines = [line for line in reported.splitlines() if "error:" in line]
    assert len(lines) == 1
    assert "Traceback" not in reported
    return lines[0]


def test_merge_reports_its_result_and_run_continues(listed, tmp_path, capsys):
    folder = tmp_path / "run"
    assert run(["measure", "merge", str(listed), "-o", str(folder), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["stages"] == ["merge"]
    assert reported["merge"]["frames"] == reported["merge"]["light_found"] == len(ANGLES)
    assert reported["merge"]["px_per_rad"] == pytest.approx(400.0, rel=0.01)
    # the tilt of the horizon is reported where the light is off axis, with the range of angles
    frames = {frame.constellation_deg: frame.horizon_deg for frame in read_run(folder).frames}
    assert len(reported["merge"]["horizon_deg"]) == len(ANGLES) - sum(abs(angle) <= 1.0 for angle in frames) > 2
    for angle, tilt in zip(
        reported["merge"]["horizon_constellation_deg"], reported["merge"]["horizon_deg"], strict=True
    ):
        assert frames[angle] == tilt
    assert (folder / "merged.png").stat().st_size > 1000
    before = (folder / "frames" / "frame-003.exr").stat().st_mtime_ns
    assert run(["measure", "run", str(listed), "-o", str(folder), "--stages", "merge"]) == 0
    assert f"{len(ANGLES)} frames of 96x64 pixels, the light seen in {len(ANGLES)}" in capsys.readouterr().out
    assert (folder / "frames" / "frame-003.exr").stat().st_mtime_ns == before
    assert len(read_run(folder).frames) == len(ANGLES)


def test_a_folder_with_a_rule_and_blocks(tmp_path, capsys):
    shots = tmp_path / "shots"
    shots.mkdir()
    shoot(shots, {angle: star(light_px(angle)) for angle in ANGLES})
    text = (shots / "captures.csv").read_text().splitlines()
    lines = ["file,exposure_s", *(",".join((row.split(",")[0], row.split(",")[2])) for row in text[1:])]
    (shots / "captures.csv").write_text("\n".join(lines))
    arguments = ["measure", "merge", str(shots / "captures.csv"), "--angles", "0+1", "--block", "2"]
    assert run([*arguments, "--white-balance", "2,1,1.5", "-o", str(tmp_path / "run"), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)["merge"]
    assert reported["size_px"] == [48, 32]
    assert reported["px_per_rad"] == pytest.approx(200.0, rel=0.01)
    assert read_run(tmp_path / "run").white_balance == (2.0, 1.0, 1.5)


@pytest.mark.parametrize(
    ("words", "scene"),
    [
        ("no light was found", lambda _: star(level=0.2)),
        ("saturated over more than half", lambda angle: star(light_px(angle), level=300.0)),
        pytest.param(
            "two lights were found", lambda angle: star(light_px(angle), (80.0, 10.0)), marks=pytest.mark.slow
        ),
        pytest.param(
            "does not move as the angles say",
            lambda angle: star((20.0 + 43.0 * (angle % 2), 31.0)),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_scenes_that_cannot_be_measured_are_refused(tmp_path, capsys, words, scene):
    listed = shoot(tmp_path, {angle: scene(angle) for angle in ANGLES})
    assert words in refused(capsys, "measure", "merge", listed, "-o", tmp_path / "run")


def test_photographs_that_cannot_be_used_are_refused(listed, tmp_path, capsys):
    command = ("measure", "merge", listed, "-o", tmp_path / "run")
    whole = (tmp_path / "2-1.npy").read_bytes()
    np.save(tmp_path / "2-1.npy", np.zeros((64, 95, 3), np.uint16))
    assert "2-1.npy has 95x64 pixels, most others have 96x64" in refused(capsys, *command)
    (tmp_path / "2-1.npy").write_bytes(b"junk")
    assert "2-1.npy cannot be read" in refused(capsys, *command)
    (tmp_path / "2-1.npy").unlink()
    assert "2-1.npy does not exist" in refused(capsys, *command)
    (tmp_path / "2-1.dng").write_bytes(b"II*\0 and no more")
    listed.write_text(listed.read_text().replace("2-1.npy", "2-1.dng"))
    assert "2-1.dng cannot be read as a RAW file" in refused(capsys, *command)
    listed.write_text(listed.read_text().replace("2-1.dng", "2-1.npy"))
    (tmp_path / "2-1.npy").write_bytes(whole)
    text = listed.read_text()
    listed.write_text(text.replace(f"2-1.npy,2,{CAMERA.exposures_s[1]!r},100,8,light\n", ""))
    assert "2 deg lacks the exposure of 0.125 s" in refused(capsys, *command)


def test_pictures_without_light_and_a_list_without_exposures_are_refused(listed, tmp_path, capsys):
    command = ("measure", "merge", listed, "-o", tmp_path / "run")
    text = listed.read_text()
    listed.write_text(text.replace("exposure_s", "focal_mm"))
    assert "8 of 8 photographs have no exposure_s" in refused(capsys, *command)
    listed.write_text(text)
    rng = np.random.default_rng(3)
    for path in sorted(tmp_path.glob("*.npy")):
        dark = rng.normal(CAMERA.black, 4.0, (64, 96, 3))
        np.save(path, dark.round().clip(0).astype(np.uint16))
    assert "no light was found" in refused(capsys, *command)


def test_folders_and_options_that_cannot_be_used_are_refused(listed, tmp_path, capsys):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "a.txt").write_text("mine")
    (tmp_path / "file").write_text("")
    for words, *arguments in (
        ("holds no run", "merge", listed, "-o", tmp_path / "other"),
        ("is a file; give a folder", "merge", listed, "-o", tmp_path / "file"),
        ("captures.txt does not exist", "merge", tmp_path / "captures.txt", "-o", tmp_path / "run"),
        ("'sing' is no stage; choose from merge", "run", listed, "--stages", "merge,sing", "-o", tmp_path / "run"),
        ("--white-balance 'warm'", "merge", listed, "--white-balance", "warm", "-o", tmp_path / "run"),
        ("the rule 'x'", "merge", listed, "--angles", "x", "-o", tmp_path / "run"),
        ("nothing.json does not exist", "merge", listed, "--camera", tmp_path / "nothing.json", "-o", tmp_path / "run"),
        ("cluster 'farm' is unknown", "merge", listed, "--cluster", "farm", "-o", tmp_path / "run"),
        (
            "--threads has no effect on --cluster tcp://a:1",
            "merge",
            listed,
            "--cluster",
            "tcp://a:1",
            "--threads",
            "2",
            "-o",
            tmp_path / "run",
        ),
        ("--cluster is for the stage merge", "run", listed, "--stages", "find", "--cluster", "local", "-o", tmp_path),
    ):
        assert words in refused(capsys, "measure", *arguments)


def test_a_full_disk_is_reported_before_and_while_writing(listed, tmp_path, capsys, monkeypatch):
    command = ("measure", "merge", listed, "-o", tmp_path / "run")
    usage = shutil.disk_usage(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1000))
        assert "free some space" in refused(capsys, *command)
    rename = os.replace

    def full(source, target):
        if str(target).endswith("frame-002.exr"):
            raise OSError(errno.ENOSPC, "No space left on device")
        rename(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        assert "frame-002.exr: no space left on device" in refused(capsys, *command)
    assert not list((tmp_path / "run" / "frames").glob(".*"))
    assert run([str(word) for word in command]) == 0
