"""A lens that reproduces a measured flare's ghosts, with a statement of how little that says about the camera."""

import json
from math import radians, tan

import numpy as np

from flarewright.cli.app import run as command
from flarewright.design.problem.ghosts import placed_ghosts
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.model.measurement.ghost_model import AberrationGhost, GhostModel
from flarewright.render.scene.resolve import load_lens

WIDTH_MM, SIZE, LARGEST = 36.0, (720, 480), 12.0
PIXEL = WIDTH_MM / SIZE[0]


def model_of(discs, visible=(0.0, LARGEST)):
    """Return a ghost model of discs: mm along the line per slope of the light, and radius in mm."""
    ghosts = []
    for k, (place, radius) in enumerate(discs):
        numbers = np.zeros(NUMBERS)
        numbers[0], numbers[10], numbers[20] = place * tan(radians(LARGEST)) / PIXEL, radius / PIXEL, 1.0
        channel = channel_of(numbers, 0)
        ghosts.append(AberrationGhost(name=str(k), red=channel, green=channel, blue=channel, visible_deg=visible))
    return GhostModel(
        size_px=SIZE, axis_px=(360.0, 240.0), focal_px=50.0 / PIXEL, largest_deg=LARGEST,
        constellation_deg=(0.0, LARGEST), ghosts=tuple(ghosts),
    )  # fmt: skip


def test_ghosts_of_a_real_lens_are_explained_by_another_one_and_that_is_said(tmp_path, capsys):
    lens = load_lens("tessar-brendel")
    own = sorted(placed_ghosts(lens, f_number=8.0), key=lambda one: abs(one.radius))[:3]
    write_ghost_model(tmp_path / "m.json", model_of([(one.place, abs(one.radius)) for one in own]))
    arguments = ["measure", "explain", str(tmp_path / "m.json"), "--searches", "200", "--lenses", "2", "--time", "30"]
    assert command([*arguments, "-o", str(tmp_path / "out"), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["explained"] == [True] * 3
    # two numbers per ghost determine at most six combinations, fewer than a lens has parameters
    assert reported["numbers"] == 6
    assert reported["rank"] <= 6 < reported["unknowns"]
    assert len(reported["remedies"]) == reported["unknowns"] - reported["rank"]
    text = (tmp_path / "out" / "explanation.txt").read_text()
    assert "explains 3 of 3 measured ghosts" in text
    assert "not the camera's own" in text
    # the written lens has these ghosts in its paraxial list
    found = load_lens(str(tmp_path / "out" / "lens-1.toml"))
    slope = tan(radians(reported["constellation_deg"]))
    made = placed_ghosts(found, entrance=100.0)
    for one in own:
        off = min(max(abs(one.place - other.place) * slope, abs(abs(one.radius) - abs(other.radius))) for other in made)
        assert off < max(0.1 * abs(one.radius), 0.1) + 0.02


def test_what_cannot_be_explained_is_reported_in_a_sentence(tmp_path, capsys):
    def refused(*more):
        assert command(["measure", "explain", *map(str, more), "-o", str(tmp_path / "out")]) == 2
        lines = [line for line in capsys.readouterr().err.splitlines() if "error:" in line]
        assert len(lines) == 1
        return lines[0]

    path = tmp_path / "m.json"
    assert "does not exist" in refused(path)
    write_ghost_model(path, model_of([]))
    assert "no ghosts off the axis" in refused(path)
    write_ghost_model(path, model_of([(10.0, 1.0)]))
    assert "at the middle" in refused(path, "--light", "0")
    assert "nothing was measured at 20 degrees" in refused(path, "--light", "20")
    assert "--sensor-width 0 is no width" in refused(path, "--sensor-width", "0")
    write_ghost_model(path, model_of([(10.0, 1.0)], visible=(1.0, 2.0)))
    assert "no ghost was found there" in refused(path, "--light", "9")
    (tmp_path / "out").write_text("")
    assert "is a file" in refused(path)


def test_the_same_command_continues_a_search_and_other_options_are_refused(tmp_path, capsys):
    path, out = tmp_path / "m.json", tmp_path / "out"
    write_ghost_model(path, model_of([(10.0, 1.0), (-6.0, 0.8), (3.0, 2.5), (-2.0, 0.3), (7.0, 1.7)]))
    words = ["measure", "explain", str(path), "-o", str(out), "--light", "9", "--lenses", "1"]
    assert command([*words, "--searches", "40"]) == 0
    before = json.loads((out / "search.json").read_text())["searches"]
    assert command([*words, "--searches", str(before + 40)]) == 0
    after = json.loads((out / "search.json").read_text())
    assert after["searches"] > before
    assert after["name"] == "From a measured flare"
    capsys.readouterr()
    for other in (["--seed", "3"], ["--most", "1"]):
        assert command([*words, *other]) == 2
        assert "of other options" in capsys.readouterr().err
