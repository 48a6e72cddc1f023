"""Damage a cache of the program: the next run reports it in a sentence and computes the same result."""

from __future__ import annotations

import atexit
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import flarewright
from flarewright.editor.session import session as sessions

from .verdict import Verdict

KIND = "cache"
LOST_S = 240.0
GHOSTS = ("ghosts", "heliar-tronnier", "--light", "10,0", "--brightest", "2")
PREDICT = (
    "predict", "heliar-tronnier", "--fstop", "16", "--quality", "draft", "--samples", "5", "--json", "--cache", "c.npz"
)  # fmt: skip


def emptied(data: bytes, _: random.Random) -> bytes:
    """Return nothing."""
    return b""


def cut(data: bytes, chance: random.Random) -> bytes:
    """Return the first part."""
    return data[: chance.randrange(len(data))]


def flipped(data: bytes, chance: random.Random) -> bytes:
    """Return the data with one other bit."""
    changed = bytearray(data)
    changed[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(changed)


DAMAGE = (emptied, cut, flipped)


def run(seed: int) -> Verdict:
    """Damage one file of one cache, or fill its disk, and run again.

    Parameters
    ----------
    seed : int

    Returns
    -------
    Verdict
    """
    kinds = (_kernels, _pictures, _autosave, _full_disk)
    return kinds[seed % len(kinds)](random.Random(f"cache {seed}"))


def _kernels(chance: random.Random) -> Verdict:
    """Damage a file of a compiled kernel."""
    place, out, _ = _whole(GHOSTS)
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        folder = Path(text) / "run"
        shutil.copytree(place, folder, copy_function=shutil.copy2)
        file = chance.choice(sorted((folder / "cache").rglob("*.nb[ic]")))
        how = chance.choice(DAMAGE)
        subject = f"{file.name} {how.__name__}"
        file.write_bytes(how(file.read_bytes(), chance))
        return _judged(subject, _run(folder, GHOSTS), out, [str(file)])


def _pictures(chance: random.Random) -> Verdict:
    """Damage the pictures of a prediction."""
    place, out, data = _whole(PREDICT)
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        folder = Path(text) / "run"
        shutil.copytree(place, folder, copy_function=shutil.copy2)
        how = chance.choice(DAMAGE)
        (folder / "c.npz").write_bytes(how(data, chance))
        # a bit of a date or of an unused field of the archive changes no picture
        named = [] if how is flipped else ["c.npz is damaged"]
        return _judged(f"c.npz {how.__name__}", _run(folder, PREDICT), out, named)


def _full_disk(chance: random.Random) -> Verdict:
    """Let no file grow beyond a few kB, as on a full disk or with a quota."""
    words, kept = chance.choice([(GHOSTS, "cache"), (PREDICT, "c.npz")])
    _, out, _ = _whole(words)
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        folder = Path(text) / "run"
        folder.mkdir()
        size = chance.choice([0, 100, 1000])

        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        return _judged(f"{words[0]}, files of {size} bytes at most", _run(folder, words, limit), out, [kept])


def _autosave(chance: random.Random) -> Verdict:
    """Damage the autosave of an editor's session."""
    how, before = chance.choice(DAMAGE), os.environ.get("FLAREWRIGHT_STATE")
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        os.environ["FLAREWRIGHT_STATE"] = text
        try:
            session, _ = sessions.begin(None)
            session.do("move_light", {"light": 0, "x": 3.0, "y": 2.0})
            session.writer.close()
            path = session.writer.path
            damaged = how(path.read_bytes(), chance)
            path.write_bytes(damaged)
            again, reported = sessions.begin(None)
            again.writer.close()
        finally:
            os.environ.pop("FLAREWRIGHT_STATE") if before is None else os.environ.update(FLAREWRIGHT_STATE=before)
        if again.project == session.project:
            return Verdict(KIND, f"autosave {how.__name__}", True, "nothing was lost")
        held = str(path) in reported and path.with_suffix(".damaged").read_bytes() == damaged
        return Verdict(KIND, f"autosave {how.__name__}", held, reported or "nothing was reported")


def _judged(subject: str, ended: subprocess.CompletedProcess[str], out: str, named: list[str]) -> Verdict:
    """Judge a run: it succeeds, its result is the same, and one line names each path."""
    said = ended.stderr
    if ended.returncode or "Traceback" in said:
        return Verdict(KIND, subject, False, f"exit code {ended.returncode}: {said[-300:]}")
    if ended.stdout != out:
        return Verdict(KIND, subject, False, "another result")
    for name in named:
        lines = [line for line in said.splitlines() if name in line]
        if len(lines) != 1:
            return Verdict(KIND, subject, False, f"{len(lines)} lines name {name}: {said[-300:]}")
    return Verdict(KIND, subject, True, "the same result")


@cache
def _whole(words: tuple[str, ...]) -> tuple[Path, str, bytes]:
    """Run a command with an empty cache; return its folder, its output, and the pictures that it keeps."""
    place = Path(tempfile.mkdtemp(prefix="trust-cache-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    ended = _run(place, words)
    assert ended.returncode == 0, ended.stderr
    return place, ended.stdout, (place / "c.npz").read_bytes() if words is PREDICT else b""


def _run(
    folder: Path, words: tuple[str, ...], limit: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(Path(flarewright.__file__).parents[1])}
    if words is GHOSTS:
        environment["NUMBA_CACHE_DIR"] = str(folder / "cache")
    return subprocess.run(
        [sys.executable, "-m", "flarewright", *words], cwd=folder, env=environment, capture_output=True, text=True,
        timeout=LOST_S, check=False, preexec_fn=limit,
    )  # fmt: skip
