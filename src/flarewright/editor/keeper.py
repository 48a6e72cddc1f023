"""Keeps a session's autosave, and keeps other editors away from it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from ..errors import FlarewrightError
from ..io.state_folder import state_folder
from .autosave import Saved, autosave_path, write_autosave
from .jobs import Lane

# editors of one project at once
MOST = 20
# the last autosave may take as long
CLOSE_S = 5.0


class Keeper:
    """Writes an autosave on a thread of its own; the file is its own until it is closed or the process ends.

    Parameters
    ----------
    path : Path
    lock : file or None
        Held open; None where the folder cannot be written.
    number : int
        1 for the first editor of a project, 2 for one beside it, and so on.
    """

    def __init__(self, path: Path, lock: IO[Any] | None = None, number: int = 1) -> None:
        self.path, self.number = path, number
        self._lock = lock
        self._lane = Lane("autosave")

    def keep(self, saved: Saved, failed: Callable[[str], None]) -> None:
        """Write a session soon; `failed` is told why that cannot be done."""
        self._lane.submit(lambda _: self._write(saved, failed))

    def close(self) -> None:
        """Write what was given, and let others have the file."""
        self._lane.wait(CLOSE_S)
        self._lane.close()
        if self._lock is not None:
            self._lock.close()

    def _write(self, saved: Saved, failed: Callable[[str], None]) -> None:
        try:
            write_autosave(self.path, saved)
        except (FlarewrightError, OSError) as error:
            failed(str(error))


def claim(what: str | None) -> Keeper:
    """Take the first autosave of a project that no other editor holds.

    Parameters
    ----------
    what : str or None
        As `autosave_path`.

    Returns
    -------
    Keeper
    """
    for number in range(1, MOST + 1):
        path = autosave_path(what, number)
        try:
            lock = _opened(path)
        except OSError:
            # nothing can be kept here; the first attempt to write tells it
            return Keeper(path)
        if _held(lock):
            return Keeper(path, lock, number)
        lock.close()
    return Keeper(autosave_path(what, os.getpid()))


def claim_last() -> Keeper | None:
    """Take the autosave that was written last, whatever it is of; None where there is none or another editor holds it.

    Returns
    -------
    Keeper or None
    """
    try:
        written = {path: path.stat().st_mtime_ns for path in state_folder().glob("*.autosave.json")}
        last = max(written, key=lambda path: written[path])
        lock = _opened(last)
    except (OSError, ValueError):
        return None
    if _held(lock):
        return Keeper(last, lock)
    lock.close()
    return None


def _opened(path: Path) -> IO[Any]:
    """Open the lock of an autosave."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return path.with_suffix(".lock").open("a+b")


def _held(file: IO[Any]) -> bool:
    """Lock a file for this process, as long as it is open; False when another one has it.

    The system lets go when a process ends, however it ends.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
