"""The library accepts the same coating texts as the command line."""

import inspect
from pathlib import Path

import pytest

import flarewright as fw
from flarewright.cli.app import run
from flarewright.io.lens.coating_text import STANDARD_NAMES
from flarewright.render.scene.arguments import Settings, project_of

LIGHTS = [fw.Light(field_deg=(6.0, 3.0))]
WORDS = [
    "lens", "none", "bare", "preset:staggered", "quarter-wave:550", "quarter-wave:550:1.38", "quarter-wave:550:ideal",
    "quarter-wave:550+10", "film:1.38:96.4", "stack:1.38:96.4,2.1:120", *STANDARD_NAMES, "one.toml", "rows.toml",
]  # fmt: skip
WRONG = [
    "early", "erly-multicoat", "quarter-wave", "quarter-wave:5", "film:9:96.4", "preset:", "preset:other", "gone.toml",
    "bad.toml",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _coating_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("one.toml").write_text('coating = "quarter-wave:430"\n')
    Path("rows.toml").write_text('rows = ["quarter-wave:430", "-"]\n')
    Path("bad.toml").write_text('rows = ["x"]\n')


def command_of(word, monkeypatch):
    """Return the project that the command line would render."""
    seen = []

    def renderer(project, *_):
        seen.append(project)
        raise fw.ProjectError("seen")

    monkeypatch.setattr("flarewright.cli.render.command._renderer", renderer)
    assert run(["render", "canon-28-80", "--ideal", "--light", "6,3", "--coating", word, "-o", "a.exr"]) == 2
    return seen[0]


@pytest.mark.parametrize("word", WORDS)
def test_every_word_of_the_command_line(word, monkeypatch):
    asked = command_of(word, monkeypatch)
    assert project_of("canon-28-80", lights=LIGHTS, coating=word) == asked
    bare = fw.Project(lens="canon-28-80", lights=LIGHTS, coating=fw.Bare())
    assert project_of(bare, coating=word) == asked
    assert bare.replace(coating=fw.parse_coating_choice(word)) == asked


@pytest.mark.parametrize("word", WRONG)
def test_wrong_words_are_refused_as_by_the_command_line(word, capsys):
    assert run(["render", "canon-28-80", "--ideal", "--light", "6,3", "--coating", word, "-o", "a.exr"]) == 2
    reported = capsys.readouterr().err
    with pytest.raises(fw.ProjectError) as refused:
        fw.render("canon-28-80", lights=LIGHTS, coating=word)
    assert reported == f"flarewright: error: {refused.value}\n"
    with pytest.raises(fw.ProjectError) as refused:
        fw.ghosts("canon-28-80", (6.0, 3.0), coating=word)
    assert reported == f"flarewright: error: {refused.value}\n"


def test_a_coating_by_itself_is_on_all_surfaces():
    everywhere = fw.Everywhere(coating=fw.Standard(name="early-multicoat"))
    for coating in ("early-multicoat", fw.Standard("early-multicoat"), everywhere):
        assert project_of("canon-28-80", lights=LIGHTS, coating=coating).coating == everywhere
    for coating in ("early-multicoat", fw.Standard("early-multicoat")):
        project = fw.Project(lens="canon-28-80", lights=LIGHTS, coating=coating)
        assert project.coating == everywhere
    assert fw.Project(lens="canon-28-80", lights=LIGHTS, coating="lens").coating == fw.AsLens()
    assert project_of(project, coating=None).coating == fw.AsLens()
    assert project_of(project) is project


def test_a_standard_coating_needs_no_keyword():
    assert fw.Standard("single-1950s") == fw.Standard(name="single-1950s")
    for wrong in ({"kind": "standard"}, {"kind": "standard", "name": "single"}):
        with pytest.raises(ValueError, match="name"):
            fw.Everywhere.model_validate({"coating": wrong})
    with pytest.raises(TypeError, match="multiple values"):
        fw.Standard("single-1950s", name="single-1950s")


def test_a_project_says_who_reads_texts():
    with pytest.raises(
        fw.ProjectError, match=r"one of uncoated.*; flarewright\.parse_coating_choice\('preset:nosuch'\) reads"
    ):
        fw.Project(coating="preset:nosuch")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, "no light is given"),
        ({"lights": LIGHTS, "coatin": "none"}, "coatin is not a known field; did you mean 'coating'"),
        ({"lights": LIGHTS, "coating": 5}, "coating 5 is neither a text nor a coating: write none"),
        ({"lights": LIGHTS, "f_number": -1.0}, "f_number should be greater than 0.3, not -1"),
        ({"lights": LIGHTS, "f_number": -1.0, "zoom": -1.0}, "2 problems"),
    ],
)
def test_settings_that_cannot_be_used(settings, words):
    with pytest.raises(fw.ProjectError, match=words):
        fw.render("canon-28-80", **settings)


def test_a_word_of_quality_keeps_the_other_settings_as_the_command_line_does():
    given = project_of("canon-28-80", lights=LIGHTS, quality=fw.Quality(wavelengths=9))
    assert project_of(given, quality="draft").quality == fw.Quality(mode="draft", wavelengths=9)
    assert project_of("canon-28-80", lights=LIGHTS, quality="draft").quality == fw.Quality(mode="draft")
    with pytest.raises(fw.ProjectError, match="'draft', 'final' or 'reference', not 'drafty'"):
        fw.render("canon-28-80", lights=LIGHTS, quality="drafty")


def test_the_settings_are_rendered():
    small = {"camera": fw.Camera(size_px=(24, 16)), "quality": fw.Quality(mode="draft", wavelengths=3)}
    small["output"] = fw.Output(starburst=False)
    whole = fw.Project(lens="heliar-tronnier", lights=LIGHTS, coating=fw.Standard("early-multicoat"), **small)
    found = fw.render("heliar-tronnier", lights=LIGHTS, coating="early-multicoat", **small)
    assert found.project == whole
    bare = fw.render(whole, coating="none")
    # a ghost is proportional to the square of the surfaces' reflectance
    assert bare.layers[1].pixels.sum(dtype=float) > 5.0 * found.layers[1].pixels.sum(dtype=float) > 0.0


def test_the_signature_names_all_settings():
    named = inspect.signature(fw.render).parameters
    assert set(Settings.__annotations__) == set(fw.Project.model_fields) - {"lens", "schema_version"}
    assert [*named] == ["project", "threads", "progress", "run", "ledger", "profile", "kept", *Settings.__annotations__]
    assert "timeline: 'Timeline' = <as in the project>, " in str(inspect.signature(fw.render))


def test_every_setting_of_render_can_be_made_with_the_names_of_the_package():
    """`inspect.signature` named Dirt, Plate, Starburst and others, which `flarewright` did not have."""
    import re

    plain = {"Sequence", "PathLike"}
    words = {word for one in Settings.__annotations__.values() for word in re.findall(r"[A-Z]\w+", one.__forward_arg__)}
    assert sorted(word for word in words - plain - {"None"} if not hasattr(fw, word)) == []


def test_a_rendering_shows_itself_briefly():
    """A terminal used to show hundreds of lines: the pixels, the whole project and the summary."""
    camera, output = fw.Camera(size_px=(32, 18)), fw.Output(starburst=False)
    found = fw.render(
        "triplet-pestrecov", lights=[fw.Light(field_deg=(6.0, 3.0), intensity=0.0)], camera=camera, output=output,
        quality=fw.Quality(mode="draft"),
    )  # fmt: skip
    shown = repr(found)
    assert len(shown) < 2000
    assert "array" not in shown
    assert "name='beauty', window=(0, 0, 32, 18)" in shown
    # light is said not to come through a lens only if there is some
    assert "the picture is black: every light has intensity 0" in found.remarks
