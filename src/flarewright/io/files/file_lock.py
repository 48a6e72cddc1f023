"""Locks between processes: the system releases them when a process ends for any reason."""

from __future__ import annotations

import errno
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

# errors of a file system that knows no locks
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
_PAUSE_S = 0.005


def held(file: IO[Any]) -> bool:
    """Lock a file for this process while it is open.

    Parameters
    ----------
    file : file
        Open for writing.

    Returns
    -------
    bool
        False if another process holds it. True on a file system without locks.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno in _NO_LOCKS
    return True


@contextmanager
def locked(path: Path) -> Iterator[IO[bytes]]:
    """Wait until no other process holds a lock file, and hold it during the block.

    Parameters
    ----------
    path : Path
        Created if missing, and kept: deleting it would let two processes hold locks of the same name.

    Yields
    ------
    file
        Open for reading and appending.

    Raises
    ------
    OSError
        The file cannot be created.
    """
    with path.open("a+b") as file:
        while not held(file):
            time.sleep(_PAUSE_S)
        yield file
