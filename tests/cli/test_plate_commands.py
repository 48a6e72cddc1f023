"""`flarewright sources` and `flarewright shot PLATE` on the command line."""

from __future__ import annotations

import csv
import json

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from flarewright.cli.app import run
from flarewright.cli.render.options.shot import ShotOptions
from flarewright.cli.render.shot_command import _over_plate
from flarewright.io.images.exr import read_exr
from flarewright.plates.settings import PlateSettings

FAST = ["--lens", "heliar-tronnier", "--fstop", "16", "--quality", "draft", "--wavelengths", "1", "--ideal"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    codes = np.full((36, 64, 3), 60, np.uint8)
    codes[8:11, 40:43] = 255
    codes[25:27, 10:20] = (255, 250, 230)
    Image.fromarray(codes).save("photo.png")
    return tmp_path


def test_sources_are_listed_marked_and_written(capsys, folder):
    # what a shot keeps stays
    (folder / "l.sources.npz").write_bytes(b"kept")
    assert run(["sources", "photo.png", "--marked", "m.png", "--csv", "l.csv", "--json"]) == 0
    (folder / "l.sources.npz").unlink()
    out = capsys.readouterr()
    data = json.loads(out.out)
    assert [(row["kind"], round(row["x"], 1), round(row["y"], 1)) for row in data["lights"]] == [
        ("rectangle", 15.0, 26.0), ("point", 41.5, 9.5),
    ]  # fmt: skip
    assert data["sources"] == [2]
    assert "decoded from sRGB" in out.err
    rows = list(csv.DictReader((folder / "l.csv").open()))
    assert [row["light"] for row in rows] == ["2", "1"]
    marked = np.asarray(Image.open(folder / "m.png"))
    assert marked.shape == (36, 64, 3)
    assert (marked == (60, 230, 90)).all(axis=2).sum() > 10
    assert sorted(path.name for path in folder.iterdir()) == ["l.csv", "m.png", "photo.png"]


def test_a_damaged_checkpoint_is_reported_and_the_result_is_the_same(capsys, folder, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(folder / "state"))
    assert run(["sources", "photo.png", "--csv", "l.csv", "--json"]) == 0
    whole = capsys.readouterr()
    (folder / "l.lights.npz").write_bytes(b"PK\3\4")
    assert run(["sources", "photo.png", "--csv", "l.csv", "--json"]) == 0
    again = capsys.readouterr()
    assert again.out == whole.out
    assert again.err == "flarewright: l.lights.npz is damaged; its frames are searched again\n" + whole.err
    assert not (folder / "l.lights.npz").exists()


def test_stops_choose_the_lights(capsys, folder):
    """The flag raised KeyError wherever no project has a plate."""
    thresholds = []
    for stops in ("1", "2"):
        assert run(["sources", "photo.png", "--stops", stops, "--json"]) == 0
        thresholds.append(json.loads(capsys.readouterr().out)["threshold"])
    assert thresholds[1] == pytest.approx(2.0 * thresholds[0])


def test_a_still_gives_a_flare_and_a_comp(capsys, folder):
    words = ["shot", "photo.png", *FAST, "--highlights", "50", "-o", "f.exr", "--over", "c.exr", "--json"]
    assert run(words) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["plate"] == {
        "threshold": pytest.approx(data["plate"]["threshold"]), "size_px": [64, 36], "sources": [2], "lights": 2,
        "area_lights": 1,
    }  # fmt: skip
    assert read_exr("f.exr").size_px == (64, 36)
    # the white of the plate stands for more
    assert read_exr("c.exr").layers[0].pixels[9, 41, 0] > 5.0


@pytest.mark.parametrize(("lens", "said"), [("anamorphic-heliar-2x", False), ("heliar-tronnier", True)])
def test_pixels_of_a_plate_are_those_of_an_anamorphic_lens(folder, lens, said):
    OpenEXR.File({"pixelAspectRatio": 2.0}, {"RGB": np.ones((4, 6, 3), np.float32)}).write("p.exr")
    _, remarks = _over_plate(ShotOptions(plate="p.exr", lens=lens, output="f.exr"), PlateSettings("p.exr"))
    assert any("--squeeze 2 gives the flare such pixels" in remark for remark in remarks) is said


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("--threshold 1 --stops 3", "--threshold and --stops both say which pixels are lights; keep one"),
        ("--white 0.9", "--white is the scale for --source"),
        ("--source sun", "the brightness of a source needs the scale of the plate: give --white"),
        ("--source moon --white 1", "--source 'moon' is no known lamp; write sun, headlight@METRES"),
        ("--source sun --white 1e30", "white paper in the sun has no plate value of 1e+30; give one up to 1000000"),
        ("--threshold 1e30", "the plate has no source above 1e+30; lower --threshold or --stops"),
        ("--plate-transfer log", "--plate-transfer 'log' is unknown; choose srgb, linear, rec709"),
        ("--plate-layer sky", "has no layers"),
        ("--flare-matte none.png", "the matte none.png does not exist"),
        ("--most-lights 0", "0 lights are not possible"),
        ("--intensity 3", "--intensity is for a --light, and none is given; --plate-gain changes"),
        ("--over photo.exr --size 32x32", "of another shape"),
        ("--overscan 10%", "--overscan draws more than the plate shows"),
        ("--crop 50%", "the cropped picture must be the plate, 64x36 pixels; give --crop 64x36 with the --size"),
        ("--crop 64x36", "is all of the plate; add the --size of the whole picture"),
        ("--over f.exr", "f.exr would replace f.exr, which the shot reads or writes; rename it"),
    ],
)
def test_flags_that_do_not_fit_are_refused(capsys, folder, words, sentence):
    assert run(["shot", "photo.png", *FAST, "-o", "f.exr", *words.split()]) == 2
    err = capsys.readouterr().err
    assert sentence in err.splitlines()[-1]
    assert not list(folder.glob("*.exr"))


def test_a_source_brighter_than_a_light_can_be_is_refused(capsys, folder):
    """It ended in a traceback."""
    pixels = np.zeros((36, 64, 3), np.float32)
    pixels[10:12, 20:22] = 1e20
    OpenEXR.File({}, {"RGB": pixels}).write("hot.exr")
    assert run(["shot", "hot.exr", *FAST, "--threshold", "1", "--plate-gain", "1e9", "-o", "f.exr"]) == 2
    assert "a source of the plate is too bright" in capsys.readouterr().err.splitlines()[-1]


def test_a_flag_of_a_plate_without_one_is_refused(capsys, folder):
    assert run(["shot", *FAST, "--light", "5,3", "--frames", "1", "--threshold", "3", "-o", "f.exr"]) == 2
    assert "--threshold is for a plate, and none is given" in capsys.readouterr().err


def test_an_output_never_replaces_the_plate(capsys, folder):
    assert run(["sources", "photo.png", "--marked", "photo.png"]) == 2
    assert "would replace a frame of the plate" in capsys.readouterr().err
    assert run(["sources", "photo.png", "--marked", "m.jpg"]) == 2
    assert run(["sources", "photo.png", "--csv", "none/l.csv"]) == 2
    assert run(["sources", "photo.png", "--csv", "photo.png"]) == 2
    assert np.asarray(Image.open(folder / "photo.png")).shape == (36, 64, 3)
