"""A machine with little memory, or with a full disk: a result or one sentence, never half a file."""

from __future__ import annotations

import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import flarewright

from .answers import ERROR, LONGEST, judged
from .commands import ARGUMENTS
from .hostile_flags import prepared
from .verdict import Verdict

LOST_S = 240.0
# run a command with a limit on the address space, bytes; 0: none, and print the largest at the end
CHILD = """
import atexit, resource, sys
limit = int(sys.argv.pop(1))
if limit:
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
else:
    atexit.register(lambda: print([w for w in open("/proc/self/status") if w.startswith("VmPeak")][0], file=sys.stderr))
from flarewright.cli.app import main
main()
"""
SMALL = (
    ("ghosts", "heliar-tronnier", "--light", "10,5", "--json"),
    ("render", "heliar-tronnier", "--light", "10,5", "--size", "96x54", "--no-png", "-o", "a.exr", "--threads", "1"),
    ("predict", "heliar-tronnier", "--fstop", "16", "--quality", "draft", "--samples", "5", "--json"),
)
# these need gigabytes above what the small ones need
LARGE = (
    ("render", "heliar-tronnier", "--light", "10,5", "--size", "24000x16000", "--quality", "draft", "-o", "a.exr"),
    ("measure", "replay", "model.json", "--constellation", "8", "--size", "24000x16000", "-o", "a.exr"),
)
SPARE = 2**30
# commands that write files soon
WRITING = (
    "render", "lens convert", "looks save", "coating plot", "project init", "scene init", "design solve",
    "design target", "design colors", "design resize", "measure merge", "measure find", "measure replay",
)  # fmt: skip


def memory(seed: int) -> Verdict:
    """Run a command with little memory; a later run without the limit gives the same result.

    Libraries of the interpreter (OpenBLAS, LLVM, the C library) abort the process when they get none. Then no file
    may be there either.
    """
    chance = random.Random(f"memory {seed}")
    large = chance.random() < 0.4
    words = chance.choice(LARGE if large else SMALL)
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        folder = Path(text)
        shutil.copy(prepared() / "model.json", folder)
        most = _needed(SMALL[1])[0] + SPARE if large else _needed(words)[0]
        limit = int(most if large else most * chance.uniform(0.3, 1.0))
        subject = f"{' '.join(words[:2])} within {limit / 2**20:.0f} MB"
        code, out, said = _run(folder, words, limit)
        if "Traceback" in said:
            return Verdict("memory", subject, False, f"a traceback: {said[-300:]}")
        left = [path.name for path in folder.iterdir() if path.name not in ("model.json", "a.exr")]
        whole = (folder / "a.exr").exists()
        if code == 0 and not large:
            held = (out, _picture(folder)) == _needed(words)[1:]
            return Verdict("memory", subject, held, "the same result" if held else "another result")
        if code == 2 or large:
            errors = [line for line in said.splitlines() if line.startswith(ERROR)]
            held = code == 2 and len(errors) == 1 and len(errors[0]) < LONGEST and not (out or whole or left)
            # the cause that it names is the memory
            held = held and "memory" in errors[0]
            return Verdict("memory", subject, held, f"exit code {code}: {said[-300:]}")
        if out or whole:
            return Verdict("memory", subject, False, f"exit code {code}, and a result")
        again = _run(folder, words, 0)
        held = (again[1], _picture(folder)) == _needed(words)[1:]
        return Verdict(
            "memory", subject, held, f"aborted with {code}" + ("" if held else "; another result afterwards")
        )


@cache
def _needed(words: tuple[str, ...]) -> tuple[int, str, bytes]:
    """Return the address space that a command needs, bytes, its output, and its picture."""
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        _run(Path(text), words, 0)
        code, out, said = _run(Path(text), words, 0)
        assert code == 0, said
        (line,) = [line for line in said.splitlines() if line.startswith("VmPeak")]
        return int(line.split()[1]) * 1024, out, _picture(Path(text))


def _picture(folder: Path) -> bytes:
    path = folder / "a.exr"
    return path.read_bytes() if path.exists() else b""


def _run(folder: Path, words: tuple[str, ...], limit: int) -> tuple[int, str, str]:
    environment = {
        **os.environ, "PYTHONPATH": str(Path(flarewright.__file__).parents[1]), "OPENBLAS_NUM_THREADS": "1",
        "NUMBA_NUM_THREADS": "1", "FLAREWRIGHT_HELPER": "1",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(limit), *words], cwd=folder, env=environment, capture_output=True, text=True,
        timeout=LOST_S, check=False, preexec_fn=_no_core,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


def _no_core() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    del soft
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def disk(seed: int) -> Verdict:
    """Run a command in a file system with a few kB left."""
    chance = random.Random(f"disk {seed}")
    command, left = chance.choice(WRITING), chance.choice((0, 0, 1, 4, 16, 64, 256)) * 1024
    subject = f"{command} with {left // 1024} kB left"
    with tempfile.TemporaryDirectory(prefix="trust-") as text, _small_disk(Path(text)) as why:
        if why:
            return Verdict("disk", subject, True, f"skipped: {why}")
        folder = Path(text) / "work"
        shutil.copytree(prepared(), folder)
        _compiled(command)
        _fill(folder, left)
        held, answer = judged((*command.split(), *ARGUMENTS[command]), folder)
        parts = [path.name for path in folder.rglob(".*.part*")]
        if held and parts:
            held, answer = False, f"{parts[0]} is left behind"
    return Verdict("disk", subject, held, answer)


@cache
def _compiled(command: str) -> None:
    """Run a command once, so that compiling does not count."""
    with tempfile.TemporaryDirectory(prefix="trust-") as text:
        folder = Path(text) / "work"
        shutil.copytree(prepared(), folder)
        judged((*command.split(), *ARGUMENTS[command]), folder)


@contextmanager
def _small_disk(place: Path) -> Iterator[str]:
    """Mount a file system of 64 MB in memory; yield why that is impossible here, or nothing."""
    if os.geteuid() != 0:
        yield "mounting needs root"
        return
    tried = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64m", "tmpfs", str(place)], capture_output=True, text=True, check=False
    )
    if tried.returncode:
        yield f"mount: {tried.stderr.strip()[:100]}"
        return
    try:
        yield ""
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def _fill(folder: Path, left: int) -> None:
    """Write a file until only some bytes are left."""
    free = shutil.disk_usage(folder).free
    with (folder.parent / "filler").open("wb") as file:
        file.write(bytes(max(free - left, 0)))
