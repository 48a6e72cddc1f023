"""`flarewright dataset`: an example to start from, a contact sheet, a data set, and one sentence for errors."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from flarewright.cli.app import run
from flarewright.io.project.file_of_kind import example_file

SPEC = """
size_px = [64, 48]
layout = "folder"
[lens]
names = ["heliar-tronnier"]
stops_down = 4
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pairs.toml").write_text(SPEC)
    return tmp_path


def test_the_example_is_printed_and_nothing_else(place, capsys):
    assert run(["dataset", "--example"]) == 0
    assert capsys.readouterr() == (example_file("dataset"), "")
    assert run(["dataset", "--example", "--seed", "3"]) == 2
    assert "--example only prints a specification; leave --seed out" in capsys.readouterr().err


def test_a_data_set_prints_one_object_and_a_line_of_json_for_each_item(place, capsys):
    words = "dataset pairs.toml -n 2 -o pairs --processes 1 --json"
    assert run(words.split()) == 0
    printed = capsys.readouterr()
    data = json.loads(printed.out)
    assert (data["drawn"], data["kept"], data["complete"], data["splits"]) == (2, 0, True, {"train": 2})
    lines = [json.loads(line) for line in printed.err.splitlines() if line.startswith("{")]
    assert [(line["item"], line["state"], line["done"], line["of"]) for line in lines] == [
        (0, "drawn", 1, 2), (1, "drawn", 2, 2),
    ]  # fmt: skip
    assert run(words.split()) == 0
    assert json.loads(capsys.readouterr().out)["kept"] == 2
    assert run([*words.split(), "--seed", "5"]) == 2
    assert "pairs holds a data set of another specification" in capsys.readouterr().err


def test_a_contact_sheet_shows_the_first_items_and_writes_no_data_set(place, capsys):
    assert run(["dataset", "pairs.toml", "--preview", "sheet.png", "-n", "2", "--threads", "1"]) == 0
    with Image.open("sheet.png") as sheet:
        # four pictures a row, each above a title, which is wider than a small picture
        column = sheet.width // 4
        assert column > 64
        assert sheet.size == (4 * column, 2 * (48 + 26))
        pixels = np.asarray(sheet)
    flared, clean = pixels[:48, :64].astype(int), pixels[:48, column : column + 64].astype(int)
    assert (flared - clean).max() > 40
    assert sorted(path.name for path in place.iterdir()) == ["pairs.toml", "sheet.png"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("", "a specification is missing; flarewright dataset --example > pairs.toml writes one"),
        ("pairs.toml", "there is no output; give -o FOLDER"),
        ("pairs.toml -o pairs --preview a.png", "--preview and -o are two outputs"),
        ("none.toml -o pairs", "none.toml does not exist"),
        ("pairs.toml -o pairs.toml", "it is a file; give the name of a folder"),
        ("pairs.toml -o pairs --chunk 3/2", "chunk 3/2 does not exist"),
        ("pairs.toml --preview a.jpg", "must be named *.png"),
        ("pairs.toml --preview a.png -n 99", "a contact sheet has at most 64 items"),
        ("pairs.toml --preview a.png --chunk 1/2", "--chunk has no effect on a contact sheet"),
        ("pairs.toml -o pairs -n 99999999", "99999999 items are not possible"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_no_file(words, sentence, place, capsys):
    assert run(["dataset", *words.split()]) == 2
    err = capsys.readouterr().err
    assert sentence in err
    assert err.startswith("flarewright: error: ")
    assert err.count("\n") == 1
    assert [path.name for path in place.iterdir()] == ["pairs.toml"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("-o pairs --cluster local:x", "'x' is no number of worker processes"),
        ("-o pairs --cluster local:2 --processes 2", "both set the processes; keep one"),
        ("--preview a.png --cluster local", "--cluster has no effect on a contact sheet; leave it out"),
        ("--example --cluster local", "--example only prints a specification; leave SPEC.toml out"),
    ],
)
def test_a_cluster_that_cannot_be_used_is_refused(place, capsys, words, said):
    assert run(["dataset", "pairs.toml", *words.split()]) == 2
    assert said in capsys.readouterr().err
    assert [path.name for path in place.iterdir()] == ["pairs.toml"]
