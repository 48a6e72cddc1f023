"""Helper processes that compile beside a command (docs/adr/0007). No import of Numba, so that they start at once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from .roots import divide_roots, drawing_roots, tracing_roots

# after this time the command stops waiting for a helper and compiles alone
PATIENCE_S = 120.0
# environment variable that marks helpers; a helper starts no helpers
_MARK = "FLAREWRIGHT_HELPER"
# helpers of this process that started before the command knew which roots it needs
_ahead: list[Helper] = []


@dataclass(frozen=True)
class Helper:
    """A helper process and the roots that it compiles into the on-disk cache."""

    names: tuple[str, ...]
    process: subprocess.Popen[bytes]

    def wait(self) -> None:
        """Wait until the process has ended, at most `PATIENCE_S`."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(PATIENCE_S)


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def is_helper() -> bool:
    """Return whether this process is a helper."""
    return _MARK in os.environ


@contextmanager
def helper_processes(shares: Sequence[Sequence[str]]) -> Iterator[list[Helper]]:
    """Start one helper process for each share; end all of them with the block.

    Parameters
    ----------
    shares : sequence of sequence of str
        Keys of `roots.roots`.
    """
    started: list[Helper] = []
    try:
        for share in shares:
            # no interpreter, no memory or no permission to start a process: the command compiles alone
            with suppress(OSError, ValueError):
                started.append(Helper(tuple(share), start(share)))
        yield started
    finally:
        for helper in started:
            helper.process.kill()
            helper.process.communicate()


@contextmanager
def head_start(rings: bool = False) -> Iterator[None]:
    """Start helpers for the roots of every tracing command while the command reads its lens, if the cache is cold.

    `ahead` returns these helpers. An error in a lens or project is reported no later than without them.

    Parameters
    ----------
    rings : bool
        Whether the command's arguments ask for ghosts with rings.
    """
    shares: Sequence[Sequence[str]] = ()
    if cores() > 1 and not is_helper() and _cache_is_cold():
        # with two cores one helper compiles all of them. If the command draws rings, the helper also compiles plain
        # drawing: the root of the rings takes the command as long as all others together take the helper
        more = drawing_roots() if rings and cores() == 2 else []
        shares = divide_roots([*tracing_roots(), *more], 1 if cores() == 2 else 2)
    with helper_processes(shares) as helpers:
        _ahead[:] = helpers
        try:
            yield
        finally:
            _ahead.clear()


def ahead() -> tuple[Helper, ...]:
    """Return the helpers that `head_start` has started."""
    return tuple(_ahead)


def _cache_is_cold() -> bool:
    """Return whether Numba's cache certainly lacks the pre-pass kernel of these sources.

    Search the two folders that are known without importing Numba: NUMBA_CACHE_DIR and the folder beside the sources.
    For any other folder return False; the command checks its cache later.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return False
    source = Path(__file__).parents[1] / "tracing" / "pupil_prepass.py"
    index = f"pupil_prepass.find_box-*.py{sys.version_info.major}{sys.version_info.minor}.nbi"
    try:
        # an index older than the source belongs to an older version
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
    """Start a process that compiles roots and ends when this process ends.

    Parameters
    ----------
    share : sequence of str
        Keys of `roots.roots`.

    Raises
    ------
    OSError
        If no process can be started.
    """
    called = f"from {__package__}.warmup import run_helper; run_helper({list(share)!r})"
    return start_python(called, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def start_python(
    called: str, *, stdout: int | None = None, stderr: int | None = None, environment: Mapping[str, str] | None = None
) -> subprocess.Popen[bytes]:
    """Start an interpreter that runs a statement, with a pipe to its stdin, which ends when this process ends.

    Parameters
    ----------
    called : str
        One or several statements; they can import what this process can.
    stdout, stderr : int, optional
        As of `subprocess.Popen`.
    environment : mapping of str to str, optional
        Added to that of this process.

    Raises
    ------
    OSError
        If no process can be started.
    """
    if getattr(sys, "frozen", False) or not sys.executable:
        raise OSError("no Python interpreter to start a helper process with")
    # use the parent's search path, not the working folder that `-c` adds
    code = f"import sys; sys.path[:] = {sys.path!r}; {called}"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=stdout,
        stderr=stderr,
        env={**os.environ, **(environment or {}), _MARK: "1"},
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )
