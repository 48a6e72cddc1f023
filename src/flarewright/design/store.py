"""A search on disk, so that it can go on later as if it had not been cut off."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ProjectError
from ..io.atomic import write_atomically
from .prescription import Structure
from .problem import Candidate
from .search import Run, State

VERSION = 1


def write_state(state: State, path: Path) -> None:
    """Write a search, every number exactly.

    Parameters
    ----------
    state : State
    path : Path

    Raises
    ------
    OutputError
        The file cannot be written.
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
    text = json.dumps(data, allow_nan=False)
    write_atomically(path, lambda temporary: _write(temporary, text))


def read_state(path: Path) -> State:
    """Read what `write_state` wrote.

    Parameters
    ----------
    path : Path

    Returns
    -------
    State

    Raises
    ------
    ProjectError
        When the file is missing or is no search.
    """
    try:
        data = json.loads(path.read_text("utf-8"))
        if data["version"] != VERSION:
            raise ProjectError(f"{path} was written by another version of Flarewright; begin the search anew")
        return State(
            int(data["seed"]), tuple(_run(run) for run in data["runs"]),
            tuple(_read_candidate(one) for one in data["ended"]), int(data["next_run"]), int(data["searches"]),
            float(data["seconds"]),
        )  # fmt: skip
    except OSError as error:
        raise ProjectError(
            f"{path} cannot be read ({(error.strerror or str(error)).lower()}): "
            "give a folder that flarewright design solve has written"
        ) from None
    except (ValueError, KeyError, TypeError, IndexError):
        raise ProjectError(f"{path} is damaged or no search; begin it anew with flarewright design solve") from None


def _glass(structure: Structure) -> str:
    return "".join("g" if glass else "-" for glass in structure.glass)


def _structure(data: dict[str, Any]) -> Structure:
    return Structure(int(data["stop"]), tuple(letter == "g" for letter in data["glass"]))


def _candidate(one: Candidate) -> dict[str, Any]:
    return {"cost": one.cost, "stop": one.structure.stop, "glass": _glass(one.structure), "x": one.x.tolist()}


def _read_candidate(data: dict[str, Any]) -> Candidate:
    structure, x = _structure(data), np.array(data["x"], dtype=np.float64)
    if x.shape != (1 + 3 * structure.rows,):
        raise ValueError("the number of variables does not fit the rows")
    return Candidate(float(data["cost"]), structure, x)


def _run(data: dict[str, Any]) -> Run:
    members = tuple(_read_candidate(one) for one in data["members"])
    return Run(
        int(data["number"]), _structure(data), members, int(data["batches"]), int(data["searches"]),
        int(data["best_at"]),
    )  # fmt: skip


def _write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8")
