"""Our lens file: round trips, and a sentence with the row for every error."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flarewright.errors import LensError, OutputError, ProjectError
from flarewright.io.files.atomic_write import write_atomically
from flarewright.io.lens import library
from flarewright.io.lens.coating_text import format_coating, parse_coating, read_coating_file
from flarewright.io.lens.lens_schema import lens_json_schema
from flarewright.io.lens.lens_writer import format_lens, write_lens
from flarewright.io.lens.media import attach, complete_medium
from flarewright.io.lens.toml_lens import read_lens
from flarewright.model import (
    Bare,
    Element,
    Everywhere,
    Figure,
    Film,
    InTurn,
    Iris,
    Lens,
    Medium,
    PerRow,
    Position,
    QuarterWave,
    RowScatter,
    Scatter,
    Stack,
    Standard,
    Stop,
    Surface,
)

GOOD = """\
schema_version = 1
name = "Triplet"
f_number = 2.7
rows = [
  { radius = 40.94, thickness = 8.74, glass = "SK16", n_d = 1.62041, v_d = 60.3, coating = "quarter-wave:550" },
  { radius = "flat", thickness = 11.05 },
  { radius = -55.65, thickness = 2.78, n_d = 1.649, v_d = 33.8, semi_diameter = 12.5 },
  { radius = 39.75, thickness = 2.5 },
  { stop = true, thickness = 5.13 },
  { radius = 107.56, thickness = 9.54, glass = "SK16" },
  { radius = -43.33, thickness = 79.34 },
]
"""

SCHEMA = jsonschema.Draft202012Validator(lens_json_schema())


def written(folder: Path, text: str, name: str = "lens.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_good_file_is_read(tmp_path):
    lens, remarks = read_lens(written(tmp_path, GOOD))
    assert lens.stop_row == 4
    assert lens.rows[0].curvature == 1 / 40.94
    assert lens.rows[0].medium.n_d == 1.62041
    assert lens.rows[0].medium.dispersion.glass == "HIKARI SK16"
    assert lens.rows[0].coating == QuarterWave(center_wavelength_nm=550)
    assert lens.rows[1].medium is None
    assert lens.rows[5].medium.v_d == pytest.approx(60.28, abs=0.01)
    assert len(remarks) == 1
    assert remarks[0].startswith("dispersion of the nearest catalogue glass: row 2 ")


# user errors: (text to replace, replacement, words expected in the message)
MISTAKES = [
    ("schema_version = 1\n", "", "schema_version is missing"),
    ("schema_version = 1", "schema_version = 2", "schema_version is 2"),
    ("schema_version = 1", 'schema_version = "1"', "schema_version is '1'"),
    ('name = "Triplet"\n', "", "name is missing"),
    ("f_number = 2.7\n", "", "f_number is missing"),
    ("f_number = 2.7", "f_number = -2.7", "f_number is -2.7: it must be above 0.3"),
    ("f_number = 2.7", "f_numbr = 2.7", "'f_numbr' is not a known key; did you mean 'f_number'?"),
    ("f_number = 2.7", "f_number = 2.7\nfield_deg = 90.0", "field_deg is 90: it must be below 90 in degrees"),
    ("f_number = 2.7", 'f_number = 2.7\niris = "round"', "iris is 'round', a table was expected"),
    ("f_number = 2.7", "f_number = 2.7\niris = { blades = 2 }", "an iris has 0 blades (round) or at least 3"),
    (
        "f_number = 2.7",
        "f_number = 2.7\niris = { blade = 5 }",
        "iris: 'blade' is not a known key; did you mean 'blades'?",
    ),
    ('radius = "flat"', "radius = 0", 'row 1: radius is 0: for a plane surface write radius = "flat"'),
    ('radius = "flat"', "radius = inf", 'row 1: radius is inf: for a plane surface write radius = "flat"'),
    ('radius = "flat"', "radius = nan", "row 1: radius is nan, a number in mm was expected"),
    ('radius = "flat"', 'radius = "plan"', "row 1: radius is 'plan', a number in mm or \"flat\" was expected"),
    ('radius = "flat"', "radius = true", "row 1: radius is true, a number"),
    ('radius = "flat"', "radius = 1" + "0" * 400, "row 1: radius is 1000"),
    ('radius = "flat", ', "", "row 1: radius is missing"),
    ('radius = "flat"', 'radius = "flat", curvature = 0.1', "row 1: radius and curvature are both given"),
    ("thickness = 11.05", 'thickness = "11 mm"', "row 1: thickness is '11 mm', a number in mm was expected"),
    ("thickness = 11.05", "thicknes = 11.05", "row 1: 'thicknes' is not a known key; did you mean 'thickness'?"),
    ("thickness = 2.78", "thickness = -2.78", "row 2: thickness is -2.78: glass cannot be thinner than 0 mm"),
    ("semi_diameter = 12.5", "semi_diameter = -12.5", "row 2: semi_diameter is -12.5: it must be above 0 in mm"),
    (
        "semi_diameter = 12.5",
        "semi_diameter = 55.7",
        "row 2: a semi_diameter of 55.7 mm does not fit the surface, which turns back 55.65 mm from the axis",
    ),
    (
        "semi_diameter = 12.5",
        "semi_diameter = 12.5, asphere = [0.01]",
        "row 2: the asphere's terms raise its rim by 244 mm, more than its semi_diameter of 12.5 mm",
    ),
    ("n_d = 1.649", "n_d = 0.9", "row 2: n_d is 0.9: it must be above 1"),
    ("n_d = 1.649, ", "", "row 2: v_d alone is no glass"),
    ("v_d = 33.8", "v_d = 0", "row 2: v_d is 0: it must be above 5"),
    (
        'glass = "SK16" }',
        'glass = "SK166" }',
        "row 5: glass 'SK166' is not in the catalogue: give n_d and v_d instead; near",
    ),
    ('glass = "SK16" }', "glass = 16 }", "row 5: glass is 16, a catalogue name"),
    ('"quarter-wave:550"', '"quarterwave:550"', "row 0: coating 'quarterwave:550' is not understood: write none"),
    (
        '"quarter-wave:550"',
        '"quarter-wave:5"',
        "row 0: coating 'quarter-wave:5': center_wavelength_nm should be",
    ),
    ('"quarter-wave:550"', "550", "row 0: coating 550 is neither a text nor a table"),
    ("  { stop = true, thickness = 5.13 },\n", "", "no row is the stop: add { stop = true"),
    ('radius = "flat"', "stop = true", "rows 1, 4 are all stops"),
    ("stop = true, ", 'stop = "yes", ', "row 4: stop is 'yes', true or false was expected"),
    (
        "stop = true, ",
        "stop = true, semi_diameter = 8, ",
        "row 4: the stop has no semi_diameter, its opening follows from",
    ),
    ("thickness = 79.34 }", 'thickness = 79.34, glass = "SF6" }', "row 6: behind the last row must be air"),
    ("{ stop = true, thickness = 5.13 }", "5", "row 4: is 5, a table"),
    ("rows = [", "rows = 3\nlines = [", "rows is 3, a list of tables was expected"),
    ("]\n", ']\n[coating_presets]\nmine = ["none"]\n', "coating preset 'mine' has 1 entry, the lens 7 rows"),
    (
        'radius = "flat"',
        'radius = "flat", radius_x = 0',
        'row 1: radius_x is 0: for a plane surface write radius_x = "flat"',
    ),
    ('radius = "flat"', 'radius = "flat", radius_x = 5, curvature_x = 0.2', "row 1: radius_x and curvature_x are both"),
    ('radius = "flat"', 'radius = "flat", conic_x = "one"', "row 1: conic_x is 'one', a number"),
    ('radius = "flat"', 'radius = "flat", asphere = 1e-6', "row 1: asphere is 1e-06, a list of numbers"),
    ('radius = "flat"', 'radius = "flat", asphere = []', "row 1: asphere has 0 terms: give 1 to 9"),
    ('radius = "flat"', 'radius = "flat", odd_asphere = []', "row 1: odd_asphere has 0 terms: give 1 to 9"),
    ('radius = "flat"', 'radius = "flat", asphere = [1e-6, "x"]', "row 1: asphere[1] is 'x', a number"),
    ('radius = "flat"', 'radius = "flat", decentre = [0.1]', "row 1: decentre has 1 numbers: give two"),
    ('radius = "flat"', 'radius = "flat", decentre = [0.1, 500]', "row 1: decentre[1] is 500: it must be at most 100"),
    ('radius = "flat"', 'radius = "flat", tilt_deg = [0, 90]', "row 1: tilt_deg[1] is 90: it must be at most 45"),
    ('radius = "flat"', 'radius = "flat", tilt = [0, 1]', "row 1: 'tilt' is not a known key; did you mean 'tilt_deg'?"),
    ('radius = "flat"', 'radius = "flat", figure = 30', "row 1: figure is 30: a table like"),
    ('radius = "flat"', 'radius = "flat", figure = {}', "row 1: figure is empty"),
    (
        'radius = "flat"',
        'radius = "flat", figure = { zernike = { 5 = 1 } }',
        "row 1: figure: 'zernike' is not a known key",
    ),
    (
        'radius = "flat"',
        'radius = "flat", figure = { zernike_nm = { 1 = 1 } }',
        "row 1: figure.zernike_nm: '1' is no term",
    ),
    (
        'radius = "flat"',
        'radius = "flat", figure = { zernike_nm = { x = 1 } }',
        "row 1: figure.zernike_nm: 'x' is no term",
    ),
    (
        'radius = "flat"',
        'radius = "flat", figure = { zernike_waves = { 5 = 900 } }',
        "term 5 is 900: a figure error is at",
    ),
    (
        'radius = "flat"',
        'radius = "flat", figure = { image = "a.png" }',
        "row 1: figure: an image needs peak_valley_nm",
    ),
    ("stop = true, ", "stop = true, decentre = [0, 1], ", "row 4: the stop has no decentre, it refracts nothing"),
    ("rows = [", "elements = 3\nrows = [", "elements is 3: write [[elements]]"),
    ("]\n", "]\n[[elements]]\ndecentre = [0, 1]\n", "element 0: rows is missing: give its first and last row"),
    (
        "]\n",
        "]\n[[elements]]\nrows = [0, 9]\n",
        "element 0 (rows 0 to 9): give its first and last row, between 0 and 6",
    ),
    ("]\n", "]\n[[elements]]\nrows = [3, 5]\n", "element 0 (rows 3 to 5) holds the stop, row 4"),
    ("]\n", "]\n[[elements]]\nrows = [0, 1]\n[[elements]]\nrows = [1, 2]\n", "shares row 1 with element 0"),
    ("]\n", "]\n[[elements]]\nrows = [0, 1]\nmoved = 1\n", "element 0: 'moved' is not a known key"),
    ("rows = [", "rows = [[", "is not valid TOML"),
    ("f_number = 2.7", "f_number = = 2.7", "is not valid TOML: invalid value (at line 3, column 12)"),
]


@pytest.mark.parametrize(("old", "new", "words"), MISTAKES, ids=[words[:50] for *_, words in MISTAKES])
def test_each_mistake_is_told_in_a_sentence(tmp_path, old, new, words):
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(LensError) as caught:
        read_lens(path)
    assert any(words in reported for reported in (str(caught.value), *caught.value.problems)), str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.problems


def test_all_mistakes_are_reported_each_with_its_row(tmp_path):
    bad = GOOD.replace('radius = "flat"', "radius = 0").replace("n_d = 1.649", "n_d = nan").replace("5.13", '"x"')
    with pytest.raises(LensError) as caught:
        read_lens(written(tmp_path, bad))
    assert [problem.split(":")[0] for problem in caught.value.problems] == ["row 1", "row 2", "row 4"]
    assert "has 3 problems" in str(caught.value)


def test_files_that_are_no_text_are_told(tmp_path):
    cases = {
        "missing.toml": "does not exist",
        "folder.toml": "is a folder",
        "empty.toml": "is empty",
        "latin.toml": "is not UTF-8 text (line 2)",
        "huge.toml": "too large for a lens file",
        "nested.toml": "nested too deeply",
        "lens.txt": "is of an unknown kind",
    }
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "empty.toml").write_text(" \n")
    (tmp_path / "latin.toml").write_bytes(b'schema_version = 1\nname = "Ang\xe9nieux"\n')
    (tmp_path / "huge.toml").write_bytes(b"#" * 4_000_001)
    (tmp_path / "nested.toml").write_text("a = " + "[" * 100_000)
    (tmp_path / "lens.txt").write_text(GOOD)
    for name, words in cases.items():
        with pytest.raises(LensError) as caught:
            read_lens(tmp_path / name)
        assert words in str(caught.value), str(caught.value)


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_an_unreadable_file_is_told(tmp_path):
    path = written(tmp_path, GOOD)
    path.chmod(0)
    with pytest.raises(LensError, match="cannot be read"):
        read_lens(path)


def test_too_many_rows_are_told(tmp_path):
    rows = "".join(f'  {{ radius = {k + 5}, thickness = 1, glass = "SF6" }},\n' for k in range(501))
    with pytest.raises(LensError, match="rows has 508 entries"):
        read_lens(written(tmp_path, GOOD.replace("rows = [\n", "rows = [\n" + rows)))


# dispersion of media


def test_known_glass_fills_in_the_numbers():
    medium, finding = attach("N-BK7", None, None)
    assert (medium.n_d, medium.v_d) == (pytest.approx(1.5168), pytest.approx(64.17, abs=0.01))
    assert finding.kind == "named"


def test_numbers_take_the_nearest_glass_and_say_which():
    medium, finding = attach(None, 1.5168, 64.2)
    assert finding.kind == "nearest"
    assert medium.dispersion.glass == finding.text
    assert medium.glass is None


def test_numbers_far_from_any_glass_take_cauchy_and_say_so():
    medium, finding = attach(None, 1.617, 38.5)
    assert medium.dispersion.formula == "cauchy"
    assert "Cauchy" in finding.text


def test_index_alone_is_a_guess_and_said_so():
    medium, finding = attach(None, 1.62, None)
    assert medium.v_d is None
    assert medium.dispersion is not None
    assert "no V_d is given" in finding.text


def test_stated_numbers_win_over_the_name():
    medium, finding = attach("N-BK7", 1.620, 60.3)
    assert (medium.n_d, medium.v_d) == (1.620, 60.3)
    assert "the stated numbers take precedence" in finding.text
    assert medium.dispersion.glass != "SCHOTT N-BK7"


def test_unknown_name_with_numbers_is_used_and_told():
    medium, finding = attach("LLF7", 1.549, 45.4)
    assert medium.dispersion.glass == "OHARA PBL7"
    assert "'LLF7' is not in the catalogue" in finding.text


def test_successor_is_told():
    assert attach("LAKN7", 1.652, 58.5)[1].text == "LAKN7 is replaced by its successor SCHOTT N-LAK7"


def test_complete_attaches_what_is_missing():
    bare = Lens(
        name="x", f_number=4, rows=(Surface(curvature=0.02, medium=Medium(n_d=1.5168, v_d=64.2)), Surface(), Stop())
    )
    lens, remarks = complete_medium(bare)
    assert lens.rows[0].medium.dispersion is not None
    assert len(remarks) == 1
    assert complete_medium(lens) == (lens, ())


# text forms of coatings

COATINGS = {
    "none": Bare(),
    "quarter-wave:550": QuarterWave(center_wavelength_nm=550),
    "quarter-wave:550:ideal": QuarterWave(center_wavelength_nm=550, index="ideal"),
    "quarter-wave:550:1.38": QuarterWave(center_wavelength_nm=550, index=1.38),
    "quarter-wave:550+10": QuarterWave(center_wavelength_nm=550, thickness_offset_nm=10),
    "quarter-wave:550:ideal-10.5": QuarterWave(center_wavelength_nm=550, index="ideal", thickness_offset_nm=-10.5),
    "film:1.38:96.4": Film(index=1.38, thickness_nm=96.4),
    "modern-broadband": Standard(name="modern-broadband"),
    "early-multicoat*0.94": Standard(name="early-multicoat", thickness=0.94),
    "stack:1.38:96.4,2.1:120": Stack(layers=(Film(index=1.38, thickness_nm=96.4), Film(index=2.1, thickness_nm=120))),
}


@pytest.mark.parametrize(("text", "coating"), COATINGS.items(), ids=list(COATINGS))
def test_coating_text_both_ways(text, coating):
    assert parse_coating(text) == coating
    assert format_coating(coating) == text


def test_coating_text_is_tolerant():
    assert parse_coating(" Quarter-Wave:550+10:ideal ") == QuarterWave(
        center_wavelength_nm=550, index="ideal", thickness_offset_nm=10
    )


@pytest.mark.parametrize(
    "text",
    [
        "",
        "coated",
        "quarter-wave",
        "quarter-wave:",
        "quarter-wave:550:best",
        "quarter-wave:550+1+2",
        "quarter-wave:5e9",
        "quarter-wave:550+1:ideal+2",
        "film:1.38",
        "film:0.5:100",
        "film:nan:100",
        "film:1.38:inf",
        "stack:",
        "stack:1.4:90,",
        "early-multicoat*",
        "early-multicoat*3",
        "early-multicoat*-1",
    ],
)
def test_coating_nonsense_is_told(text):
    with pytest.raises(ProjectError, match="coating"):
        parse_coating(text)


def test_coating_files(tmp_path):
    one = written(tmp_path, 'coating = "quarter-wave:550"\n', "one.toml")
    assert read_coating_file(one) == Everywhere(coating=QuarterWave(center_wavelength_nm=550))
    rows = written(tmp_path, 'rows = ["none", "-", { kind = "film", index = 1.4, thickness_nm = 90 }]\n', "rows.toml")
    assert read_coating_file(rows) == PerRow(coatings=(Bare(), None, Film(index=1.4, thickness_nm=90)))
    turn = written(tmp_path, 'in_turn = ["quarter-wave:450", "none"]\n', "turn.toml")
    assert read_coating_file(turn) == InTurn(coatings=(QuarterWave(center_wavelength_nm=450), Bare()))
    for text, words in [
        ("in_turn = []", "in_turn = .* from the front"),
        ('in_turn = ["none", "x"]', "coating 1: coating 'x' is not understood"),
        ('rows = ["x", "none", "y"]', "row 0: coating 'x' is not understood.*row 2: coating 'y'"),
        ("colour = 1", "is no coating file"),
        ("coating = ", "is not valid TOML"),
        ('rows = [{ kind = "film", index = 9, thickness_nm = 90 }]', "row 0: coating table: index should be"),
    ]:
        with pytest.raises(ProjectError, match=words):
            read_coating_file(written(tmp_path, text, "bad.toml"))
    with pytest.raises(ProjectError, match="does not exist"):
        read_coating_file(tmp_path / "none.toml")


# round trips

finite = {"allow_nan": False, "allow_infinity": False}
films = st.builds(Film, index=st.floats(1.0, 4.0), thickness_nm=st.floats(0.0, 2000.0))
coatings = st.one_of(
    st.just(Bare()),
    st.builds(
        QuarterWave,
        center_wavelength_nm=st.floats(100.0, 3000.0),
        index=st.one_of(st.sampled_from(["real", "ideal"]), st.floats(1.0, 4.0)),
        thickness_offset_nm=st.floats(-1000.0, 5000.0),
    ),
    films,
    st.builds(Stack, layers=st.lists(films, min_size=1, max_size=4).map(tuple)),
)


def _medium(choice):
    return None if choice is None else attach(*choice)[0]


media = st.one_of(
    st.none(),
    st.tuples(st.sampled_from(["N-BK7", "SF6", "LAKN7", "OHARA S-TIH6"]), st.none(), st.none()),
    st.tuples(st.sampled_from([None, "N-BK7", 'odd "name"\\']), st.floats(1.3, 2.2), st.none() | st.floats(15.0, 95.0)),
).map(_medium)
curvatures = st.just(0.0) | st.floats(-100.0, 100.0) | st.floats(1.0, 1e4).map(lambda r: 1.0 / r)
pairs = st.none() | st.tuples(st.floats(-45.0, 45.0), st.floats(-45.0, 45.0)).filter(any)
figures = st.one_of(
    st.none(),
    st.dictionaries(st.integers(2, 28), st.floats(-1e5, 1e5), min_size=1, max_size=3).map(
        lambda terms: Figure(zernike_nm=tuple(terms.items()))
    ),
    st.builds(Figure, image=st.just("/pictures/zero.png"), peak_valley_nm=st.floats(-1e5, 1e5)),
)
air_surfaces = st.builds(
    Surface,
    curvature_x=st.none() | curvatures,
    conic_x=st.none() | st.floats(-10.0, 10.0),
    asphere=st.lists(st.floats(-1.0, 1.0), max_size=9).map(tuple),
    odd_asphere=st.lists(st.floats(-1.0, 1.0), max_size=9).map(tuple),
    decentre=pairs,
    tilt_deg=pairs,
    figure=figures,
    curvature=curvatures,
    conic=st.just(0.0) | st.floats(-10.0, 10.0),
    thickness=st.floats(0.0, 10000.0),
    semi_diameter=st.none() | st.floats(1e-3, 2000.0),
    semi_diameter_estimated=st.booleans(),
    coating=st.none() | coatings,
).map(lambda row: row.replace(semi_diameter=min(row.semi_diameter, row.equator)) if row.semi_diameter else row)
air_surfaces = air_surfaces.map(
    lambda row: row.replace(asphere=(), odd_asphere=()) if row.lifted > (row.semi_diameter or 0.0) else row
)
surfaces = st.builds(lambda surface, medium: surface.replace(medium=medium), air_surfaces, media)
texts = st.text(st.characters(codec="utf-8"), max_size=30)


@st.composite
def lenses(draw):
    first = draw(air_surfaces).replace(medium=attach("N-BK7", None, None)[0])
    rows = [first, *draw(st.lists(surfaces, max_size=4)), draw(air_surfaces)]
    rows.insert(draw(st.integers(0, len(rows))), Stop(thickness=draw(st.floats(-100.0, 100.0))))
    if isinstance(rows[-1], Stop):
        rows[-2] = rows[-2].replace(medium=None)
    stop = next(k for k, row in enumerate(rows) if isinstance(row, Stop))
    preset = st.lists(st.none() | coatings, min_size=len(rows), max_size=len(rows)).map(tuple)
    positive = st.none() | st.floats(1e-3, 1e6)
    return Lens(
        name=draw(texts.filter(str.strip)),
        source=draw(texts),
        notes=draw(texts),
        f_number=draw(st.floats(0.5, 256.0)),
        field_deg=draw(st.none() | st.floats(0.1, 89.0)),
        stated_focal_length=draw(positive),
        sensor_distance=draw(positive),
        focus_distance=draw(positive),
        iris=draw(
            st.builds(
                Iris,
                blades=st.sampled_from([0, 5, 9]),
                rotation_deg=st.floats(-360, 360),
                mask=st.none() | st.just("/pictures/iris.png"),
            )
        ),
        rows=tuple(rows),
        elements=()
        if isinstance(rows[0], Stop)
        else draw(
            st.lists(st.builds(Element, rows=st.just((0, 0)), decentre=pairs.filter(bool)), max_size=1).map(tuple)
        ),
        positions=draw(
            st.lists(
                st.builds(
                    Position,
                    name=texts.filter(str.strip),
                    gaps=st.floats(0.0, 90.0).map(lambda gap: ((stop, gap),)),
                    focal_length=positive,
                    focus_distance=positive,
                    field_deg=st.none() | st.floats(0.1, 89.0),
                ),
                max_size=1,
            ).map(tuple)
        )
        if not isinstance(rows[-1], Stop)
        else (),
        scatter=draw(
            st.none()
            | st.builds(
                Scatter,
                model=st.sampled_from(["none", "chaumond", "harvey-shack", "abg"]),
                roughness_nm=st.floats(0.0, 50.0),
                cleanliness_level=st.none() | st.floats(10.0, 2000.0),
                rows=st.just(()) | st.just((RowScatter(row=1, abg=(1e-4, 1e-3, 2.0), share=0.01),)),
            )
        ),
        squeeze=draw(st.none() | st.floats(0.25, 4.0)),
        coating_presets=draw(st.dictionaries(texts, preset, max_size=2)),
    )


@settings(max_examples=8, deadline=None)
@given(lenses())
def test_what_is_written_is_read_back(tmp_path_factory, lens):
    path = tmp_path_factory.mktemp("lens") / "lens.toml"
    write_lens(lens, path)
    assert read_lens(path).lens == lens
    SCHEMA.validate(tomllib.loads(path.read_text(encoding="utf-8")))


def test_a_radius_comes_back_as_it_was_typed(tmp_path):
    lens = read_lens(written(tmp_path, GOOD)).lens
    text = format_lens(lens)
    for radius in ("40.94", "-55.65", "39.75", "107.56", "-43.33"):
        assert f"{{ radius = {radius}, " in text


# JSON Schema


def test_the_schema_is_one_and_takes_every_shipped_lens():
    jsonschema.Draft202012Validator.check_schema(lens_json_schema())
    SCHEMA.validate(tomllib.loads(GOOD))
    for name in library.library_names():
        SCHEMA.validate(tomllib.loads(library.lens_path(name).read_text(encoding="utf-8")))


# the schema checks structure and limits; the reader checks glass names, TOML syntax and conditions between rows
BEYOND_THE_SCHEMA = (
    "is nan",
    "wave:5'",
    "SK166",
    "'name'",
    "not valid TOML",
    "thinner than",
    "behind the last row",
    "the lens 7 rows",
    "1000",
    "term 5 is 900",
    "between 0 and 6",
    "holds the stop",
    "shares row",
    "does not fit the surface",
    "raise its rim",
)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [case for case in MISTAKES if not any(word in case[2] for word in BEYOND_THE_SCHEMA)],
    ids=lambda value: str(value)[:30],
)
def test_the_schema_refuses_structural_mistakes(old, new, words):
    assert not SCHEMA.is_valid(tomllib.loads(GOOD.replace(old, new, 1)))


# lenses of the library, and atomic writing


def test_every_shipped_lens_reads():
    assert len(library.library_names()) >= 12
    for name in library.library_names():
        lens = read_lens(library.lens_path(name)).lens
        assert lens.source
        assert all(row.medium.dispersion for row in lens.rows if isinstance(row, Surface) and row.medium)


def test_names_are_tolerant_and_unknown_ones_suggest(tmp_path):
    assert library.lens_path("Heliar Tronnier") == library.lens_path("heliar-tronnier")
    with pytest.raises(LensError, match="did you mean heliar-tronnier"):
        library.lens_path("heliar-troner")
    with pytest.raises(LensError, match="does not exist"):
        library.lens_path(tmp_path / "nothing.toml")
    mine = written(tmp_path, GOOD)
    assert library.lens_path(mine) == mine


def test_nothing_half_written_is_left(tmp_path):
    target = written(tmp_path, "old", "out.txt")

    def fails(path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match="no space left on device"):
        write_atomically(target, fails)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]
    with pytest.raises(OutputError, match="does not exist; create it first"):
        write_atomically(tmp_path / "no" / "out.txt", fails)
    with pytest.raises(OutputError, match="it is a folder"):
        write_atomically(tmp_path, fails)
    with pytest.raises(OutputError, match="nothing was written"):
        write_atomically(target, lambda path: None)


def test_a_file_that_comes_up_to_the_last_is_left_as_it_is(tmp_path, monkeypatch):
    target = tmp_path / "out.txt"

    def ours(path: Path) -> None:
        path.write_text("ours")

    def refuse() -> None:
        raise OutputError("seen")

    write_atomically(target, ours, replace=False)
    assert target.read_text() == "ours"
    target.write_text("theirs")
    with pytest.raises(OutputError, match="seen"):
        write_atomically(target, ours, look=refuse)
    with pytest.raises(FileExistsError):
        write_atomically(target, ours, replace=False)
    # the same on a file system without hard links
    monkeypatch.setattr("os.link", lambda *_: (_ for _ in ()).throw(PermissionError(1, "Operation not permitted")))
    with pytest.raises(FileExistsError):
        write_atomically(target, ours, replace=False)
    assert target.read_text() == "theirs"
    write_atomically(tmp_path / "new.txt", ours, replace=False)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["new.txt", "out.txt"]
