"""Our solver: iterated local search over pools of minima, from many beginnings, on all cores.

A run is a pool of local minima of one structure, or of neighbouring ones where there are thousands. It proposes new
starting points from its pool (some variables drawn anew, a step between members, halves of two members around the
stop, curvatures that change sign), polishes them (`kernels.design_search`) and keeps the best. A run that finds nothing
better for a while is replaced by a new one. Runs do not depend on each other, and each batch has random numbers of its
own, so the same seed gives the same lenses whatever the number of threads, and a run that was cut off goes on as if it
had not been.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..kernels.design_picture import polish_by_picture
from ..kernels.design_search import polish_many
from ..model import Medium
from ..model.design import Bounds
from .canvas import canvas
from .glass_list import GlassList
from .objective import Objective
from .prescription import Structure
from .variables import Variables, variables

Floats = NDArray[np.float64]

# runs that are under way at once; not the number of threads, for results must not depend on that
ACTIVE = 4
# minima a run keeps
POOL = 40
# of which so many are drawn before it proposes from them
FIRST = 160
# what a local search may take, and the cost at which it is done
STEPS = 60
ENOUGH = 1e-18
# a cost at which the wanted ghosts are met
SOLVED = 1e-14
# more structures than this are not gone through one by one
FEW = 24
# one run in so many begins with them
HEIRS = 3
# best lenses remembered of runs that ended
KEPT = 60


@dataclass(frozen=True)
class Problem:
    """What a solver needs to know.

    Attributes
    ----------
    objective : Objective
    structures : tuple of Structure
        All of the same number of rows.
    bounds : Bounds
    stop_diameter : float or None
        When it is known, mm.
    fixed : ndarray, shape (1 + 3 K,), or None
        Prescription whose `fixed_rows` are kept.
    fixed_rows : tuple of int
    begin_with : tuple of (Structure, ndarray)
        Prescriptions that join the first run.
    glasses : GlassList or None
        Every lens is made of these; the bounds of n_d are theirs.
    fixed_media : tuple of Medium or None
        Behind each row of the prescription whose `fixed_rows` are kept.
    traced : bool
        Lenses that were found are finished with traced rays.
    """

    objective: Objective
    structures: tuple[Structure, ...]
    bounds: Bounds
    stop_diameter: float | None = None
    fixed: Floats | None = None
    fixed_rows: tuple[int, ...] = ()
    begin_with: tuple[tuple[Structure, Floats], ...] = ()
    glasses: GlassList | None = None
    fixed_media: tuple[Medium | None, ...] = ()
    traced: bool = False

    def check(self) -> None:
        """Refuse what no solver can begin with.

        Raises
        ------
        ProjectError
            When no structure has enough ghosts, or nothing is free to change.
        """
        if not self.structures:
            raise ProjectError(
                f"no lens of that many surfaces has {self.objective.wanted} ghosts; ask for fewer, or give more "
                "surfaces"
            )
        if self.variables(self.structures[0]).free.size == 0:
            raise ProjectError("every row is fixed, so there is nothing to search; leave some rows free")

    def variables(self, structure: Structure) -> Variables:
        """Return the variables of a structure."""
        return variables(
            structure, self.bounds, stop_diameter=self.stop_diameter, fixed=self.fixed, fixed_rows=self.fixed_rows
        )


@dataclass(frozen=True)
class Candidate:
    """A local minimum: cost, structure and search variables."""

    cost: float
    structure: Structure
    x: Floats


@dataclass(frozen=True)
class Run:
    """A pool of minima, best first, and how long it has been at it."""

    number: int
    home: Structure
    members: tuple[Candidate, ...] = ()
    batches: int = 0
    searches: int = 0
    best_at: int = 0


@dataclass(frozen=True)
class State:
    """Everything that a search needs to go on.

    Attributes
    ----------
    seed : int
    runs : tuple of Run
        Those under way.
    ended : tuple of Candidate
        The best of those that ended, best first.
    next_run, searches : int
    seconds : float
        Spent so far.
    """

    seed: int
    runs: tuple[Run, ...] = ()
    ended: tuple[Candidate, ...] = ()
    next_run: int = 0
    searches: int = 0
    seconds: float = 0.0

    @property
    def best(self) -> Candidate | None:
        """The best minimum so far."""
        found = [run.members[0] for run in self.runs if run.members] + list(self.ended[:1])
        return min(found, key=lambda one: one.cost) if found else None


Progress = Callable[[State], None]
Over = Callable[[], bool]


def never() -> bool:
    """Tell that the time is not up."""
    return False


def solve(
    problem: Problem,
    *,
    seed: int = 0,
    time_limit: float | None = 60.0,
    most_searches: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    state: State | None = None,
) -> State:
    """Search until the ghosts are met, the time is up, or somebody cancels.

    Parameters
    ----------
    problem : Problem
    seed : int
    time_limit : float, optional
        Seconds of this call; None: no limit.
    most_searches : int, optional
        Ends after about so many local searches, at the same one on every machine.
    threads : int, optional
        None: all cores; more than `ACTIVE` are of no use, and the lenses do not depend on it.
    progress : callable, optional
        Called with the state after every round.
    cancelled : callable, optional
        Asked after every round.
    state : State, optional
        Where to go on; its seed holds.

    Returns
    -------
    State

    Raises
    ------
    ProjectError
        When no structure has enough ghosts, or nothing is free to change.
    """
    problem.check()
    begun, spent = time.perf_counter(), 0.0 if state is None else state.seconds
    state = State(seed) if state is None else state
    workers = min(threads or os.cpu_count() or 1, ACTIVE)
    with ThreadPoolExecutor(workers) as pool:
        while not _done(state, most_searches):
            state = _with_new_runs(state, problem)
            advanced = pool.map(partial(advance, problem=problem, seed=state.seed), state.runs)
            state = replace(state, runs=tuple(advanced))
            state = _without_stale_runs(state, problem)
            elapsed = time.perf_counter() - begun
            state = replace(state, seconds=spent + elapsed)
            if progress is not None:
                progress(state)
            if (time_limit is not None and elapsed >= time_limit) or (cancelled is not None and cancelled()):
                break
    return state


def _done(state: State, most_searches: int | None) -> bool:
    best = state.best
    if best is not None and best.cost <= SOLVED:
        return True
    return most_searches is not None and state.searches >= most_searches


def _with_new_runs(state: State, problem: Problem) -> State:
    runs, number = list(state.runs), state.next_run
    while len(runs) < ACTIVE:
        heirs = _heirs(number, state)
        known = FIRST if heirs else 0
        runs.append(Run(number, _home(number, state, problem), heirs, searches=known, best_at=known))
        number += 1
    return replace(state, runs=tuple(runs), next_run=number)


def _home(number: int, state: State, problem: Problem) -> Structure:
    """Choose the structure of a new run: every one once where they are few, later the good ones more often."""
    count = len(problem.structures)
    order = np.random.default_rng([state.seed, 1]).permutation(count)
    if number < min(count, FEW):
        return problem.structures[int(order[number])]
    random = np.random.default_rng([state.seed, 2, number])
    if state.ended and random.random() < 0.5:
        # good ones first, by a falling chance
        chosen = state.ended[min(int(random.exponential(2.0)), len(state.ended) - 1)].structure
        return chosen if count <= FEW else neighbour(chosen, random)
    return problem.structures[int(random.integers(count))]


def _heirs(number: int, state: State) -> tuple[Candidate, ...]:
    """Return what a run begins with: for one in a few half of the best of those that ended, drawn by chance."""
    if number % HEIRS or len(state.ended) < KEPT:
        return ()
    random = np.random.default_rng([state.seed, 4, number])
    return merge((), [one for one in state.ended if random.random() < 0.5], POOL)


def _without_stale_runs(state: State, problem: Problem) -> State:
    """End the runs that found nothing better for a while, and remember their best."""
    patience = 30 * int(problem.variables(problem.structures[0]).free.size)
    stale = [run for run in state.runs if run.searches - run.best_at > patience]
    ended = [*state.ended, *(one for run in stale for one in run.members[:10])]
    ended.sort(key=lambda one: one.cost)
    return replace(
        state,
        runs=tuple(run for run in state.runs if run not in stale),
        ended=tuple(ended[:KEPT]),
        searches=state.searches + len(state.runs) * batch_size(problem),
    )


def batch_size(problem: Problem) -> int:
    """Return how many local searches a batch has: some hundredths of a second's worth."""
    work = len(problem.objective.targets) * problem.structures[0].rows
    return int(np.clip(3000 // work, 4, 32))


def advance(run: Run, problem: Problem, seed: int) -> Run:
    """Propose and polish one batch.

    Parameters
    ----------
    run : Run
    problem : Problem
    seed : int

    Returns
    -------
    Run
    """
    random = np.random.default_rng([seed, 3, run.number, run.batches])
    count = batch_size(problem)
    known = problem.variables(run.home)
    first = len(run.members) < 2 or run.searches < FIRST
    starts = _first_points(run, problem, known, random, count) if first else [
        propose(run.members, problem, random) for _ in range(count)
    ]  # fmt: skip
    # what is twice as bad as the worst of a full pool is not worth a closer look
    worth = 2.0 * run.members[-1].cost if len(run.members) == POOL else np.inf
    found = polish(problem, starts, worth=worth)
    members = merge(run.members, found, POOL)
    better = not run.members or members[0].cost < 0.999 * run.members[0].cost
    searches = run.searches + count
    return replace(
        run, members=members, batches=run.batches + 1, searches=searches, best_at=searches if better else run.best_at
    )


def _first_points(
    run: Run, problem: Problem, known: Variables, random: np.random.Generator, count: int
) -> list[tuple[Structure, Floats]]:
    points = [(run.home, x) for x in known.random_points(random, count)]
    if run.number == 0 and run.batches == 0:
        given = [(s, problem.variables(s).search_point(vector)) for s, vector in problem.begin_with]
        points[: len(given)] = given
    return points


def propose(members: Sequence[Candidate], problem: Problem, random: np.random.Generator) -> tuple[Structure, Floats]:
    """Draw a new starting point from a pool.

    Parameters
    ----------
    members : sequence of Candidate
        Best first, at least 2.
    problem : Problem
    random : numpy Generator

    Returns
    -------
    structure : Structure
    x : ndarray, shape (1 + 3 K,)
        Not cut to the bounds yet.
    """
    parent = members[int(len(members) * random.random() ** 2)]
    structure, x = parent.structure, parent.x.copy()
    if len(problem.structures) > FEW and random.random() < 0.2:
        structure = neighbour(structure, random)
    known = problem.variables(structure)
    rows, kind = structure.rows, random.random()
    if kind < 0.35:
        # one to three variables drawn anew
        fresh = random.choice(known.free, min(int(random.integers(1, 4)), known.free.size), replace=False)
        x[fresh] = known.random_points(random, 1)[0][fresh]
    elif kind < 0.6:
        # differential evolution's step
        one, other = (members[k] for k in random.choice(len(members), 2, replace=False))
        x += random.uniform(0.3, 1.0) * (one.x - other.x) * (random.random(len(x)) < 0.7)
    elif kind < 0.8:
        # a half of another member
        other = members[int(random.integers(len(members)))]
        if other.structure.stop == structure.stop:
            front = (np.arange(3 * rows) % rows) < structure.stop
            taken = np.concatenate([[False], front if random.random() < 0.5 else ~front])
            x = np.where(taken, other.x, x)
    elif kind < 0.9:
        turned = 1 + rows + random.choice(rows, int(random.integers(1, 3)), replace=False)
        x[turned] = -x[turned]
    else:
        spread = np.repeat([0.3, 0.01, 0.05], [1 + rows, rows, rows])
        x += random.normal(size=len(x)) * spread
    return structure, x


def neighbour(structure: Structure, random: np.random.Generator) -> Structure:
    """Turn one gap from glass to air or back so that every surface still touches glass; the same when none can."""
    for gap in random.permutation(structure.rows):
        glass = list(structure.glass)
        glass[gap] = not glass[gap]
        turned = Structure(structure.stop, tuple(glass))
        if turned.standing_in_air and len(turned.pairs) == len(structure.pairs):
            return turned
    return structure


def polish(
    problem: Problem, starts: Sequence[tuple[Structure, Floats]], *, objective: Objective | None = None,
    steps: int = STEPS, worth: float = np.inf,
) -> list[Candidate]:  # fmt: skip
    """Run a local search from each of several points.

    Parameters
    ----------
    problem : Problem
    starts : sequence of (Structure, ndarray)
    objective : Objective, optional
        None: the problem's.
    steps : int
    worth : float
        Where the picture counts: a lens that costs more before its picture is polished stays as it is.

    Returns
    -------
    list of Candidate
        In the same order; inside the bounds whatever the points were. Where the picture counts, places and sizes are
        polished first, for a picture does not feel a ghost that is far off; one that meets them all is kept so.
    """
    aim = problem.objective if objective is None else objective
    groups: dict[Structure, list[int]] = {}
    for k, (structure, _) in enumerate(starts):
        groups.setdefault(structure, []).append(k)
    found: dict[int, Candidate] = {}
    for structure, which in groups.items():
        known = problem.variables(structure)
        points = np.array([starts[k][1] for k in which])
        ends, costs = polish_within(known, points, replace(aim, picture=None), steps)
        near = np.flatnonzero((costs > SOLVED) & np.isfinite(costs))
        if aim.picture is not None and near.size:
            ends[near], costs[near] = polish_within(known, ends[near], aim, steps // 2, worth=worth)
        found.update((k, Candidate(float(costs[m]), structure, ends[m])) for m, k in enumerate(which))
    return [found[k] for k in range(len(starts))]


def polish_within(
    known: Variables, points: Floats, aim: Objective, steps: int = STEPS, *, worth: float = np.inf
) -> tuple[Floats, Floats]:
    """Run a local search from each of several points of one structure, by the picture where that counts.

    Parameters
    ----------
    known : Variables
        Variables whose bounds are equal stay there.
    points : ndarray, shape (B, 1 + 3 K)
    aim : Objective
    steps : int
        0: only the cost is wanted.
    worth : float
        Where the picture counts: a point that costs more stays where it is.

    Returns
    -------
    ends : ndarray, shape (B, 1 + 3 K)
    costs : ndarray, shape (B,)
    """
    structure = known.structure
    ends, costs = np.empty_like(points), np.empty(len(points))
    picture = aim.picture
    if picture is not None:
        polish_by_picture(
            points, structure.stop, structure.mirrors, aim.entrance, known.low, known.high, known.free, known.longest,
            aim.slopes, aim.wishes, picture.light, picture.unit, picture.edges, picture.rows, picture.limits,
            picture.start, picture.pixel, picture.wanted, steps, worth, ends, costs,
        )  # fmt: skip
        return ends, costs
    matches = np.empty((len(points), len(aim.targets)), np.int64)
    polish_many(
        points, structure.stop, structure.mirrors, aim.entrance, known.low, known.high, known.free, known.longest,
        aim.slopes, aim.spans, aim.targets, aim.weights, aim.signed, aim.extra * aim.extra_part, aim.wishes, steps,
        4, ENOUGH, ends, costs, matches,
    )  # fmt: skip
    return ends, costs


def merge(members: Sequence[Candidate], found: Sequence[Candidate], most: int) -> tuple[Candidate, ...]:
    """Add minima to a pool, best first; one that is there already, or no lens, is left out.

    Parameters
    ----------
    members, found : sequence of Candidate
    most : int

    Returns
    -------
    tuple of Candidate
    """
    out = list(members)
    for one in found:
        # the same cost to seven digits is the same minimum
        if np.isfinite(one.cost) and not any(abs(one.cost - other.cost) < 1e-7 * other.cost for other in out):
            out.append(one)
    out.sort(key=lambda one: one.cost)
    return tuple(out[:most])


def finer(problem: Problem) -> Problem:
    """Return the problem for the last steps: with a finer picture, where the picture counts."""
    picture = problem.objective.picture
    if picture is None or picture.fine is None:
        return problem
    return replace(problem, objective=replace(problem.objective, picture=picture.fine))


def finest(problem: Problem, one: Candidate, steps: int) -> Candidate:
    """Polish a lens a last time.

    Parameters
    ----------
    problem : Problem
        `finer` than that of the search.
    one : Candidate
    steps : int

    Returns
    -------
    Candidate
        Its cost is that of the finer picture, where the picture counts.
    """
    aim = problem.objective
    if aim.picture is None or one.cost <= SOLVED:
        return min(polish(problem, [(one.structure, one.x)], steps=steps)[0], one, key=lambda each: each.cost)
    ends, costs = polish_within(problem.variables(one.structure), one.x[None], aim, steps)
    return Candidate(float(costs[0]), one.structure, ends[0])


@lru_cache(maxsize=2)
def compile_kernels(picture: bool = False) -> None:
    """Compile what a search calls, so that its time is spent searching; `picture`: for one by the picture."""
    structure = Structure(2, (True, False, False, True, False))
    aim = Objective(
        np.array([0.1]), np.array([0, 1]), np.ones((1, 3)), np.ones((1, 3)), True, 0.0, 100.0,
        np.array([[0.0, 1.0, 1.0], [0.0, 9.0, 1.0], [0.0, 1e9, 0.0], [0.1, 0.9, 5.0]]), ("",),
    )  # fmt: skip
    if picture:
        wanted = canvas(aim.targets, aim.spans, [(1.0, 0.0)], light=1.0, half_frame=(20.0, 20.0), blades=6)
        aim = replace(aim, picture=wanted)
    problem = Problem(aim, (structure,), Bounds())
    start = problem.variables(structure).random_points(np.random.default_rng(0), 1)[0]
    polish(problem, [(structure, start)], steps=1)
