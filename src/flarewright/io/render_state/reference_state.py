"""State files of reference renders: NumPy archives, written atomically."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from ..._version import __version__
from ...errors import FileError, ProjectError
from ...model.project.reference_state import ReferenceState
from ..files.atomic_write import write_atomically
from ..files.door import no_file, outside_arrays
from ..project.project_file import project_from_data
from ..project.project_text import project_text

FORMAT = 1
NAMES = {"figures", "paths", "planes", "blocks"}
"""Summed quantities (`render.reference.batches.run_batch`)."""
SUFFIX = ".state.npz"
"""Suffix of a state file, appended to the picture's name."""


def write_reference_state(path: Path, state: ReferenceState) -> None:
    """Write a state atomically.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    about = {
        "format": FORMAT,
        "version": __version__,
        "batches": state.batches,
        "fingerprints": state.fingerprints,
        "project": project_text(state.project),
    }
    arrays: dict[str, Any] = {f"sums.{name}": array for name, array in state.sums.items()}
    arrays |= {f"squares.{name}": array for name, array in state.squares.items()}

    def write(temporary: Path) -> None:
        # a file object keeps NumPy from adding its own suffix
        with temporary.open("wb") as file:
            np.savez(file, about=np.array(json.dumps(about)), **arrays)

    write_atomically(path, write)


def read_reference_state(path: str | Path) -> ReferenceState:
    """Read a state file.

    Raises
    ------
    ProjectError
        When the file is missing, damaged, or of another program version.
    """
    path = Path(path)
    if not path.is_file():
        raise ProjectError(f"--resume {path} {no_file(path)}; give the state file of an earlier reference render")
    try:
        with outside_arrays(path, "a state file of a reference render", "restart without --resume") as archive:
            about = json.loads(str(archive["about"]))
            kinds = {
                kind: {name.removeprefix(kind): archive[name] for name in archive.files if name.startswith(kind)}
                for kind in ("sums.", "squares.")
            }
        version, form = about["version"], about["format"]
        if (version, form) != (__version__, FORMAT):
            raise ProjectError(
                f"--resume {path} was written by version {version} of this program, which draws other random rays; "
                "restart without --resume"
            )
        if any(set(kind) != NAMES for kind in kinds.values()) or not about["batches"] > 0:
            raise ValueError("sums are missing")
        project = project_from_data(tomllib.loads(about["project"]), folder=Path(), where=str(path))
        return ReferenceState(project, about["fingerprints"], about["batches"], kinds["sums."], kinds["squares."])
    except FileError as error:
        raise ProjectError(f"--resume {error}") from error
    except ProjectError:
        raise
    except Exception as error:
        raise ProjectError(
            f"--resume {path} is no state file of a reference render, or it is damaged; restart without --resume"
        ) from error
