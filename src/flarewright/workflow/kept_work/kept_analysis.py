"""Keep the finished part of a ghost analysis in a file, from which the same command resumes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import FileError
from ...io.render_state.kept_arrays import read_arrays, write_arrays
from ...render.analysis_memory import AnalysisMemory
from ...sentences import count
from ...typing import Report
from .checkpoints import kept_until_done

_REMEDY = "its ghosts are traced again"


@contextmanager
def kept_analysis(path: Path, digest: str, report: Report) -> Iterator[AnalysisMemory]:
    """Load the finished part of an interrupted analysis, and store it with the new part until the block is done.

    Parameters
    ----------
    path : Path
        The file, written every 10 s and when the block fails; success deletes it.
    digest : str
        Of everything that determines the ghosts.
    report : callable
        Called with sentences: on resuming, on a file that does not fit or is damaged, and when nothing can be kept.

    Yields
    ------
    AnalysisMemory
        For `render.analysis.find_ghosts`.
    """
    memory = _read(path, digest, report)
    stored = memory.finished

    def store() -> None:
        nonlocal stored
        # before the arrays, which can hold more by then
        if (finished := memory.finished) > stored:
            write_arrays(path, digest, memory.arrays())
            stored = finished

    with kept_until_done(path, store, report, "the ghosts"):
        yield memory


def _read(path: Path, digest: str, report: Report) -> AnalysisMemory:
    """Read the finished part of the same analysis; an empty one if there is none."""
    if not path.exists():
        return AnalysisMemory()
    try:
        about, arrays = read_arrays(path, "part of an analysis of ghosts", _REMEDY)
    except FileError as error:
        report(str(error))
        return AnalysisMemory()
    if about["digest"] != digest:
        report(f"{path} belongs to other settings; {_REMEDY}")
        return AnalysisMemory()
    try:
        memory = AnalysisMemory(arrays)
    except (KeyError, ValueError, IndexError):
        report(f"{path} is damaged; {_REMEDY}")
        return AnalysisMemory()
    report(f"{path}: resuming with {count(memory.ghosts, 'ghost', 'ghosts')} of an interrupted run")
    return memory
