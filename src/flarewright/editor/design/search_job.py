"""Background searches of lenses and coatings for the targets of a project."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...design.coatings.color_search import ColorStep, solve_colors
from ...design.coatings.colors import ColorProblem, coated, color_problem, colors_of, perceived_differences
from ...design.finishing.candidate import Outcome, outcomes
from ...design.problem.impossible import obstacles
from ...design.problem.problem import Over, Problem
from ...design.problem.target import problem_of
from ...design.results.report import verdict
from ...design.solvers.evolution_log import until
from ...design.solvers.polish import compile_kernels
from ...design.solvers.pool_search import PoolState, solve
from ...errors import FlarewrightError, OutputError, ProjectError
from ...model import AsLens, CoatingChoice, Everywhere, InTurn, Lens, PerRow, Project, Surface
from ...optics.lens.paraxial import first_order
from ...optics.rays.pack import resolve_coatings
from ...render.scene.resolve import open_lens, resolve_project
from ...sentences import count
from ...typing import Floats, Mask
from ..commands.design_targets import clear_ghost_targets, ghost_target_names
from ..common.latest_job import Check, Lane, refused_at_exit
from ..common.light_names import with_light_names
from ..preview.display_image import jpeg, pixels_of
from ..preview.draft_match import Match as Held
from ..preview.picture import Grade
from ..preview.render_picture import chosen_light, exposure_of, has_no_ghosts, take
from ..session.session import Session
from ..session.view_settings import View
from .kept_search import drop, keep, kept_search, read_kept

CANDIDATES = 5
LOOK_EVERY_S = 1.0
# the search is stored this often, for an editor that is ended or killed meanwhile
KEEP_EVERY_S = 10.0
# fraction of the time for finishing lenses with traced rays
FINISHING = 0.25
THUMB_SCALE = 0.4
# error in place or size that is invisible, mm
UNSEEN_MM = 1e-3
# Oklab distances: just noticeable side by side, and still the same hue
UNSEEN_COLOR, NEAR_COLOR = 0.02, 0.1

GETTING_READY = "Preparing; the first search on a computer takes a minute longer"
UNSEEN = "drawn by matrices, as no traced ray of its ghosts reaches the picture at this angle"
HOW_WELL = {"met": "met", "nearly": "nearly met"}
# a target as numbered in messages of design
_COUNTED = re.compile(r"design\.ghost_targets\[(\d+)\]|\btarget (\d+)\b")


@dataclass(frozen=True)
class FoundLens:
    """A lens or coating that a search found.

    Attributes
    ----------
    changes : dict
        Fields of the project that it replaces: the lens, or its coatings.
    words : str
        How well it meets the targets.
    picture : bytes
        JPEG.
    """

    changes: dict[str, Any]
    words: str
    picture: bytes

    def taken(self, project: Project) -> Project:
        """Return a project with it and without targets, as these are met."""
        return clear_ghost_targets(project).replace(**self.changes)


@dataclass(frozen=True)
class DisplaySettings:
    """Display settings, so that a result looks the same before and after it is accepted.

    Attributes
    ----------
    view : View
    held_stops : float or None
        Exposure of the present lens, for results with other coatings of this lens; None: each has its own.
    """

    view: View = field(default_factory=View)
    held_stops: float | None = None


@dataclass(frozen=True)
class SearchState:
    """Progress of a search."""

    running: bool = False
    words: str = ""
    seconds: float = 0.0
    found: tuple[FoundLens, ...] = ()
    number: int = field(default=0)


class Solver:
    """Runs one search at a time.

    Parameters
    ----------
    session : Session
    display : callable
        Returns the present display settings.
    """

    def __init__(self, session: Session, display: Callable[[], DisplaySettings] = DisplaySettings) -> None:
        self.session, self.display = session, display
        self.progress = SearchState()
        # the lens at the start of the search
        self._searched: Lens | str | None = None
        self._stop = threading.Event()
        # whether the editor ends: then the search is kept for the next one
        self._closing = False
        # set once the search reacts to a stop; the first compilation on a computer does not
        self._ready = threading.Event()
        self._thread: threading.Thread | None = None
        self._report_lock = threading.Lock()
        self._tracing = Lane("found")

    @property
    def fitting(self) -> SearchState:
        """Progress of the search; without results that belong to another lens than the present one."""
        progress, lens = self.progress, self.session.project.lens
        # after one result is accepted, the others stay available
        if not progress.found or lens in (self._searched, *(found.changes["lens"] for found in progress.found)):
            return progress
        return replace(progress, words=progress.words if progress.running else "", found=())

    def start(self, seconds: float) -> None:
        """Start a lens search for the project's targets; raise an error at once if it cannot be searched."""
        project = self.session.project
        ghost_targets = () if project.design is None else project.design.ghost_targets
        if not ghost_targets:
            raise ProjectError(
                "no targets yet, so there is nothing to search: choose a ghost and set its target, or add a ghost, "
                "then solve"
            )
        self.stop()
        problem, settled = _in_page_names(problem_of, project)
        self._begin(partial(self._search, project, problem, settled.lens.name, seconds))

    def start_colors(self, kind: str, seconds: float) -> None:
        """Start a coating search for the target colours."""
        project = self.session.project
        ghost_targets = () if project.design is None else project.design.ghost_targets
        if all(ghost_target.color is None for ghost_target in ghost_targets):
            raise ProjectError("no target colours yet: choose a ghost, give it a colour, then solve for colours")
        self.stop()
        films: Any = "film" if kind == "film" else "quarter-wave"
        problem, lens = _in_page_names(partial(color_problem, kind=films), project)

        def work(stop: threading.Event, ready: threading.Event) -> None:
            ready.set()
            started = time.perf_counter()

            def note(step: ColorStep) -> None:
                self._report(True, "Searching coatings", step.seconds, ())

            found = solve_colors(problem, time_limit=seconds, cancelled=stop.is_set, note=note)
            took = time.perf_counter() - started
            # a hundredth of a nanometre is invisible, and finer than manufacturing
            values = np.round(found.values, 2) if films == "quarter-wave" else found.values
            new = coated(lens, problem.rows, films, values)
            # glass, f-number and zoom stay unchanged
            worn = tuple(row.coating if isinstance(row, Surface) else None for row in new.rows)
            words = coloured(problem, values)
            changes = {"lens": project.lens, "coating": PerRow(coatings=worn)}
            drawn = _found(self._present_project(project), changes, words, self.display())
            self._end(project, "Coatings were found", took, (drawn,))

        self._begin(work)

    def stop(self) -> None:
        """End the search and keep its best results."""
        self._stop.set()
        if self._thread is None or not self._thread.is_alive():
            return
        if self._ready.is_set():
            self._thread.join(30.0)
        else:
            # it ends by itself after the compilation; do not wait for that
            self._report(False, "Stopped before the search began", 0.0, self.progress.found)

    def close(self) -> None:
        """Ask the search to end, without waiting for it; the next editor can resume it."""
        self._closing = True
        self._stop.set()
        self._tracing.close()

    def accept(self, number: int) -> str:
        """Put a result into the present project; return a sentence on the other changes."""
        found, before = self.fitting.found, self.session.project
        if not 0 <= number < len(found):
            raise ProjectError("the results belong to another lens than the present one; solve again")
        after = found[number].taken(before)
        self.session.put(after, "Accept the result")
        return changed(before, after)

    def _begin(self, work: Callable[[threading.Event, threading.Event], None]) -> None:
        stop, ready = self._stop, self._ready = threading.Event(), threading.Event()
        self._searched = self.session.project.lens
        self._tracing.cancel()
        self._report(True, GETTING_READY, 0.0, ())

        def run() -> None:
            try:
                work(stop, ready)
            except FlarewrightError as error:
                if ready.is_set() or not stop.is_set():
                    self._report(False, str(error), 0.0, self.progress.found)
            except RuntimeError as error:
                if not refused_at_exit(error):
                    raise

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
        looked, stored, file = 0.0, time.perf_counter(), kept_search(project)
        earlier = read_kept(file) or PoolState(0)
        if earlier.searches:
            self._report(True, f"Resuming a search of {count(earlier.searches, 'try', 'tries')}", earlier.seconds, ())

        def look(state: PoolState) -> None:
            nonlocal looked, stored
            now = time.perf_counter()
            if now - stored >= KEEP_EVERY_S:
                stored = now
                self._keep(file, state)
            if now - looked < LOOK_EVERY_S:
                return
            looked = now
            best = self._found(project, problem, state, 1, name, stop.is_set)
            self._report(True, "Searching", state.seconds, best)

        # for new ghosts the user's places refer to traced rays; own ghosts compare matrices with matrices
        scratch = project.design is not None and not project.design.own_ghosts
        finished = replace(problem, traced=problem.traced or scratch)
        rest = FINISHING * seconds if finished.traced else 0.0
        # a resumed search has the rest of its time
        limit = max(seconds - rest - earlier.seconds, 0.0)
        state = solve(problem, time_limit=limit, progress=look, cancelled=stop.is_set, state=earlier)
        if self._closing:
            self._keep(file, state)
            return
        drop(file)
        over = until(seconds - state.seconds, stop.is_set)
        found = self._found(project, finished, state, CANDIDATES, name, over)
        outcome = (
            f"{count(len(found), 'lens', 'lenses')} of {state.searches} tries"
            if found
            else "No lens was found; search longer"
        )
        proven = obstacles(problem, project)
        if proven:
            why = " ".join(f"{one.target}: {one.reason}" for one in proven)
            outcome = f"No lens can do that: {named(why, project)} ({outcome})"
        self._end(project, outcome, state.seconds, found)

    def _keep(self, file: Path, state: PoolState) -> None:
        try:
            keep(file, state)
        except OutputError as error:
            # a full disk does not end the search
            self.session.tell({"type": "message", "kind": "warning", "text": f"The search is not kept: {error}"})

    def _found(
        self, project: Project, problem: Problem, state: PoolState, count: int, name: str, over: Over
    ) -> tuple[FoundLens, ...]:
        best = outcomes(state, problem, count=count, name=f"After {name}", iris=project.iris, over=over)
        out = []
        # sort by the reported error, and put lenses with lost ghosts last
        for number, one in enumerate(sorted(best, key=lambda one: (len(one.lost), _worst(one))), 1):
            lens = one.lens.replace(name=f"After {name} {number}")
            coating = _coatings_for(project, lens)
            bare = "" if coating is not None else "; without the coatings, which do not fit it"
            words = named(f"Lens {number}: {described(lens)}; {judged(one, problem)}{bare}", project)
            changes = {"lens": lens, "coating": coating or AsLens(), "f_number": None, "zoom": None}
            out.append(_found(self._present_project(project), changes, words, self.display()))
        return tuple(out)

    def _report(self, running: bool, words: str, seconds: float, found: tuple[FoundLens, ...]) -> SearchState:
        with self._report_lock:
            state = self.progress = SearchState(running, words, seconds, found, self.progress.number + 1)
        self.session.tell({"type": "solve"})
        return state

    def _end(self, project: Project, words: str, seconds: float, found: tuple[FoundLens, ...]) -> None:
        """Report the results, then redraw them with traced rays: matrices can flatter a fast lens."""
        state = self._report(False, words, seconds, found)
        if found:
            self._tracing.submit(partial(self._trace, project, state))

    def _present_project(self, project: Project) -> Project:
        """Return the present project, as the light may have moved; if its lens differs, the searched project."""
        now = self.session.project
        return now if now.lens == project.lens else project

    def _trace(self, project: Project, state: SearchState, check: Check) -> None:
        shot, display = self._present_project(project), self.display()
        traced = tuple(_drawn(one, shot, display, "soon", check) for one in state.found)
        with self._report_lock:
            if self.progress is not state:
                return
            self.progress = replace(state, found=traced, number=state.number + 1)
        self.session.tell({"type": "solve"})


def _coatings_for(project: Project, lens: Lens) -> CoatingChoice | None:
    """Return coatings for a new lens: those of the old one if the rows correspond; None if not."""
    if isinstance(project.coating, Everywhere | InTurn):
        return project.coating
    before = open_lens(project.lens).lens
    worn = resolve_coatings(before, project.coating)
    if not any(worn):
        return AsLens()
    same = [isinstance(row, Surface) for row in before.rows] == [isinstance(row, Surface) for row in lens.rows]
    return PerRow(coatings=tuple(worn)) if same else None


def _in_page_names(read: Callable[[Project], Any], project: Project) -> Any:
    """Convert a project to a problem; errors use the names of the page."""
    try:
        return read(project)
    except FlarewrightError as error:
        raise type(error)(named(str(error), project)) from None


def named(text: str, project: Project) -> str:
    """Replace numbers of targets and lights in a message by the page's names."""
    names = () if project.design is None else ghost_target_names(project.design)

    def name(found: re.Match[str]) -> str:
        number = int(found[1] or found[2])
        return names[number] if number < len(names) else found[0]

    return with_light_names(_COUNTED.sub(name, text), project)


def described(lens: Lens) -> str:
    """Return a short description of a lens."""
    surfaces = sum(isinstance(row, Surface) for row in lens.rows)
    return f"{surfaces} surfaces, {first_order(lens).efl:.3g} mm f/{lens.f_number:.3g}"


def changed(before: Project, after: Project) -> str:
    """Describe further changes that came with an accepted result, such as another f-number.

    Returns
    -------
    str
        Several sentences.
    """
    gone = " The targets are removed." if before.design is not None else ""
    back = f"{gone} Undo restores everything."
    if after.lens == before.lens:
        return f"The coatings were accepted; lens, f-number and zoom are unchanged.{back}"
    settled = resolve_project(after)
    old, new = resolve_project(before).order, settled.order
    parts = [f"“{settled.opened.lens.name}” was accepted"]
    if f"{new.f_number:.3g}" != f"{old.f_number:.3g}":
        parts.append(
            f"its f-number is f/{new.f_number:.3g} instead of f/{old.f_number:.3g}, as its ghosts have the found "
            "sizes at that opening"
        )
    if f"{new.efl:.3g}" != f"{old.efl:.3g}":
        parts.append(f"its focal length is {new.efl:.3g} mm, not {old.efl:.3g} mm")
    if before.zoom is not None:
        parts.append(f"it has no zoom position {before.zoom!r}")
    return f"{'; '.join(parts)}.{back}"


def coloured(problem: ColorProblem, values: Floats) -> str:
    """Describe how close coatings come to the target colours, and how well the other ghosts keep theirs.

    Parameters
    ----------
    problem : ColorProblem
    values : ndarray, shape (M, P)
        As in `Coatings`.
    """
    off = perceived_differences(problem, colors_of(problem, values))
    names = [f"{j}-{i}" for j, i in problem.structure.pairs]

    def said(what: str, chosen: Mask, words: tuple[str, str, str]) -> str:
        worst = int(np.argmax(np.where(chosen, off, -1.0)))
        how = words[int(np.searchsorted((UNSEEN_COLOR, NEAR_COLOR), off[worst]))]
        farthest = "" if how == words[0] else f", ghost {names[worst]} is farthest off, by {off[worst]:.2g}"
        return f"{what}: {how}{farthest}"

    counted = problem.weights > 0.0
    parts = []
    if (wanted := problem.hue_only & counted).any():
        parts.append(said("Target colours", wanted, ("met", "nearly met", "not met")))
    if (others := ~problem.hue_only & counted).any():
        parts.append(said("the other ghosts", others, ("kept", "nearly kept", "changed")))
    if any("farthest" in words for words in parts):
        parts.append(f"{UNSEEN_COLOR:g} is just noticeable side by side")
    if problem.kept:
        rows = ", ".join(str(k) for k in problem.kept)
        parts.append(f"the cemented rows ({rows}) stay bare, as cemented surfaces take no film")
    return "; ".join(parts)


def judged(one: Outcome, problem: Problem) -> str:
    """Describe how well a lens meets the targets, and which ghost has the largest error."""
    farthest = abs(one.residuals).max(axis=1).argmax()
    target = problem.objective.names[int(farthest)]
    ghost = target if target.startswith("target ") else f"ghost {target}"
    words = HOW_WELL.get(verdict(one), "not met")
    # an invisible error is rounding
    how_well = words if _worst(one) < UNSEEN_MM else f"{words}, {ghost} is farthest off, by {_worst(one):.3g} mm"
    gone = ", ".join(name if name.startswith("target ") else f"ghost {name}" for name in one.lost)
    return f"{how_well}; too few rays reach {gone}" if gone else how_well


def _worst(one: Outcome) -> float:
    """Return the largest error of place or size of any ghost, mm."""
    return float(abs(one.residuals).max())


def _found(project: Project, changes: dict[str, Any], words: str, display: DisplaySettings) -> FoundLens:
    """Draw a result as a small draft."""
    return _drawn(FoundLens(changes, words, b""), project, display, "draft", lambda: None)


def _drawn(found: FoundLens, project: Project, display: DisplaySettings, grade: Grade, check: Check) -> FoundLens:
    """Draw a result as it looks after acceptance; if that fails, keep its draft."""
    taken = found.taken(project)
    try:
        picture = take(taken, grade, View(), scale=THUMB_SCALE, hasty=True, progress=lambda *_: check())
    except FlarewrightError:
        if found.picture:
            return found
        raise
    if found.picture and has_no_ghosts(picture):
        # a black picture has no information: keep the draft and say so
        return replace(found, words=f"{found.words}; {UNSEEN}")
    # another lens has its own exposure, also after acceptance
    stops = display.held_stops if taken.lens == project.lens else None
    chosen = display.view.exposure_stops
    stops = chosen if chosen is not None else exposure_of(picture) if stops is None else stops
    return replace(found, picture=jpeg(pixels_of(chosen_light(picture, Held()), stops, display.view), 85))
