"""The design commands: lenses that render, searches that resume, errors in one sentence."""

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from flarewright import __version__
from flarewright.cli.app import run
from flarewright.cli.common import end_as_interrupted, stop_on_interrupt, was_interrupted
from flarewright.design.results import report
from flarewright.design.solvers import pool_search
from flarewright.design.thesis import benchmark as thesis
from flarewright.io.lens.toml_lens import read_lens
from flarewright.io.project.project_file import read_project
from flarewright.io.project.project_text import project_text
from flarewright.model import Lens

PROJECT = """
lens = "heliar-tronnier"
f_number = 16
[[lights]]
field_deg = [7, 3]
[camera]
size_px = [120, 80]
[design]
brightness = "stop"
[[design.ghost_targets]]
ghost = "4-1"
height = 1.001
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shot.toml").write_text(PROJECT)
    return tmp_path


def test_solve_writes_lenses_that_render_and_resume_goes_on(folder, capsys):
    assert run(["design", "solve", "shot.toml", "-o", "found", "--searches", "100", "--lenses", "2", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["lenses"]
    assert reported["searches"] >= 100
    assert {"place_error_mm", "radius_error_mm"} <= set(reported["lenses"][0]["ghosts"][0])
    for lens in reported["lenses"]:
        reading = read_lens(folder / "found" / lens["file"])
        assert isinstance(reading[0], Lens)
        assert (folder / "found" / lens["file"]).with_suffix(".png").stat().st_size > 500
    report = (folder / "found" / "report.html").read_text()
    assert "<script" not in report
    assert "http" not in report
    assert report.count("data:image/png;base64,") >= 3 * len(reported["lenses"])
    assert run(["render", "found/lens-1.toml", "--light", "7,3", "--quality", "draft", "--size", "64x36",
                "--no-png", "-o", "a.exr"]) == 0  # fmt: skip
    capsys.readouterr()
    assert run(["design", "resume", "found", "--searches", "200", "--lenses", "1", "--json"]) == 0
    printed = capsys.readouterr()
    again = json.loads(printed.out)
    assert len(reported["lenses"]) == 2
    assert "lens-2.png, lens-2.toml in found are of an earlier search, and not in this report" in printed.err
    assert again["searches"] > reported["searches"]
    assert again["lenses"][0]["cost"] <= reported["lenses"][0]["cost"] * (1 + 1e-9)


def test_a_design_survives_being_written():
    given = read_project("shot.toml")
    text = project_text(given)
    assert "[[design.ghost_targets]]" in text
    Path("again.toml").write_text(text)
    assert read_project("again.toml").design == given.design


def test_benchmark_prints_the_requested_measures(folder, capsys):
    assert run(["design", "benchmark", "heliar", "--cpu-time", "0.05", "--picture", "a.png", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["runs"]
    assert {"seed", "seconds", "fitness_algorithm1", "fitness", "psnr_db", "ssim", "psnr_black_db", "psnr_gain_db",
            "recovered"} <= set(one)  # fmt: skip
    # a black picture scores 20.0 dB in the thesis' test
    assert one["psnr_black_db"] == pytest.approx(20.0, abs=0.2)
    assert one["psnr_db"] > one["psnr_black_db"]
    assert (folder / "a.png").stat().st_size > 1000
    assert run(["design", "benchmark", "heliar", "--time", "0.02"]) == 0
    assert "25.89 dB" in capsys.readouterr().out


def test_a_killed_benchmark_resumes_after_its_finished_runs(folder, monkeypatch, capsys):
    words = ["design", "benchmark", "heliar", "--cpu-time", "0.02", "--seeds", "2", "--report", "a.html", "--json"]
    done = []
    one = thesis.run_trial

    def noted(*arguments, seed, **options):
        if len(done) == 1:
            done.append("killed")
            raise Killed
        done.append(seed)
        return one(*arguments, seed=seed, **options)

    monkeypatch.setattr(thesis, "run_trial", noted)
    with pytest.raises(Killed):
        run(words)
    capsys.readouterr()
    assert run(words) == 0
    reported = capsys.readouterr()
    assert "a.partial.json: resuming after 1 run of" in reported.err
    assert [each["seed"] for each in json.loads(reported.out)["runs"]] == [0, 1]
    assert done == [0, "killed", 1]
    assert not (folder / "a.partial.json").exists()


def test_identify_finds_the_rank_that_trials_found(capsys):
    words = ["design", "identify", "heliar-tronnier", "--light", "5.45,5.45", "--fstop", "16"]
    assert run([*words, "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert (reported["rank"], reported["unknowns"]) == (17, 23)
    assert len(reported["remedies"]) == 6
    assert reported["rank_with_brightness"] == 23
    assert run([*words, "--brightness", "--stop-known", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert (reported["rank"], reported["unknowns"], reported["free"]) == (22, 22, [])
    assert run(words) == 0
    said = capsys.readouterr().out
    assert "fix 17 of 23" in said
    assert "the brightness of ghosts (bare glass): 23 of 23" in said


def test_scratch_and_colors_write_lenses(folder, plain, short_rounds, capsys):
    words = ["design", "scratch", "--random", "3", "--unsigned", "--searches", "32", "--lenses", "1", "-o", "new"]
    assert run([*words, "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["lenses"][0]["ghosts"]) == 3
    (folder / "red.toml").write_text(PROJECT.replace("height = 1.001", "color = [1.0, 0.2, 0.1]"))
    words = ["design", "colors", "red.toml", "-o", "red-lens.toml", "--starts", "2", "--map", "4-1", "--curves", "3"]
    assert run([*words, "--json"]) == 0
    out, said = capsys.readouterr()
    reported = json.loads(out)
    # row 5 is the stop, rows 1 and 7 are cemented
    assert set(reported["rows"]) == {str(k) for k in range(9)} - {"1", "5", "7"}
    assert "rows left bare, as cemented surfaces take no film: 1, 7" in said
    assert len(reported["ghosts"]) == 13
    lens = read_lens(folder / "red-lens.toml")[0]
    assert lens.rows[0].coating.center_wavelength_nm == reported["rows"]["0"]["center_wavelength_nm"]
    assert (folder / "red-lens.4-1.png").stat().st_size > 1000
    assert (folder / "red-lens.row-3.png").stat().st_size > 1000
    words = [*words[:5], "--starts", "1"]
    assert run([*words, "--films", "3", "--json"]) == 0
    films = json.loads(capsys.readouterr().out)["rows"]["0"]["films"]
    written = read_lens(folder / "red-lens.toml")[0].rows[0].coating
    written = written.layers if len(films) > 1 else (written,)
    assert [one.thickness_nm for one in written] == [one["thickness_nm"] for one in films]
    assert run([*words, "--films", "free"]) == 0
    assert "Algorithm 2" in capsys.readouterr().out


def test_an_unreachable_limit_is_reported_and_the_nearest_are_written(folder, capsys):
    head = 'lens = "triplet-pestrecov"\nf_number = 8\n[[lights]]\nfield_deg = [7, 3]\n'
    (folder / "short.toml").write_text(head + '[design.bounds]\nlength = 3.0\nhard = ["length", "edges"]\n')
    assert run(["design", "solve", "short.toml", "-o", "short", "--searches", "100", "--lenses", "1", "--json"]) == 0
    out, err = capsys.readouterr()
    reported = json.loads(out)
    assert reported["verdict"] == "impossible"
    assert "hard limit length" in err
    assert reported["lenses"][0]["breaks"]["length"] > 0.01
    assert reported["lenses"][0]["ghosts"]
    page = (folder / "short" / "report.html").read_text()
    assert "it breaks length" in page
    assert read_lens(folder / "short" / "lens-1.toml")[0].rows


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["solve", "no.toml", "-o", "x"], "does not exist"),
        (["solve", "shot.toml"], "missing option '-o'"),
        (["solve", "shot.toml", "-o", "shot.toml"], "is a file"),
        (["solve", "shot.toml", "-o", "no/such/\0"], "flarewright"),
        (["solve", "shot.toml", "-o", "x", "--time", "0"], "seconds above 0"),
        (["solve", "shot.toml", "-o", "x", "--time", "nan"], "seconds above 0"),
        (["solve", "shot.toml", "-o", "x", "--seed", "-1"], "'--seed'"),
        (["solve", "shot.toml", "-o", "x", "--lenses", "0"], "'--lenses'"),
        (["solve", "shot.toml", "-o", "x", "--restarts", "0"], "'--restarts'"),
        (["solve", "shot.toml", "-o", "x", "--cluster", "local:2"], "there is one: start with --restarts 8, or omit"),
        (["solve", "shot.toml", "-o", "x", "--processes", "2"], "--processes 2 shares out independent searches"),
        (["solve", "shot.toml", "-o", "x", "--restarts", "2", "--cluster", "farm"], "cluster 'farm' is unknown"),
        (["solve", "axis.toml", "-o", "x"], "light on the axis"),
        (["solve", "wish.toml", "-o", "x"], "place_mm"),
        (["solve", "bounds.toml", "-o", "x"], "design.bounds"),
        (["solve", "hard.toml", "-o", "x"], "no length is given"),
        (["solve", "glass.toml", "-o", "x"], "near names: SCHOTT N-BK7"),
        (["solve", "misspelt.toml", "-o", "x"], "did you mean"),
        (["scratch", "-o", "x"], "--random N"),
        (["scratch", "-o", "x", "--random", "3", "--ghost", "1,1"], "--random N"),
        (["scratch", "-o", "x", "--ghost", "1"], "not two numbers"),
        (["scratch", "-o", "x", "--ghost", "1,0"], "a radius of 0"),
        (["scratch", "-o", "x", "--random", "3", "--stop-diameter", "-1"], "no diameter"),
        (["scratch", "-o", "x", "--random", "20", "--surfaces", "4"], "surfaces ="),
        (["colors", "shot.toml", "-o", "x.exr"], "must be named"),
        (["colors", "shot.toml", "-o", "x.toml", "--films", "gold"], "choose quarter-wave or free"),
        (["colors", "shot.toml", "-o", "x.toml", "--curves", "5"], "--curves 5"),
        (["colors", "shot.toml", "-o", "x.toml", "--solver", "luck"], "there is no solver"),
        (["colors", "shot.toml", "-o", "x.toml", "--fitness", "algorithm1"], "choose ours or algorithm2"),
        (["colors", "shot.toml", "-o", "x.toml", "--time", "0"], "seconds above 0"),
        (["scratch", "-o", "x", "--random", "3", "--solver", "luck"], "there is no solver"),
        (["colors", "shot.toml", "-o", "x.toml", "--judge", "lab"], "choose linear or oklab"),
        (["colors", "shot.toml", "-o", "x.toml", "--map", "9-9"], "is no ghost"),
        (["resume", "nothing"], "design solve has written"),
        (["benchmark", "tessar"], "choose heliar or canon"),
        (["benchmark", "heliar", "--angle", "0"], "above 0"),
        (["benchmark", "heliar", "--unsigned", "--fresnel"], "keep one"),
        (["benchmark", "heliar", "--time", "1", "--cpu-time", "1"], "keep one"),
        (["benchmark", "heliar", "--cpu-time", "nan"], "--cpu-time nan"),
        (["benchmark", "heliar", "--picture", "a.gif"], "must be named"),
        (["identify", "heliar-tronnier"], "missing option '--light'"),
        (["identify", "heliar-tronnier", "--light", "0,0"], "on the axis"),
        (["identify", "heliar-tronnier", "--light", "5,5", "--entrance", "-1"], "no diameter"),
        (["identify", "heliar-tronnier", "--light", "5,5", "--fstop", "1"], "faster than"),
    ],
)
def test_an_error_is_one_sentence(words, reported, folder, capsys):
    head = 'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [7, 3]\n'
    (folder / "axis.toml").write_text(head.replace("7, 3", "0, 0"))
    (folder / "wish.toml").write_text(head + "[[design.ghost_targets]]\nradius_mm = 1.0\n")
    (folder / "bounds.toml").write_text(head + "[design.bounds]\nn_d = [1.9, 1.6]\n")
    (folder / "hard.toml").write_text(head + '[design.bounds]\nhard = ["length"]\n')
    (folder / "glass.toml").write_text(head + '[design]\nglasses = ["N-BK77"]\n')
    (folder / "misspelt.toml").write_text(head + "[design]\nsurface = 4\n")
    before = sorted(path.name for path in folder.iterdir())
    assert run(["design", *words]) == 2
    error = capsys.readouterr().err
    assert reported in error
    assert error.startswith("flarewright: error: ")
    assert "Traceback" not in error
    assert sorted(path.name for path in folder.iterdir()) == before


class Killed(BaseException):
    """Ends a command as a kill does: no code of the program handles it."""


@pytest.fixture
def rounds(short_rounds, monkeypatch):
    """Return a list of callables: the n-th one is called after the n-th round of a search."""
    planned = []
    whole = pool_search._without_stale_runs

    def after_round(state, problem):
        ended = whole(state, problem)
        if planned:
            planned.pop(0)()
        return ended

    monkeypatch.setattr(pool_search, "_without_stale_runs", after_round)
    return planned


def made(folder):
    """Return the bytes of the lenses in a folder, and its search without the time that it took."""
    lenses = {path.name: path.read_bytes() for path in folder.glob("lens-*")}
    return lenses, json.loads((folder / "search.json").read_text()) | {"seconds": 0, "digest": ""}


SEARCH = ["--searches", "100", "--lenses", "1", "--time", "600"]


def nothing():
    """Let a round pass."""


def test_an_ended_and_a_killed_search_resume_to_the_same_lenses(folder, plain, rounds, monkeypatch, capsys):
    assert run(["design", "solve", "shot.toml", "-o", "whole", *SEARCH]) == 0
    whole = made(folder / "whole")
    rounds += [nothing, lambda: signal.raise_signal(signal.SIGTERM)]
    capsys.readouterr()
    assert run(["design", "solve", "shot.toml", "-o", "cut", *SEARCH]) == 0
    assert capsys.readouterr().err.endswith("ended early; to resume: flarewright design resume cut\n")
    assert made(folder / "cut")[1]["searches"] < whole[1]["searches"]
    assert run(["design", "resume", "cut", *SEARCH]) == 0
    assert made(folder / "cut") == whole

    monkeypatch.setattr("flarewright.workflow.kept_work.checkpoints.CHECKPOINT_S", 0.001)
    stored = threading.Event()
    write = report.write_state

    def noted(*arguments):
        write(*arguments)
        stored.set()

    def kill():
        raise Killed

    monkeypatch.setattr(report, "write_state", noted)
    rounds += [nothing, lambda: stored.wait(60.0), nothing, kill]
    with pytest.raises(Killed):
        run(["design", "solve", "shot.toml", "-o", "killed", *SEARCH])
    assert not list((folder / "killed").glob("lens-*"))
    assert run(["design", "resume", "killed", *SEARCH]) == 0
    assert made(folder / "killed") == whole


def test_restarts_in_turn_resume_to_the_same_lenses(folder, plain, rounds, capsys):
    words = ["--restarts", "3", "--processes", "1", *SEARCH]
    assert run(["design", "solve", "shot.toml", "-o", "whole", *words]) == 0
    whole = made(folder / "whole")
    assert (whole[1]["restarts"], whole[1]["runs"]) == (3, [])
    rounds += [*[nothing] * 9, lambda: signal.raise_signal(signal.SIGTERM)]
    capsys.readouterr()
    assert run(["design", "solve", "shot.toml", "-o", "cut", *words]) == 0
    assert "ended early; to resume: flarewright design resume cut\n" in capsys.readouterr().err
    assert made(folder / "cut")[1]["searches"] < whole[1]["searches"]
    assert run(["design", "resume", "cut", "--processes", "1", *SEARCH]) == 0
    assert "2 of 3 searches go on where they were" in capsys.readouterr().err
    assert made(folder / "cut") == whole
    # without its state another search would take over these restarts
    (folder / "cut" / "search.json").unlink()
    assert run(["design", "solve", "shot.toml", "-o", "cut", *words]) == 2
    assert "holds searches of an earlier command; choose another folder" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_a_signal_after_the_work_ends_the_process_without_a_word():
    """As `python -m flarewright`."""
    code = (
        "import atexit, os, runpy, signal, sys\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGTERM))\n"
        "sys.argv = ['flarewright', '--version']\n"
        "runpy.run_module('flarewright', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == -signal.SIGTERM
    assert done.stderr == ""
    assert done.stdout == f"flarewright {__version__}\n"


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_signals_that_end_a_search(name):
    kind = getattr(signal, name)
    before = signal.getsignal(kind)
    with stop_on_interrupt() as asked:
        assert not asked()
        signal.raise_signal(kind)
        assert asked()
    assert signal.getsignal(kind) is before


def test_signals_that_end_a_command(default_signals):
    # as under nohup
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    end_as_interrupted()
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)
    assert was_interrupted()


def test_a_search_from_scratch_resumes_under_its_name(folder, plain):
    words = ["--light", "10,5", "--ghost", "4,1.5", "--lenses", "1"]
    assert run(["design", "scratch", *words, "--searches", "60", "-o", "whole"]) == 0
    assert run(["design", "scratch", *words, "--searches", "1", "-o", "cut"]) == 0
    assert run(["design", "resume", "cut", "--searches", "60", "--lenses", "1"]) == 0
    assert made(folder / "cut") == made(folder / "whole")
