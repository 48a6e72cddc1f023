"""What `flarewright render` fills in for a lens of the library when nothing is said."""

from types import SimpleNamespace

import pytest

from flarewright.cli.app import run
from flarewright.cli.photograph import LIGHT_DEG, ROUGHNESS_UM, ROUNDING, plausible_preset, stopped_down
from flarewright.io.library import shipped
from flarewright.model import AsLens, Bare, Everywhere, Layer, Preset, Standard
from flarewright.optics.pack import resolve_coatings
from flarewright.render.prepare import load_lens


@pytest.fixture
def projects(monkeypatch, tmp_path):
    """Return the projects that commands would render; nothing is."""
    import numpy as np

    found = []

    def render(project, **_):
        found.append(project)
        width, height = project.camera.size_px
        layer = Layer("beauty", np.zeros((height, width, 3), np.float32), (0, 0, width, height))
        return SimpleNamespace(project=project, layers=(layer,), summary={"f_number": 4.0}, remarks=(), ledger=None)

    monkeypatch.setattr("flarewright.render.first_run.compile_for_render", lambda *_: None)
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
    assert project.iris.roughness_um == ROUGHNESS_UM
    assert project.iris.blades == load_lens("takumar-50-f1.4").iris.blades
    assert project.lights[0].diameter_deg == LIGHT_DEG
    told = capsys.readouterr().err
    assert "as photographed: f/4, coating preset:period (chosen, not known)" in told
    assert "--ideal leaves this out" in told


def test_ideal_is_the_lens_as_in_its_file(projects, capsys):
    call("takumar-50-f1.4", "--light", "-9,5", "--ideal")
    (project,) = projects
    assert project.f_number is None
    assert project.coating == AsLens()
    assert project.iris is None
    assert project.lights[0].diameter_deg == 0.0
    assert "as photographed" not in capsys.readouterr().err


def test_what_is_said_holds(projects, capsys):
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
    # a sun has a size of its own, and the others' is not guessed beside it
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


@pytest.mark.parametrize(
    ("wide_open", "stopped"), [(1.1, 4.0), (1.4, 4.0), (2.03, 4.0), (2.8, 5.6), (3.5, 7.1), (4.0, 8.0), (11.5, 22.0)]
)
def test_two_stops_down(wide_open, stopped):
    assert stopped_down(wide_open) == stopped


@pytest.mark.parametrize("name", shipped())
def test_every_lens_wears_films_of_its_time(name):
    """None before 1938; single films or stacks that differ from surface to surface after."""
    lens = load_lens(name)
    preset = plausible_preset(lens)
    assert stopped_down(lens.f_number) >= lens.f_number
    assert preset == ("blue-streak" if name == "anamorphic-heliar-2x" else "period")
    worn = [coating for coating in resolve_coatings(lens, Preset(name=preset)) if coating not in (None, Bare())]
    if name in ("biotar-50-f1.4", "speed-panchro-50"):
        assert not worn
    elif preset == "period":
        assert len(set(worn)) >= 4


def test_a_lens_without_films_of_its_time_wears_the_first_that_it_names():
    lens = load_lens("triplet-pestrecov")
    bare = lens.replace(coating_presets={})
    assert plausible_preset(bare) == "staggered"
    coatings = lens.coating_presets["single-coated"]
    assert plausible_preset(bare.replace(coating_presets={"single-coated": coatings, "maker": coatings})) == "maker"
