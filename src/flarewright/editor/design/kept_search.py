"""The state of a search in progress in a file, from which a search of an ended or killed editor resumes."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path

from ... import __version__
from ...design.solvers.pool_search import PoolState
from ...design.solvers.search_state import read_state, write_state
from ...errors import FlarewrightError
from ...io.files.atomic_write import make_folder
from ...io.files.state_folder import state_folder
from ...model import Project

# largest number of searches that are kept, one for each project that was searched when an editor ended
MOST = 8


def kept_search(project: Project) -> Path:
    """Return the file for the search of a project by this version of the program."""
    digest = hashlib.sha256(f"{__version__}\0{project.model_dump_json()}".encode()).hexdigest()
    return state_folder() / "searches" / f"{digest[:16]}.json"


def read_kept(file: Path) -> PoolState | None:
    """Return the search that an ended editor has left; None if there is none that can be read."""
    with suppress(FlarewrightError):
        return read_state(file) if file.exists() else None
    return None


def keep(file: Path, state: PoolState) -> None:
    """Write a search, and delete the oldest of too many.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    make_folder(file.parent)
    write_state(state, file)
    with suppress(OSError):
        known = sorted(file.parent.glob("*.json"), key=lambda one: one.stat().st_mtime_ns)
        for old in known[:-MOST]:
            old.unlink(missing_ok=True)


def drop(file: Path) -> None:
    """Delete a search that has ended."""
    with suppress(OSError):
        file.unlink(missing_ok=True)
