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
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .polish import merge, polish
from .prescription import Structure
from .problem import SOLVED, Candidate, Problem
from .variables import Variables

Floats = NDArray[np.float64]

# runs that are under way at once; not the number of threads, for results must not depend on that
ACTIVE = 4
# minima a run keeps
POOL = 40
# of which so many are drawn before it proposes from them
FIRST = 160
# more structures than this are not gone through one by one
FEW = 24
# one run in so many begins with them
HEIRS = 3
# best lenses remembered of runs that ended
KEPT = 60


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
