"""`flarewright shot`, and the moments of `flarewright render`."""

from __future__ import annotations

import json

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.io.images.exr import read_exr

PROJECT = """
lens = "triplet-pestrecov"
f_number = 16
[timeline]
start = 1001
[[lights]]
field_deg = [5.0, 5.0]
motion = "smooth"
keyframes = [ { at_s = 0.0, field_deg = [-6.0, 3.0] }, { at_s = 0.25, field_deg = [6.0, 3.0] } ]
[[lights.curves]]
of = "intensity"
at_s = [0.0, 0.25]
values = [1.0, 4.0]
[[curves]]
of = "f_number"
at_s = [0.0, 0.25]
values = [16.0, 22.0]
[camera]
size_px = [64, 36]
[quality]
mode = "draft"
wavelengths = 3
[output]
starburst = false
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.toml").write_text(PROJECT)
    return tmp_path


def test_a_shot_prints_one_object_and_a_line_of_json_for_each_frame(place, capsys):
    words = "shot --project p.toml --frames 1001-1007x3 -o f.$F4.exr --processes 1 --json"
    assert run(words.split()) == 0
    printed = capsys.readouterr()
    data = json.loads(printed.out)
    assert [frame["frame"] for frame in data["frames"]] == [1001, 1004, 1007]
    assert (data["drawn"], data["kept"], data["processes"]) == (3, 0, 1)
    lines = [json.loads(line) for line in printed.err.splitlines() if line.startswith("{")]
    assert [(line["frame"], line["state"], line["done"], line["of"]) for line in lines] == [
        (1001, "drawn", 1, 3), (1004, "drawn", 2, 3), (1007, "drawn", 3, 3),
    ]  # fmt: skip
    assert lines[0]["left_s"] is None
    assert lines[-1]["left_s"] == 0.0
    assert run(words.split()) == 0
    assert json.loads(capsys.readouterr().out)["kept"] == 3


def test_flags_override_the_curves_of_their_values(place):
    flags = ["--intensity", "2", "--fstop", "32", "--fps", "12", "--shutter", "90", "--subframes", "2"]
    assert run(["shot", "--project", "p.toml", "--frames", "1002", "-o", "f.exr", *flags]) == 0
    found = read_exr(place / "f.exr")
    assert '"intensity": 2.0' in found.metadata["lights"]
    assert found.header["aperture"] == pytest.approx(32)
    assert found.header["framesPerSecond"] == 12
    assert found.header["expTime"] == pytest.approx(90 / 360 / 12)


def test_a_lens_alone_is_drawn_as_photographed(place, capsys):
    words = (
        "shot --lens triplet-pestrecov --light 4,2 --size 64x36 --quality draft --frames 1-2 -o f.#.exr --processes 1"
    )
    # the default f-number and iris have a slow starburst
    assert run([*words.split(), "--no-starburst"]) == 0
    said = capsys.readouterr().err
    assert "as photographed" in said
    assert "all frames are alike" in said
    assert "wrote 2 frames" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--frames 1-7 -o f.#.exr", "lie outside the project's 1001-1007"),
        ("--frames 9-1 -o f.#.exr", "write 1-9"),
        ("-o f.exr", "all 7 frames would go to f.exr"),
        ("-o f.#.#.exr", "2 places"),
        ("-o no/f.#.exr", "the folder no does not exist"),
        ("-o f.#.tif", "must be named *.exr"),
        ("--chunk 3/2 -o f.#.exr", "chunk 3/2 does not exist"),
        ("--parts many -o f.#.exr", "choose multi or single"),
        ("--fps 0 -o f.#.exr", "--fps should be greater than or equal to 0.01, not 0"),
        ("--compression foo -o f.#.exr", "--compression should be 'zip' or 'dwaa', not 'foo'"),
        ("--shutter 400 -o f.#.exr", "give 0 to 360"),
    ],
)
def test_bad_input_is_one_sentence(place, capsys, words, said):
    assert run(["shot", "--project", "p.toml", *words.split()]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1


def test_a_frame_does_not_replace_a_file_that_the_shot_reads(place, capsys):
    from flarewright.io.images.exr import write_exr
    from flarewright.model import Layer

    write_exr("plate.1003.exr", [Layer("beauty", np.ones((36, 64, 3), np.float32), (0, 0, 64, 36), {})], (64, 36))
    before = (place / "plate.1003.exr").read_bytes()
    (place / "p.toml").write_text(PROJECT.replace("[quality]", '[holdout]\nimage = "plate.1003.exr"\n[quality]'))
    assert run(["shot", "--project", "p.toml", "-o", "plate.####.exr"]) == 2
    assert "plate.1003.exr would replace an input file" in capsys.readouterr().err
    assert (place / "plate.1003.exr").read_bytes() == before


def test_render_draws_a_frame_or_a_moment_and_says_which(place, capsys):
    plain = ["render", "--project", "p.toml", "--no-png", "-o"]
    assert run([*plain, "a.exr", "--frame", "1004"]) == 0
    assert "frame 1004, 0.125 s (24 frames per second) is drawn\n" in capsys.readouterr().err
    assert run([*plain, "b.exr", "--time", "0.125"]) == 0
    said = capsys.readouterr().err
    assert "the moment 0.125 s is drawn" in said
    assert "rests" not in said
    assert (place / "a.exr").read_bytes() == (place / "b.exr").read_bytes()
    assert "field_deg = [0.0, 3.0]" in read_exr(place / "a.exr").metadata["project"]
    assert run([*plain, "c.exr", "--frame", "1099"]) == 0
    assert "is drawn; everything rests after the last key at 0.25 s\n" in capsys.readouterr().err
    assert run([*plain, "c.exr"]) == 0
    said = capsys.readouterr().err
    assert "one frame is drawn, with the plain values of the project; keys of light 0, f_number are left out" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--frame 1 --time 1", "keep one"),
        ("--frame 1000", "the frame at 0 s is 1001"),
        ("--time -1", "lies outside the time"),
        ("--time nan", "nan"),
    ],
)
def test_a_moment_outside_is_refused(place, capsys, words, said):
    assert run(["render", "--project", "p.toml", "-o", "a.exr", *words.split()]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--cluster local:0", "'0' is no number of worker processes from 1 to 1024"),
        ("--cluster farm", "cluster 'farm' is unknown; write local, local:4, tcp://HOST:PORT or slurm:FILE"),
        ("--cluster local:2 --processes 2", "--processes 2 and --cluster local:2 both set the processes; keep one"),
        ("--cluster tcp://a:1 --processes 2", "--processes has no effect on --cluster tcp://a:1"),
        ("--cluster tcp://a:1 --threads 2", "--threads has no effect on --cluster tcp://a:1"),
        ("--cluster slurm:none.toml", "none.toml does not exist"),
    ],
)
def test_a_cluster_that_cannot_be_used_is_one_sentence(place, capsys, words, said):
    assert run(["shot", "--project", "p.toml", "-o", "f.####.exr", *words.split()]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert [path.name for path in place.iterdir()] == ["p.toml"]


def test_radiances_are_irradiances_times_the_factor_of_the_lens(place, capsys):
    for name, flag in (("e", "--float"), ("l", "--radiance")):
        assert run(f"shot --project p.toml --frames 1001 -o {name}.####.exr --processes 1 {flag}".split()) == 0
    irradiance, radiance = (read_exr(place / f"{name}.1001.exr").layers[0].pixels for name in "el")
    bright = irradiance > 0.1 * irradiance.max()
    # 4 N^2 / (pi T) of a triplet at f/16, which transmits most of the light
    factors = radiance[bright] / irradiance[bright]
    np.testing.assert_allclose(factors, factors.mean(), rtol=2e-3)
    assert 1.0 < factors.mean() / (4 * 16.0**2 / np.pi) < 1.5
