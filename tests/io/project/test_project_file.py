"""Project files: round trips, short texts, and all errors at once."""

import json
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest

from flarewright.errors import ProjectError
from flarewright.io.lens.coating_text import parse_coating_choice
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.project.project_file import project_json_schema, read_project
from flarewright.io.project.project_text import project_text
from flarewright.io.project.spectrum_text import parse_spectrum, spectrum_text
from flarewright.model import (
    D65,
    Art,
    AsLens,
    Bare,
    BlackBody,
    Camera,
    Dirt,
    EqualEnergy,
    Everywhere,
    Film,
    Holdout,
    Imperfection,
    InTurn,
    Iris,
    Lens,
    Light,
    Lines,
    Medium,
    Output,
    PerRow,
    Preset,
    Project,
    Quality,
    QuarterWave,
    RowScatter,
    Rule,
    Scatter,
    Stack,
    Standard,
    Starburst,
    Stop,
    Surface,
    Tabulated,
)
from flarewright.render.scene.resolve import load_lens

LENS = Lens(
    name='A "lens"\twith\nodd characters \x7f ä',
    f_number=2.8,
    rows=(
        Surface(curvature=0.02, thickness=5.0, medium=Medium(n_d=1.5, v_d=60.0), coating=Bare()),
        Surface(curvature=-0.02, thickness=3.0, semi_diameter=10.0),
        Stop(thickness=80.0),
    ),
    coating_presets={"a b": (QuarterWave(center_wavelength_nm=500), None, None)},
)

PROJECTS = [
    Project(lens="heliar-tronnier", lights=(Light(field_deg=(-3, 4)),)),
    Project(
        lens="lenses/my.toml",
        f_number=5.6,
        iris=Iris(blades=6, rotation_deg=-12.5, rounding=0.25, mask="masks/star.png"),
        coating=PerRow(coatings=(None, QuarterWave(center_wavelength_nm=550, index="ideal"), Bare())),
        lights=(
            Light(field_deg=(1, 2), spectrum=BlackBody(temperature_k=3200.25)),
            Light(field_deg=(1, 2), spectrum=Lines(lines=((589.0, 0.5), (589.6, 1.0))), intensity=1e-7),
            Light(field_deg=(1, 2), spectrum=Tabulated(wavelength_nm=(400, 500.5), power=(0, 1)), name="sun"),
        ),
        camera=Camera(size_px=(640, 480), sensor_mm=(24, 18), sensor_distance=80.5, focus_distance=2000),
        quality=Quality(
            mode="draft",
            wavelengths=3,
            bridge=False,
            paths="same-side",
            tolerance_px=0.5,
            cull=1e-5,
            seed=2**62,
            orders=4,
            order4_limit=1e-6,
            reference_error=0.003,
            reference_error_of="total",
            reference_samples=10**9,
        ),
        output=Output(layers="ghosts", brightest=7, colorspace="acescg", pixel_type="half", starburst=False),
    ),
    Project(lens=LENS, coating=Preset(name="a b"), lights=(Light(field_deg=(0, 0), spectrum=EqualEnergy()),)),
    Project(
        lens="x",
        coating=Everywhere(coating=Stack(layers=(Film(index=1.38, thickness_nm=96.4),))),
        lights=(Light(field_deg=(0, 0)),),
    ),
    Project(
        lens="x",
        coating=PerRow(coatings=(Standard(name="modern-broadband"), None)),
        lights=(Light(field_deg=(0, 0)),),
        art=Art(
            gain={"ghosts": 2.5},
            rules=(
                Rule(select="not row:7", enable=False),
                Rule(select="7-3,8-2", gain=0.5, tint=(1, 0.5, 0), offset_px=(1, -2.5), scale=1.5, blur_mm=0.25),
                Rule(select="all", ramp=((0, 1, 1, 1), (1, 1, 0.5, 0)), offset_mm=(0, 1), blur_px=2, enable=True),
            ),
        ),
    ),
    Project(
        lens="x",
        coating=InTurn(coatings=(Bare(), Standard(name="early-multicoat", thickness=0.94))),
        lights=(Light(field_deg=(0, 0)),),
        art=Art(physical=True),
    ),
    Project(
        lens="x",
        lights=(Light(field_deg=(0, 0)),),
        scatter=Scatter(
            model="abg",
            abg=(1e-5, 1e-4, 1.5),
            cleanliness_level=300,
            rows=(RowScatter(row=0, abg=(1e-4, 1e-4, 2.0)), RowScatter(row=3, cleanliness_level=500)),
        ),
    ),
    Project(lens="x", lights=(Light(field_deg=(0, 0)),), scatter=Scatter()),
]


@pytest.mark.parametrize("comments", [False, True])
@pytest.mark.parametrize("project", PROJECTS)
def test_a_written_project_reads_back_the_same(tmp_path, monkeypatch, project, comments):
    monkeypatch.chdir(tmp_path)
    Path("p.toml").write_text(project_text(project, comments=comments), "utf-8")
    assert read_project("p.toml") == project


def test_a_commented_project_teaches_every_key(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = project_text(Project(lens="x", iris=Iris(), lights=(Light(field_deg=(0, 0)),)), comments=True)
    records = (
        Project,
        Light,
        Iris,
        Camera,
        Quality,
        Output,
        Dirt,
        Starburst,
        Scatter,
        Holdout,
        Imperfection,
        Art,
        Rule,
    )
    keys = {name for record in records for name in record.model_fields}
    # design targets belong to no render
    assert {key for key in keys if not re.search(rf"\b{key}\b", text)} == {"design"}
    taught = re.findall(r"^# \w+ = .*$", text.split("\n# Starburst")[0], re.MULTILINE)
    assert len(taught) >= 15
    for line in taught:
        Path("p.toml").write_text(text.replace(line, line[2:]), "utf-8")
        assert read_project("p.toml")


@pytest.fixture(scope="module")
def schema():
    found = project_json_schema()
    jsonschema.Draft202012Validator.check_schema(found)
    assert json.dumps(found)
    return jsonschema.Draft202012Validator(found)


@pytest.mark.parametrize("project", PROJECTS)
def test_the_schema_accepts_what_is_written(schema, project):
    schema.validate(tomllib.loads(project_text(project)))


def test_paths_start_at_the_projects_folder(tmp_path, monkeypatch):
    folder = tmp_path / "shot"
    folder.mkdir()
    (folder / "lamp.csv").write_text("nm,power\n400,1\n700,2\n")
    (folder / "coat.toml").write_text('coating = "film:1.38:100"\n')
    (folder / "p.toml").write_text(
        'lens = "sub/my.lens"\ncoating = "coat.toml"\n[iris]\nmask = "iris.png"\n'
        '[[lights]]\nfield_deg = [0, 0]\nspectrum = "lamp.csv"\n'
    )
    monkeypatch.chdir(tmp_path)
    project = read_project("shot/p.toml")
    assert project.lens == str(Path("shot/sub/my.lens"))
    assert project.iris is not None
    assert project.iris.mask == str(Path("shot/iris.png"))
    assert project.coating == Everywhere(coating=Film(index=1.38, thickness_nm=100))
    assert project.lights[0].spectrum == Tabulated(wavelength_nm=(400, 700), power=(1, 2))
    # and back: a text for that folder has paths relative to it
    text = project_text(project, folder=Path("shot"))
    assert 'lens = "sub/my.lens"' in text
    assert 'mask = "iris.png"' in text


def test_an_embedded_lens_may_be_written_as_in_a_lens_file(tmp_path):
    (tmp_path / "p.toml").write_text(
        'lights = [{ field_deg = [0, 0] }]\n[lens]\nschema_version = 1\nname = "L"\nf_number = 4\n'
        "rows = [{ radius = 50, thickness = 5, n_d = 1.5, v_d = 60 }, "
        "{ radius = -50, thickness = 1 }, { stop = true }]\n"
    )
    lens = read_project(tmp_path / "p.toml").lens
    assert isinstance(lens, Lens)
    assert lens.rows[0].curvature == 0.02


def test_every_mistake_is_told_at_once_where_it_is(tmp_path):
    (tmp_path / "p.toml").write_text(
        'lens = 3\nflare = 1\ncoating = "quarter-wave:x"\n'
        '[camera]\nsize = [1, 2]\nsize_px = ["a", 2]\nblades = 3\n[quality]\nmode = "best"\n'
        '[[lights]]\nfield_deg = [1, 2]\nspectrum = { kind = "black-body" }\n[[lights]]\nspectrum = "sun"\n'
    )
    with pytest.raises(ProjectError, match=r"p\.toml has 10 problems") as caught:
        read_project(tmp_path / "p.toml")
    problems = caught.value.problems  # type: ignore[attr-defined]
    for words in (
        "lens should be a name, a file or a table, not 3",
        "flare is not a known key; known are schema_version, lens",
        "coating 'quarter-wave:x' is not understood",
        "camera.size is not a known key; did you mean 'size_px'?",
        "camera.size_px[0] should be a whole number",
        "camera.blades is not a known key here; it belongs into [iris]",
        "quality.mode should be 'draft', 'final' or 'reference', not 'best'",
        "lights[0].spectrum.temperature_k is missing",
        "lights[1].field_deg is missing",
        "lights[1].spectrum: the spectrum 'sun' is unknown",
    ):
        assert any(problem.startswith(words) for problem in problems), (words, problems)
    assert len(problems) == 10


@pytest.mark.parametrize(
    ("text", "spectrum"),
    [
        ("d65", D65()),
        (" D65 ", D65()),
        ("equal-energy", EqualEnergy()),
        ("black-body:3200", BlackBody(temperature_k=3200)),
        ("black-body:3200K", BlackBody(temperature_k=3200)),
        ("lines:589.0,589.6", Lines(lines=((589.0, 1), (589.6, 1)))),
        ("lines:589.0*0.5, 600", Lines(lines=((589.0, 0.5), (600, 1)))),
    ],
)
def test_spectrum_texts(text, spectrum):
    assert parse_spectrum(text) == spectrum
    again = spectrum_text(spectrum)
    assert again is not None
    assert parse_spectrum(again) == spectrum


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("d56", "did you mean 'd65'"),
        ("sunny", "use d65, equal-energy"),
        ("black-body", "holds '' where a number belongs"),
        ("black-body:10", "between 500 and 100000"),
        ("black-body:nan", "between 500 and 100000"),
        ("lines:", "where a number belongs"),
        ("lines:200", "between 360 and 830"),
        ("lines:589*-1", "powers of 0 or more"),
        ("missing.csv", "does not exist"),
    ],
)
def test_spectrum_texts_that_mean_nothing(text, words):
    with pytest.raises(ProjectError, match=words) as caught:
        parse_spectrum(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("400,1\n500,x\n", "line 2: '500,x'"),
        ("400,1,2\n500,1,2\n", "line 2"),
        ("400,1\n", "at least two lines"),
        ("500,1\n400,1\n", "rising"),
        ("400,-1\n500,1\n", "0 or more"),
        ("400,nan\n500,1\n", "0 or more"),
        ("nm;power\nwavelength;x\n", "line 2"),
    ],
)
def test_spectrum_tables_with_mistakes(tmp_path, content, words):
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(ProjectError, match=words):
        parse_spectrum("a.csv", folder=tmp_path)


def test_spectrum_tables_in_any_common_dress(tmp_path):
    expected = Tabulated(wavelength_nm=(400, 500), power=(1, 0.5))
    for content in (
        "400,1\n500,0.5",
        "nm;power\n\n400;1\n500;0.5\n",
        "# a lamp\n400\t1\r\n500 0.5",
        "\ufeffnm,p\n400, 1\n500, .5",
    ):
        (tmp_path / "a.csv").write_text(content, "utf-8")
        assert parse_spectrum("a.csv", folder=tmp_path) == expected


def test_coating_choices(tmp_path):
    assert parse_coating_choice("lens") == AsLens()
    assert parse_coating_choice("none") == Everywhere(coating=Bare())
    assert parse_coating_choice("preset:a b") == Preset(name="a b")
    assert parse_coating_choice("quarter-wave:550") == Everywhere(coating=QuarterWave(center_wavelength_nm=550))
    (tmp_path / "c.toml").write_text('rows = ["quarter-wave:430", "-"]\n')
    per_row = PerRow(coatings=(QuarterWave(center_wavelength_nm=430), None))
    assert parse_coating_choice("c.toml", folder=tmp_path) == per_row
    with pytest.raises(ProjectError, match="names no preset"):
        parse_coating_choice("preset:")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"lens = ", "not valid TOML.*at end of document.: a value, a closing bracket or a closing quote is missing"),
        (b'lens = "tessar\n', r"illegal character .* \(at line 1, column 15\): close the quotes in that line"),
        (b"lens = tessar\n", "at line 1, column 8.: a value is a number, true, false, text in quotes"),
        (b"lens\n", "at line 1, column 5.: write KEY = VALUE"),
        (b'lens = "tessar" f_number = 4\n', "at line 1, column 17.: write one key a line"),
        (b"\xff\xfe", "UTF-8"),
        (b"schema_version = 2\n", "newer than this program"),
        (b"", "empty"),
    ],
)
def test_files_that_are_no_project(tmp_path, content, words):
    (tmp_path / "p.toml").write_bytes(content)
    with pytest.raises(ProjectError, match=words):
        read_project(tmp_path / "p.toml")


def test_a_folder_behind_a_link_is_left_by_its_real_way(tmp_path, monkeypatch):
    """Paths were counted along the link, and the written project named a file that does not exist."""
    (tmp_path / "disk" / "renders").mkdir(parents=True)
    (tmp_path / "shots").mkdir()
    try:
        (tmp_path / "shots" / "out").symlink_to(tmp_path / "disk" / "renders")
    except OSError:
        pytest.skip("this system makes no links")
    monkeypatch.chdir(tmp_path / "shots")
    write_lens(load_lens("heliar-tronnier"), "my.toml")
    made = Project(lens="my.toml", lights=(Light(field_deg=(1.0, 2.0)),))
    Path("out/p.toml").write_text(project_text(made, folder=Path("out")), "utf-8")
    found = read_project("out/p.toml")
    assert Path(found.lens).resolve() == tmp_path / "shots" / "my.toml"


def test_the_configuration_of_colours_starts_at_the_projects_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    made = Project(
        lens="heliar-tronnier", lights=(Light(field_deg=(1.0, 2.0)),),
        output=Output(ocio_space="ACEScg", ocio_config="sub/show.ocio"),
    )  # fmt: skip
    Path("sub/p.toml").write_text(project_text(made, folder=Path("sub")), "utf-8")
    assert 'ocio_config = "show.ocio"' in Path("sub/p.toml").read_text("utf-8")
    assert Path(read_project("sub/p.toml").output.ocio_config) == Path("sub/show.ocio")
    built_in = made.replace(output=made.output.replace(ocio_config="ocio://default"))
    Path("sub/q.toml").write_text(project_text(built_in, folder=Path("sub")), "utf-8")
    assert read_project("sub/q.toml").output.ocio_config == "ocio://default"
