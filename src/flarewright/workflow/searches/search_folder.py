"""Search lenses into a folder: the search is stored while it runs, its lenses and report at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import FlarewrightError, OutputError
from ...io.files.atomic_write import make_folder
from ...io.files.file_lock import held
from ...typing import Report
from ..kept_work.checkpoints import checkpoints
from .lens_search import LensSearch, search_lenses

if TYPE_CHECKING:
    from ...design.solvers.genes import Measure
    from ...design.solvers.pool_search import Observer, PoolState
    from ...design.solvers.solvers import Choice
    from ...model import Project
    from .search_restarts import Sharing


@dataclass(frozen=True)
class SearchLimits:
    """How long a search takes, and how many lenses it returns; each as the parameter of `search_lenses`."""

    time_s: float = 60.0
    lenses: int = 5
    searches: int | None = None
    threads: int | None = None


@dataclass(frozen=True)
class FolderSearch:
    """Result of a search in a folder.

    Attributes
    ----------
    search : LensSearch
    summary : dict
        Facts for JSON, as in the report.
    remarks : tuple of str
        On the project and on what was written.
    cut_off : bool
        Whether the search was cancelled; it can be resumed.
    """

    search: LensSearch
    summary: dict[str, Any]
    remarks: tuple[str, ...]
    cut_off: bool


def search_in_folder(
    project: Project,
    folder: Path,
    state: PoolState,
    limits: SearchLimits = SearchLimits(),
    *,
    choice: Choice | None = None,
    measure: Measure = "ours",
    name: str | None = None,
    report: Report = lambda _: None,
    display: Callable[[str], AbstractContextManager[Observer | None]] = lambda _unit: nullcontext(),
    cancelled: Callable[[], bool] = lambda: False,
    sharing: Sharing | None = None,
) -> FolderSearch:
    """Search lenses, and write project, search, lenses, pictures and report.

    The search is stored every 10 s, so that a killed one resumes by `read_search` of its file to the same lenses.

    Parameters
    ----------
    project : Project
    folder : Path
        Made when the search starts.
    state : PoolState
        Start of a search, or a search to resume.
    limits : SearchLimits
    choice, measure, name, report, cancelled, sharing
        As for `search_lenses`.
    display : callable
        Called with the unit that the solver counts; during the search, its block's value gets the states.

    Raises
    ------
    ProjectError
        As `search_lenses`.
    OutputError
        When another process searches into the folder, or a file cannot be written at the end.
    """
    from ...design.results.report import search_summary, write_folder

    with ExitStack() as owning:
        with ExitStack() as watching:

            def observer(unit: str) -> Observer:
                # the project is valid by now, and the search starts
                make_folder(folder)
                owning.enter_context(_owned(folder))
                show = watching.enter_context(display(unit))
                return watching.enter_context(_stored(project, folder, state, name, sharing is not None, show, report))

            done = search_lenses(
                project, time_s=limits.time_s, state=state, lenses=limits.lenses, searches=limits.searches,
                threads=limits.threads, choice=choice, measure=measure, name=name, report=report, progress=observer,
                cancelled=cancelled, sharing=sharing,
            )  # fmt: skip
        cut_off = cancelled()
        remarks = write_folder(
            folder, project, done.problem, done.state, done.outcomes, done.obstacles, done.conflict, name
        )
    # a name belongs to lenses that do not come from the project's lens
    about = done.settled.remarks if name is None else ()
    summary = search_summary(done.state, done.outcomes, done.problem, done.obstacles, done.conflict)
    return FolderSearch(done, summary, (*about, *remarks), cut_off)


@contextmanager
def _owned(folder: Path) -> Iterator[None]:
    """Refuse a folder into which another process searches, until the block ends: both would write the same files."""
    path = folder / ".search.lock"
    try:
        file = path.open("wb")
    except OSError:
        # a full disk does not end a search
        yield
        return
    with file:
        if not held(file):
            raise OutputError(f"another process searches into {folder}; wait for it, or choose another folder")
        try:
            yield
        finally:
            # Windows deletes no open file
            file.close()
            with suppress(OSError):
                path.unlink()


@contextmanager
def _stored(
    project: Project, folder: Path, state: PoolState, name: str | None, shared: bool, show: Observer | None,
    report: Report,
) -> Iterator[Observer]:  # fmt: skip
    """Store the newest state every 10 s during the block, which gets the function that notes states."""
    from ...design.results.report import write_checkpoint

    latest, stored = state, state

    def store() -> None:
        nonlocal stored
        if (now := latest) is not stored:
            write_checkpoint(folder, project, now, name)
            stored = now

    def note(now: PoolState) -> None:
        nonlocal latest
        latest = now
        if shared and stored is state:
            # restarts keep their own states from now on; this names their number
            store()
        if show is not None:
            show(now)

    with checkpoints(store, report):
        yield note


def search_to_resume(folder: Path, project: Project, seed: int) -> PoolState:
    """Return the search of a folder to resume, or a new one.

    Raises
    ------
    FlarewrightError
        When the search cannot be read, or is that of another project or seed.
    """
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.search_state import read_state
    from ...io.files.text_file import read_text
    from ...io.project.project_text import project_text

    if not (folder / "search.json").exists():
        return PoolState(seed)
    state = read_state(folder / "search.json")
    try:
        same = read_text(folder / "project.toml", "a project file") == project_text(project, folder=folder)
    except FlarewrightError:
        same = False
    if not same or state.seed != seed:
        raise OutputError(f"{folder} holds the search of another model, or of other options; choose another folder")
    return state
