"""The built-in solver: iterated local search over pools of minima, with many restarts, on all cores.

A run is a pool of local minima of one structure, or of neighbouring ones where there are thousands. It proposes new
starting points from its pool (some variables redrawn, a step between members, halves of two members around the stop,
curvatures with flipped sign), polishes them (`kernels.design.local_search`) and keeps the best. A run
without improvement is replaced. Runs are independent, and each batch has its own random numbers, so the same seed gives
the same lenses for any number of threads, and an interrupted run resumes with the same result.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...typing import Floats
from ..problem.prescription import Structure
from ..problem.problem import SOLVED, LensCandidate, Problem
from ..problem.variables import Variables
from .polish import merge_pools, polish

# number of concurrent runs; a constant, so that results do not depend on the number of threads
ACTIVE = 4
# number of minima in the pool of a run
POOL = 40
# number of random starts of a run before it proposes points from its pool
FIRST = 160
# largest number of structures that are tried one by one
MOST_STRUCTURES = 24
# one run in this many starts from the best minima of ended runs
INHERIT_EVERY = 3
# number of best lenses kept from ended runs
KEPT = 60


@dataclass(frozen=True)
class Run:
    """A pool of minima, best first, and its counts of batches and searches."""

    number: int
    home: Structure
    members: tuple[LensCandidate, ...] = ()
    batches: int = 0
    searches: int = 0
    best_at: int = 0


@dataclass(frozen=True)
class PoolState:
    """Complete state of a search, enough to resume it.

    Attributes
    ----------
    seed : int
    runs : tuple of Run
        Active runs.
    ended : tuple of LensCandidate
        The best minima of ended runs, best first.
    next_run, searches : int
    seconds : float
        Total search time.
    restarts : int
        Number of independent searches whose best minima these are (`restarts`).
    """

    seed: int
    runs: tuple[Run, ...] = ()
    ended: tuple[LensCandidate, ...] = ()
    next_run: int = 0
    searches: int = 0
    seconds: float = 0.0
    restarts: int = 1

    def fits(self, problem: Problem) -> bool:
        """Return whether its lenses have as many rows as those of a problem."""
        rows = problem.structures[0].rows
        members = [one for run in self.runs for one in run.members] + list(self.ended)
        return all(one.structure.rows == rows for one in members)

    @property
    def best(self) -> LensCandidate | None:
        """Lowest minimum so far."""
        found = [run.members[0] for run in self.runs if run.members] + list(self.ended[:1])
        return min(found, key=lambda one: one.cost) if found else None


Observer = Callable[[PoolState], None]


def solve(
    problem: Problem,
    *,
    seed: int = 0,
    time_limit: float | None = 60.0,
    most_searches: int | None = None,
    threads: int | None = None,
    progress: Observer | None = None,
    cancelled: Callable[[], bool] | None = None,
    state: PoolState | None = None,
) -> PoolState:
    """Search until the targets are met, the time is up, or the caller cancels.

    Parameters
    ----------
    problem : Problem
    seed : int
    time_limit : float, optional
        Seconds of this call; None: no limit.
    most_searches : int, optional
        Approximate number of local searches, the same on every machine.
    threads : int, optional
        None: all cores; more than `ACTIVE` have no effect, and the lenses do not depend on it.
    progress : callable, optional
        Called with the state after every round.
    cancelled : callable, optional
        Called after every round.
    state : PoolState, optional
        Search to resume; its seed replaces `seed`.

    Raises
    ------
    ProjectError
        When no structure has enough ghosts, or nothing is free to change.
    """
    problem.check()
    started, spent = time.perf_counter(), 0.0 if state is None else state.seconds
    state = PoolState(seed) if state is None else state
    workers = min(threads or os.cpu_count() or 1, ACTIVE)
    with ThreadPoolExecutor(workers) as pool:
        while not finished(state, most_searches):
            state = _with_new_runs(state, problem)
            advanced = pool.map(partial(advance, problem=problem, seed=state.seed), state.runs)
            state = replace(state, runs=tuple(advanced))
            state = _without_stale_runs(state, problem)
            elapsed = time.perf_counter() - started
            state = replace(state, seconds=spent + elapsed)
            if progress is not None:
                progress(state)
            if (time_limit is not None and elapsed >= time_limit) or (cancelled is not None and cancelled()):
                break
    return state


def finished(state: PoolState, most_searches: int | None) -> bool:
    """Return whether a search has met its targets or made its number of local searches."""
    best = state.best
    if best is not None and best.cost <= SOLVED:
        return True
    return most_searches is not None and state.searches >= most_searches


def _with_new_runs(state: PoolState, problem: Problem) -> PoolState:
    runs, number = list(state.runs), state.next_run
    while len(runs) < ACTIVE:
        inherited = _inherited_members(number, state)
        known = FIRST if inherited else 0
        runs.append(Run(number, _home(number, state, problem), inherited, searches=known, best_at=known))
        number += 1
    return replace(state, runs=tuple(runs), next_run=number)


def _home(number: int, state: PoolState, problem: Problem) -> Structure:
    """Choose the structure of a new run: each once if they are few, then good ones more often."""
    count = len(problem.structures)
    order = np.random.default_rng([state.seed, 1]).permutation(count)
    if number < min(count, MOST_STRUCTURES):
        return problem.structures[int(order[number])]
    random = np.random.default_rng([state.seed, 2, number])
    if state.ended and random.random() < 0.5:
        # good structures first, with exponentially falling probability
        chosen = state.ended[min(int(random.exponential(2.0)), len(state.ended) - 1)].structure
        return chosen if count <= MOST_STRUCTURES else neighbour(chosen, random)
    return problem.structures[int(random.integers(count))]


def _inherited_members(number: int, state: PoolState) -> tuple[LensCandidate, ...]:
    """Return the first pool of a run: every few runs, a random half of the best minima of ended runs."""
    if number % INHERIT_EVERY or len(state.ended) < KEPT:
        return ()
    random = np.random.default_rng([state.seed, 4, number])
    return merge_pools((), [one for one in state.ended if random.random() < 0.5], POOL)


def _without_stale_runs(state: PoolState, problem: Problem) -> PoolState:
    """End runs without recent improvement, and keep their best minima."""
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
    """Return the number of local searches in a batch, for a few hundredths of a second of work."""
    work = len(problem.objective.targets) * problem.structures[0].rows
    return int(np.clip(3000 // work, 4, 32))


def advance(run: Run, problem: Problem, seed: int) -> Run:
    """Propose and polish one batch."""
    random = np.random.default_rng([seed, 3, run.number, run.batches])
    count = batch_size(problem)
    known = problem.variables(run.home)
    first = len(run.members) < 2 or run.searches < FIRST
    starts = _first_points(run, problem, known, random, count) if first else [
        propose(run.members, problem, random) for _ in range(count)
    ]  # fmt: skip
    # skip the picture of a lens that is twice as bad as the worst of a full pool
    worth = 2.0 * run.members[-1].cost if len(run.members) == POOL else np.inf
    found = polish(problem, starts, worth=worth)
    members = merge_pools(run.members, found, POOL)
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


def propose(
    members: Sequence[LensCandidate], problem: Problem, random: np.random.Generator
) -> tuple[Structure, Floats]:
    """Draw a new starting point from a pool.

    Parameters
    ----------
    members : sequence of LensCandidate
        Best first, at least 2.
    problem : Problem
    random : numpy Generator

    Returns
    -------
    structure : Structure
    x : ndarray, shape (1 + 3 K,)
        May lie outside the bounds.
    """
    parent = members[int(len(members) * random.random() ** 2)]
    structure, x = parent.structure, parent.x.copy()
    if len(problem.structures) > MOST_STRUCTURES and random.random() < 0.2:
        structure = neighbour(structure, random)
    known = problem.variables(structure)
    rows, kind = structure.rows, random.random()
    if kind < 0.35:
        # redraw one to three variables
        fresh = random.choice(known.free, min(int(random.integers(1, 4)), known.free.size), replace=False)
        x[fresh] = known.random_points(random, 1)[0][fresh]
    elif kind < 0.6:
        # the step of differential evolution
        one, other = (members[k] for k in random.choice(len(members), 2, replace=False))
        x += random.uniform(0.3, 1.0) * (one.x - other.x) * (random.random(len(x)) < 0.7)
    elif kind < 0.8:
        # half of another member
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
    """Switch one gap between glass and air so that every surface still touches glass; unchanged if none can."""
    for gap in random.permutation(structure.rows):
        glass = list(structure.glass)
        glass[gap] = not glass[gap]
        turned = Structure(structure.stop, tuple(glass))
        if turned.standing_in_air and len(turned.pairs) == len(structure.pairs):
            return turned
    return structure
