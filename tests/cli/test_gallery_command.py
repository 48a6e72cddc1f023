"""`flarewright gallery`, `flarewright looks` and `flarewright` without arguments."""

import json

import numpy as np
import pytest
from PIL import Image

from flarewright.cli import gallery as gallery_module
from flarewright.cli.app import run
from flarewright.io.images.thumbnails import thumbnail_path
from flarewright.io.project.look_file import read_look, shipped_looks
from flarewright.render import gallery as pictures
from flarewright.render.gallery import cards

KNOWN = cards()


@pytest.fixture
def two_cards(monkeypatch):
    """Install a library of a fast lens and look; return how often each was drawn."""
    drawn = []

    def picture(card, size_px):
        drawn.append(card.name)
        return np.full((size_px[1], size_px[0], 3), 10 * len(drawn), np.uint8)

    monkeypatch.setattr(pictures, "cards", lambda: (KNOWN[0], KNOWN[-1]))
    monkeypatch.setattr(pictures, "card_picture", picture)
    monkeypatch.setattr("flarewright.render.warmup.compile_for_render", lambda *_: None)
    return drawn


def test_a_gallery_resumes_and_redraws_changes(two_cards, tmp_path, capsys):
    folder = tmp_path / "new" / "gallery"
    assert run(["gallery", "-o", str(folder), "--size", "32x18", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [each["kind"] for each in said["pictures"]] == ["lens", "look"]
    page = (folder / "index.html").read_text("utf-8")
    for card in (KNOWN[0], KNOWN[-1]):
        assert card.title in page
        assert f'src="{card.kind}-{card.name}.png"' in page
    with Image.open(folder / "contact-sheet.png") as sheet:
        # columns are wider than pictures whose titles do not fit
        assert sheet.size == (4 * 320, 18 + 26)
    assert two_cards == [KNOWN[0].name, KNOWN[-1].name]
    (folder / f"lens-{KNOWN[0].name}.png").unlink()
    assert run(["gallery", "-o", str(folder), "--size", "32x18"]) == 0
    assert two_cards == [KNOWN[0].name, KNOWN[-1].name, KNOWN[0].name]
    assert run(["gallery", "-o", str(folder), "--size", "16x9"]) == 0
    assert len(two_cards) == 5
    capsys.readouterr()
    damaged = folder / f"lens-{KNOWN[0].name}.png"
    for data in (b"", damaged.read_bytes()[:-20]):
        damaged.write_bytes(data)
        assert run(["gallery", "-o", str(folder), "--size", "16x9"]) == 0
        assert f"{damaged} is damaged" in capsys.readouterr().err
    assert len(two_cards) == 7
    (folder / "gallery.json").write_text("[")
    assert run(["gallery", "-o", str(folder), "--size", "16x9"]) == 0
    assert len(two_cards) == 9


def test_words_on_the_page_are_escaped():
    from flarewright.io.images.contact_sheet import Figure, sheet_page

    pixels = np.zeros((2, 2, 3), np.uint8)
    page = sheet_page("<b>", [Figure("A & B", "<i>", "x", 'say "y"', "a.png", pixels)])
    assert "<b>" not in page
    assert "<i>" not in page
    assert "A &amp; B" in page


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["gallery"], "-o"),
        (["gallery", "-o", "file.txt"], "cannot write into file.txt: it is a file"),
        (["gallery", "-o", "g", "--size", "x"], "--size 'x' is not two numbers"),
        (["looks", "save", "none.toml", "-o", "a.toml"], "none.toml"),
        (["looks", "save", "shot.toml", "-o", "a.exr"], "must be named *.toml"),
        (["looks", "save", "bare.toml", "-o", "a.toml"], "there is nothing in it for a look"),
    ],
)
def test_errors_are_reported(words, reported, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file.txt").write_text("")
    (tmp_path / "bare.toml").write_text('lens = "tessar-brendel"\n[[lights]]\nfield_deg = [1, 2]\n')
    assert run(words) == 2
    assert reported in capsys.readouterr().err


def test_looks_are_listed_and_saved(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["looks", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["looks"]
    assert [look["name"] for look in said] == list(shipped_looks())
    assert run(["looks"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in shipped_looks())
    (tmp_path / "shot.toml").write_text(
        'lens = "tessar-brendel"\nf_number = 8\ncoating = "modern-broadband"\n[[lights]]\nfield_deg = [1, 2]\n'
        'spectrum = "black-body:3000"\n'
    )
    assert run(["looks", "save", "shot.toml", "-o", "blue-hour.toml", "--notes", "Cool."]) == 0
    look = read_look("blue-hour.toml")
    assert (look.name, look.notes) == ("Blue hour", "Cool.")
    assert set(look.says) == {"f_number", "coating", "lights.spectrum"}
    assert run(["looks", "save", "shot.toml", "-o", "blue-hour.toml"]) == 2
    assert "exists already" in capsys.readouterr().err


def test_the_terminal_shows_a_look_in_half_blocks():
    from flarewright.cli.looks import _picture

    drawn = _picture(KNOWN[-1])
    lines = drawn.plain.split("\n")
    assert len(lines) == 9
    assert set(drawn.plain) == {"▀", "\n"}
    assert len({span.style for span in drawn.spans}) > 20


def test_the_program_alone_lays_out_the_pictures_that_ship(tmp_path, monkeypatch, capsys):
    def start():
        raise AssertionError("a process was started")

    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path))
    # it compiles nothing
    monkeypatch.setattr("flarewright.cli.app.head_start", start)
    # every picture ships; four are laid out here
    assert [card.name for card in KNOWN if not thumbnail_path(card.kind, card.name).is_file()] == []
    some = KNOWN[:: len(KNOWN) // 3]
    assert len(some) == 4
    monkeypatch.setattr(pictures, "cards", lambda: some)
    assert run([]) == 0
    page = tmp_path / "gallery" / "index.html"
    said = capsys.readouterr()
    assert page.as_uri() in said.err
    assert "Usage" in said.out
    assert page.read_text("utf-8").count("<figure>") == 4
    # if they cannot be written, only the help is printed
    monkeypatch.setattr(gallery_module, "shipped_gallery", _full)
    assert run([]) == 0
    assert "pictures of every" not in capsys.readouterr().err


def _full(_folder):
    raise OSError("no space left")


def test_a_damaged_list_of_pictures_is_written_again(two_cards, tmp_path):
    words = ["gallery", "-o", str(tmp_path), "--size", "16x9"]
    assert run(words) == 0
    whole = (tmp_path / "gallery.json").read_text()
    deep = f'"old.png": {"[" * 900}{"]" * 900}'
    for damage in (
        '"old.png": 1e999',
        '"old.png": {"of": 1e999, "sha256": ""}',
        f'"old.png": {deep}',
        '"old.png": "a"',
    ):
        (tmp_path / "gallery.json").write_text(whole.replace("{", f"{{{damage},", 1))
        # the list is written with the next picture
        (tmp_path / f"lens-{KNOWN[0].name}.png").unlink()
        assert run(words) == 0
        again = (tmp_path / "gallery.json").read_text()
        assert "Infinity" not in again
        assert json.loads(again).keys() == json.loads(whole).keys()
