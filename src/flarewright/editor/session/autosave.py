"""The autosave: the whole history, written after every change, to resume after a crash."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ...io.files.atomic_write import write_text_atomically
from ...io.files.state_folder import state_folder
from ...io.files.text_file import read_text
from ...model import Project
from .history import History, Moment
from .view_settings import View

VERSION = 1
# bytes
_LARGEST = 64_000_000
# largest number of undo steps on disk
KEPT = 60


@dataclass(frozen=True)
class Saved:
    """Contents of an autosave.

    Attributes
    ----------
    history : History
    view : View
    file : str or None
        The project file of the session.
    clean : bool
        Whether that file holds the present project.
    stamps : dict of str to str
        Contents of project files when they were last opened or saved here (`files.stamp_of`).
    """

    history: History
    view: View
    file: str | None
    clean: bool
    stamps: dict[str, str] = field(default_factory=dict)


def autosave_path(what: str | None, number: int = 1) -> Path:
    """Return the path of the autosave of a project file or a lens; None: of a session without either.

    `number` counts the editors that have it open at the same time.
    """
    name = "session" if what is None else hashlib.sha256(what.encode()).hexdigest()[:16]
    return state_folder() / f"{name}{'' if number == 1 else f'-{number}'}.autosave.json"


def write_autosave(path: Path, saved: Saved) -> None:
    """Write a session atomically, with a digest in the second line.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    first = max(0, saved.history.at - KEPT + 1)
    moments = saved.history.moments[first : first + KEPT]
    data = {
        "version": VERSION, "file": saved.file, "clean": saved.clean, "at": saved.history.at - first,
        "stamps": saved.stamps,
        "view": saved.view.model_dump(mode="json"),
        "moments": [
            {
                "label": m.label, "group": m.group, "file": m.file, "begins": m.begins, "look": m.look,
                "project": m.project.model_dump(mode="json"),
            }
            for m in moments
        ],
    }  # fmt: skip
    text = json.dumps(data, allow_nan=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text_atomically(path, f"{text}\n{_digest(text)}\n")


def read_autosave(path: Path) -> Saved | None:
    """Read the file of `write_autosave`; None if it is missing or unusable."""
    try:
        text, *digests = read_text(path, "an autosave", _LARGEST).splitlines()
        # older autosaves have no digest
        if digests and digests != [_digest(text)]:
            return None
        data: dict[str, Any] = json.loads(text)
        if data["version"] != VERSION:
            return None
        moments = tuple(
            # older autosaves have one file for all steps
            Moment(Project.model_validate(m["project"]), str(m["label"]), str(m["group"]), m.get("file", data["file"]))
            for m in data["moments"]
        )
        moments = tuple(
            replace(one, begins=bool(m.get("begins")), look=bool(m.get("look")))
            for one, m in zip(moments, data["moments"], strict=True)
        )
        at = int(data["at"])
        if not 0 <= at < len(moments):
            return None
        # older autosaves have the path of a background
        view = View.model_validate({key: value for key, value in data["view"].items() if key != "plate"})
        return Saved(History(moments, at), view, data["file"], bool(data["clean"]), dict(data.get("stamps", {})))
    except Exception:
        # a damaged autosave must not prevent the start, whatever its bytes make the readers raise
        return None


def set_aside(path: Path) -> str:
    """Rename an unusable autosave, so that the session does not replace it; return a sentence for the user.

    Parameters
    ----------
    path : Path
        Its `read_autosave` returned None.

    Returns
    -------
    str
        Empty if there is no such file.
    """
    if not path.is_file():
        return ""
    aside = path.with_suffix(".damaged")
    damage = f"The autosave {path} is damaged or of another release; the session starts without it"
    try:
        os.replace(path, aside)
    except OSError:
        return f"{damage}."
    return f"{damage}, and it is kept as {aside.name}."


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
