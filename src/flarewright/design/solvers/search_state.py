"""A search as a file, from which it can be resumed without any difference."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError, ProjectError
from ...io.files.atomic_write import write_text_atomically
from ...io.files.text_file import read_json
from ..problem.prescription import Structure
from ..problem.problem import LensCandidate
from .pool_search import PoolState, Run
from .restart_limit import MOST_RESTARTS

VERSION = 1
# bytes; a search of days has some megabytes
_LARGEST = 256_000_000


def write_state(state: PoolState, path: Path, name: str | None = None) -> None:
    """Write a search with exact numbers, and a digest of them.

    Parameters
    ----------
    state : PoolState
    path : Path
    name : str, optional
        Name of the lenses to be found; None: after the project's lens.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    data = {
        "version": VERSION,
        "seed": state.seed,
        "next_run": state.next_run,
        "searches": state.searches,
        "seconds": state.seconds,
        "ended": [_candidate(one) for one in state.ended],
        "runs": [
            {
                "number": run.number, "stop": run.home.stop, "glass": _glass(run.home), "batches": run.batches,
                "searches": run.searches, "best_at": run.best_at,
                "members": [_candidate(one) for one in run.members],
            }
            for run in state.runs
        ],
    }  # fmt: skip
    if name is not None:
        data["name"] = name
    if state.restarts > 1:
        data["restarts"] = state.restarts
    data["digest"] = _digest(data)
    text = json.dumps(data, allow_nan=False)
    write_text_atomically(path, text)


def read_state(path: Path) -> PoolState:
    """Read the file of `write_state`.

    Raises
    ------
    ProjectError
        When the file is missing or holds no search.
    """
    return read_search(path)[0]


def read_search(path: Path) -> tuple[PoolState, str | None]:
    """Read a search and the name of its lenses, None for that of the project's lens; raises as `read_state`."""
    try:
        data = read_json(path, "a search", _LARGEST)
        if data["version"] != VERSION:
            raise ProjectError(f"{path} was written by another version of Flarewright; restart the search")
        # earlier releases wrote no digest
        if data.get("digest") != _digest(data) and "digest" in data:
            raise ValueError("the digest differs")
        state = PoolState(
            int(data["seed"]), tuple(_run(run) for run in data["runs"]),
            tuple(_read_candidate(one) for one in data["ended"]), int(data["next_run"]), int(data["searches"]),
            float(data["seconds"]), int(data.get("restarts", 1)),
        )  # fmt: skip
        if not 1 <= state.restarts <= MOST_RESTARTS:
            raise ValueError("an impossible number of searches")
        return state, data.get("name")
    except FileError as error:
        if not path.is_file():
            raise ProjectError(
                f"{path} does not exist: give a folder that flarewright design solve has written"
            ) from None
        raise ProjectError(f"{error}; restart it with flarewright design solve") from None
    except ProjectError:
        raise
    except Exception:
        raise ProjectError(f"{path} is damaged or no search; restart it with flarewright design solve") from None


def _digest(data: dict[str, Any]) -> str:
    """Return a digest of everything but the digest itself; JSON restores each number to the last bit."""
    return hashlib.sha256(json.dumps({**data, "digest": ""}, sort_keys=True).encode()).hexdigest()


def _glass(structure: Structure) -> str:
    return "".join("g" if glass else "-" for glass in structure.glass)


def _structure(data: dict[str, Any]) -> Structure:
    return Structure(int(data["stop"]), tuple(letter == "g" for letter in data["glass"]))


def _candidate(one: LensCandidate) -> dict[str, Any]:
    return {"cost": one.cost, "stop": one.structure.stop, "glass": _glass(one.structure), "x": one.x.tolist()}


def _read_candidate(data: dict[str, Any]) -> LensCandidate:
    structure, x = _structure(data), np.array(data["x"], dtype=np.float64)
    if x.shape != (1 + 3 * structure.rows,):
        raise ValueError("the number of variables does not fit the rows")
    return LensCandidate(float(data["cost"]), structure, x)


def _run(data: dict[str, Any]) -> Run:
    members = tuple(_read_candidate(one) for one in data["members"])
    return Run(
        int(data["number"]), _structure(data), members, int(data["batches"]), int(data["searches"]),
        int(data["best_at"]),
    )  # fmt: skip
