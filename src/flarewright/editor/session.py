"""One open project: its history, its view, its file, and its autosave."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import FlarewrightError, ProjectError
from ..model import Project
from . import history as past
from .autosave import Saved, autosave_path, read_autosave, write_autosave
from .deeds import done
from .edit_lens import sentence
from .files import open_any, sample_project, save_project
from .jobs import Lane
from .view import View

Listener = Callable[[dict[str, Any]], None]


class Session:
    """What all tabs share; every change is told to the listeners and saved on the side.

    Parameters
    ----------
    saved : Saved
    keep : Path
        The autosave.
    """

    def __init__(self, saved: Saved, keep: Path) -> None:
        self.lock = threading.RLock()
        self.history, self.view, self.file = saved.history, saved.view, saved.file
        self.clean = saved.clean
        self.revision = 0
        self.listeners: list[Listener] = []
        self._keep = keep
        self._saver = Lane("autosave")

    @property
    def project(self) -> Project:
        """The project as it stands."""
        return self.history.present

    def tell(self, event: dict[str, Any]) -> None:
        """Tell all listeners something."""
        for listener in tuple(self.listeners):
            listener(event)

    def do(self, name: str, values: dict[str, Any], group: str = "") -> None:
        """Do something to the project (`deeds.DEEDS`), or refuse it and leave everything as it was."""
        with self.lock:
            project, label = done(self.project, name, values)
            self._move(past.committed(self.history, project, label, group))

    def put(self, project: Project, label: str) -> None:
        """Take a whole project as the next moment."""
        with self.lock:
            self._move(past.committed(self.history, project, label))

    def undo(self) -> None:
        """Go back a moment."""
        with self.lock:
            self._move(past.undone(self.history))

    def redo(self) -> None:
        """Go on a moment."""
        with self.lock:
            self._move(past.redone(self.history))

    def set_view(self, values: dict[str, Any]) -> None:
        """Change the view, which no history keeps: it is no part of the picture's files."""
        with self.lock:
            try:
                self.view = self.view.replace(**values)
            except ValidationError as error:
                raise ProjectError(sentence(error)) from None
            self._changed()

    def remember(self, stops: float) -> None:
        """Keep the exposure that was found for the lens; nobody needs to be told."""
        with self.lock:
            self.view = self.view.replace(found_stops=stops)
            self._keep_it()

    def save(self, text: str) -> Path:
        """Write the project file and go on with it."""
        with self.lock:
            path = save_project(self.project, text)
            self.file, self.clean = str(path), True
            self._changed()
            return path

    def open(self, text: str) -> None:
        """Open another project or lens; undo leads back."""
        with self.lock:
            project, file = open_any(text)
            self.history = past.committed(self.history, project, f"Open {Path(text).name}")
            self.file, self.clean = file, file is not None
            self._changed()

    def flush(self, timeout_s: float = 5.0) -> None:
        """Wait until the autosave is written."""
        self._saver.wait(timeout_s)

    def _move(self, history: past.History) -> None:
        if history is not self.history and history != self.history:
            self.history, self.clean = history, False
            self._changed()

    def _changed(self) -> None:
        self.revision += 1
        self._keep_it()
        self.tell({"type": "changed"})

    def _keep_it(self) -> None:
        saved = Saved(self.history, self.view, self.file, self.clean)
        self._saver.submit(lambda _: self._autosave(saved))

    def _autosave(self, saved: Saved) -> None:
        try:
            write_autosave(self._keep, saved)
        except (FlarewrightError, OSError) as error:
            self.tell({"type": "message", "kind": "warning", "text": f"The autosave failed: {error}"})


def begin(what: str | None) -> tuple[Session, str]:
    """Begin a session, or go on with one that was cut off.

    Parameters
    ----------
    what : str or None
        A project file, a lens file or a lens' name; None: what was open last without one, or the sample.

    Returns
    -------
    session : Session
    told : str
        What a person should know about it; may be empty.

    Raises
    ------
    FlarewrightError
        When there is no such project or lens.
    """
    given: tuple[Project, str | None] | None = None if what is None else open_any(what)
    key = None if what is None else str(Path(what).resolve()) if Path(what).exists() else what
    keep = autosave_path(key)
    saved = read_autosave(keep)
    if saved is not None and not saved.clean and (given is None or given[0] != saved.history.present):
        told = "Went on where the last session ended; undo leads back." if len(saved.history.moments) > 1 else ""
        return Session(saved, keep), told
    if given is None and saved is not None and saved.file is not None and Path(saved.file).is_file():
        # what was saved may have been changed by other programs since
        project, file = open_any(saved.file)
        return Session(replace(saved, history=past.committed(saved.history, project, "Open")), keep), ""
    project, file = (sample_project(), None) if given is None else given
    view = View() if saved is None else saved.view.replace(found_stops=None)
    fresh = Saved(past.begun(project), view, file, clean=file is not None)
    return Session(fresh, keep), ""
