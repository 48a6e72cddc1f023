"""The file, the command and the running program of the add-on, without Blender."""

from __future__ import annotations

import json
import os
import sys
import time
import tomllib
import zipfile
from pathlib import Path

import pytest

from flarewright.io.tracks.numbers import MOST_FRAMES, MOST_TRACKS
from flarewright.io.tracks.scene_json import read_scene

FOLDER = Path(__file__).parents[2] / "bridges" / "blender"
ROOT = FOLDER.parents[1]
EYE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
LAMP = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -5.0], [0, 0, 0, 1]]


def states(*frames):
    return [{"frame": frame, "matrix": EYE, "focal_mm": 50.0, "sensor_mm": [36.0, 20.0]} for frame in frames]


def order(addon, **values):
    fields = {
        "lens": "heliar-tronnier", "scene": Path("f.scene.json"), "pattern": Path("f.####.exr"), "frames": (1, 9, 2),
        "start": 1, "fps": 24.0, "size_px": (64, 36), "sensor_mm": (36.0, 20.25),
    }  # fmt: skip
    return addon.program.Order(**{**fields, **values})


def ended(running):
    until = time.monotonic() + 20.0
    while not running.poll():
        assert time.monotonic() < until
        time.sleep(0.01)
    return running


def test_a_path_is_what_the_program_reads_and_is_dark_where_the_light_was_not_found(addon):
    path = addon.document.LightPath("Lamp", "point")
    path.add(1, LAMP, (2.0, 1.0, 0.5), 1.0, 0.1)
    path.add(3, LAMP, (2.0, 1.0, 0.5), 0.25, 0.2)
    path.add(4, LAMP, (0.0, 0.0, 0.0), 1.0, 0.2)
    dark = addon.document.LightPath("Dark", "point")
    dark.add(1, LAMP, (1.0, 1.0, 1.0), 0.0, 0.0)
    data = addon.document.scene_data(25.0, "Eye", states(1, 2, 3, 4), [path, dark])
    found = read_scene(json.dumps(data), "s.json")
    assert (found.fps, [track.name for track in found.tracks]) == (25.0, ["Lamp"])
    level = 2.0 * addon.document.LUMINANCE[0] + addon.document.LUMINANCE[1] + 0.5 * addon.document.LUMINANCE[2]
    assert found.tracks[0].intensity.tolist() == pytest.approx([level, 0.0, 0.25 * level, 0.0])
    assert found.tracks[0].hidden.tolist() == [False, True, False, True]
    assert found.tracks[0].rgb[0].tolist() == pytest.approx([1.0, 0.5, 0.25])


def test_the_limits_are_those_of_the_reader(addon):
    assert (addon.document.MOST_LIGHTS, addon.document.MOST_FRAMES) == (MOST_TRACKS, MOST_FRAMES)
    paths = [addon.document.LightPath(f"L{k}", "point") for k in range(MOST_TRACKS + 1)]
    for path in paths:
        path.add(1, LAMP, (1.0, 1.0, 1.0), 1.0, 0.0)
    with pytest.raises(addon.errors.FlareError, match="1001 lights reach the camera, more than 1000; choose a collec"):
        addon.document.scene_data(24.0, "Eye", states(1), paths)


@pytest.mark.parametrize(
    ("text", "scene", "frame"),
    [
        ("/a/flare.####.exr", "flare.scene.json", "flare.0012.exr"),
        ("/a/my_shot_##.EXR", "my_shot.scene.json", "my_shot_12.EXR"),
        ("/a/####.exr", "flare.scene.json", "0012.exr"),
    ],
)
def test_the_scene_lies_beside_its_frames(addon, text, scene, frame):
    pattern, file = addon.document.frame_pattern(text)
    assert file == Path("/a") / scene
    assert addon.document.frame_file(pattern, 12).name == frame


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("/a/flare.exr", "has no place for the number of a frame; name it flare.####.exr"),
        ("/a/f.##.##.exr", "has no place for the number of a frame"),
        ("/a/f.####.png", "is no EXR file; name it flare.####.exr"),
    ],
)
def test_a_name_that_is_no_sequence_is_refused(addon, text, words):
    with pytest.raises(addon.errors.FlareError, match=words):
        addon.document.frame_pattern(text)


def test_a_file_is_written_whole_or_not_at_all(addon, tmp_path):
    addon.document.write_json({"a": 1}, tmp_path / "new" / "s.json")
    assert json.loads((tmp_path / "new" / "s.json").read_text()) == {"a": 1}
    assert [each.name for each in (tmp_path / "new").iterdir()] == ["s.json"]
    (tmp_path / "file").write_text("")
    with pytest.raises(addon.errors.FlareError, match=r"cannot write .*s\.json: .*; choose another output"):
        addon.document.write_json({}, tmp_path / "file" / "s.json")


def test_the_command_says_all_that_the_scene_states(addon):
    made = addon.program.shot_command(
        ["flarewright"], order(addon, f_number=5.6, shutter_deg=180.0, more="--blades 8 --look 'low sun'", start=0)
    )
    words = " ".join(made)
    for part in (
        "shot --lens heliar-tronnier --track f.scene.json --track-format blender", "--frames 1-9x2 --start 0",
        "--fps 24 --size 64x36 --sensor 36x20.25", "--fstop 5.6", "--shutter 180", "--radiance --json", "-o f.####.exr",
    ):  # fmt: skip
        assert part in words
    assert made[-6:-2] == ["--blades", "8", "--look", "low sun"]
    with pytest.raises(addon.errors.FlareError, match="have an open quotation mark; close it"):
        addon.program.shot_command(["flarewright"], order(addon, more="'"))


def test_a_program_is_found_by_name_by_path_or_as_a_command(addon, tmp_path):
    odd = tmp_path / "a program"
    odd.write_text("#!/bin/sh\n")
    odd.chmod(0o755)
    assert addon.program.find_program(str(odd)) == [str(odd)]
    assert addon.program.find_program(f"{sys.executable} -m flarewright") == [sys.executable, "-m", "flarewright"]
    for text in ("", "no-such-program"):
        with pytest.raises(addon.errors.FlareError, match="was not found; install it with 'pip install flarewright'"):
            addon.program.find_program(text)


def script(text):
    return [sys.executable, "-c", text]


def test_progress_remarks_and_summary_of_a_running_program(addon):
    text = (
        "import sys\n"
        "print('flarewright: a remark', file=sys.stderr)\n"
        'print(\'{"frame": 1, "done": 1, "of": 2, "left_s": 3.2}\', file=sys.stderr)\n'
        "print('{\"frames\": [1]}')"
    )
    running = ended(addon.program.Running(script(text)))
    assert (running.code, running.done, running.of, running.remarks) == (0, 1, 2, ["a remark"])
    assert running.words == "flare of 1 of 2 frames, 4 s left"
    assert running.summary() == {"frames": [1]}


def test_the_sentence_of_a_program_that_fails(addon):
    text = "import sys; print('flarewright: error: no such lens', file=sys.stderr); print('x'); sys.exit(2)"
    running = ended(addon.program.Running(script(text)))
    assert (running.code, running.error, running.summary()) == (2, "Flarewright: no such lens", {})
    with pytest.raises(addon.errors.FlareError, match="cannot start /no/such"):
        addon.program.Running(["/no/such"])


@pytest.mark.skipif(os.name != "posix", reason="asks for a process by its number")
def test_a_cancelled_program_ends_with_what_it_started(addon, tmp_path):
    text = (
        "import subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(child.pid) + '.')\n"
        "time.sleep(60)"
    )
    running = addon.program.Running(script(text))
    until = time.monotonic() + 20.0
    while not ((tmp_path / "pid").exists() and (tmp_path / "pid").read_text().endswith(".")):
        assert time.monotonic() < until
        time.sleep(0.01)
    running.cancel()
    child = int((tmp_path / "pid").read_text()[:-1])
    assert ended(running).code != 0
    while Path(f"/proc/{child}").exists() and "zombie" not in Path(f"/proc/{child}/status").read_text():
        assert time.monotonic() < until
        time.sleep(0.01)
    running.cancel()


def test_a_job_advances_ends_and_is_cancelled(addon):
    closed = []

    def work(error=None):
        try:
            for k in range(3):
                yield f"step {k}"
            if error is not None:
                raise error
            return ["done"]
        finally:
            closed.append(True)

    job = addon.job.Job(work())
    assert job.advance(0.0)
    assert (job.words, job.state) == ("step 0", "RUNNING")
    assert not job.advance(10.0)
    assert (job.state, job.said) == ("FINISHED", ["done"])
    job = addon.job.Job(work(addon.errors.FlareError("a sentence")))
    assert not job.advance(10.0)
    assert (job.state, job.said) == ("FAILED", ["a sentence"])
    job = addon.job.Job(work())
    job.advance(0.0)
    job.cancel()
    closed.clear()
    assert not job.advance(10.0)
    assert (job.state, closed) == ("CANCELLED", [True])
    job = addon.job.Job(work(ValueError("a bug")))
    with pytest.raises(ValueError, match="a bug"):
        job.advance(10.0)
    assert job.state == "FAILED"


def test_a_job_that_waits_returns_at_once(addon):
    def work():
        while True:
            yield "waits"

    job = addon.job.Job(work())
    started = time.monotonic()
    assert job.advance(5.0)
    assert time.monotonic() - started < 1.0


def test_the_packed_file_has_all_modules_and_the_same_bytes_each_time(addon, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from blender_addon import pack

    for name in ("a.zip", "b.zip"):
        pack(tmp_path / name)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    names = set(zipfile.ZipFile(tmp_path / "a.zip").namelist())
    assert names == {*(each.name for each in FOLDER.glob("*.py")), "blender_manifest.toml", "LICENSE"}
    manifest = tomllib.loads((FOLDER / "blender_manifest.toml").read_text())
    assert manifest["version"] == ".".join(map(str, addon.bl_info["version"]))
    assert manifest["blender_version_min"] == ".".join(map(str, addon.bl_info["blender"]))
