"""Files that the page may open and save: those under chosen folders, and those of what was opened at the start."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ...errors import FlarewrightError, ProjectError
from ...io.lens.library import library_name, near_names
from ...io.project.named_files import picture_files
from ...measure.replay.measured_project import is_measured
from ...model import Project
from ...render.scene.resolve import open_lens
from .history import History


@dataclass(frozen=True)
class Reach:
    """What a session may read and write.

    Attributes
    ----------
    roots : tuple of Path or None
        Folders, resolved; None: everything, for sessions without a page.
    files : frozenset of Path
        Single files, resolved.
    """

    roots: tuple[Path, ...] | None = None
    files: frozenset[Path] = frozenset()

    def check(self, path: str | Path) -> None:
        """Check that a file may be used; links count as what they lead to.

        Raises
        ------
        ProjectError
            When it is outside the folders; whether it exists is not reported.
        """
        if self.roots is None:
            return
        try:
            found = Path(path).expanduser().resolve()
        except (OSError, RuntimeError, ValueError):
            raise ProjectError(f"{str(path)!r:.120} is no path of a file") from None
        if found in self.files or any(found.is_relative_to(root) for root in self.roots):
            return
        raise ProjectError(
            f"{Path(path).name!r:.120} is outside the folders of this editor; start it with --root "
            f"{found.parent!s:.120} or put the file into one of them"
        )

    def check_name(self, text: str) -> None:
        """Check a path, or a name of the library, which is always allowed; a misspelt name is reported as one.

        Raises
        ------
        ProjectError
            As `check`; whether a file exists is not reported.
        """
        if _named(text):
            return
        try:
            self.check(text)
        except ProjectError:
            if Path(text).parent != Path() or Path(text).suffix or not text:
                raise
            hint = f" (did you mean {' or '.join(near)}?)" if (near := near_names(text)) else ""
            raise ProjectError(
                f"{text!r:.120} is neither a shipped lens{hint} nor a file in the folders of this editor"
            ) from None

    def check_project(self, project: Project, before: Project | None = None) -> None:
        """Check every file that a project reads and an earlier state of it does not."""
        if self.roots is None:
            return
        fresh = set(files_of(project)) - set(() if before is None else files_of(before))
        for path in sorted(fresh):
            self.check(path)
        if project.lens in fresh and not is_measured(project):
            # a lens file that cannot be read reports this itself
            with suppress(FlarewrightError):
                self.check_project(project.replace(lens=open_lens(project.lens).lens), before)


def reach_of(roots: Iterable[Path], history: History) -> Reach:
    """Return the reach of a page: folders, and what a session has opened before the page can ask for anything.

    Parameters
    ----------
    roots : iterable of Path
    history : History
        The folders of its project files are included, and the files that its projects read.
    """
    beside = {Path(moment.file).parent for moment in history.moments if moment.file is not None}
    known = {path for moment in history.moments for path in files_of(moment.project)}
    return Reach(
        tuple(sorted({path.expanduser().resolve() for path in (*roots, *beside)})),
        frozenset(Path(path).expanduser().resolve() for path in known),
    )


def files_of(project: Project) -> tuple[str, ...]:
    """Return the paths of all files that a project reads: its lens or measured flare, and pictures."""
    lens = (project.lens,) if isinstance(project.lens, str) and not _named(project.lens) else ()
    return (*lens, *picture_files(project))


def _named(text: str) -> bool:
    try:
        return library_name(text) is not None
    except (FlarewrightError, OSError, ValueError, RuntimeError):
        return False
