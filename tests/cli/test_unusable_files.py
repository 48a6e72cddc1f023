"""Messages on unusable files: which file, which key in which line, and where the key belongs."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flarewright.cli.app import run
from flarewright.render.scene.resolve import load_lens

LENS = """schema_version = 1
name = "Singlet"
f_number = 5.0
rows = [
  { radius = 50.0, thickness = 5.0, glass = "N-BK7", semi_diameter = 10.0 },
  { radius = -50.0, thickness = 2.0, semi_diameter = 10.0 },
  { stop = true, thickness = 80.0 },
]
"""
SCENE = (
    '[[cameras]]\nname = "A"\nlens = "heliar-tronnier"\nposition_m = [0, 0, 0]\naim_m = [0, 0, 5]\n'
    '[[lights]]\nname = "lamp"\nposition_m = [0, 1, 5]\nintensity_cd = 100\n'
)
FILM = '{ kind = "film", index = "1.38", thickness_nm = 90.0 }'
PROJECT = 'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [10, 5]\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys, words: list[str]) -> str:
    """Run a command that must fail, and return its sentence."""
    assert run(words) == 2
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    assert err.startswith("flarewright: error: ")
    return out + err


@pytest.mark.parametrize(
    ("command", "text", "words"),
    [
        ("lens", LENS.replace("f_number = 5.0", "f_number = 5.0\nf_number = 4.0"), "f_number twice, in lines 3 and 4"),
        ("lens", LENS.replace("radius = 50.0", "radius = 50.0, radius = 40.0"), "'radius' twice within the braces"),
        ("project", PROJECT + "[camera]\n[iris]\n[camera]\n", "[camera] twice, in lines 4 and 6: put all its keys"),
        ("project", PROJECT + "[lights]\n", "[lights] twice, in lines 2 and 4: write [[lights]] each time"),
        ("project", PROJECT + "field_deg = 3\n", "field_deg twice, in lines 3 and 4: keep one"),
        ("scene", "[site]\nlatitude_deg = 1\nlatitude_deg = 2\n", "latitude_deg twice, in lines 2 and 3: keep one"),
    ],
)
def test_a_duplicate_key_is_reported_with_both_lines(capsys, folder, command, text, words):
    (folder / "twice.toml").write_text(text)
    assert f"twice.toml says {words}" in refused(capsys, [command, "check", "twice.toml"])


def test_the_same_key_of_two_entries_stands_twice_by_right(folder):
    text = PROJECT + "keyframes = []\n[[lights]]\nfield_deg = [1, 1]\n[iris]\nblades = 6\n[art]\nphysical = true\n"
    (folder / "right.toml").write_text(text)
    assert run(["project", "check", "right.toml"]) == 0


NEGATIVE = LENS.replace("radius = 50.0", "radius = -50.0").replace(
    "radius = -50.0, thickness = 2", "radius = 50.0, thickness = 2"
)


@pytest.mark.parametrize(
    "command",
    [["lens", "check"], ["lens", "show"], ["ghosts", "--light", "1,1"], ["render", "--light", "1,1", "-o", "a.exr"]],
)
def test_a_lens_that_makes_no_image_is_refused_with_its_file(capsys, folder, command):
    (folder / "weak.toml").write_text(NEGATIVE)
    assert "weak.toml: Singlet: " in refused(
        capsys,
        [*command[:2], "weak.toml", *command[2:]] if command[0] == "lens" else [command[0], "weak.toml", *command[1:]],
    )


def test_what_a_project_asks_of_its_lens_is_refused_with_its_file(capsys, folder):
    (folder / "fast.toml").write_text("f_number = 1.0\n" + PROJECT)
    assert "fast.toml: f/1 is faster" in refused(capsys, ["project", "check", "fast.toml"])


def test_a_missing_iris_image_is_refused_with_the_lens_file_that_names_it(capsys, folder):
    (folder / "masked.toml").write_text(LENS + '[iris]\nmask = "nowhere.png"\n')
    reported = refused(capsys, ["lens", "check", "masked.toml"])
    assert "masked.toml: " in reported
    assert "nowhere.png does not exist; give the path of a PNG" in reported


KINDS = {
    "lens": LENS,
    "project": PROJECT,
    "scene": '[[cameras]]\nname = "a"\nlens = "heliar-tronnier"\nposition_m = [0, 0, 0]\naim_m = [0, 1, 0]\n',
}


@pytest.mark.parametrize("given", KINDS)
@pytest.mark.parametrize("command", KINDS)
def test_a_file_of_another_kind_names_its_command(capsys, folder, command, given):
    (folder / "file.toml").write_text(KINDS[given])
    if given == command:
        run([command, "check", "file.toml"])
        assert "check it with" not in capsys.readouterr().err
        return
    reported = refused(capsys, [command, "check", "file.toml"])
    assert f"file.toml is a {given} file, not a {command} file: " in reported
    assert f"flarewright {given} check file.toml" in reported


def test_a_scene_of_one_camera_has_one_camera(capsys, folder):
    (folder / "scene.toml").write_text(
        KINDS["scene"] + '[[lights]]\nname = "b"\nposition_m = [0, 9, 0]\nintensity_cd = 1.0\n'
    )
    assert run(["scene", "check", "scene.toml"]) == 0
    assert capsys.readouterr().out == "scene.toml: usable, 1 camera, 1 light, 1 time\n"


def test_a_foreign_lens_file_names_its_command(capsys, folder):
    (folder / "old.lens").write_text("# Tessar\n")
    assert "flarewright lens check old.lens" in refused(capsys, ["project", "check", "old.lens"])


def test_an_iris_image_is_looked_for_beside_the_file_that_names_it(capsys, folder):
    (folder / "sub").mkdir()
    Image.fromarray(np.full((8, 8), 255, np.uint8)).save(folder / "sub" / "iris.png")
    (folder / "sub" / "masked.toml").write_text(LENS + '[iris]\nmask = "iris.png"\n')
    (folder / "sub" / "shot.toml").write_text(PROJECT + '[iris]\nmask = "iris.png"\n')
    (folder / "sub" / "whole.toml").write_text(
        '[[lights]]\nfield_deg = [1, 1]\n[lens]\nschema_version = 1\nname = "S"\nf_number = 5.0\n'
        + LENS[LENS.index("rows") :]
        + '[lens.iris]\nmask = "iris.png"\n'
    )
    assert run(["lens", "check", "sub/masked.toml"]) == 0
    assert run(["project", "check", "sub/shot.toml"]) == 0
    assert run(["project", "check", "sub/whole.toml"]) == 0
    assert Path(load_lens("sub/masked.toml").iris.mask).samefile(folder / "sub" / "iris.png")


@pytest.mark.parametrize(
    ("command", "text", "words"),
    [
        ("project", 'f_number = "8"\n' + PROJECT, "f_number should be a number, not '8'"),
        ("project", PROJECT.replace("5]", "true]"), "lights[0].field_deg[1] should be a number, not true"),
        ("project", PROJECT + "[output]\nstarburst = 1\n", "output.starburst should be true or false, not 1"),
        ("project", PROJECT + '[output]\nstarburst = "yes"\n', "output.starburst should be true or false, not 'yes'"),
        (
            "project",
            PROJECT + "[quality]\nwavelengths = true\n",
            "quality.wavelengths should be a whole number, not true",
        ),
        (
            "project",
            f'coating = {{ kind = "everywhere", coating = {FILM} }}\n{PROJECT}',
            "should be a number, not '1.38'",
        ),
        (
            "scene",
            SCENE.replace("[0, 1", "['0', 1"),
            "lights[0].position_m[0] should be a number, not '0'",
        ),
    ],
)
def test_a_value_is_never_taken_for_another_kind(capsys, folder, command, text, words):
    (folder / "loose.toml").write_text(text)
    assert words in refused(capsys, [command, "check", "loose.toml"])


def test_whole_numbers_are_numbers_and_round_numbers_whole(folder):
    (folder / "right.toml").write_text("f_number = 8\n" + PROJECT + "[iris]\nblades = 6.0\n")
    assert run(["project", "check", "right.toml"]) == 0


def test_a_flags_rule_is_read_as_strictly(capsys, folder):
    words = ["render", "heliar-tronnier", "--light", "1,1", "--rule", 'select = "all", gain = "2"', "-o", "x.exr"]
    assert "--rule: gain should be a number, not '2'" in refused(capsys, words)


@pytest.mark.parametrize("words", [["project", "check", "loop.toml"], ["lens", "show", "loop.toml"]])
def test_a_link_that_leads_nowhere_is_called_one(capsys, folder, words):
    (folder / "loop.toml").symlink_to("loop.toml")
    assert "loop.toml is a broken link" in refused(capsys, words)


def test_a_rule_that_chooses_nothing_is_refused_by_the_judge_too(capsys, folder):
    words = ["render", "heliar-tronnier", "--light", "1,1", "--quality", "reference", "--solo", "99-98", "-o", "x.exr"]
    assert "99-98" in refused(capsys, words)
    assert not (folder / "x.exr").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes among its files")
@pytest.mark.parametrize("flag", ["--iris-image", "--depth", "--holdout", "--look", "--dirt-image", "--ocio"])
def test_a_pipe_is_no_file_though_it_exists(capsys, folder, flag):
    os.mkfifo(folder / "pipe.png")
    words = ["render", "heliar-tronnier", "--light", "1,1", "--colorspace", "ACES", flag, "pipe.png", "-o", "x.exr"]
    if flag != "--ocio":
        words = [word for word in words if word not in ("--colorspace", "ACES")]
    assert "pipe.png is not a regular file; " in refused(capsys, words)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes among its files")
@pytest.mark.parametrize(
    "words",
    [
        ["render", "heliar-tronnier", "--light", "1,1", "-o", "pipe.exr"],
        ["shot", "--project", "p.toml", "--frames", "1", "-o", "pipe.exr"],
        ["lens", "convert", "heliar-tronnier", "pipe.toml"],
    ],
)
def test_a_pipe_is_no_output_and_stays(capsys, folder, words):
    (folder / "p.toml").write_text(PROJECT)
    pipe = next(folder / word for word in words if word.startswith("pipe"))
    os.mkfifo(pipe)
    assert f"cannot write {pipe.name}: it is not a regular file; give a file name" in refused(capsys, words)
    assert pipe.is_fifo()
