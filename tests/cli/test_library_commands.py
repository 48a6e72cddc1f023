"""The commands of the user's library, as a user types them."""

import json

import pytest

from flarewright.cli.app import run
from flarewright.cli.library.tables import print_records
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.lens.own.record import LensRecord
from flarewright.render.scene.resolve import open_lens


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    (tmp_path / "my").mkdir()
    for name in ("biotar-50-f1.4", "triplet-pestrecov"):
        write_lens(open_lens(name).lens, tmp_path / "my" / f"old {name}.toml")
    (tmp_path / "my" / "broken.lens").write_text("surfaces:\n")
    return tmp_path


def answer(capsys, words, code=0):
    assert run(words.split()) == code
    said = capsys.readouterr()
    return json.loads(said.out) if "--json" in words else said.out, said.err


def test_a_lens_is_added_found_used_by_name_and_removed(folder, capsys):
    added, _ = answer(capsys, "library add my --json")
    assert [one["name"] for one in added["added"]] == ["old-biotar-50-f1.4", "old-triplet-pestrecov"]
    assert "broken.lens" in added["refused"][0]["reason"]
    found, _ = answer(capsys, "library search zeiss --focal 45-55 --fstop -2 --json")
    assert {one["name"]: one["shipped"] for one in found["lenses"]} == {
        "biotar-50-f1.4": True, "old-biotar-50-f1.4": False,
    }  # fmt: skip
    found, _ = answer(capsys, "library search --own --patent 1786916 --json")
    assert [one["name"] for one in found["lenses"]] == ["old-biotar-50-f1.4"]
    # as a shipped one
    mine, _ = answer(capsys, "lens show Old_Biotar-50-f1.4 --json")
    shipped, _ = answer(capsys, "lens show biotar-50-f1.4 --json")
    assert mine["rows"] == shipped["rows"]
    listed, _ = answer(capsys, "lenses --json")
    assert [one["name"] for one in listed["own_lenses"]] == ["old-biotar-50-f1.4", "old-triplet-pestrecov"]
    project, _ = answer(capsys, "project init old-biotar-50-f1.4")
    assert 'lens = "old-biotar-50-f1.4"' in project
    known, _ = answer(capsys, "library show old-biotar-50-f1.4 --json")
    assert known["file"].endswith("old biotar-50-f1.4.toml")
    assert known["maker"] == "Carl Zeiss"
    _, err = answer(capsys, "library remove old-biotar-50-f1.4")
    assert "removed old-biotar-50-f1.4" in err
    _, err = answer(capsys, "lens show old-biotar-50-f1.4", 2)
    assert "is neither a shipped lens nor a file: did you mean biotar-50-f1.4" in err


def test_tables_for_people_name_every_lens(folder, capsys):
    _, err = answer(capsys, "library list")
    assert "your library is empty; fill it with flarewright library add FOLDER" in err
    out, err = answer(capsys, "library add my")
    assert out.startswith("old-biotar-50-f1.4: Biotar 50 mm f/1.4, my/old biotar-50-f1.4.toml")
    assert "flarewright: refused: my/broken.lens: the table" in err
    assert "2 lenses added; 1 refused" in err
    for words in ("library list", "library search pestrecov", "lenses"):
        assert "old-triplet-pestrecov" in answer(capsys, words)[0]
    assert "triplet-pestrecov *" in answer(capsys, "library search pestrecov")[0]
    assert "sha256: " in answer(capsys, "library show old-triplet-pestrecov")[0]
    assert "no lens matches" in answer(capsys, "library search summicron")[1]


def test_a_long_name_leaves_the_numbers_whole(capsys):
    record = LensRecord(
        name="panasonic-leica-dg-vario-elmar-100-400mm-f4.0-6.3-asph", title="Vario-Elmar", maker="Konica Minolta",
        patent="US 2018/0284478", efl_mm=103.0, efl_range_mm=(103.0, 388.0), f_number=4.13, field_deg=6.0, surfaces=41,
    )  # fmt: skip
    print_records([record])
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if record.name in line)
    expected = (record.name, "103.0-388.0", "4.13", "6.0", "41", record.maker, record.patent, record.title)
    assert tuple(cell.strip() for cell in row.strip("\u2502").split("\u2502")) == expected


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("library add my/broken.lens", 'broken.lens: the table behind "surfaces:" is empty'),
        ("library add empty", "there are no lens files: check the folder"),
        ("library add nowhere", "nowhere does not exist"),
        ("library add my --name one", "--name gives one lens its name, and my holds 3 files"),
        ("library search --focal long", "--focal 'long' is no range"),
        ("library show heliar-tronnier", "heliar-tronnier is a shipped lens; your lenses are in"),
        ("library remove old", "your library has no lens 'old'"),
        ("library thumbnails old", "your library has no lens 'old'"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(folder, capsys, words, sentence):
    (folder / "empty").mkdir()
    _, err = answer(capsys, words, 2)
    errors = [line for line in err.splitlines() if line.startswith("flarewright: error:")]
    assert len(errors) == 1
    assert sentence in errors[0]


def test_thumbnails_are_drawn_once_and_again_after_a_change(folder, capsys):
    answer(capsys, "library add my")
    assert "1 rendered" in answer(capsys, "library thumbnails old-triplet-pestrecov")[1]
    assert "1 rendered" in answer(capsys, "library thumbnails")[1]
    assert "0 rendered" in answer(capsys, "library thumbnails")[1]
    path = folder / "state" / "library" / "lenses" / "old-triplet-pestrecov.toml"
    path.write_text(path.read_text())
    assert "1 rendered" in answer(capsys, "library thumbnails")[1]
