"""`--solver` of the design commands: lenses, comparisons, Ctrl-C, and missing packages."""

import json
import os
import re
import signal
import sys

import pytest

from flarewright.cli.app import run
from flarewright.io.lens.toml_lens import read_lens

PROJECT = """
lens = "triplet-pestrecov"
f_number = 8
[[lights]]
field_deg = [7, 3]
[design]
structure = "lens"
brightness = "stop"
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shot.toml").write_text(PROJECT)
    return tmp_path


def test_solve_with_another_solver_writes_lenses_and_resume_goes_on(folder, capsys):
    pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    words = "design solve shot.toml -o found --solver sade:3x4 --searches 600 --lenses 1 --json"
    assert run(words.split()) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["searches"] >= 600
    assert read_lens(folder / "found" / reported["lenses"][0]["file"])[0].rows
    assert run(["design", "resume", "found", "--searches", "700", "--lenses", "1", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["lenses"][0]["cost"] <= reported["lenses"][0]["cost"] * (1 + 1e-9)


def test_ctrl_c_ends_a_search_and_keeps_the_best(folder, capsys, monkeypatch):
    pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    from flarewright.design.solvers.evolution_log import SearchRecord

    note, calls = SearchRecord.note, []

    def pressed(self, *facts):
        calls.append(self)
        if len(calls) == 8:
            os.kill(os.getpid(), signal.SIGINT)
        return note(self, *facts)

    monkeypatch.setattr(SearchRecord, "note", pressed)
    assert run(["design", "solve", "shot.toml", "-o", "found", "--solver", "pso:3x4", "--lenses", "1", "--json"]) == 0
    assert len(calls) in (8, 9)
    assert json.loads(capsys.readouterr().out)["lenses"]
    calls.clear()
    assert run(["design", "benchmark", "heliar", "--solver", "pso:2x2", "--solver", "sade:2x2", "--time", "60"]) == 0
    reported = capsys.readouterr()
    assert "1 of 2 runs" in reported.err
    assert "sade" not in reported.out


# the package cmaes loads most of SciPy
@pytest.mark.parametrize(
    ("names", "packages", "seconds"),
    [
        (["pools", "sade:2x2"], ["pygmo"], "0.02"),
        pytest.param(["pools", "pso:2x2", "cmaes"], ["pygmo", "cmaes"], "0.2", marks=pytest.mark.slow),
    ],
    ids=["two", "three"],
)
def test_benchmark_compares_solvers(folder, capsys, names, packages, seconds):
    for needed in packages:
        pytest.importorskip(needed, reason=f"the extra evo is not installed: no {needed}")
    words = ["design", "benchmark", "heliar", "--unsigned", "--seeds", "2", "--time", seconds, "--report", "a.html"]
    assert run([*words, *(part for name in names for part in ("--solver", name)), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert [(one["solver"], one["seed"]) for one in reported["runs"]] == [
        (name, seed) for name in names for seed in (0, 1)
    ]
    assert [one["saw"] for one in reported["runs"][::2]] == ["ours", *["algorithm1"] * (len(names) - 1)]
    for one in reported["runs"][2:]:
        # not every step decreases this value: focal length and f-number are part of the cost
        fitness = [point["fitness_algorithm1"] for point in one["trace"]]
        assert fitness[-1] <= fitness[0]
        assert fitness[-1] == pytest.approx(one["fitness_algorithm1"])
    assert [one["figure"] for one in reported["figures"]] == ["6.1", "6.3"]
    assert [one["solver"] for one in reported["figures"][0]["curves"]] == names
    assert reported["figures"][1]["solvers"][1]["psnr_db"] == [one["psnr_db"] for one in reported["runs"][2:4]]
    assert reported["figures"][1]["thesis"]["psnr_db"] == 25.89
    page = (folder / "a.html").read_text()
    assert page.count("<svg") == 4
    assert page.count("data:image/png;base64,") == 1 + len(names)
    # the SVG name space is a name, not a request
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")
    assert all(name in page for name in names)
    assert "nan" not in " ".join(re.findall(r'points="([^"]*)"', page))


@pytest.mark.slow
def test_coatings_and_scratch_are_compared_too(folder, capsys):
    pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    words = ["design", "benchmark", "heliar", "--coatings", "quarter-wave", "--time", "0.05", "--report", "c.html"]
    assert run([*words, "--solver", "ours", "--solver", "sade:2x4", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert [(one["solver"], one["saw"]) for one in reported["runs"]] == [("ours", "ours"), ("sade:2x4", "algorithm2")]
    assert [one["figure"] for one in reported["figures"]] == ["6.8", "6.10"]
    assert reported["figures"][1]["thesis"] == {"psnr_db": 31.82, "ssim": None, "seconds": None}
    assert set(reported["figures"][0]["curves"][0]) == {"solver", "seconds", "fitness_algorithm2"}
    page = (folder / "c.html").read_text()
    assert page.count("data:image/png;base64,") == 3
    assert "figure 6.10" in page
    assert run([*words[:6], "0.05", "--fitness", "ours"]) == 0
    assert "quarter waves, 5.45 degrees" in " ".join(capsys.readouterr().out.split())
    words = ["design", "benchmark", "scratch", "--ghosts", "5", "--unsigned", "--time", "0.05", "--seeds", "2"]
    assert run([*words, "--picture", "s.png", "--report", "s.html", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert [one["seed"] for one in reported["runs"]] == [0, 1]
    assert [one["figure"] for one in reported["figures"]] == ["-", "6.14"]
    assert (folder / "s.html").read_text().count("data:image/png;base64,") == 2


def test_population_sizes_are_figure_6_5(capsys):
    pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    words = ["design", "benchmark", "heliar", "--angle", "13.40", "--time", "0.05", "--json"]
    assert run([*words, "--solver", "pso:2x2", "--solver", "pso:2x4"]) == 0
    assert json.loads(capsys.readouterr().out)["figures"][0]["figure"] == "6.5"


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["solve", "shot.toml", "-o", "x", "--solver", "newton"], "choose from pools, pso"),
        (["solve", "shot.toml", "-o", "x", "--fitness", "best"], "choose ours or algorithm1"),
        (["benchmark", "heliar", "--solver", "pools", "--solver", "pools:2x2"], "pso:15x15"),
        (["benchmark", "heliar", "--fitness", "best"], "choose ours or algorithm1"),
        (["benchmark", "heliar", "--report", "a.pdf"], "must be named"),
        (["benchmark", "heliar", "--coatings", "gold"], "--coatings 'gold' is unknown"),
        (["benchmark", "scratch", "--coatings", "free"], "scratch has no lens"),
        (["benchmark", "heliar", "--coatings", "free", "--fitness", "algorithm1"], "choose ours or algorithm2"),
    ],
)
def test_an_error_is_one_sentence(words, reported, folder, capsys):
    refused(words, reported, folder, capsys)


@pytest.mark.parametrize(("solver", "package"), [("de1220", "pygmo"), ("cmaes", "cmaes")])
def test_a_missing_package_is_one_sentence(solver, package, folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    for words in (["solve", "shot.toml", "-o", "x"], ["benchmark", "canon"]):
        refused([*words, "--solver", solver], f"the solver {solver} needs the package {package}", folder, capsys)


def refused(words, reported, folder, capsys):
    before = sorted(path.name for path in folder.iterdir())
    assert run(["design", *words]) == 2
    error = capsys.readouterr().err
    assert reported in error
    assert error.startswith("flarewright: error: ")
    assert len(error.strip().splitlines()) == 1
    assert sorted(path.name for path in folder.iterdir()) == before
