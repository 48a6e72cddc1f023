"""The record in the first line of a lens file, and the index of all records."""

import json
import tomllib
from dataclasses import replace

import pytest

from flarewright.io.lens.own.index import Entry, index_path, read_index, write_index
from flarewright.io.lens.own.record import LensRecord, record_in, with_record

RECORD = LensRecord(
    "planar", 'A "Planar"\x7f', source="US 583,336", maker="Carl Zeiss", efl_mm=51.6, efl_range_mm=(51.6, 51.6),
    f_number=1.4, field_deg=23.0, surfaces=10, file="a\nb.zmx", digest="0" * 64, remarks=("one", "two"),
)  # fmt: skip
LENS = 'schema_version = 1\nname = "Planar"\n'


@pytest.fixture
def library(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path))
    (tmp_path / "library").mkdir()
    return tmp_path / "library"


def test_a_record_is_one_comment_line_of_the_lens_file():
    text = with_record(LENS, RECORD)
    assert tomllib.loads(text) == tomllib.loads(LENS)
    assert text.count("\n") == LENS.count("\n") + 1
    assert record_in(text, "planar") == (RECORD, True)
    # the name is that of the file
    assert record_in(text, "renamed") == (replace(RECORD, name="renamed"), True)


def test_a_lens_edited_by_hand_is_noticed():
    record, current = record_in(with_record(LENS, RECORD).replace('"Planar"', '"Sonnar"'), "planar")
    assert (record, current) == (RECORD, False)


@pytest.mark.parametrize(
    "change", [("{", "["), ('"title"', '"titel"'), ("51.6", '"51.6"'), ("[51.6, 51.6]", "[1e999]")]
)
def test_a_damaged_record_is_none(change):
    assert record_in(with_record(LENS, RECORD).replace(*change), "planar") == (None, False)
    assert record_in(LENS, "planar") == (None, False)


def test_the_index_returns_what_was_written(library):
    entries = {"planar": Entry(120, 5, RECORD)}
    write_index(entries)
    assert read_index() == (entries, "")


@pytest.mark.parametrize("text", ["", "{", "[]", '{"version": 1}', '{"lenses": 3}', "\x00\xff"])
def test_a_damaged_index_is_reported_and_empty(library, text):
    index_path().write_text(text)
    entries, damaged = read_index()
    assert entries == {}
    assert str(index_path()) in damaged
    assert "made again" in damaged


def test_a_broken_entry_does_not_take_the_others_with_it(library):
    write_index({"planar": Entry(120, 5, RECORD), "other": Entry(1, 2, replace(RECORD, name="other"))})
    data = json.loads(index_path().read_text())
    data["lenses"]["other"][2]["efl_mm"] = "long"
    index_path().write_text(json.dumps(data))
    entries, damaged = read_index()
    assert list(entries) == ["planar"]
    assert "1 entries that are no records" in damaged
