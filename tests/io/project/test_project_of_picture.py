"""An EXR carries its project, which every reader of projects reads."""

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.errors import ProjectError
from flarewright.io.images.exr import write_exr
from flarewright.io.project.project_file import read_project
from flarewright.model import Layer


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def picture(path, metadata):
    pixels = np.zeros((4, 6, 3), np.float32)
    write_exr(path, [Layer("beauty", pixels, (0, 0, 6, 4), {})], (6, 4), metadata=metadata)


def test_the_picture_of_a_picture_is_the_same_one(folder, capsys):
    (folder / "out").mkdir()
    words = ["render", "heliar-tronnier", "--light", "6,3", "--quality", "draft", "--size", "32x24", "--fstop", "8"]
    assert run([*words, "--no-starburst", "-o", "out/a.exr"]) == 0
    assert run(["render", "--project", "out/a.exr", "-o", "b.exr"]) == 0
    assert read_project("b.exr") == read_project("out/a.exr")
    assert read_project("b.exr").f_number == 8.0
    assert run(["project", "check", "out/a.exr"]) == 0
    # a picture never replaces the one that it is drawn from
    assert run(["render", "--project", "b.exr", "-o", "b.exr"]) == 2
    assert "b.exr would replace an input file" in capsys.readouterr().err


def test_paths_in_a_picture_start_at_its_folder(folder):
    (folder / "out").mkdir()
    picture("out/a.exr", {"project": 'lens = "own.toml"\n[[lights]]\nfield_deg = [1, 2]\n[dirt]\nimage = "../d.png"\n'})
    found = read_project("out/a.exr")
    assert (found.lens, found.dirt.image) == ("out/own.toml", "out/../d.png")


@pytest.mark.parametrize(
    ("metadata", "said"),
    [
        ({}, "a.exr carries no project: give"),
        ({"project": "lens = "}, "is not valid TOML"),
        ({"project": "x = 1"}, "the first: lens is missing"),
    ],
)
def test_pictures_without_a_project(folder, metadata, said):
    picture("a.exr", metadata)
    with pytest.raises(ProjectError, match=said):
        read_project("a.exr")


def test_what_is_no_picture(folder):
    (folder / "a.exr").write_text("lens")
    with pytest.raises(ProjectError, match="cannot be read as an EXR file"):
        read_project("a.exr")
