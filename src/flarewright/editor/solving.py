"""Searching lenses for what a person wants of their ghosts, beside the page."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
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
from ..model import AsLens, Lens, Project
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
    lens : Lens
    words : str
        How well it does.
    picture : bytes
        JPEG.
    """

    lens: Lens
    words: str
    picture: bytes


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

    def start(self, seconds: float, exposure_stops: float) -> None:
        """Begin to search lenses for the project's wishes; what cannot be searched for is refused at once."""
        self.stop()
        project = self.session.project
        problem, settled = problem_of(project)
        self._begin(partial(self._search, project, problem, settled.lens.name, seconds, exposure_stops))

    def start_colors(self, kind: str, exposure_stops: float) -> None:
        """Begin to search coatings for the wished colours."""
        self.stop()
        project = self.session.project
        films: Any = "film" if kind == "film" else "quarter-wave"
        problem, lens = color_problem(project, films)

        def work(_: threading.Event, ready: threading.Event) -> None:
            ready.set()
            found = solve_colors(problem)
            new = coated(lens, problem.structure, films, found.values)
            words = "Coatings for the wished colours"
            self._tell(False, words, 0.0, (Found(new, words, self._thumb(project, new, exposure_stops)),))

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
        """Take a lens that was found; the wishes are fulfilled and go."""
        found = self.progress.found
        if not 0 <= number < len(found):
            return
        project = clear_wishes(self.session.project)
        self.session.put(
            project.replace(lens=found[number].lens, coating=AsLens(), f_number=None, zoom=None), "Accept a found lens"
        )

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
        self, project: Project, problem: Problem, name: str, seconds: float, exposure_stops: float,
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
            best = self._found(project, problem, state, 1, name, exposure_stops, stop.is_set)
            self._tell(True, "Searching", state.seconds, best)

        state = solve(problem, time_limit=seconds, progress=look, cancelled=stop.is_set)
        over = until(seconds - state.seconds, stop.is_set)
        found = self._found(project, problem, state, CANDIDATES, name, exposure_stops, over)
        told = f"{len(found)} lenses of {state.searches} tries" if found else "No lens was found; search longer"
        proven = obstacles(problem, project)
        if proven:
            told = f"No lens can do that: {' '.join(f'{one.target}: {one.reason}' for one in proven)} ({told})"
        self._tell(False, told, state.seconds, found)

    def _found(
        self, project: Project, problem: Problem, state: State, count: int, name: str, exposure_stops: float,
        over: Over,
    ) -> tuple[Found, ...]:  # fmt: skip
        best = outcomes(state, problem, count=count, name=f"After {name}", iris=project.iris, over=over)
        out = []
        for one in best:
            worst = max(abs(float(value)) for value in one.residuals.ravel())
            words = f"{verdict(one)}, off by {worst:.3g} mm at most"
            out.append(Found(one.lens, words, self._thumb(project, one.lens, exposure_stops)))
        return tuple(out)

    def _thumb(self, project: Project, lens: Lens, exposure_stops: float) -> bytes:
        del exposure_stops
        shot = clear_wishes(project).replace(lens=lens, coating=AsLens(), f_number=None, zoom=None)
        picture = take(shot, "draft", View(), scale=THUMB_SCALE)
        light = light_of(picture, Held())
        return jpeg(pixels_of(light, exposure_of(picture), View()), 85)

    def _tell(self, running: bool, words: str, seconds: float, found: tuple[Found, ...]) -> None:
        self.progress = Progress(running, words, seconds, found, self.progress.number + 1)
        self.session.tell({"type": "solve"})
