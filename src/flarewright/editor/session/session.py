"""`Session`: one open project with history, view, file and autosave."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ...errors import ProjectError
from ...io.files.door import expanded
from ...model import Backplate, Project
from ...sentences import INVALID
from ...workflow.plates.plate_files import backplate_picture
from ..commands.lens import table_of
from ..commands.registry import done
from ..common.messages import sentence
from . import history as past
from .autosave import Saved, autosave_path, read_autosave, set_aside
from .autosave_lock import AutosaveWriter, claim, claim_last
from .files import PICTURES, open_any, opened, project_path, sample_project, stamp_of
from .input_notes import correction
from .known_files import KnownFiles
from .reach import Reach
from .view_settings import View

Listener = Callable[[dict[str, Any]], None]
# a project, its file, and the file's stamp by name
Opened = tuple[Project, str | None, dict[str, str]]


class Session:
    """State shared by all tabs; every change is sent to the listeners and saved in the background.

    Parameters
    ----------
    saved : Saved
    writer : AutosaveWriter
        Of the autosave.
    """

    def __init__(self, saved: Saved, writer: AutosaveWriter) -> None:
        self.lock = threading.RLock()
        self.history, self.view = past.filed(saved.history, saved.file), saved.view
        self.revision = 0
        # incremented when another project replaces the present one
        self.opened = 0
        # incremented when another project or look replaces the present one
        self.exposures = 0
        self.listeners: list[Listener] = []
        # files that the page may name
        self.reach = Reach()
        self.writer = writer
        self._known = KnownFiles(saved.stamps)
        if self.file is not None:
            self._known.resume(self.file, self.project if saved.clean else None)

    @property
    def clean(self) -> bool:
        """Whether the project file holds the present project."""
        return self._known.holds(self.file, self.project)

    @property
    def file(self) -> str | None:
        """Project file of the present state; undo may return to that of an earlier project."""
        return self.history.file

    @property
    def project(self) -> Project:
        """The present project."""
        return self.history.present

    def tell(self, event: dict[str, Any]) -> None:
        """Send an event to all listeners."""
        for listener in tuple(self.listeners):
            listener(event)

    def do(self, name: str, values: dict[str, Any], group: str = "", table: str | None = None) -> str:
        """Run a command on the project (`registry.COMMANDS`); on an error nothing changes.

        `table` identifies the prescription for which a command on a row was meant (`lens.table_of`). Returns a sentence
        if a typed number was changed; not for commands in a group, where a slider shows the value.
        """
        with self.lock:
            if table is not None and table != table_of(self.project):
                raise ProjectError(
                    "the lens has changed since this row was shown, so nothing was written; choose the row again in "
                    "the present table"
                )
            self._check_lens(name, values)
            project, label = done(self.project, name, values)
            project = _on_plate(self.project, project)
            self.reach.check_project(project, self.project)
            self._move(past.committed(self.history, project, label, group, file=self.file, look=name == "put_look"))
            return "" if group else correction(name, values, project)

    def put(
        self, project: Project, label: str, *, begins: bool = False, placed: bool = False, look: bool = False
    ) -> None:
        """Add a project to the history.

        Parameters
        ----------
        project : Project
        label : str
        begins : bool
            It is another project, not an edit.
        placed : bool
            So are its lights.
        look : bool
            It is the present project with another look.
        """
        with self.lock:
            if not begins and not placed:
                project = _on_plate(self.project, project)
            self.reach.check_project(project, self.project)
            # another project has no file yet: that of the one before must not be overwritten
            file = None if begins and project != self.project else self.file
            self._move(past.committed(self.history, project, label, file=file, begins=begins, look=look))

    def _check_lens(self, name: str, values: dict[str, Any]) -> None:
        """Check the path of a lens before it is read."""
        if name == "choose_lens" and isinstance(values.get("lens"), str):
            self.reach.check_name(values["lens"])

    def undo(self) -> None:
        """Go one state back."""
        with self.lock:
            self._move(past.undone(self.history))

    def redo(self) -> None:
        """Go one state forward."""
        with self.lock:
            self._move(past.redone(self.history))

    def set_view(self, values: dict[str, Any]) -> None:
        """Change the view, which has no undo, as it is no part of the files."""
        with self.lock:
            try:
                view = self.view.replace(**values)
            except INVALID as error:
                raise ProjectError(sentence(error)) from None
            self.view = view
            self._changed()

    def remember(self, stops: float) -> None:
        """Store the exposure of the lens in the autosave, without an event."""
        with self.lock:
            self.view = self.view.replace(found_stops=stops)
            self._autosave()

    def save(self, text: str) -> Path:
        """Write the project file, which becomes the file of the session.

        Raises
        ------
        FlarewrightError
            When it cannot be written, or would overwrite contents that this session has not opened or saved; a second
            attempt overwrites them.
        """
        with self.lock:
            path = project_path(text)
            self.reach.check(path)
            self._known.save(self.project, path, own=str(path) == self.file)
            self.history = past.filed(self.history, str(path))
            self._changed()
            return path

    def open(self, text: str) -> None:
        """Open another project or lens, or a picture as the plate, as a step of the history."""
        place = expanded(text.strip())
        if place.suffix.lower() in PICTURES:
            self.reach.check(place)
            # a large file is read before the session is locked
            backplate_picture(Backplate(image=str(place.resolve())))
            self.do("set_plate", {"values": {"image": str(place.resolve())}})
            return
        with self.lock:
            self.reach.check_name(text.strip())
            project, file, stamps = _stamped(partial(opened, allowed=self.reach.check_project), text)
            if file is not None:
                self._known.note(file, project, stamps)
            label = f"Open {Path(text).name}"
            history = past.committed(self.history, project, label, file=file, begins=True)
            if history == self.history:
                # the project is unchanged, but a picture that it names may exist now
                self._changed()
            self._move(history)

    def _move(self, history: past.History) -> None:
        if history is not self.history and history != self.history:
            self.opened += past.first_entry(history) is not past.first_entry(self.history)
            self.exposures += past.exposed_entry(history) is not past.exposed_entry(self.history)
            self.history = history
            self._changed()

    def _changed(self) -> None:
        self.revision += 1
        self._autosave()
        self.tell({"type": "changed"})

    def _autosave(self) -> None:
        saved = Saved(self.history, self.view, self.file, self.clean, dict(self._known.stamps))
        warning = {"type": "message", "kind": "warning"}
        self.writer.keep(saved, lambda why: self.tell(warning | {"text": f"The autosave failed: {why}"}))


def _on_plate(before: Project, after: Project) -> Project:
    """Return a changed project whose lights stay where they are in its plate."""
    if not after.lit_by_plate:
        return after
    # imports SciPy, which the editor does not need without a plate
    from ...workflow.plates.found_lights import kept_on_plate

    return kept_on_plate(before, after)


def _stamped(read: Callable[[str], tuple[Project, str | None]], text: str) -> Opened:
    """Read a project or a lens, with its stamp from before, so that later changes by other programs are detected."""
    before = stamp_of(expanded(text.strip()))
    project, file = read(text)
    return project, file, {} if file is None or before is None else {file: before}


def begin(what: str | None) -> tuple[Session, str]:
    """Start a session, or resume an interrupted one.

    Parameters
    ----------
    what : str or None
        A project file, a lens file or a lens' name; None: the last session if it was not saved, else the last session
        without a file, or the sample.

    Returns
    -------
    session : Session
    message : str
        Message for the user; may be empty.

    Raises
    ------
    FlarewrightError
        When there is no such project or lens.
    """
    lost = ""
    if what is None:
        # resume an interrupted session, also if it was started with a file or a lens
        cut, lost = _resume_last()
        if cut is not None:
            return cut
    given = None if what is None else _stamped(open_any, what)
    key = None if what is None else str(Path(what).resolve()) if Path(what).exists() else what
    writer = claim(key)
    saved = read_autosave(writer.path)
    if saved is None:
        lost = set_aside(writer.path) or lost
    if saved is None and what is None and writer.number > 1:
        # a second editor starts with the state of the first
        saved = read_autosave(autosave_path(None))
    session, message = _started(saved, given, writer)
    if writer.number > 1:
        message = f"Another editor has this open too; this one has a separate autosave. {message}".strip()
    return session, f"{lost} {message}".strip()


def _resume_last() -> tuple[tuple[Session, str] | None, str]:
    """Resume the last session if it was not saved and no editor has it open; else return a sentence on its damage."""
    writer = claim_last()
    if writer is None:
        return None, ""
    saved = read_autosave(writer.path)
    if saved is not None and not saved.clean:
        return _started(saved, None, writer), ""
    lost = set_aside(writer.path) if saved is None else ""
    writer.close()
    return None, lost


def _started(saved: Saved | None, given: Opened | None, writer: AutosaveWriter) -> tuple[Session, str]:
    if saved is not None and not saved.clean and (given is None or given[0] != saved.history.present):
        message = "The last session was resumed; undo leads back." if len(saved.history.moments) > 1 else ""
        return Session(saved, writer), message
    if given is None and saved is not None and saved.file is not None and Path(saved.file).is_file():
        # other programs may have changed the file since
        project, file, fresh_stamps = _stamped(open_any, saved.file)
        stamps = saved.stamps | fresh_stamps
        history = past.committed(saved.history, project, "Open", file=file)
        return Session(replace(saved, history=history, stamps=stamps), writer), ""
    project, file, stamps = (sample_project(), None, {}) if given is None else given
    view = View() if saved is None else saved.view.replace(found_stops=None)
    fresh = Saved(past.started(project, file=file), view, file, clean=file is not None, stamps=stamps)
    return Session(fresh, writer), ""
