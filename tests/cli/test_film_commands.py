"""`flarewright film`, `shot --movie` and films as plates on the command line."""

from __future__ import annotations

import json
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("av", reason="the extra video: PyAV")

from film_samples import LOSSLESS, lamp, write_sample

from flarewright.cli.app import run
from flarewright.io.films.film_file import open_film

FAST = ["--lens", "heliar-tronnier", "--fstop", "16", "--quality", "draft", "--wavelengths", "1", "--ideal"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_sample(tmp_path / "drive.mp4", frames=3, rate=Fraction(24000, 1001), options=LOSSLESS)
    for k in range(3):
        Image.fromarray(lamp(k)).save(f"p.{k + 1:04d}.png")
    return tmp_path


def test_lights_of_a_film_are_listed_and_marked(capsys, folder):
    assert run(["sources", "drive.mp4", "--threshold", "0.5", "--marked", "m.##.png", "--json"]) == 0
    out = capsys.readouterr()
    data = json.loads(out.out)
    assert (data["frames"], data["sources"], data["size_px"]) == ([1, 2, 3], [1, 1, 1], [64, 36])
    assert [round(row["x"]) for row in data["lights"]] == [8, 9, 10]
    assert "the film has codes of a video camera (BT.709)" in out.err
    assert np.asarray(Image.open("m.03.png")).shape == (36, 64, 3)


def test_a_film_in_and_a_film_out(capsys, folder):
    words = [
        "shot",
        "drive.mp4",
        *FAST,
        "--start",
        "1001",
        "--threshold",
        "0.5",
        "-o",
        "f.####.exr",
        "--processes",
        "1",
    ]
    assert run([*words, "--over", "c.####.exr", "--movie", "c.mp4", "--json"]) == 0
    out = capsys.readouterr()
    data = json.loads(out.out)
    assert [frame["frame"] for frame in data["frames"]] == [1001, 1002, 1003]
    assert data["fps"] == pytest.approx(24000 / 1001)
    assert data["movie"] == {
        "film": "c.mp4", "frames": 3, "fps": "24000/1001", "size_px": [64, 36], "codec": "H.264, 8 bits",
        "view": data["movie"]["view"], "exposure_stops": 0.0,
    }  # fmt: skip
    assert [json.loads(line)["done"] for line in out.err.splitlines() if '"encoded"' in line] == [1, 2, 3]
    assert open_film("c.mp4").fps == Fraction(24000, 1001)
    # what several machines have drawn gives the same film
    assert run(["film", "c.####.exr", "-o", "again.mp4"]) == 0
    assert (folder / "again.mp4").read_bytes() == (folder / "c.mp4").read_bytes()
    assert "wrote again.mp4: 3 frames of 64x36, 23.976 a second, H.264, 8 bits" in capsys.readouterr().err


def test_a_film_has_the_exposure_and_the_view_that_are_asked_for(capsys, folder):
    for stops in ("0", "-1"):
        assert run(["film", "p.####.png", "--exposure", stops, "--fps", "25", "-o", f"f{stops}.mov", "--json"]) == 0
    one, darker = (open_film(f"f{stops}.mov") for stops in ("0", "-1"))
    assert one.fps == darker.fps == 25
    assert one.digest != darker.digest
    assert '"exposure_stops": -1.0' in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("film p.####.png -o drive.mp4", "drive.mp4 exists"),
        ("film p.0001.png -o f.mp4", "p.0001.png is one picture, a film has many; write p.0001.####.png"),
        ("film none.####.png -o f.mp4", "no file is named none.####.png; check the folder"),
        ("film drive.mp4 -o f.mp4", "drive.mp4 is a film already; give the frames of one"),
        ("film p.####.png -o f.avi", "the film f.avi must be named *.mp4 (H.264) or *.mov"),
        ("film p.####.png -o f.mp4 --fps 0", "--fps 0 is no frame rate"),
        # as a fraction with a small denominator it was 0, and a division ended in a traceback
        ("film p.####.png -o f.mp4 --fps 1e-300", "--fps 1e-300 is no frame rate: give a number from 0.01 to 1000"),
        ("film p.####.png -o f.mp4 --view log", "--view 'log' is unknown; choose filmic, srgb, aces"),
        ("film p.####.png -o f.mp4 --layer sky", "has no layers"),
        ("film p.####.png -o f.mp4 --frames 1-9", "lacks frames 4-9; there are 1-3"),
        ("SHOT -o f.####.exr --view srgb", "--view is for the film, and none is made; add --movie FILM.mp4"),
        ("SHOT -o f.####.exr --movie f.mp4 --exposure 200", "--exposure 200 is out of range"),
        ("SHOT -o f.exr --frames 1 --movie f.mp4", "a film is made of numbered frames; write f.####.exr for f.exr"),
        ("SHOT -o f.####.exr --movie drive.mp4", "drive.mp4 exists, and is no film of Flarewright"),
        ("SHOT -o f.####.exr --movie f.mp4 --chunk 1/2", "then: flarewright film f.####.exr -o f.mp4"),
        ("SHOT -o f.####.exr --plate-layer sky", "drive.mp4 has no layers, so there is no 'sky'"),
        ("SHOT -o f.####.exr --frames 7", "the film drive.mp4 lacks frame 7; it has 1-3"),
    ],
)
def test_what_cannot_be_a_film_is_refused(capsys, folder, words, sentence):
    before = sorted(path.name for path in folder.iterdir())
    first, *rest = words.split()
    assert run(["shot", "drive.mp4", *FAST, *rest] if first == "SHOT" else [first, *rest]) == 2
    out = capsys.readouterr()
    assert sentence in out.err.splitlines()[-1]
    assert out.out == ""
    assert sorted(path.name for path in folder.iterdir()) == before
