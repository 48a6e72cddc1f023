"""Temporary files beside their targets, and the removal of those whose process was killed."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import re
import secrets
import sys
from functools import cache
from pathlib import Path


def temporary_beside(target: Path) -> Path:
    """Return a new hidden name in the folder of a target, with its suffix; it names this machine and process."""
    return target.with_name(f"{_start(target)}{os.getpid()}-{secrets.token_hex(4)}.part{target.suffix}")


def remove_abandoned(target: Path) -> None:
    """Delete the temporary files of a target that processes of this machine left when they were killed.

    Files of living processes and of other machines that share the folder stay.

    Parameters
    ----------
    target : Path
        The file that the temporary files were to become; it stays.
    """
    name = re.compile(rf"{re.escape(_start(target))}(\d{{1,9}})-[0-9a-f]{{8}}\.part{re.escape(target.suffix)}")
    with contextlib.suppress(OSError):
        for one in os.listdir(target.parent):
            found = name.fullmatch(one)
            if found is not None and not _lives(int(found[1])):
                target.with_name(one).unlink(missing_ok=True)


def _start(target: Path) -> str:
    return f".{target.stem[:100]}.{_machine()}-"


@cache
def _machine() -> str:
    """Return a digest of what gives process numbers their meaning: the machine and, in a container, its namespace."""
    space = ""
    with contextlib.suppress(OSError):
        space = os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(f"{platform.node()} {space}".encode()).hexdigest()[:8]


def _lives(process: int) -> bool:
    if process == os.getpid():
        return True
    if sys.platform == "win32":
        # there a file that is being written cannot be deleted, and the null signal would end the process
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        # a process of another user
        return True
    return True
