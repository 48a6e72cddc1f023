"""Kill every long job at a random moment, resume it, and compare its files with those of an uninterrupted run."""

from __future__ import annotations

import atexit
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

import flarewright
from flarewright.io.lens.library import lens_path, library_names
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.model.measurement.ghost_model import AberrationGhost, GhostModel

from .verdict import Verdict

KIND = "kill"
# run a command with checkpoints every 50 ms, so that a tiny job has some
CHILD = """
import sys
from flarewright.workflow.kept_work import checkpoints
checkpoints.CHECKPOINT_S = 0.05
if sys.argv[1] == "render":
    from flarewright.render.image import partial_picture
    from flarewright.render.reference import estimator
    estimator.SAVE_EVERY_S = partial_picture.CHECKPOINT_S = 0.05
    partial_picture.WRITING = 1.0
if sys.argv[1] == "film":
    from flarewright.workflow.films import assembly
    assembly._PART_FRAMES = 2
from flarewright.cli.app import main
main()
"""
# a run that takes longer hangs, seconds; machines are slow and busy; jobs of `LONG` take minutes
LOST_S, LOST_LONG_S = 240.0, 1800.0
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
move_mm = 2.0
color = [1.0, 0.4, 0.1]
[[design.ghost_targets]]
ghost = "3-1"
move_mm = -3.0
"""
MOVING = """
lens = "heliar-tronnier"
f_number = 16
[[lights]]
field_deg = [0, 4]
keyframes = [ { at_s = 0.0, field_deg = [-8.0, 4.0] }, { at_s = 2.0, field_deg = [8.0, 4.0] } ]
[camera]
size_px = [64, 36]
[quality]
mode = "draft"
"""
PAIRS = """
size_px = [64, 48]
items_per_shard = 5
[lens]
names = ["heliar-tronnier", "triplet-pestrecov"]
[splits]
train = 1
test = 1
"""
SEARCH = ("--searches", "3000", "--lenses", "1", "--time", "600")


@dataclass(frozen=True)
class Trial:
    """A tiny job of one kind.

    Attributes
    ----------
    start : tuple of str
        The command.
    made : tuple of str
        Patterns of the files to compare.
    resume : tuple of str
        The command that resumes; empty: the same.
    sign : str
        File without which there is nothing to resume, so that the start is repeated.
    output : callable or None
        Returns what to compare of stdout.
    prepare : callable
        Puts the inputs into a folder.
    """

    start: tuple[str, ...]
    made: tuple[str, ...]
    resume: tuple[str, ...] = ()
    sign: str = ""
    output: Callable[[str], object] | None = None
    prepare: Callable[[Path], None] = lambda _: None


def _project(folder: Path) -> None:
    (folder / "shot.toml").write_text(PROJECT)


def _plates(folder: Path) -> None:
    """Write six plates with a lamp that moves."""
    for k in range(6):
        pixels = np.full((90, 160, 3), 40, np.uint8)
        pixels[30:36, 20 * k + 10 : 20 * k + 16] = 255
        Image.fromarray(pixels).save(folder / f"plate.{k + 1:04d}.png")


def _model(folder: Path) -> None:
    """Write a measured model of five round ghosts."""
    ghosts = []
    for k, (place_px, radius_px) in enumerate([(40.0, 20.0), (-25.0, 16.0), (12.0, 50.0), (-8.0, 6.0), (28.0, 34.0)]):
        numbers = np.zeros(NUMBERS)
        numbers[0], numbers[10], numbers[20] = place_px, radius_px, 1.0
        channel = channel_of(numbers, 0)
        ghosts.append(AberrationGhost(name=str(k), red=channel, green=channel, blue=channel, visible_deg=(0.0, 12.0)))
    model = GhostModel(
        size_px=(720, 480), axis_px=(360.0, 240.0), focal_px=1000.0, largest_deg=12.0, constellation_deg=(0.0, 12.0),
        ghosts=tuple(ghosts),
    )  # fmt: skip
    write_ghost_model(folder / "model.json", model)


def _lenses(folder: Path) -> None:
    """Write shipped lenses as a user's files."""
    (folder / "lenses").mkdir()
    for name in library_names()[:8]:
        shutil.copy(lens_path(name), folder / "lenses" / f"my-{name}.toml")


@cache
def _photographs() -> Path:
    """Photograph a lens once for all runs."""
    sys.path.append(str(Path(__file__).parents[1] / "measure"))
    from synthetic_camera import Setup, make

    place = Path(tempfile.mkdtemp(prefix="trust-photographs-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return make(Setup(size_px=(120, 80), angles_deg=tuple(4.0 * k for k in range(-1, 4)), drift=0.0), place)


def _captures(folder: Path) -> None:
    # with their times, which a resumed run compares
    shutil.copytree(_photographs(), folder / "photographs", dirs_exist_ok=True)


def _merged_until(*stages: str) -> Callable[[Path], None]:
    """Return what prepares a run whose stages before the killed one are complete."""

    def prepare(folder: Path) -> None:
        _captures(folder)
        for stage in ("merge", *stages):
            place = ("photographs/captures.csv", "-o", "run") if stage == "merge" else ("run",)
            _run(folder, ("measure", stage, *place))

    return prepare


_MEASURED = ("found.json", "model.json", "tracks.json", "compact.json")
TRIALS = {
    "design solve": Trial(
        ("design", "solve", "shot.toml", "-o", "out", *SEARCH), ("out/lens-*", "out/search.json"),
        ("design", "resume", "out", *SEARCH), "out/search.json", prepare=_project,
    ),
    "design resume": Trial(
        ("design", "resume", "out", *SEARCH), ("out/lens-*", "out/search.json"),
        prepare=lambda folder: (
            _project(folder), _run(folder, ("design", "solve", "shot.toml", "-o", "out", "--searches", "1")), None
        )[-1],
    ),
    "design scratch": Trial(
        ("design", "scratch", "--random", "6", "-o", "out", *SEARCH), ("out/lens-*", "out/search.json"),
        ("design", "resume", "out", *SEARCH), "out/search.json",
    ),
    "design colors": Trial(
        ("design", "colors", "shot.toml", "-o", "out.toml", "--starts", "48"), ("out.toml",), prepare=_project
    ),
    # what a seed finds depends on the time that it gets
    "design benchmark": Trial(
        ("design", "benchmark", "heliar", "--cpu-time", "0.2", "--seeds", "4", "--report", "out.html", "--json"), (),
        output=lambda text: [run["seed"] for run in json.loads(text)["runs"]],
    ),
    "design benchmark --json": Trial(
        ("design", "benchmark", "heliar", "--cpu-time", "0.2", "--seeds", "4", "--json"), ("state/partial/*",),
        output=lambda text: [run["seed"] for run in json.loads(text)["runs"]],
    ),
    "measure explain": Trial(
        ("measure", "explain", "model.json", "-o", "out", "--light", "9", *SEARCH),
        ("out/lens-*", "out/search.json", "out/explanation.txt"), prepare=_model,
    ),
    "measure run": Trial(
        ("measure", "run", "photographs/captures.csv", "-o", "run"),
        tuple(f"run/{name}" for name in ("frames/*.exr", "merged.json", *_MEASURED)), prepare=_captures,
    ),
    "measure merge": Trial(
        ("measure", "merge", "photographs/captures.csv", "-o", "run"), ("run/frames/*.exr", "run/merged.json"),
        prepare=_captures,
    ),
    "measure find": Trial(("measure", "find", "run"), ("run/found.json",), prepare=_merged_until()),
    "measure fit": Trial(("measure", "fit", "run"), ("run/model.json",), prepare=_merged_until("find")),
    "measure track": Trial(("measure", "track", "run"), ("run/tracks.json",), prepare=_merged_until("find", "fit")),
    "measure compress": Trial(
        ("measure", "compress", "run"), ("run/compact.json",), prepare=_merged_until("find", "fit", "track")
    ),
    "predict": Trial(
        ("predict", "heliar-tronnier", "--fstop", "16", "--quality", "draft", "--samples", "15", "-o", "out.html",
         "--json"),
        ("out.html",), output=str,
    ),
    "predict --json": Trial(
        ("predict", "heliar-tronnier", "--fstop", "16", "--quality", "draft", "--samples", "9", "--json"),
        ("state/partial/*",), output=str,
    ),
    "ghosts": Trial(
        ("ghosts", "heliar-tronnier", "--light", "8,5", "--orders", "4", "--order4-limit", "1e-4", "--csv"),
        ("state/partial/*",), output=str,
    ),
    "ghosts --glare": Trial(
        ("ghosts", "heliar-tronnier", "--light", "8,5", "--glare", "--scatter", "harvey-shack", "--surface-roughness",
         "2", "--json"),
        ("state/partial/*",), output=str,
    ),
    "ghosts --sweep": Trial(
        ("ghosts", "heliar-tronnier", "--light", "8,5", "--sweep", "field=0:20:2", "--csv"),
        ("state/partial/*",), output=str,
    ),
    "render --quality final": Trial(
        ("render", "canon-28-80", "--light", "10,5", "--light", "-4,3", "--quality", "final", "--size", "480x270",
         "--orders", "4", "--no-png", "-o", "out.exr"),
        ("out.exr", "out.partial/*"),
    ),
    "render --quality reference": Trial(
        ("render", "heliar-tronnier", "--light", "10,5", "--quality", "reference", "--samples", "200000", "--error",
         "0.0001", "--size", "96x64", "--no-png", "-o", "out.exr"),
        ("out.exr",), ("render", "--resume", "out.state.npz", "--samples", "200000", "--error", "0.0001", "--no-png",
                       "-o", "out.exr"), "out.state.npz",
    ),
    "shot": Trial(
        ("shot", "--project", "moving.toml", "--processes", "2", "-o", "out.####.exr"), ("out.*.exr",),
        prepare=lambda folder: (folder / "moving.toml").write_text(MOVING) and None,
    ),
    "library add": Trial(("library", "add", "lenses"), ("state/library/lenses/*",), prepare=_lenses),
    "library thumbnails": Trial(
        ("library", "thumbnails"), ("state/library/thumbnails/*.jpg",),
        prepare=lambda folder: (_lenses(folder), _run(folder, ("library", "add", "lenses")), None)[-1],
    ),
    "sources": Trial(
        ("sources", "plate.####.png", "--csv", "out.csv", "--marked", "out.####.png"), ("out.csv", "out.*.png"),
        prepare=_plates,
    ),
    "sources --json": Trial(
        ("sources", "plate.####.png", "--json"), ("state/partial/*",), output=str, prepare=_plates,
    ),
    "film": Trial(("film", "plate.####.png", "--force", "-o", "out.mp4"), ("out.mp4",), prepare=_plates),
    "dataset": Trial(
        ("dataset", "pairs.toml", "-n", "24", "--processes", "2", "-o", "out"), ("out/*",),
        prepare=lambda folder: (folder / "pairs.toml").write_text(PAIRS) and None,
    ),
    "dataset --preview": Trial(
        ("dataset", "pairs.toml", "-n", "12", "--preview", "out.png"), ("out*",),
        prepare=lambda folder: (folder / "pairs.toml").write_text(PAIRS) and None,
    ),
    "gallery": Trial(("gallery", "-o", "out", "--size", "32x18"), ("out/*.png", "out/index.html")),
    "warm-up": Trial(("warm-up",), ("cache/*/*.nbi",)),
}  # fmt: skip
"""One tiny job for every entry of `flarewright.workflow.long_jobs.JOBS`, by its words; `render` has two."""


# minutes each on a busy machine: the kind `stages` of the rig
LONG = {"measure run", "measure find", "measure fit", "measure track", "measure compress", "gallery", "warm-up"}


def run(seed: int) -> Verdict:
    """Kill the job that the seed chooses, one of the shorter ones."""
    jobs = [name for name in TRIALS if name not in LONG]
    return kill_and_resume(jobs[seed % len(jobs)], seed // len(jobs))


def run_long(seed: int) -> Verdict:
    """Kill the job that the seed chooses, one of the longer ones."""
    jobs = sorted(LONG)
    return kill_and_resume(jobs[seed % len(jobs)], seed // len(jobs))


def kill_and_resume(job: str, seed: int) -> Verdict:
    """Kill a job at a random moment, resume it, and compare it with an uninterrupted run.

    Parameters
    ----------
    job : str
        Key of `TRIALS`.
    seed : int
        Even: SIGKILL; odd: SIGTERM.

    Returns
    -------
    Verdict
    """
    trial, kind = TRIALS[job], (signal.SIGKILL, signal.SIGTERM)[seed % 2]
    wanted, took_s, prepared = _uninterrupted(job)
    moment = random.Random(f"{job} {seed}").uniform(0.0, took_s)
    subject = f"{job}, {kind.name} after {moment:.2f} of {took_s:.2f} s"
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        folder = Path(text)
        shutil.copytree(prepared, folder, dirs_exist_ok=True, copy_function=shutil.copy2)
        killed = _started(folder, trial.start)
        ended = _ended(killed, moment)
        if ended is None:
            killed.send_signal(kind)
            ended = _ended(killed, LOST_S)
        if ended is None:
            killed.kill()
            killed.communicate()
            return Verdict(KIND, subject, False, f"it goes on for {LOST_S:g} s after the signal")
        _, said = ended
        # Python handles no signals while it starts and ends
        if kind is signal.SIGTERM and (killed.returncode not in (0, 130, -kind) or "Traceback" in said):
            return Verdict(KIND, subject, False, f"exit code {killed.returncode}: {said[-300:]}")
        again = trial.resume if trial.sign and (folder / trial.sign).exists() else trial.start
        try:
            code, out, said = _run(folder, again)
        except subprocess.TimeoutExpired:
            return Verdict(KIND, subject, False, "resuming hangs")
        if code:
            return Verdict(KIND, subject, False, f"resuming ends with {code}: {said[-300:]}")
        made = _made(folder, trial, out)
    other = sorted(name for name in wanted.keys() | made.keys() if wanted.get(name) != made.get(name))
    if other:
        return Verdict(KIND, subject, False, f"differs from an uninterrupted run: {', '.join(other)}")
    return Verdict(KIND, subject, True, f"{len(made)} results are the same")


@cache
def _uninterrupted(job: str) -> tuple[dict[str, object], float, Path]:
    """Run a job once without an end; return its files, its time, and a folder with its inputs."""
    trial, place = TRIALS[job], Path(tempfile.mkdtemp(prefix="trust-whole-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    prepared, whole = place / "prepared", place / "whole"
    prepared.mkdir()
    trial.prepare(prepared)
    if job != "warm-up":
        # compile the kernels before the time counts
        shutil.copytree(prepared, whole, copy_function=shutil.copy2)
        _run(whole, trial.start)
        shutil.rmtree(whole)
    shutil.copytree(prepared, whole, copy_function=shutil.copy2)
    started = time.monotonic()
    code, out, said = _run(whole, trial.start)
    assert code == 0, said
    took_s = time.monotonic() - started
    return _made(whole, trial, out), took_s, prepared


def _made(folder: Path, trial: Trial, out: str) -> dict[str, object]:
    """Return what a run has made: the contents of its files, and what counts of its output."""
    paths = [path for pattern in trial.made for path in folder.glob(pattern)]
    files: dict[str, object] = {str(path.relative_to(folder)): _lasting(path) for path in paths}
    return files if trial.output is None else files | {"stdout": trial.output(out)}


def _lasting(path: Path) -> bytes:
    """Return the bytes of a file that do not differ between runs."""
    if path.name == "search.json":
        return json.dumps(json.loads(path.read_text()) | {"seconds": 0, "digest": ""}).encode()
    # the number of a signature's file depends on the order of compilation
    return b"" if path.suffix == ".nbi" else path.read_bytes()


def _run(folder: Path, words: tuple[str, ...]) -> tuple[int, str, str]:
    process = _started(folder, words)
    patience_s = LOST_LONG_S if {words[0], " ".join(words[:2])} & LONG else LOST_S
    ended = _ended(process, patience_s)
    if ended is None:
        process.kill()
        process.communicate()
        raise subprocess.TimeoutExpired(words, patience_s)
    return process.returncode, *ended


def _started(folder: Path, words: tuple[str, ...]) -> subprocess.Popen[str]:
    # the same sources from another folder
    environment = {**os.environ, "PYTHONPATH": str(Path(flarewright.__file__).parents[1])}
    environment["FLAREWRIGHT_STATE"] = str(folder / "state")
    if words == ("warm-up",):
        environment["NUMBA_CACHE_DIR"] = str(folder / "cache")
    return subprocess.Popen(
        [sys.executable, "-c", CHILD, *words], cwd=folder, env=environment, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def _ended(process: subprocess.Popen[str], seconds: float) -> tuple[str, str] | None:
    """Wait for a process; return its output, or None if it still runs."""
    try:
        return process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        return None
