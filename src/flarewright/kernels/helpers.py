"""Processes that compile beside a command (docs/adr/0007). Nothing here needs Numba, so that they can start at once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

# a helper that takes longer than this is given up, and the command compiles alone
PATIENCE_S = 120.0
# what every command compiles that traces rays, whatever it makes of them; with two cores one helper has it all
TRACING = (("mesh", "nodes"), ("prepass",))
# what is drawn without rings; where rings are drawn too, they alone take the command as long as all else its helper
DRAWING = ("draw", "densities")
# set for helpers, which start none themselves
_MARK = "FLAREWRIGHT_HELPER"
# of the process: those that began before the command knew what it needs
_ahead: list[Helper] = []


@dataclass(frozen=True)
class Helper:
    """A process and the roots that it compiles into the cache on disk."""

    names: tuple[str, ...]
    process: subprocess.Popen[bytes]

    def wait(self) -> None:
        """Wait until it has ended, or for as long as anybody would."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(PATIENCE_S)


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def is_helper() -> bool:
    """Tell whether this process is itself a helper."""
    return _MARK in os.environ


@contextmanager
def helping(shares: Sequence[Sequence[str]]) -> Iterator[list[Helper]]:
    """Start a process a share; none outlives the block.

    Parameters
    ----------
    shares : sequence of sequence of str
        Keys of `first_run.ROOTS`.
    """
    started: list[Helper] = []
    try:
        for share in shares:
            # no program, no memory or no right to start another: the command compiles alone
            with suppress(OSError, ValueError):
                started.append(Helper(tuple(share), start(share)))
        yield started
    finally:
        for helper in started:
            helper.process.kill()
            helper.process.communicate()


@contextmanager
def head_start(rings: bool = False) -> Iterator[None]:
    """Have what every tracing command needs compiled while it still reads its lens, where surely nothing is compiled.

    The command finds out who is at work by `ahead`. That a lens or project is wrong is told no later for it.

    Parameters
    ----------
    rings : bool
        Whether the command, by its words, draws ghosts with rings.
    """
    shares: Sequence[Sequence[str]] = ()
    if cores() > 1 and not is_helper() and _surely_cold():
        shares = [sum(TRACING, DRAWING if rings else ())] if cores() == 2 else TRACING
    with helping(shares) as helpers:
        _ahead[:] = helpers
        try:
            yield
        finally:
            _ahead.clear()


def ahead() -> tuple[Helper, ...]:
    """Return the helpers that have a head start."""
    return tuple(_ahead)


def _surely_cold() -> bool:
    """Tell whether Numba's cache holds no pre-pass of these sources.

    Only the two places are looked at that can be told without Numba, the folder of the user's choice and the one beside
    the sources; elsewhere the command itself finds out, later.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return False
    source = Path(__file__).with_name("prepass.py")
    index = f"prepass.find_box-*.py{sys.version_info.major}{sys.version_info.minor}.nbi"
    try:
        # an index that is older than the sources is of other sources
        written = source.stat().st_mtime
        if chosen := os.environ.get("NUMBA_CACHE_DIR"):
            found = Path(chosen).glob(f"*/{index}")
        elif os.access(source.parent, os.W_OK):
            found = (source.parent / "__pycache__").glob(index)
        else:
            return False
        return all(path.stat().st_mtime < written for path in found)
    except OSError:
        return False


def start(share: Sequence[str]) -> subprocess.Popen[bytes]:
    """Start a process that compiles roots and ends with this one.

    Parameters
    ----------
    share : sequence of str
        Keys of `first_run.ROOTS`.

    Raises
    ------
    OSError
        When no process can be started.
    """
    if getattr(sys, "frozen", False) or not sys.executable:
        raise OSError("there is no interpreter to start")
    # the parent's search path, and never the working folder in its place
    called = f"from {__package__}.first_run import help_out; help_out({list(share)!r})"
    code = f"import sys; sys.path[:] = {sys.path!r}; {called}"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, _MARK: "1"},
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )
