"""Lights in pixels, tracks, the sun, cameras and frames on the command line."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flarewright.cli.app import run
from flarewright.io.images.exr import read_exr
from flarewright.io.project.camera_list import camera_formats
from flarewright.io.project.project_file import project_from_data

LENS = "triplet-pestrecov"
# the starburst of a small round opening is faster
SMALL = ["--quality", "draft", "--wavelengths", "1", "--fstop", "16", "--blades", "0"]
RENDER = ["render", LENS, *SMALL, "--no-png", "-o", "a.exr"]
SHOT = ["shot", "--lens", LENS, *SMALL, "--processes", "1", "-o", "f.####.exr"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = "".join(f"{frame},{10 + 4 * frame},{30 - 2 * frame},{frame}\n" for frame in range(1, 6))
    (tmp_path / "sun.csv").write_text("frame,x,y,intensity\n" + rows)
    return tmp_path


def brightest(file):
    """Return the pixel of a picture's brightest light, and its project."""
    found = read_exr(file)
    light = found.layers[0].pixels.sum(axis=2)
    row, column = np.unravel_index(light.argmax(), light.shape)
    return (int(column), int(row)), project_from_data(
        tomllib.loads(found.metadata["project"]), folder=Path(), where="a.exr"
    )


def test_a_light_is_drawn_at_its_pixel_from_either_corner(folder, capsys):
    assert run([*RENDER, "--size", "64x36", "--light-px", "50.5,10.5"]) == 0
    place, project = brightest("a.exr")
    assert place == (50, 10)
    assert run([*RENDER, "--size", "64x36", "--light-px", "50.5,25.5", "--px-origin", "bottom-left"]) == 0
    assert brightest("a.exr")[1].lights[0].field_deg == pytest.approx(project.lights[0].field_deg, abs=1e-6)
    words = ["--light", "2,1", "--light-px", "sun@20.5,30.5", "--intensity", "1", "--intensity", "9"]
    assert run([*RENDER, "--size", "64x36", *words, "--overscan", "8"]) == 0
    place, project = brightest("a.exr")
    assert (place, project.camera.size_px, len(project.lights)) == ((28, 38), (80, 52), 2)
    assert project.camera.sensor_mm == pytest.approx((45.0, 29.25))
    assert (project.lights[1].name, project.lights[1].diameter_deg) == ("sun", 0.53)
    assert "overscan: the picture is 80x52 pixels, the frame of 64x36 in its middle" in capsys.readouterr().err


def test_a_holdout_stays_over_the_frame_of_a_picture_with_overscan(folder, capsys):
    """It was stretched over the larger picture, and hid lights beside its black pixels."""
    matte = np.full((36, 64), 255, np.uint8)
    matte[6:15, 46:55] = 0
    Image.fromarray(matte).save("matte.png")
    # 50.5 px and 60 px of the frame: behind the matte, and beside it
    for column, black in ((50.5, True), (57.0, False)):
        words = ["--size", "64x36", "--light-px", f"{column},10.5", "--holdout", "matte.png", "--overscan", "20px"]
        assert run([*RENDER, *words]) == 0
        assert ("hides every light" in capsys.readouterr().err) is black
        _, project = brightest("a.exr")
        assert project.holdout.frame == pytest.approx((64 / 104, 36 / 76))


def test_a_render_and_a_check_use_the_frames_of_a_holdout_sequence(folder, capsys):
    """A render asked for a file with signs in its name, and a check called the project unusable."""
    for frame, level in ((1, 255), (2, 0)):
        Image.fromarray(np.full((36, 64), level, np.uint8)).save(f"matte.{frame}.png")
    words = ["--size", "64x36", "--light", "4,2"]
    for frame, black in ((1, False), (2, True)):
        assert run([*RENDER, *words, "--holdout", "matte.#.png", "--frame", str(frame)]) == 0
        said = capsys.readouterr().err
        assert ("hides every light" in said, f"frame {frame}, " in said) == (black, True)
    assert run([*RENDER, *words, "--holdout", "matte.#.png", "--frame", "3"]) == 2
    assert "the holdout matte.#.png lacks frame 3" in capsys.readouterr().err
    assert run([*RENDER, *words, "--holdout", "matte.#.png"]) == 2
    assert "matte.#.png is a sequence: add --frame N" in capsys.readouterr().err
    head = f"lens = '{LENS}'\n[camera]\nsize_px = [64, 36]\n[holdout]\nimage = 'matte.#.png'\n"
    light = "[[lights]]\nfield_deg = [4.0, 2.0]\n"
    Path("still.toml").write_text(head + light)
    assert run(["project", "check", "still.toml"]) == 0
    moving = "keyframes = [{ at_s = 0.0, field_deg = [1.0, 2.0] }, { at_s = 0.1, field_deg = [2.0, 2.0] }]\n"
    Path("moving.toml").write_text(head + light + moving)
    assert run(["project", "check", "moving.toml"]) == 2
    assert "lacks frames 3-4" in capsys.readouterr().err


def test_a_shot_follows_a_track_and_a_render_shows_one_of_its_frames(folder, capsys):
    assert run([*SHOT, "--size", "64x36", "--track", "sun.csv", "--frames", "2-4x2", "--json"]) == 0
    printed = capsys.readouterr()
    data = json.loads(printed.out)
    assert [frame["frame"] for frame in data["frames"]] == [2, 4]
    assert "track 'track' moves light 0 (counted from 0) in frames 1 to 5" in data["remarks"]
    # whole pixels of a path count from their corner, so the centre of the light lies between four
    for frame, file in ((2, "f.0002.exr"), (4, "f.0004.exr")):
        place, project = brightest(file)
        assert abs(place[0] + 0.5 - (10 + 4 * frame)) <= 0.5
        assert abs(place[1] + 0.5 - (30 - 2 * frame)) <= 0.5
        assert project.lights[0].intensity == pytest.approx(frame)
    words = ["--size", "64x36", "--track", "new=sun.csv", "--light", "1,1", "--frame", "4", "--intensity", "5"]
    assert run([*RENDER, *words]) == 0
    _, again = brightest("a.exr")
    assert again.lights[1].field_deg == pytest.approx(project.lights[0].field_deg)
    # the flag overrides the column
    assert [light.intensity for light in again.lights] == [5.0, 5.0]


def test_a_camera_by_name_gives_its_area_its_pixels_and_a_part_for_other_proportions(folder, capsys):
    assert run([*RENDER, "--light", "2,1", "--sensor", "Super 16", "--size", "64x36"]) == 0
    assert "Super 16 film: 64x36 pixels on 12.52x7.04 mm, a part of its 12.52x7.41 mm" in capsys.readouterr().err
    _, project = brightest("a.exr")
    assert project.camera.sensor_mm == pytest.approx((12.52, 12.52 * 36 / 64))
    words = ["--light", "2,1", "--sensor", "arri-alexa-mini", "--crop", "2%"]
    assert run([*RENDER, *words]) == 0
    _, project = brightest("a.exr")
    assert project.camera.size_px == (68, 44)
    # the pitch of the camera, 8.25 um
    assert np.array(project.camera.sensor_mm) / (68, 44) == pytest.approx([0.00825, 0.00825], rel=1e-3)
    assert run(["cameras", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["cameras"]
    assert len(listed) == len(camera_formats()) > 25


def test_the_ghosts_of_a_light_at_a_pixel_and_a_project_that_begins_with_one(folder, capsys):
    """The pixel against the centroid that the ghost table traces, at the same wavelength within lateral colour."""
    words = ["--light-px", "48.5,8.5", "--size", "64x36", "--sensor", "super-16", "--fstop", "16"]
    assert run(["ghosts", LENS, *words, "--json"]) == 0
    x, y = json.loads(capsys.readouterr().out)["direct"]["centroid_mm"]
    pitch = 12.52 / 64
    assert (32.0 + x / pitch, 18.0 - y / pitch) == pytest.approx((48.5, 8.5), abs=0.05)
    assert run(["project", "init", LENS, "--light-px", "640,180", "-o", "new.toml"]) == 0
    light = tomllib.loads((folder / "new.toml").read_text())["lights"][0]
    assert light["field_deg"][0] == pytest.approx(0.0, abs=1e-3)
    assert light["field_deg"][1] > 1.0
    for wrong in (
        ["ghosts", LENS, "--light", "1,1", "--size", "64x36"],
        ["ghosts", LENS],
        ["ghosts", LENS, "--light", "1,1", "--light-px", "1,1"],
        ["project", "init", LENS, "--light", "1,1", "--light-px", "1,1"],
    ):
        assert run(wrong) == 2


def test_pixels_of_known_cameras_are_square_and_have_sources():
    for camera in camera_formats():
        assert len(camera.source) > 10
        if camera.size_px is not None:
            pitch = np.array(camera.sensor_mm) / camera.size_px
            assert pitch[0] == pytest.approx(pitch[1], rel=0.02), camera.name


def test_the_sun_at_a_time_and_place(folder, capsys):
    pytest.importorskip("astral")
    words = ["--sun", "2003-10-17T12:30:30-07:00,39.742476,-105.1786", "--heading", "200", "--tilt", "36"]
    assert run([*RENDER, "--size", "64x36", *words]) == 0
    assert "azimuth 194.34, elevation 39.89 degrees" in capsys.readouterr().err
    (sun,) = brightest("a.exr")[1].lights
    assert (sun.name, sun.diameter_deg) == ("sun", 0.53)
    # left of the axis and above it; the angle follows from two directions
    slope = np.hypot(*np.tan(np.radians(sun.field_deg)))
    a, b = (np.radians([194.34, 39.89]), np.radians([200.0, 36.0]))
    cosine = np.sin(a[1]) * np.sin(b[1]) + np.cos(a[1]) * np.cos(b[1]) * np.cos(a[0] - b[0])
    assert np.degrees(np.arctan(slope)) == pytest.approx(np.degrees(np.arccos(cosine)), abs=0.02)
    assert sun.field_deg[0] < 0.0 < sun.field_deg[1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--light-px 400", "--light-px '400' is not two numbers"),
        ("--light-px moon@4,5", "there is no 'moon'; write --light-px 640,360 or --light-px sun@640,360"),
        ("--light-px sun", "--light-px sun has no place"),
        ("--light-px 9999,5", "has no direct image at 9999,5 px"),
        ("--light 1,1 --px-origin top-left", "--px-origin is the corner of --light-px and --track"),
        ("--light-px 1,1 --px-origin middle", "choose top-left or bottom-left"),
        ("--light 1,1 --track-offset 5", "--track-offset is for tracks"),
        ("--track sun.csv", "add --frame N, or draw all with flarewright shot"),
        ("--track 3=sun.csv --frame 2 --light 1,1", "there is no light 3: the lights are 0 to 0"),
        ("--track =sun.csv --frame 2", "names no light"),
        ("--track sun.csv --frame 2 --track-format foo", "choose csv, nuke"),
        ("--light 1,1 --tilt 5", "--tilt is the camera's orientation for --sun"),
        ("--sun 2024-06-21T18:00,48,11 --heading 270", "has no offset from UTC"),
        ("--sun 2024-06-21T18:00Z,98,11 --heading 270", "'98' is no angle up to 90 degrees"),
        ("--sun noon,48,11 --heading 270", "has no time 'noon'"),
        ("--sun 2024-06-21T18:00Z,48,11", "--sun needs --heading"),
        ("--light 1,1 --sensor alexa-l", "did you mean"),
        ("--light 1,1 --crop 5000x10", "the picture is only 64 pixels wide"),
        ("--light 1,1 --crop 63x36", "cuts an odd number"),
        ("--light 1,1 --crop 5", "give 80%"),
        ("--light 1,1 --overscan much", "give 10% of the picture"),
        ("--light 1,1 --overscan 900%", "give 0% to 400%"),
    ],
)
def test_bad_input_is_one_sentence(folder, capsys, words, said):
    if "--sun" in words:
        pytest.importorskip("astral")
    assert run([*RENDER, "--size", "64x36", *words.split()]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert not (folder / "a.exr").exists()
