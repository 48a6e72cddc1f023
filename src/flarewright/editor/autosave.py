"""What survives a crash: the whole history, written after every change."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import FlarewrightError
from ..io.atomic import write_atomically
from ..io.state_folder import state_folder
from ..model import Project
from .history import History, Moment
from .view import View

VERSION = 1
# steps back that are kept on disk
KEPT = 60


@dataclass(frozen=True)
class Saved:
    """What an autosave holds.

    Attributes
    ----------
    history : History
    view : View
    file : str or None
        The project file that is edited.
    clean : bool
        Whether that file holds the present project.
    stamps : dict of str to str
        What project files held when they were opened or saved here last (`files.stamp_of`).
    """

    history: History
    view: View
    file: str | None
    clean: bool
    stamps: dict[str, str] = field(default_factory=dict)


def autosave_path(what: str | None, number: int = 1) -> Path:
    """Return the autosave of a project file or a lens; None: of the session without either.

    `number` counts the editors that have it open at once.
    """
    name = "session" if what is None else hashlib.sha256(what.encode()).hexdigest()[:16]
    return state_folder() / f"{name}{'' if number == 1 else f'-{number}'}.autosave.json"


def write_autosave(path: Path, saved: Saved) -> None:
    """Write a session, whole or not at all.

    Parameters
    ----------
    path : Path
    saved : Saved

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    first = max(0, saved.history.at - KEPT + 1)
    moments = saved.history.moments[first : first + KEPT]
    data = {
        "version": VERSION, "file": saved.file, "clean": saved.clean, "at": saved.history.at - first,
        "stamps": saved.stamps,
        "view": saved.view.model_dump(mode="json"),
        "moments": [
            {
                "label": m.label, "group": m.group, "file": m.file, "begins": m.begins,
                "project": m.project.model_dump(mode="json"),
            }
            for m in moments
        ],
    }  # fmt: skip
    text = json.dumps(data, allow_nan=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda temporary: _write(temporary, text))


def read_autosave(path: Path) -> Saved | None:
    """Read what `write_autosave` wrote; None where there is nothing, or nothing of use."""
    try:
        data: dict[str, Any] = json.loads(path.read_text("utf-8"))
        if data["version"] != VERSION:
            return None
        moments = tuple(
            # what was written before steps knew their file has one for all
            Moment(Project.model_validate(m["project"]), str(m["label"]), str(m["group"]), m.get("file", data["file"]))
            for m in data["moments"]
        )
        moments = tuple(
            replace(one, begins=bool(m.get("begins"))) for one, m in zip(moments, data["moments"], strict=True)
        )
        at = int(data["at"])
        if not 0 <= at < len(moments):
            return None
        view = View.model_validate(data["view"])
        return Saved(History(moments, at), view, data["file"], bool(data["clean"]), dict(data.get("stamps", {})))
    except (OSError, ValueError, KeyError, TypeError, ValidationError, FlarewrightError):
        # a damaged autosave must not keep the editor from starting
        return None


def _write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8")
