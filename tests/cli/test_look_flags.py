"""Photographic defaults of `flarewright render` for library lenses, and `--look`."""

from types import SimpleNamespace

import pytest

from flarewright.cli.app import run
from flarewright.model import AsLens, Bare, BlackBody, Everywhere, Layer, Preset, QuarterWave, Standard
from flarewright.render.scene.photographic_defaults import LIGHT_DEG, ROUGHNESS_LENGTH_UM, ROUGHNESS_UM, ROUNDING
from flarewright.render.scene.resolve import load_lens


@pytest.fixture
def projects(monkeypatch, tmp_path):
    """Return the projects that commands would render, without rendering."""
    import numpy as np

    found = []

    def render(project, **_):
        found.append(project)
        width, height = project.camera.size_px
        layer = Layer("beauty", np.zeros((height, width, 3), np.float32), (0, 0, width, height))
        return SimpleNamespace(
            project=project,
            layers=(layer,),
            summary={"f_number": 4.0},
            remarks=(),
            ledger=None,
            profile=None,
            matte=None,
        )

    monkeypatch.setattr("flarewright.render.warmup.compile_for_render", lambda *_: None)
    monkeypatch.setattr("flarewright.render.render.render", render)
    monkeypatch.chdir(tmp_path)
    return found


def call(*words):
    assert run(["render", *words, "--size", "8x6", "--no-png", "-o", "a.exr"]) == 0


def test_a_lens_of_the_library_is_as_photographed(projects, capsys):
    call("takumar-50-f1.4", "--light", "-9,5")
    (project,) = projects
    assert project.f_number == 4.0
    assert project.coating == Preset(name="period")
    assert project.iris.rounding == ROUNDING
    assert (project.iris.roughness_um, project.iris.roughness_length_um) == (ROUGHNESS_UM, ROUGHNESS_LENGTH_UM)
    assert project.iris.blades == load_lens("takumar-50-f1.4").iris.blades
    assert project.lights[0].diameter_deg == LIGHT_DEG
    reported = capsys.readouterr().err
    assert "as photographed: f/4, coating preset:period (chosen, not known)" in reported
    assert "--ideal omits this" in reported


def test_ideal_is_the_lens_as_in_its_file(projects, capsys):
    call("takumar-50-f1.4", "--light", "-9,5", "--ideal")
    (project,) = projects
    assert project.f_number is None
    assert project.coating == AsLens()
    assert project.iris is None
    assert project.lights[0].diameter_deg == 0.0
    assert "as photographed" not in capsys.readouterr().err


def test_given_settings_are_kept(projects, capsys):
    call(
        "takumar-50-f1.4", "--light", "-9,5", "--fstop", "1.4", "--coating", "early-multicoat", "--rounding", "0",
        "--light-diameter", "0",
    )  # fmt: skip
    (project,) = projects
    assert project.f_number == 1.4
    assert project.coating == Everywhere(coating=Standard(name="early-multicoat"))
    assert project.iris.rounding == 0.0
    assert project.lights[0].diameter_deg == 0.0
    assert "as photographed" not in capsys.readouterr().err


def test_one_thing_said_leaves_the_others(projects):
    call("takumar-50-f1.4", "--light", "sun@-9,5", "--light", "2,1", "--blades", "8")
    (project,) = projects
    assert project.f_number == 4.0
    assert project.iris.blades == 8
    assert project.iris.rounding == 0.0
    # a sun has its own size, and that of the others is not set beside it
    assert [light.diameter_deg for light in project.lights] == [0.53, 0.0]


def test_a_file_of_ones_own_is_taken_as_it_is(projects, tmp_path, capsys):
    (tmp_path / "own.toml").write_text(
        'schema_version = 1\nname = "Singlet"\nf_number = 5.0\nrows = [\n'
        "  { radius = 50.0, thickness = 5.0, n_d = 1.5168, v_d = 64.17, semi_diameter = 10.0 },\n"
        "  { radius = -50.0, thickness = 2.0, semi_diameter = 10.0 },\n  { stop = true, thickness = 80.0 },\n]\n"
    )
    call("own.toml", "--light", "2,1")
    (tmp_path / "shot.toml").write_text('lens = "takumar-50-f1.4"\n[[lights]]\nfield_deg = [1, 2]\n')
    call("--project", "shot.toml")
    for project in projects:
        assert project.f_number is None
        assert project.coating == AsLens()
        assert project.lights[0].diameter_deg == 0.0
    assert "as photographed" not in capsys.readouterr().err


LOOK = """
name = "Dusk"
lens = "tessar-brendel"
f_number = 8.0
coating = "quarter-wave:600"
[iris]
rounding = 0.1
[dirt]
dust_per_mm2 = 3.0
[[lights]]
field_deg = [-5.0, 2.0]
spectrum = "black-body:2500"
"""


@pytest.fixture
def dusk(tmp_path):
    (tmp_path / "dusk.toml").write_text(LOOK, "utf-8")
    return "dusk.toml"


def test_a_look_by_itself_is_its_own_lens_and_lights(projects, dusk, capsys):
    call("--look", dusk)
    (project,) = projects
    assert (project.lens, project.f_number, project.dirt.dust_per_mm2) == ("tessar-brendel", 8.0, 3.0)
    assert project.lights[0].field_deg == (-5.0, 2.0)
    assert project.lights[0].spectrum == BlackBody(temperature_k=2500.0)
    # settings that it leaves open are as photographed
    assert project.lights[0].diameter_deg == LIGHT_DEG
    assert project.iris == load_lens("tessar-brendel").iris.replace(rounding=0.1)
    assert "as photographed: lights of 0.25 degrees; --ideal omits this" in capsys.readouterr().err


def test_a_look_goes_onto_another_lens_and_light_and_flags_win(projects, dusk):
    call(
        "takumar-50-f1.4", "--look", dusk, "--light", "sun@-9,5", "--intensity", "2", "--coating", "none",
        "--blades", "8",
    )  # fmt: skip
    (project,) = projects
    assert project.lens == "takumar-50-f1.4"
    assert project.f_number == 8.0
    assert project.coating == Everywhere(coating=Bare())
    assert (project.iris.blades, project.iris.rounding) == (8, 0.1)
    (light,) = project.lights
    assert (light.field_deg, light.intensity, light.diameter_deg) == ((-9.0, 5.0), 2.0, 0.53)
    assert light.spectrum == BlackBody(temperature_k=2500.0)


def test_a_look_goes_onto_a_project(projects, dusk, tmp_path):
    (tmp_path / "shot.toml").write_text(
        'lens = "takumar-50-f1.4"\nf_number = 2.0\ncoating = "none"\n[[lights]]\nfield_deg = [1, 2]\n'
        "[camera]\nsize_px = [4, 3]\n"
    )
    call("--project", "shot.toml", "--look", dusk)
    (project,) = projects
    assert (project.lens, project.f_number, project.dirt.dust_per_mm2) == ("takumar-50-f1.4", 8.0, 3.0)
    assert project.coating == Everywhere(coating=QuarterWave(center_wavelength_nm=600.0))
    # a project is used as it is, without defaults
    assert project.lights[0].diameter_deg == 0.0


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (
            ["--look", "warm-vintge"],
            "'warm-vintge' is neither a look of the library nor a file: did you mean warm-vintage",
        ),
        (["--look", "none.toml"], "the look none.toml does not exist"),
        (["model.json", "--look", "dusk.toml"], "model.json is a measured flare and has the look of its lens"),
    ],
)
def test_an_unknown_look_is_reported(words, reported, dusk, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.json").write_text("{}")
    assert run(["render", *words, "-o", "a.exr"]) == 2
    assert reported in capsys.readouterr().err


def test_a_look_wider_than_the_lens_is_reported_unless_a_flag_sets_the_opening(projects, capsys):
    call("heliar-tronnier", "--light", "-9,5", "--look", "warm-vintage")
    assert "is wider than Heliar-Tronnier 100 mm f/3.5 opens: f/3.5" in capsys.readouterr().err
    call("heliar-tronnier", "--light", "-9,5", "--look", "warm-vintage", "--fstop", "8")
    assert "is wider" not in capsys.readouterr().err
    assert [project.f_number for project in projects] == [3.5, 8.0]
    assert projects[0].coating == projects[1].coating
