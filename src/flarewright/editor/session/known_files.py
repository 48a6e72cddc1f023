"""`KnownFiles`: the project files that a session has opened or saved, and whether other programs changed them since."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from ...errors import FlarewrightError, ProjectError
from ...model import Project
from .files import open_any, save_project, stamp_of


class KnownFiles:
    """Contents and stamps of project files.

    Parameters
    ----------
    stamps : mapping of str to str
        Stamp of each file when last opened or saved.
    """

    def __init__(self, stamps: Mapping[str, str]) -> None:
        self.stamps = dict(stamps)
        # as last read or written here
        self._contents: dict[str, Project] = {}
        # the file and the stamp of the last refused overwrite
        self._refused: tuple[Path, str] | None = None

    def resume(self, file: str, contents: Project | None) -> None:
        """Know the file of a resumed session; without its contents, read them if it is unchanged since its stamp."""
        if file not in self.stamps and (stamp := stamp_of(file)) is not None:
            self.stamps[file] = stamp
        try:
            if contents is None and stamp_of(file) == self.stamps.get(file):
                contents = open_any(file)[0]
        except FlarewrightError:
            return
        if contents is not None:
            self._contents[file] = contents

    def note(self, file: str, contents: Project, stamps: Mapping[str, str]) -> None:
        """Know the contents and the stamp of a file that was opened or saved."""
        self._contents[file] = contents
        self.stamps |= stamps

    def holds(self, file: str | None, project: Project) -> bool:
        """Return whether a file holds a project."""
        return file is not None and self._contents.get(file) == project

    def save(self, project: Project, path: Path, *, own: bool) -> None:
        """Write a project file; `own` says that it is the file of the session.

        Raises
        ------
        FlarewrightError
            When it cannot be written, or would overwrite contents of other programs; a second attempt overwrites them.
        """
        look = partial(self._check_overwrite, path, own)
        there = look()
        try:
            # another program may save meanwhile: check again just before the file is replaced
            stamp = save_project(project, path, look=look, replace=there is not None)
        except FileExistsError:
            look()
            raise ProjectError(
                f"{path.name} is there already and cannot be read, so nothing was written; save under another name"
            ) from None
        self.note(str(path), project, {str(path): stamp})
        self._refused = None

    def _check_overwrite(self, place: Path, own: bool) -> str | None:
        """Refuse once to overwrite contents of other programs; return the stamp of what may be overwritten."""
        there = stamp_of(place)
        if there is None or self._refused == (place, there) or (own and self.stamps.get(str(place), there) == there):
            return there
        self._refused = place, there
        why = "was changed by another program since it was opened or saved here" if own else "is there already"
        raise ProjectError(f"{place.name} {why}; save again to overwrite it, or save under another name")
