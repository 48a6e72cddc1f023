"""The writer of an autosave, with a lock against other editors."""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO, Any

from ...errors import FlarewrightError
from ...io.files.file_lock import held
from ...io.files.state_folder import state_folder
from ...typing import Report
from ..common.latest_job import Lane
from .autosave import Saved, autosave_path, write_autosave

# largest number of editors of one project at the same time
MOST = 20
# time limit of the last autosave, seconds
CLOSE_S = 1.0


class AutosaveWriter:
    """Writes an autosave on a thread; holds its lock until it is closed or the process ends.

    Parameters
    ----------
    path : Path
    lock : file or None
        Open lock file; None if the folder cannot be written.
    number : int
        1 for the first editor of a project, 2 for the next, and so on.
    """

    def __init__(self, path: Path, lock: IO[Any] | None = None, number: int = 1) -> None:
        self.path, self.number = path, number
        self._lock = lock
        self._lane = Lane("autosave")

    def keep(self, saved: Saved, failed: Report) -> None:
        """Write a session soon; call `failed` with the reason if that fails."""
        self._lane.submit(lambda _: self._write(saved, failed))

    def close(self) -> None:
        """Finish writing, and release the lock."""
        self._lane.wait(CLOSE_S)
        self._lane.close()
        if self._lock is not None:
            self._lock.close()

    def _write(self, saved: Saved, failed: Report) -> None:
        try:
            write_autosave(self.path, saved)
        except (FlarewrightError, OSError) as error:
            failed(str(error))


def claim(what: str | None) -> AutosaveWriter:
    """Lock the first autosave of a project that no other editor holds.

    A file system without locks lets every editor have it: else each start would get another autosave, and resume none.

    Parameters
    ----------
    what : str or None
        As in `autosave_path`.
    """
    for number in range(1, MOST + 1):
        path = autosave_path(what, number)
        try:
            lock = _opened(path)
        except OSError:
            # the folder cannot be written; the first write reports it
            return AutosaveWriter(path)
        if held(lock):
            return AutosaveWriter(path, lock, number)
        lock.close()
    return AutosaveWriter(autosave_path(what, os.getpid()))


def claim_last() -> AutosaveWriter | None:
    """Lock the most recent autosave of any project; None if there is none or another editor holds it."""
    try:
        written = {path: path.stat().st_mtime_ns for path in state_folder().glob("*.autosave.json")}
        last = max(written, key=lambda path: written[path])
        lock = _opened(last)
    except (OSError, ValueError):
        return None
    if held(lock):
        return AutosaveWriter(last, lock)
    lock.close()
    return None


def _opened(path: Path) -> IO[Any]:
    """Open the lock file of an autosave."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return path.with_suffix(".lock").open("a+b")
