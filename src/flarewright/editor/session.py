"""One open project: its history, its view, its file, and its autosave."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import FlarewrightError, ProjectError
from ..model import Project
from . import history as past
from .autosave import Saved, autosave_path, read_autosave
from .corrections import correction
from .deeds import done
from .edit_lens import table_of
from .files import open_any, opened, project_path, sample_project, save_project, stamp_of
from .keeper import Keeper, claim, claim_last
from .view import View
from .words import sentence

Listener = Callable[[dict[str, Any]], None]
# a project, its file, and the file's stamp by its name
Opened = tuple[Project, str | None, dict[str, str]]


class Session:
    """What all tabs share; every change is told to the listeners and saved on the side.

    Parameters
    ----------
    saved : Saved
    keeper : Keeper
        Of the autosave.
    """

    def __init__(self, saved: Saved, keeper: Keeper) -> None:
        self.lock = threading.RLock()
        self.history, self.view = past.filed(saved.history, saved.file), saved.view
        self.revision = 0
        # counts up where another project takes the place of the one before
        self.opened = 0
        self.listeners: list[Listener] = []
        self.keeper = keeper
        # what project files held when they were opened or saved here last, and what was found there instead
        self._stamps = dict(saved.stamps)
        if self.file is not None and self.file not in self._stamps:
            self._stamp(self.file, stamp_of(self.file))
        self._refused: tuple[Path, str] | None = None
        # what project files hold, as far as it was read or written here
        self._held: dict[str, Project] = {}
        if self.file is not None:
            self._hold(self.file, self.project if saved.clean else _held_by(self.file, self._stamps))

    @property
    def clean(self) -> bool:
        """Whether the project file holds the present project."""
        return self.file is not None and self._held.get(self.file) == self.project

    @property
    def file(self) -> str | None:
        """The project file that is edited: that of the present moment, for undo may lead back to another one."""
        return self.history.file

    @property
    def project(self) -> Project:
        """The project as it stands."""
        return self.history.present

    def tell(self, event: dict[str, Any]) -> None:
        """Tell all listeners something."""
        for listener in tuple(self.listeners):
            listener(event)

    def do(self, name: str, values: dict[str, Any], group: str = "", table: str | None = None) -> str:
        """Do something to the project (`deeds.DEEDS`), or refuse it and leave everything as it was.

        `table` is the prescription that a deed on one of its rows was meant for (`edit_lens.table_of`). Returned is
        what became of a number that was not taken as it was typed; a hand that slides, in a group, sees it.
        """
        with self.lock:
            if table is not None and table != table_of(self.project):
                raise ProjectError(
                    "the lens has become another one since this row was shown, so nothing was written; choose the row "
                    "again in the table as it is now"
                )
            project, label = done(self.project, name, values)
            self._move(past.committed(self.history, project, label, group, file=self.file))
            return "" if group else correction(name, values, project)

    def put(self, project: Project, label: str, *, begins: bool = False) -> None:
        """Take a whole project as the next moment; `begins` tells that it is another one."""
        with self.lock:
            self._move(past.committed(self.history, project, label, file=self.file, begins=begins))

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
        """Write the project file and go on with it.

        Raises
        ------
        FlarewrightError
            It cannot be written, or it would overwrite what this session has neither opened nor saved there; then the
            next try does.
        """
        with self.lock:
            path = project_path(text)
            stamp = self._written(path, self._spare(path))
            self.history = past.filed(self.history, str(path))
            self._hold(str(path), self.project)
            self._stamp(str(path), stamp)
            self._refused = None
            self._changed()
            return path

    def _written(self, path: Path, there: str | None) -> str:
        """Write the project file where the file of a stamp lies, and none but that; return the new stamp."""
        try:
            # others may save while this is written: looked at once more when nothing is left but to put it there
            return save_project(self.project, path, look=partial(self._spare, path), replace=there is not None)
        except FileExistsError:
            self._spare(path)
            raise ProjectError(
                f"{path.name} is there already and cannot be read, so nothing was written; save under another name"
            ) from None

    def _spare(self, place: Path) -> str | None:
        """Refuse once to overwrite the work of others; return the stamp of what may be overwritten."""
        there, own = stamp_of(place), str(place) == self.file
        if there is None or self._refused == (place, there) or (own and self._stamps.get(str(place), there) == there):
            return there
        self._refused = place, there
        why = "was changed by another program since it was opened or saved here" if own else "is there already"
        raise ProjectError(f"{place.name} {why}; save again to overwrite it, or save under another name")

    def _stamp(self, file: str, stamp: str | None) -> None:
        if stamp is not None:
            self._stamps[file] = stamp

    def open(self, text: str) -> None:
        """Open another project or lens; undo leads back."""
        with self.lock:
            project, file, stamps = _stamped(opened, text)
            if file is not None:
                self._hold(file, project)
                self._stamps |= stamps
            label = f"Open {Path(text).name}"
            history = past.committed(self.history, project, label, file=file, begins=True)
            if history == self.history:
                # the file is as it was; a picture that it names may have come
                self._changed()
            self._move(history)

    def _hold(self, file: str, project: Project | None) -> None:
        if project is not None:
            self._held[file] = project

    def _move(self, history: past.History) -> None:
        if history is not self.history and history != self.history:
            self.opened += past.beginning(history) is not past.beginning(self.history)
            self.history = history
            self._changed()

    def _changed(self) -> None:
        self.revision += 1
        self._keep_it()
        self.tell({"type": "changed"})

    def _keep_it(self) -> None:
        saved = Saved(self.history, self.view, self.file, self.clean, dict(self._stamps))
        warning = {"type": "message", "kind": "warning"}
        self.keeper.keep(saved, lambda why: self.tell(warning | {"text": f"The autosave failed: {why}"}))


def _held_by(file: str, stamps: dict[str, str]) -> Project | None:
    """Return what a project file holds, where nobody has changed it since; None where that cannot be known."""
    try:
        return open_any(file)[0] if stamp_of(file) == stamps.get(file) else None
    except FlarewrightError:
        return None


def _stamped(read: Callable[[str], tuple[Project, str | None]], text: str) -> Opened:
    """Read a project or a lens; its stamp is from before, so that what others write meanwhile is theirs."""
    before = stamp_of(Path(text.strip()).expanduser())
    project, file = read(text)
    return project, file, {} if file is None or before is None else {file: before}


def begin(what: str | None) -> tuple[Session, str]:
    """Begin a session, or go on with one that was cut off.

    Parameters
    ----------
    what : str or None
        A project file, a lens file or a lens' name; None: what was open last where it was not saved, else what was open
        last without one, or the sample.

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
    if what is None:
        # what was cut off is gone on with, also where it had been begun with a file or a lens
        cut = _cut_off()
        if cut is not None:
            return cut
    given = None if what is None else _stamped(open_any, what)
    key = None if what is None else str(Path(what).resolve()) if Path(what).exists() else what
    keeper = claim(key)
    saved = read_autosave(keeper.path)
    if saved is None and what is None and keeper.number > 1:
        # an editor beside another one begins with what that one shows
        saved = read_autosave(autosave_path(None))
    session, told = _begun(saved, given, keeper)
    if keeper.number > 1:
        told = f"Another editor has this open too; this one keeps an autosave of its own. {told}".strip()
    return session, told


def _cut_off() -> tuple[Session, str] | None:
    """Go on with the session that was open last, where it had not been saved and nobody has it open."""
    keeper = claim_last()
    if keeper is None:
        return None
    saved = read_autosave(keeper.path)
    if saved is not None and not saved.clean:
        return _begun(saved, None, keeper)
    keeper.close()
    return None


def _begun(saved: Saved | None, given: Opened | None, keeper: Keeper) -> tuple[Session, str]:
    if saved is not None and not saved.clean and (given is None or given[0] != saved.history.present):
        told = "Went on where the last session ended; undo leads back." if len(saved.history.moments) > 1 else ""
        return Session(saved, keeper), told
    if given is None and saved is not None and saved.file is not None and Path(saved.file).is_file():
        # what was saved may have been changed by other programs since
        project, file, fresh_stamps = _stamped(open_any, saved.file)
        stamps = saved.stamps | fresh_stamps
        history = past.committed(saved.history, project, "Open", file=file)
        return Session(replace(saved, history=history, stamps=stamps), keeper), ""
    project, file, stamps = (sample_project(), None, {}) if given is None else given
    view = View() if saved is None else saved.view.replace(found_stops=None)
    fresh = Saved(past.begun(project, file=file), view, file, clean=file is not None, stamps=stamps)
    return Session(fresh, keeper), ""
