"""Searching lenses for what a person wants of their ghosts, beside the page."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..design.candidate import Outcome, outcomes
from ..design.color_search import ColorStep, solve_colors
from ..design.colors import ColorProblem, Floats, coated, color_problem, colors_of, perceived_differences
from ..design.hunt import until
from ..design.impossible import obstacles
from ..design.polish import compile_kernels
from ..design.problem import Over, Problem
from ..design.report import verdict
from ..design.search import State, solve
from ..design.target import problem_of
from ..errors import FlarewrightError, ProjectError
from ..io.sentences import count
from ..model import AsLens, CoatingChoice, Design, Everywhere, InTurn, Lens, PerRow, Project, Surface
from ..optics.pack import resolve_coatings
from ..render.prepare import as_lens, first_order, settle
from .draft_match import Match as Held
from .edit_wishes import clear_wishes, wish_names
from .jobs import Check, Lane
from .picture import Grade
from .session import Session
from .shown import jpeg, pixels_of
from .studio import exposure_of, is_dark, light_of, take
from .view import View

CANDIDATES = 5
LOOK_EVERY_S = 1.0
# part of the time in which lenses are finished with traced rays
FINISHING = 0.25
THUMB_SCALE = 0.4
# of a ghost's place or size
UNSEEN_MM = 1e-3
# of a colour, by Oklab; up to so much is not seen side by side, or is still the same hue
UNSEEN_COLOR, NEAR_COLOR = 0.02, 0.1

GETTING_READY = "Getting ready; the first search of a machine takes a minute more"
UNSEEN = "drawn by matrices, for no traced ray of its ghosts comes to the picture at this angle"
HOW_WELL = {"met": "met", "nearly": "nearly met"}
# a wish as messages of design count it
_COUNTED = re.compile(r"design\.wishes\[(\d+)\]|\bwish (\d+)\b")


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
class Seeing:
    """How the picture is shown, so that what is found is shown as it will be once it is taken.

    Attributes
    ----------
    view : View
    held_stops : float or None
        The exposure of the present lens, which other coatings of it keep; None: each has its own.
    """

    view: View = field(default_factory=View)
    held_stops: float | None = None


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
    seeing : callable
        Returns how the picture is shown at the moment.
    """

    def __init__(self, session: Session, seeing: Callable[[], Seeing] = Seeing) -> None:
        self.session, self.seeing = session, seeing
        self.progress = Progress()
        # the lens that the search began with
        self._searched: Lens | str | None = None
        self._stop = threading.Event()
        # set once a search can be ended at any time: compiling, at the first one of a machine, cannot
        self._ready = threading.Event()
        self._thread: threading.Thread | None = None
        self._telling = threading.Lock()
        self._tracing = Lane("found")

    @property
    def fitting(self) -> Progress:
        """How the search stands; without what it found where that is for another lens than the present one."""
        progress, lens = self.progress, self.session.project.lens
        # who takes one of them may take another one instead
        if not progress.found or lens in (self._searched, *(found.changes["lens"] for found in progress.found)):
            return progress
        return replace(progress, words=progress.words if progress.running else "", found=())

    def start(self, seconds: float) -> None:
        """Begin to search lenses for the project's wishes; what cannot be searched for is refused at once."""
        project = self.session.project
        wishes = () if project.design is None else project.design.wishes
        if not wishes:
            raise ProjectError(
                "nothing is wished for yet, so there is nothing to search: choose a ghost and say what it shall be, or "
                "add one, then solve"
            )
        self.stop()
        problem, settled = _in_words(problem_of, project)
        self._begin(partial(self._search, project, problem, settled.lens.name, seconds))

    def start_colors(self, kind: str, seconds: float) -> None:
        """Begin to search coatings for the wished colours."""
        project = self.session.project
        wishes = () if project.design is None else project.design.wishes
        if all(wish.color is None for wish in wishes):
            raise ProjectError("no colour is wished for yet: choose a ghost, give it a colour, then solve for colours")
        self.stop()
        films: Any = "film" if kind == "film" else "quarter-wave"
        problem, lens = _in_words(partial(color_problem, kind=films), project)

        def work(stop: threading.Event, ready: threading.Event) -> None:
            ready.set()
            begun = time.perf_counter()

            def note(step: ColorStep) -> None:
                self._tell(True, "Searching coatings", step.seconds, ())

            found = solve_colors(problem, time_limit=seconds, cancelled=stop.is_set, note=note)
            took = time.perf_counter() - begun
            # nobody sees, or evaporates, a hundredth of a nanometre
            values = np.round(found.values, 2) if films == "quarter-wave" else found.values
            new = coated(lens, problem.rows, films, values)
            # the glass stays as it was, and so do opening and zoom
            worn = tuple(row.coating if isinstance(row, Surface) else None for row in new.rows)
            words = coloured(problem, values)
            changes = {"lens": project.lens, "coating": PerRow(coatings=worn)}
            drawn = _found(self._shot(project), changes, words, self.seeing())
            self._end(project, "Coatings were found", took, (drawn,))

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

    def accept(self, number: int) -> str:
        """Take what was found, in the project as it stands now; return what changed with it."""
        found, before = self.fitting.found, self.session.project
        if not 0 <= number < len(found):
            raise ProjectError("what was found is for another lens than the present one; solve anew")
        after = found[number].taken(before)
        self.session.put(after, "Accept what was found")
        return changed(before, after)

    def _begin(self, work: Callable[[threading.Event, threading.Event], None]) -> None:
        stop, ready = self._stop, self._ready = threading.Event(), threading.Event()
        self._searched = self.session.project.lens
        self._tracing.cancel()
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

        # places that a person has chosen are those of rays; a lens' own ghosts are compared as matrices have both
        scratch = project.design is not None and not project.design.own_ghosts
        finished = replace(problem, traced=problem.traced or scratch)
        rest = FINISHING * seconds if finished.traced else 0.0
        state = solve(problem, time_limit=seconds - rest, progress=look, cancelled=stop.is_set)
        over = until(seconds - state.seconds, stop.is_set)
        found = self._found(project, finished, state, CANDIDATES, name, over)
        told = (
            f"{count(len(found), 'lens', 'lenses')} of {state.searches} tries"
            if found
            else "No lens was found; search longer"
        )
        proven = obstacles(problem, project)
        if proven:
            why = " ".join(f"{one.target}: {one.reason}" for one in proven)
            told = f"No lens can do that: {named(why, project.design)} ({told})"
        self._end(project, told, state.seconds, found)

    def _found(
        self, project: Project, problem: Problem, state: State, count: int, name: str,
        over: Over,
    ) -> tuple[Found, ...]:  # fmt: skip
        best = outcomes(state, problem, count=count, name=f"After {name}", iris=project.iris, over=over)
        out = []
        # a person judges them by the error that is told, and most by ghosts that are not there
        for number, one in enumerate(sorted(best, key=lambda one: (len(one.lost), _worst(one))), 1):
            lens = one.lens.replace(name=f"After {name} {number}")
            coating = _kept(project, lens)
            bare = "" if coating is not None else "; without the coatings, which do not fit it"
            words = named(f"Lens {number}: {described(lens)}; {judged(one, problem)}{bare}", project.design)
            changes = {"lens": lens, "coating": coating or AsLens(), "f_number": None, "zoom": None}
            out.append(_found(self._shot(project), changes, words, self.seeing()))
        return tuple(out)

    def _tell(self, running: bool, words: str, seconds: float, found: tuple[Found, ...]) -> Progress:
        with self._telling:
            told = self.progress = Progress(running, words, seconds, found, self.progress.number + 1)
        self.session.tell({"type": "solve"})
        return told

    def _end(self, project: Project, words: str, seconds: float, found: tuple[Found, ...]) -> None:
        """Tell what was found, and draw it anew by traced rays: matrices may flatter a lens that is wide open."""
        told = self._tell(False, words, seconds, found)
        if found:
            self._tracing.submit(partial(self._trace, project, told))

    def _shot(self, project: Project) -> Project:
        """Return the project as it stands, for the light may have been moved; as it was, where it has another lens."""
        now = self.session.project
        return now if now.lens == project.lens else project

    def _trace(self, project: Project, told: Progress, check: Check) -> None:
        shot, seeing = self._shot(project), self.seeing()
        traced = tuple(_drawn(one, shot, seeing, "soon", check) for one in told.found)
        with self._telling:
            if self.progress is not told:
                return
            self.progress = replace(told, found=traced, number=told.number + 1)
        self.session.tell({"type": "solve"})


def _kept(project: Project, lens: Lens) -> CoatingChoice | None:
    """Return what a new lens wears: what the one before did, row for row where it has the same; None where not."""
    if isinstance(project.coating, Everywhere | InTurn):
        return project.coating
    before = as_lens(project.lens)
    worn = resolve_coatings(before, project.coating)
    if not any(worn):
        return AsLens()
    same = [isinstance(row, Surface) for row in before.rows] == [isinstance(row, Surface) for row in lens.rows]
    return PerRow(coatings=tuple(worn)) if same else None


def _in_words(read: Callable[[Project], Any], project: Project) -> Any:
    """Read a project as a problem; what is refused is told in the page's own names."""
    try:
        return read(project)
    except FlarewrightError as error:
        raise type(error)(named(str(error), project.design)) from None


def named(text: str, design: Design | None) -> str:
    """Call wishes what the page calls them, not by their number in the file."""
    names = () if design is None else wish_names(design)

    def name(found: re.Match[str]) -> str:
        number = int(found[1] or found[2])
        return names[number] if number < len(names) else found[0]

    return _COUNTED.sub(name, text)


def described(lens: Lens) -> str:
    """Say in a few words what a lens is."""
    surfaces = sum(isinstance(row, Surface) for row in lens.rows)
    return f"{surfaces} surfaces, {first_order(lens).efl:.3g} mm f/{lens.f_number:.3g}"


def changed(before: Project, after: Project) -> str:
    """Say what else changed with what was accepted: that it comes with an opening of its own surprises who chose one.

    Parameters
    ----------
    before, after : Project

    Returns
    -------
    str
        Several sentences.
    """
    gone = " What was wished for is taken off the list." if before.design is not None else ""
    back = f"{gone} Undo brings all of it back."
    if after.lens == before.lens:
        return f"The coatings were accepted; lens, opening and zoom stay as they were.{back}"
    old, new = settle(before).order, settle(after).order
    told = [f"“{as_lens(after.lens).name}” was accepted"]
    if f"{new.f_number:.3g}" != f"{old.f_number:.3g}":
        told.append(
            f"it stands at its own f/{new.f_number:.3g}, no longer at f/{old.f_number:.3g}, for at that opening its "
            "ghosts are as large as was found"
        )
    if f"{new.efl:.3g}" != f"{old.efl:.3g}":
        told.append(f"its focal length is {new.efl:.3g} mm, not {old.efl:.3g} mm")
    if before.zoom is not None:
        told.append(f"it has no zoom position {before.zoom!r}")
    return f"{'; '.join(told)}.{back}"


def coloured(problem: ColorProblem, values: Floats) -> str:
    """Say how near coatings come to the wished colours, and how well the other ghosts keep theirs.

    Parameters
    ----------
    problem : ColorProblem
    values : ndarray, shape (M, P)
        As in `Coatings`.

    Returns
    -------
    str
    """
    off = perceived_differences(problem, colors_of(problem, values))
    names = [f"{j}-{i}" for j, i in problem.structure.pairs]

    def said(what: str, chosen: NDArray[np.bool_], words: tuple[str, str, str]) -> str:
        worst = int(np.argmax(np.where(chosen, off, -1.0)))
        how = words[int(np.searchsorted((UNSEEN_COLOR, NEAR_COLOR), off[worst]))]
        farthest = "" if how == words[0] else f", ghost {names[worst]} is farthest off, by {off[worst]:.2g}"
        return f"{what}: {how}{farthest}"

    counted = problem.weights > 0.0
    told = []
    if (wished := problem.hue_only & counted).any():
        told.append(said("Wished colours", wished, ("met", "nearly met", "not met")))
    if (others := ~problem.hue_only & counted).any():
        told.append(said("the other ghosts", others, ("kept", "nearly kept", "changed")))
    if any("farthest" in words for words in told):
        told.append(f"{UNSEEN_COLOR:g} is just seen side by side")
    if problem.kept:
        rows = ", ".join(str(k) for k in problem.kept)
        told.append(f"the cemented rows ({rows}) stay bare, for no film can be put there")
    return "; ".join(told)


def judged(one: Outcome, problem: Problem) -> str:
    """Say how well a lens does what is wished, and which ghost is farthest from it."""
    farthest = abs(one.residuals).max(axis=1).argmax()
    target = problem.objective.names[int(farthest)]
    ghost = target if target.startswith("wish") else f"ghost {target}"
    words = HOW_WELL.get(verdict(one), "not met")
    # what nobody can see is rounding, not an error
    told = words if _worst(one) < UNSEEN_MM else f"{words}, {ghost} is farthest off, by {_worst(one):.3g} mm"
    gone = ", ".join(name if name.startswith("wish") else f"ghost {name}" for name in one.lost)
    return f"{told}; too few rays make {gone}" if gone else told


def _worst(one: Outcome) -> float:
    """Return how far place or size of any ghost is off at most, mm."""
    return float(abs(one.residuals).max())


def _found(project: Project, changes: dict[str, Any], words: str, seeing: Seeing) -> Found:
    """Draw what was found, small and fast."""
    return _drawn(Found(changes, words, b""), project, seeing, "draft", lambda: None)


def _drawn(found: Found, project: Project, seeing: Seeing, grade: Grade, check: Check) -> Found:
    """Draw what was found, as it will be shown once it is taken; as it was where it cannot be drawn so."""
    taken = found.taken(project)
    try:
        picture = take(taken, grade, View(), scale=THUMB_SCALE, hasty=True, progress=lambda *_: check())
    except FlarewrightError:
        if found.picture:
            return found
        raise
    if found.picture and is_dark(picture):
        # a black picture tells nothing: that of before stays, and what it is worth is said
        return replace(found, words=f"{found.words}; {UNSEEN}")
    # another lens is shown at an exposure of its own, as it will be
    stops = seeing.held_stops if taken.lens == project.lens else None
    chosen = seeing.view.exposure_stops
    stops = chosen if chosen is not None else exposure_of(picture) if stops is None else stops
    return replace(found, picture=jpeg(pixels_of(light_of(picture, Held()), stops, seeing.view), 85))
