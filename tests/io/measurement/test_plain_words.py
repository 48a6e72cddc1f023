"""Error messages for values of the wrong type use the words of the file, never those of Python."""

from __future__ import annotations

import datetime as dates
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from flarewright.errors import FlarewrightError
from flarewright.io.lens.coating_text import read_coating_file
from flarewright.io.lens.toml_lens import lens_from_table
from flarewright.io.measurement.captures import read_camera, read_captures
from flarewright.io.measurement.ghost_model_file import (
    read_corrections,
    read_ghost_model,
    read_ghost_tracks,
    read_replay_camera,
)
from flarewright.io.measurement.merged import read_run
from flarewright.io.project.file_of_kind import example_file
from flarewright.io.project.project_file import project_from_data
from flarewright.io.project.scene_file import scene_from_data

PYTHON = re.compile(
    r"[Ii]nput should|valid (?:string|number|integer|boolean|tuple|dictionary|list|datetime)|\btuple\b|\bdict\b|\bstr\b"
    r"|\bint\b|(?<!')\bfloat\b|\bbool\b|NoneType|\bNone\b|\bTrue\b|\bFalse\b|datetime\.|tzinfo|pydantic|type=|instance|"
    r"\bparse\b|Extra inputs|Field required|something else|[Vv]alue error|Traceback|object at 0x|<class|lambda"
)

BAD: tuple[Any, ...] = (
    dates.date(2024, 6, 21),
    dates.time(7, 30),
    dates.datetime(2024, 6, 21, 7, 30),
    dates.datetime(2024, 6, 21, 7, 30, tzinfo=dates.UTC),
    [],
    [1, 2, 3, 4, 5],
    ["a", dates.date(2024, 6, 21)],
    {},
    {"a": 1, "b": dates.date(2024, 6, 21)},
    {"kind": "nothing"},
    {"kind": dates.date(2024, 6, 21)},
    True,
    False,
    "",
    "two words",
    math.nan,
    math.inf,
    -math.inf,
    10**400,
    -(10**30),
    1e300,
    -1.5,
    0,
    0.5,
)

LENS = """
schema_version = 1
name = "Singlet"
source = "here"
notes = ""
f_number = 5.0
field_deg = 20.0
stated_focal_length = 49.0
sensor_distance = 50.0
focus_distance = 2000.0
squeeze = 1.0
[[rows]]
radius = 50.0
thickness = 5.0
glass = "N-BK7"
n_d = 1.5168
v_d = 64.17
semi_diameter = 10.0
semi_diameter_estimated = true
conic = 0.0
coating = "quarter-wave:550"
[[rows]]
radius = -50.0
thickness = 2.0
semi_diameter = 10.0
radius_x = -51.0
conic_x = 0.0
decentre = [0.0, 0.1]
tilt_deg = [0.0, 0.1]
figure = { zernike_nm = { 5 = 30.0 } }
[[rows]]
stop = true
thickness = 10.0
[[rows]]
curvature = 0.0
thickness = 5.0
n_d = 1.5
asphere = [1e-9]
coating = { kind = "film", index = 1.4, thickness_nm = 100.0 }
[[rows]]
curvature = -0.02
curvature_x = -0.02
thickness = 5.0
[iris]
blades = 6
rotation_deg = 10.0
rounding = 0.1
roughness_um = 1.0
roughness_length_um = 200.0
roughness_seed = 1
[scatter]
model = "abg"
roughness_nm = 1.0
abg = [2e-5, 1e-3, 2.0]
[[scatter.rows]]
row = 1
share = 0.01
[[elements]]
rows = [0, 1]
decentre = [0.0, 0.0]
tilt_deg = [0.0, 0.0]
[[positions]]
name = "wide"
gaps = { 1 = 2.0 }
focal_length = 49.0
f_number = 5.0
field_deg = 20.0
[coating_presets]
p = ["none", "none", "-", "quarter-wave:550", "none"]
"""

PROJECT = """
schema_version = 1
lens = "heliar-tronnier"
f_number = 8.0
coating = { kind = "everywhere", coating = { kind = "stack", layers = [{ index = 1.38, thickness_nm = 96.0 }] } }
zoom = 50.0
filter = { thickness = 2.0, gap = 5.0, glass = "N-BK7", n_d = 1.5, v_d = 60.0, coating = "none" }
[iris]
blades = 6
rounding = 0.1
mask = "iris.png"
[[lights]]
name = "a"
field_deg = [10, 5]
distance = 900.0
intensity = 1.0
spectrum = { kind = "table", wavelength_nm = [400.0, 700.0], power = [1.0, 1.0] }
shape = { kind = "rectangle", size_deg = [4.0, 3.0], rotation_deg = 15.0 }
keyframes = [{ at_s = 0.0, field_deg = [1.0, 1.0] }]
holdout = { image = "a.png", invert = true, overscan = 1.2, frame = [0.9, 0.8] }
[[lights]]
field_deg = [1, 5]
diameter_deg = 0.53
spectrum = { kind = "lines", lines = [[589.0, 1.0]] }
[[lights]]
field_deg = [1, 5]
shape = { kind = "polygon", corners_deg = [[0, 0], [1, 0], [1, 1]] }
spectrum = { kind = "rgb", rgb = [1.0, 0.5, 0.1] }
[camera]
size_px = [640, 360]
sensor_mm = [36.0, 24.0]
sensor_distance = 80.0
focus_distance = 2000.0
cover_glass = "N-BK7:2:0.5"
sensor_reflectance = 0.1
sensor_grating = { period_um = 8.0, fill = 0.7, orders = 3 }
squeeze = 2.0
desqueeze = true
[quality]
mode = "final"
wavelengths = 7
bridge = true
paths = "all"
tolerance_px = 0.2
ringing = "off"
cull = 0.0
orders = 2
order4_limit = 1e-4
source_step_deg = 2.0
screen = false
seed = 1
reference_error = 0.02
reference_error_of = "total"
reference_from = "auto"
reference_samples = 1000
[output]
layers = "passes"
brightest = 3
colorspace = "rec709"
pixel_type = "half"
starburst = true
[dirt]
dust_per_mm2 = 0.5
dust_um = [5.0, 100.0]
scratches_per_cm2 = 1.0
fingerprint = 0.2
image = "dirt.png"
seed = 1
in_ghosts = true
[starburst]
cats_eye = true
size = 1.0
intensity = 1.0
spiral_deg = 1.0
[imperfection]
seed = 1
decentre_um = 10.0
[scatter]
model = "abg"
abg = [2e-5, 1e-3, 2.0]
[[scatter.rows]]
row = 0
roughness_nm = 5.0
[holdout]
depth = "depth.exr"
depth_unit_mm = 1000.0
[art]
physical = false
gain = { ghosts = 2.0 }
[[art.rules]]
select = "7-3"
enable = true
gain = 0.5
tint = [1.0, 1.0, 1.0]
ramp = [[0.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]]
offset_px = [1.0, 1.0]
scale = 1.0
blur_mm = 1.0
[design]
own_ghosts = true
surfaces = 6
structure = "lens"
fixed_rows = [0]
signed = true
weights = "relative"
brightness = "none"
extra = 5.0
glasses = ["SCHOTT"]
judge = "ghosts"
[[design.ghost_targets]]
ghost = "7-3"
light = 0
action = "want"
place_mm = 3.0
radius_mm = 2.0
color = [1.0, 1.0, 1.0]
[design.bounds]
air = [0.1, 100.0]
n_d = [1.5, 2.0]
focal_length = [5.0, 2000.0]
length = 100.0
hard = ["edges"]
"""

TEN = {"f": [0.0] * 10, "g": [0.0] * 10, "intensity": [1.0] * 10, "discs": [{"centre": [0.0, 0.0], "radius": 1.0}]}

JSON_FILES: dict[str, tuple[Callable[[Path], object], dict[str, Any]]] = {
    "model": (
        read_ghost_model,
        {
            "schema_version": 1,
            "size_px": [64, 36],
            "axis_px": [32.0, 18.0],
            "focal_px": 50.0,
            "largest_deg": 40.0,
            "constellation_deg": [0.0, 30.0],
            "ghosts": [
                {
                    "kind": "aberration",
                    "name": "a",
                    "red": TEN,
                    "green": TEN,
                    "blue": TEN,
                    "blades": {"count": 6, "first_deg": 0.0},
                    "visible_deg": [0.0, 30.0],
                    "curves": {"size": {"values": [1.0], "error": [0.1]}},
                },
                {"kind": "bezier", "name": "b", "numbers": [[1.0]] * 19, "visible_deg": [0.0, 30.0]},
            ],
            "halo": {"radius_px": [1.0, 2.0], "radiance": [[1.0, 1.0, 1.0]] * 2, "strength": [[0.0, 1.0]]},
            "star": {
                "spikes": 6,
                "first_deg": 0.0,
                "width_px": 2.0,
                "radius_px": [1.0, 2.0],
                "radiance": [[1.0, 1.0, 1.0]] * 2,
            },
            "reference": {"f_number": 8.0, "iso": 100.0},
            "background": [0.0, 0.0, 0.0],
            "to_rec709": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            "remarks": ["measured"],
        },
    ),
    "tracks": (
        read_ghost_tracks,
        {
            "schema_version": 1,
            "ghosts": [
                {"name": "a", "lives": [], "steps": [{"constellation_deg": 1.0, "state": "seen", "inside": 1.0}]}
            ],
        },
    ),
    "camera of a replay": (
        read_replay_camera,
        {"schema_version": 1, "position": [0.0, 0.0, 0.0], "light": [0.0, 0.0, -1.0], "size_px": [64, 36], "iso": 100},
    ),
    "corrections": (
        read_corrections,
        {
            "schema_version": 1,
            "add": [{"constellation_deg": 1.0, "centre_px": [1.0, 2.0], "radius_px": 3.0}],
            "remove": ["a"],
        },
    ),
    "camera": (read_camera, {"schema_version": 1, "black_level": 0.0, "electrons_per_unit": 1.0, "iso": 100.0}),
    "merged": (
        lambda path: read_run(path.parent),
        {
            "schema_version": 1,
            "size_px": [64, 36],
            "frames": [
                {
                    "file": "a.exr",
                    "constellation_deg": 0.0,
                    "nominal_deg": 0.0,
                    "light_px": [1.0, 2.0],
                    "axis_px": [1.0, 2.0],
                    "light_found": True,
                }
            ],
            "axis_px": [32.0, 18.0],
            "px_per_rad": 50.0,
            "camera": {"iso": 100.0},
        },
    ),
}


def _places(data: Any, where: tuple[Any, ...] = (), *, every: bool = False) -> Iterator[tuple[Any, ...]]:
    """Yield the places of a file that hold a value; of equal values next to each other, the first.

    In a list all numbers are the same in this respect, and so are all lists of numbers; in a table equal tables are.
    """
    seen: list[Any] = []
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        sort = _sort(value) if isinstance(data, list) else value
        known = not every and isinstance(sort, dict | list | str) and sort in seen
        if known and isinstance(data, list):
            continue
        yield (*where, key)
        if isinstance(value, dict | list) and not known:
            yield from _places(value, (*where, key), every=every)
        seen.append(sort)


def _sort(value: Any) -> Any:
    """Return a value with all its numbers replaced by one name."""
    if isinstance(value, list):
        sorts = [_sort(one) for one in value]
        return [one for k, one in enumerate(sorts) if one not in sorts[:k]]
    return "number" if isinstance(value, int | float) and not isinstance(value, bool) else value


def _with(data: Any, where: tuple[Any, ...], value: Any) -> Any:
    """Return the data with a value at a place; other parts stay the same objects."""
    if not where:
        return value
    changed = data.copy()
    changed[where[0]] = _with(data[where[0]], where[1:], value)
    return changed


def _sentences(read: Callable[[Any], object], data: Any) -> list[str]:
    try:
        read(data)
    except FlarewrightError as error:
        return [str(error), *error.problems]
    return []


def _trials(data: Any, every: bool) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Yield places of a file and values to insert: all, or in a long file every third or fourth, in turn."""
    places = list(_places(data, every=every))
    parts = 1 if every or len(places) < 10 else 3 if len(places) < 60 else 4
    for k, place in enumerate(places):
        for value in BAD[k % parts :: parts]:
            yield place, value


def _reported(
    read: Callable[[Any], object], data: Any, *, every: bool = False
) -> Iterator[tuple[tuple[Any, ...], Any, str]]:
    """Insert bad values into the places of a file, and in its place, and yield the messages."""
    for place, value in [*(((), value) for value in BAD), *_trials(data, every)]:
        for sentence in _sentences(read, _with(data, place, value) if place else value):
            yield place, value, sentence


def _python_words(reported: Iterator[tuple[tuple[Any, ...], Any, str]]) -> list[tuple[Any, ...]]:
    found = list(reported)
    assert len(found) > 100
    return [(*place, value, sentence) for place, value, sentence in found if PYTHON.search(sentence)]


EVERY = pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)])


@EVERY
@pytest.mark.parametrize("kind", ["lens", "project", "scene"])
def test_no_field_of_a_toml_file_is_refused_in_words_of_python(kind, every, tmp_path):
    text, read = {
        "lens": (LENS, lambda data: lens_from_table(data, "the file", folder=tmp_path)),
        "project": (PROJECT, lambda data: project_from_data(data, folder=tmp_path, where="the file")),
        "scene": (example_file("scene"), lambda data: scene_from_data(data, folder=tmp_path, where="the file")),
    }[kind]
    data = tomllib.loads(text)
    read(data)
    reported = (
        (place, value, sentence)
        for place, value in _trials(data, every)
        for sentence in _sentences(read, _with(data, place, value))
    )
    assert _python_words(reported) == []
    # readers must not modify their input
    assert data == tomllib.loads(text)


@EVERY
@pytest.mark.parametrize("kind", JSON_FILES)
def test_no_field_of_a_json_file_is_refused_in_words_of_python(kind, every, tmp_path):
    reader, data = JSON_FILES[kind]
    path = tmp_path / "merged.json"

    def read(changed: Any) -> object:
        path.write_text(json.dumps(changed, default=str), "utf-8")
        return reader(path)

    read(data)
    assert _python_words(_reported(read, data, every=every)) == []


def test_no_cell_of_a_list_of_captures_is_refused_in_words_of_python(tmp_path):
    good = {
        "file": "a.png", "constellation_deg": "0", "exposure_s": "1", "iso": "100", "f_number": "5.6",
        "roll_deg": "0", "focal_mm": "50", "light_x_px": "1", "light_y_px": "1", "kind": "light",
    }  # fmt: skip
    (tmp_path / "a.png").write_bytes(b"png")
    path = tmp_path / "captures.csv"

    def read(row: dict[str, str]) -> object:
        path.write_text(f"{','.join(row)}\n{','.join(row.values())}\n", "utf-8")
        return read_captures(path)

    read(good)
    cells = [
        "2024-06-21",
        "true",
        "",
        "two words",
        "nan",
        "inf",
        "-inf",
        "1e400",
        "1" + "0" * 200,
        "-1e30",
        "-1",
        "0",
        "0.5",
    ]
    reported = [
        sentence for key in good for cell in cells if cell for sentence in _sentences(read, {**good, key: cell})
    ]
    assert len(reported) > 40
    assert [sentence for sentence in reported if PYTHON.search(sentence)] == []


@pytest.mark.parametrize("line", ["coating = {}", "rows = [{}]"])
def test_no_coating_of_a_file_is_refused_in_words_of_python(line, tmp_path):
    path = tmp_path / "coating.toml"
    values = [
        "2024-06-21", "07:30:00", "true", '"two words"', "nan", "0", "-1.5", "[]", "{ }", '{ kind = "x" }',
        '{ kind = "film" }', '{ kind = "film", index = 2024-06-21, thickness_nm = [] }',
        '{ kind = "stack", layers = 2024-06-21 }', '{ kind = "quarter-wave", center_wavelength_nm = "a", index = {} }',
    ]  # fmt: skip
    for value in values:
        path.write_text(line.replace("{}", value, 1), "utf-8")
        with pytest.raises(FlarewrightError) as error:
            read_coating_file(path)
        assert not PYTHON.search(str(error.value))
