"""Tracks of other programs: the same path in each format gives the same places."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from flarewright.errors import FileError, ProjectError
from flarewright.io.tracks.read_tracks import FORMATS, read_tracks, track_format

SIZE = (640.0, 360.0)
FRAMES = np.arange(1001.0, 1025.0)
X = 320.0 + 200.0 * np.sin(np.arange(24) / 6.0)
Y = 180.0 + 60.0 * np.cos(np.arange(24) / 5.0)
PATH = np.column_stack([X, Y])


def lines(*columns, start=0):
    return "\n".join(" ".join(f"{value:.9f}" for value in row) for row in np.column_stack(columns)[start:]) + "\n"


def curve(values, at=1001):
    return "{curve i x" + str(at) + " " + " ".join(f"{value:.9f}" for value in values) + "}"


def tracker4():
    columns = ("enable", "name", "track_x", "track_y", "offset_x")
    head = " \n".join(f"{{ 2 1 58 {column} {column} 1 }}" for column in columns)
    row = f'{{ {{curve K x1001 1}} "track 1" {curve(X)} {curve(360.0 - Y)} {{curve K x1001 0}} }}'
    return (
        'Root {\n inputs 0\n format "640 360 0 0 640 360 1 small"\n}\n'
        f"Tracker4 {{\n inputs 0\n tracks {{ {{ 1 31 1 }} \n{{ {head} \n}} \n{{ \n {row} \n}} \n}}\n"
        " name Tracker1\n}\n"
    )


def after_effects(property_="Motion Trackers\tTracker #1\tTrack Point #1\tFeature Center", size=SIZE, scale=1.0):
    head = f"Adobe After Effects 8.0 Keyframe Data\r\n\r\n\tUnits Per Second\t25\r\n\tSource Width\t{size[0]:g}\r\n"
    head += f"\tSource Height\t{size[1]:g}\r\n\tSource Pixel Aspect Ratio\t1\r\n\r\n{property_}\r\n"
    rows = "".join(
        f"\t{frame:g}\t{scale * x:.9f}\t{scale * y:.9f}\t\r\n" for frame, (x, y) in zip(FRAMES, PATH, strict=True)
    )
    return f"{head}\tFrame\tX pixels\tY pixels\t\r\n{rows}\r\nEnd of Keyframe Data\r\n"


TEXTS = {
    "csv": "frame,x,y\n" + lines(FRAMES, X, Y).replace(" ", ","),
    "nuke": tracker4(),
    "nuke-ascii": lines(FRAMES, X, 360.0 - Y),
    "after-effects": after_effects(),
    "syntheyes": "\n".join(
        f"Tracker1 {frame:.0f} {2 * x / 640 - 1:.12f} {2 * y / 360 - 1:.12f} 30"
        for frame, x, y in zip(FRAMES, X, Y, strict=True)
    ),
    "3de": "1\nsun\n0\n24\n"
    + "\n".join(f"{f:.0f} {x:.12f} {360 - y:.12f}" for f, x, y in zip(FRAMES, X, Y, strict=True)),
}


@pytest.fixture
def read(tmp_path):
    def reader(text, form=None, **options):
        file = tmp_path / "track.txt"
        file.write_bytes(text.encode())
        return read_tracks(file, form, **options)

    return reader


@pytest.mark.parametrize("form", TEXTS)
def test_each_format_is_recognised_and_gives_the_same_path(read, form):
    found = read(TEXTS[form])
    assert found.format == form
    (track,) = found.tracks
    np.testing.assert_array_equal(track.frames, FRAMES)
    np.testing.assert_allclose(track.from_top_left(SIZE), PATH, atol=1e-6)
    # a forced format reads the same
    np.testing.assert_array_equal(read(TEXTS[form], form).tracks[0].places, track.places)


def test_a_scene_of_blender_gives_the_pinhole_projection(read):
    def posed(frame, position, **more):
        matrix = np.eye(4)
        matrix[:3, 3] = position
        return {"frame": frame, "matrix": matrix.tolist(), **more}

    camera = [posed(k, (0.1 * k, 0.0, 5.0), focal_mm=50.0, sensor_mm=[36.0, 20.25]) for k in (1, 2, 3)]
    scene = {
        "format": "flarewright-scene", "version": 1, "fps": 25, "camera": {"frames": camera},
        "lights": [
            {"name": "lamp", "kind": "point", "radius": 0.05, "frames": [posed(1, (1, 0.5, -5), rgb=[1, 0.5, 0.2])]},
            {"name": "behind", "kind": "spot", "frames": [posed(1, (0.0, 0.0, 9.0))]},
            {"name": "sun", "kind": "sun", "diameter_deg": 0.53, "frames": [posed(1, (7.0, 8.0, 9.0))]},
        ],
    }  # fmt: skip
    scene["lights"][2]["frames"][0]["matrix"] = [[1, 0, 0, 0], [0, 0.8, 0.6, 0], [0, 0.6, -0.8, 0], [0, 0, 0, 1]]
    found = read(json.dumps(scene))
    assert (found.format, found.fps) == ("blender", 25.0)
    lamp, sun = found.tracks
    np.testing.assert_array_equal(lamp.frames, [1, 2, 3])
    places = lamp.from_top_left((3600.0, 2025.0))
    for k, place in enumerate(places, 1):
        # 10 in front, 1 mm of film is 100 pixels
        assert place == pytest.approx((1800.0 + 5.0 * (1.0 - 0.1 * k) * 100.0, 1012.5 - 2.5 * 100.0))
    assert lamp.diameter_deg == pytest.approx(np.degrees(0.1 / np.sqrt(0.9**2 + 0.5**2 + 100.0)), rel=0.01)
    assert sun.directions[0] == pytest.approx((0.0, 0.75))
    assert sun.diameter_deg == 0.53
    assert ["'behind' is never in front" in line for line in found.remarks] == [True]


@pytest.mark.parametrize("key", ["intensity", "rgb"])
def test_a_value_in_some_frames_of_a_light_only_is_refused(read, key):
    """It was dropped for all frames without a word."""
    eye = np.eye(4).tolist()
    lamp = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -5], [0, 0, 0, 1]]
    value = {"intensity": 0.5, "rgb": [1, 0.5, 0.2]}[key]
    states = [{"frame": 1, "matrix": lamp, key: value}, {"frame": 2, "matrix": lamp}]
    scene = {
        "format": "flarewright-scene", "version": 1,
        "camera": {"frames": [{"frame": 1, "matrix": eye, "focal_mm": 50.0, "sensor_mm": [36.0, 20.0]}]},
        "lights": [{"name": "lamp", "kind": "point", "frames": states}],
    }  # fmt: skip
    with pytest.raises(FileError, match=f"the light 'lamp' has {key} in some frames only; give it in all of them"):
        read(json.dumps(scene))
    states[1][key] = value
    assert getattr(read(json.dumps(scene)).tracks[0], key).shape[0] == 2


def test_the_example_of_the_documentation_can_be_read(read):
    text = (Path(__file__).parents[3] / "docs" / "placing-lights.md").read_text("utf-8")
    (sun,) = read(text.partition("```json")[2].partition("```")[0]).tracks
    assert sun.directions[0] == pytest.approx((0.0, 0.17 / 0.98))


def test_curves_of_nuke_have_gaps_slopes_and_binary_numbers(read):
    pasted = "{curve x1001 10 s2 x1005 20 22 K x1010 30} {curve L x1001 1 x1005 0x40000000 2 5 u0.5}"
    (track,) = read(pasted).tracks
    np.testing.assert_array_equal(track.frames, [1001, 1005, 1009, 1010, 1013])
    # each curve is straight between its keys
    np.testing.assert_allclose(track.places[:3], [[10, 1], [20, 2], [22, 2]])
    assert track.places[3] == pytest.approx((30.0, 2.75))


def test_old_trackers_and_their_names(read):
    text = f"Tracker3 {{\n track1 {{{curve(X)} {curve(Y)}}}\n track2 {{0 0}}\n name Tracker7\n}}\n"
    found = read(text)
    assert [track.name for track in found.tracks] == ["Tracker7 track1"]


def test_columns_without_frames_begin_at_the_first_frame(read):
    found = read(lines(X, Y), first_frame=1001)
    np.testing.assert_array_equal(found.tracks[0].frames, FRAMES)
    assert found.remarks == (f"{found.remarks[0].split(' has no')[0]} has no frames: its first line is frame 1001",)


def test_columns_with_tabs_say_from_which_corner_they_count(read):
    found = read("1\t10\t20\n2\t11\t21\n")
    assert (found.format, found.tracks[0].origin) == ("csv", "top-left")
    assert "from the top left corner; --track-format nuke-ascii counts from the bottom left" in found.remarks[0]
    assert not read("1\t10\t20\n", origin="bottom-left").remarks
    assert not read("frame\tx\ty\n1\t10\t20\n").remarks
    assert not read("1\t10\t20\n", "csv").remarks
    assert not read("1,10,20\n").remarks


def test_positions_of_a_null_count_in_the_composition(read):
    """The source of a null is 100x100 pixels, whatever the size of the composition."""
    (track,) = read(after_effects("Transform\tPosition", (100.0, 100.0))).tracks
    assert track.size_px is None
    (track,) = read(after_effects("Transform\tPosition", (1280.0, 720.0), 2.0)).tracks
    np.testing.assert_allclose(track.from_top_left(SIZE), PATH, atol=1e-6)


def test_tables_have_intensity_colour_names_and_another_corner(read):
    text = "name;frame;x;y;r;g;b;intensity;note\nsun;2;5;6;1;0.5;0.25;3;\nsun;1;7;8;1;1;1;0;\nlamp;1;1;2;1;1;1;1;x\n"
    found = read(text, origin="bottom-left")
    sun, lamp = found.tracks
    assert (sun.name, lamp.name, sun.frames.tolist()) == ("sun", "lamp", [1.0, 2.0])
    assert sun.intensity.tolist() == [0.0, 3.0]
    assert sun.rgb.tolist() == [[1, 1, 1], [1, 0.5, 0.25]]
    np.testing.assert_allclose(sun.from_top_left((10.0, 10.0)), [[7.0, 2.0], [5.0, 4.0]])
    assert "columns note have no effect" in found.remarks[0]


@pytest.mark.parametrize(
    ("text", "form", "said"),
    [
        ("", None, "is empty"),
        ("hello world\n", None, "is no known file of tracks"),
        ("1,2\n", None, "is no known file of tracks"),
        ("1,2,3,4,5\n", None, "has 5 cells a line; write frame,x,y"),
        ("frame,x\n1,2\n", "csv", "has no column 'y'"),
        ("frame,x,y,r\n1,2,3,4\n", None, "some of the columns r, g and b"),
        ("1,2,3\n2,nan,4\n", None, "line 2: 'nan' is no number for x"),
        ("1,2,3\n1,3,4\n", None, "has frame 1 twice"),
        ("1,2,3\n2,3\n", None, "line 2 has 2 cells and not 3"),
        ("1,2,3,1,0,0,0\n", None, "not all 0"),
        ("1,2,3,-1\n", None, "an intensity lies between"),
        ("1,2,1e30\n", None, "which no picture has"),
        ("Tracker4 {\n tracks { { 1 31 1 } {", None, "is no known file"),
        ("Tracker4 {\n tracks { {curve x1 5 ", None, "cut short"),
        ("{curve x1 5}", "nuke", "has 1 curves"),
        ("{curve x5 1 x4 1} {curve x1 2}", None, "frames do not rise"),
        ("{curve x1 {parent.a}} {curve x1 2}", None, "has an expression"),
        ("{curve x1 5 nan 7} {curve x1 5 6 7}", None, "'nan' is no number for a value"),
        ("{" * 100, "nuke", "more than 40 braces"),
        ('{curve x1 10 ""} {curve x1 2}', "nuke", "'' is no number for a value"),
        (f"frame,x,y\n1,2,{'3' * 200_000}\n", "csv", "line 2 is no line of a table; write frame,x,y"),
        (
            "Adobe After Effects 8.0 Keyframe Data\n\nTransform\tScale\n\tFrame\tX percent\n\t0\t5\n",
            None,
            "no property",
        ),
        ("T 1 0.5 7000\n", None, "between -1 and 1"),
        ("T 1 0.5 0.5\nT 2 0.5\n", None, "line 2 is no 'name frame u v'"),
        ("1\nsun\n0\n2\n1 2 3\n", None, "ends where a frame of 'sun' belongs"),
        ("1\nsun\n0\n0\n", "3de", "none with a frame"),
        ('{"format": "flarewright-scene", "version": 2}', None, "version"),
        ('{"format": "flarewright-scene"', None, "not valid JSON"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(read, text, form, said):
    with pytest.raises(FileError) as error:
        read(text, form)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_format_lists_the_known_ones():
    assert [track_format(name) for name in FORMATS] == list(FORMATS)
    with pytest.raises(ProjectError, match="choose csv, nuke"):
        track_format("shake")
