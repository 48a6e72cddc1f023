"""Searching lenses for what a person wants of their ghosts, beside the page."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from ..design.candidate import outcomes
from ..design.color_search import solve_colors
from ..design.colors import coated, color_problem
from ..design.hunt import until
from ..design.impossible import obstacles
from ..design.polish import compile_kernels
from ..design.problem import Over, Problem
from ..design.report import verdict
from ..design.search import State, solve
from ..design.target import problem_of
from ..errors import FlarewrightError
from ..model import AsLens, PerRow, Project, Surface
from .edit_wishes import clear_wishes
from .session import Session
from .shown import jpeg, pixels_of
from .studio import Match as Held
from .studio import exposure_of, light_of, take
from .view import View

CANDIDATES = 5
LOOK_EVERY_S = 1.0
THUMB_SCALE = 0.4

GETTING_READY = "Getting ready; the first search of a machine takes a minute more"


@dataclass(frozen=True)
class Found:
    """A lens that was found.

    Attributes
    ----------
    changes : dict
        What it changes in the project: the lens, or its coatings.
    words : str
        How well it does.
    picture : bytes
        JPEG.
    """

    changes: dict[str, Any]
    words: str
    picture: bytes

    def taken(self, project: Project) -> Project:
        """Return a project with it; its wishes are fulfilled and go."""
        found: Project = clear_wishes(project).replace(**self.changes)
        return found


@dataclass(frozen=True)
class Progress:
    """How a search stands."""

    running: bool = False
    words: str = ""
    seconds: float = 0.0
    found: tuple[Found, ...] = ()
    number: int = field(default=0)


class Solver:
    """One search at a time.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.progress = Progress()
        self._stop = threading.Event()
        # set once a search can be ended at any time: compiling, at the first one of a machine, cannot
        self._ready = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, seconds: float) -> None:
        """Begin to search lenses for the project's wishes; what cannot be searched for is refused at once."""
        self.stop()
        project = self.session.project
        problem, settled = problem_of(project)
        self._begin(partial(self._search, project, problem, settled.lens.name, seconds))

    def start_colors(self, kind: str) -> None:
        """Begin to search coatings for the wished colours."""
        self.stop()
        project = self.session.project
        films: Any = "film" if kind == "film" else "quarter-wave"
        problem, lens = color_problem(project, films)

        def work(_: threading.Event, ready: threading.Event) -> None:
            ready.set()
            found = solve_colors(problem)
            new = coated(lens, problem.structure, films, found.values)
            # the glass stays as it was, and so do opening and zoom
            worn = tuple(row.coating if isinstance(row, Surface) else None for row in new.rows)
            words = "Coatings for the wished colours"
            changes = {"lens": project.lens, "coating": PerRow(coatings=worn)}
            self._tell(False, words, 0.0, (_found(project, changes, words),))

        self._begin(work)

    def stop(self) -> None:
        """End the search and keep the best."""
        self._stop.set()
        if self._thread is None or not self._thread.is_alive():
            return
        if self._ready.is_set():
            self._thread.join(30.0)
        else:
            # it ends by itself when it is ready, and nobody waits for that
            self._tell(False, "Stopped before the search began", 0.0, self.progress.found)

    def accept(self, number: int) -> None:
        """Take what was found, in the project as it stands now."""
        found = self.progress.found
        if not 0 <= number < len(found):
            return
        self.session.put(found[number].taken(self.session.project), "Accept what was found")

    def _begin(self, work: Callable[[threading.Event, threading.Event], None]) -> None:
        stop, ready = self._stop, self._ready = threading.Event(), threading.Event()
        self._tell(True, GETTING_READY, 0.0, ())

        def run() -> None:
            try:
                work(stop, ready)
            except FlarewrightError as error:
                if ready.is_set() or not stop.is_set():
                    self._tell(False, str(error), 0.0, self.progress.found)

        self._thread = threading.Thread(target=run, name="solver", daemon=True)
        self._thread.start()

    def _search(
        self, project: Project, problem: Problem, name: str, seconds: float,
        stop: threading.Event, ready: threading.Event,
    ) -> None:  # fmt: skip
        compile_kernels(problem.objective.picture is not None)
        if stop.is_set():
            return
        ready.set()
        looked = 0.0

        def look(state: State) -> None:
            nonlocal looked
            now = time.perf_counter()
            if now - looked < LOOK_EVERY_S:
                return
            looked = now
            best = self._found(project, problem, state, 1, name, stop.is_set)
            self._tell(True, "Searching", state.seconds, best)

        state = solve(problem, time_limit=seconds, progress=look, cancelled=stop.is_set)
        over = until(seconds - state.seconds, stop.is_set)
        found = self._found(project, problem, state, CANDIDATES, name, over)
        told = f"{len(found)} lenses of {state.searches} tries" if found else "No lens was found; search longer"
        proven = obstacles(problem, project)
        if proven:
            told = f"No lens can do that: {' '.join(f'{one.target}: {one.reason}' for one in proven)} ({told})"
        self._tell(False, told, state.seconds, found)

    def _found(
        self, project: Project, problem: Problem, state: State, count: int, name: str,
        over: Over,
    ) -> tuple[Found, ...]:  # fmt: skip
        best = outcomes(state, problem, count=count, name=f"After {name}", iris=project.iris, over=over)
        out = []
        for one in best:
            worst = max(abs(float(value)) for value in one.residuals.ravel())
            words = f"{verdict(one)}, off by {worst:.3g} mm at most"
            changes = {"lens": one.lens, "coating": AsLens(), "f_number": None, "zoom": None}
            out.append(_found(project, changes, words))
        return tuple(out)

    def _tell(self, running: bool, words: str, seconds: float, found: tuple[Found, ...]) -> None:
        self.progress = Progress(running, words, seconds, found, self.progress.number + 1)
        self.session.tell({"type": "solve"})


def _found(project: Project, changes: dict[str, Any], words: str) -> Found:
    """Draw what was found, small."""
    found = Found(changes, words, b"")
    picture = take(found.taken(project), "draft", View(), scale=THUMB_SCALE)
    return replace(found, picture=jpeg(pixels_of(light_of(picture, Held()), exposure_of(picture), View()), 85))
