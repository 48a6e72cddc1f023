"""Search lenses for a project's ghost targets, from the project to the best distinct lenses."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...errors import ProjectError
from ...typing import Report

if TYPE_CHECKING:
    from ...design.finishing.candidate import Outcome
    from ...design.finishing.constraints import Breach
    from ...design.problem.impossible import Obstacle
    from ...design.problem.problem import Over, Problem
    from ...design.solvers.genes import Measure
    from ...design.solvers.pool_search import Observer, PoolState
    from ...design.solvers.solvers import Choice
    from ...model import Iris, Project
    from ...render.scene.resolve import ResolvedProject
    from .search_restarts import Sharing

FINISHING = 0.15
"""Part of the time for finishing lenses with traced rays or glasses."""


@dataclass(frozen=True)
class LensSearch:
    """Result of a search.

    Attributes
    ----------
    problem : Problem
    settled : ResolvedProject
        Lens and aperture of the project.
    state : PoolState
        Final state of the search, from which it can resume.
    outcomes : tuple of Outcome
        Best distinct lenses, best first. If none meets the hard limits, the nearest ones.
    obstacles : tuple of Obstacle
        Targets that no lens can meet.
    conflict : tuple of Breach
        Hard limits that the nearest lens breaks even without targets; they contradict each other.
    """

    problem: Problem
    settled: ResolvedProject
    state: PoolState
    outcomes: tuple[Outcome, ...]
    obstacles: tuple[Obstacle, ...]
    conflict: tuple[Breach, ...]


def search_lenses(
    project: Project,
    *,
    time_s: float = 60.0,
    seed: int = 0,
    state: PoolState | None = None,
    lenses: int = 5,
    searches: int | None = None,
    threads: int | None = None,
    choice: Choice | None = None,
    measure: Measure = "ours",
    name: str | None = None,
    report: Report = lambda _: None,
    progress: Callable[[str], Observer | None] = lambda _unit: None,
    cancelled: Callable[[], bool] = lambda: False,
    sharing: Sharing | None = None,
) -> LensSearch:
    """Search lenses whose ghosts meet a project's targets.

    Parameters
    ----------
    project : Project
        Its `design` has the targets; without a design, other lenses with the same ghosts are searched.
    time_s : float
        Time for the search, or for each of its restarts, and for finishing the lenses.
    seed : int
        Seed of the random numbers.
    state : PoolState, optional
        State of an earlier search to resume, or with a number of `restarts`, which need `sharing`.
    lenses : int
        Largest number of distinct lenses to return.
    searches : int, optional
        Number of local searches after which the search ends, or each of its restarts.
    threads : int, optional
        Default: all cores; the lenses do not depend on it.
    choice : Choice, optional
        Solver (default: pools of local minima).
    measure : {"ours", "algorithm1"}
        Fitness of evolutionary solvers.
    name : str, optional
        Name of the lenses (default: from the project's lens).
    report : callable
        Called with a line for each impossible target, before the search.
    progress : callable
        Called with the unit that the solver counts; returns the callback that gets the state during the search.
    cancelled : callable
        Returns True to end the search early.
    sharing : Sharing, optional
        Who works off the restarts, and where they keep their states.

    Raises
    ------
    ProjectError
        When the targets cannot be read, the state belongs to another project, or there is no such cluster.

    Examples
    --------
    >>> import flarewright as fw
    >>> targets = (fw.GhostTarget(ghost="4-1", move_mm=2.0),)
    >>> project = fw.Project(
    ...     lens="heliar-tronnier", lights=(fw.Light(field_deg=(8, 0)),), design=fw.Design(ghost_targets=targets)
    ... )
    >>> found = search_lenses(project, time_s=5.0)  # doctest: +SKIP
    >>> found.outcomes[0].fitness  # doctest: +SKIP
    """
    from ...design.problem.impossible import obstacles
    from ...design.problem.target import problem_of
    from ...design.solvers.evolution_log import Limits, until
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.solvers import chosen, make_ready, solve_with
    from .search_restarts import search_restarts

    problem, settled = problem_of(project)
    state = PoolState(seed) if state is None else state
    if not state.fits(problem):
        raise ProjectError("the search was started for a lens with another number of rows; restart it")
    if state.restarts > 1 and sharing is None:
        raise ProjectError(f"the search has {state.restarts} restarts, which need a folder; give sharing")
    proven = obstacles(problem, project)
    for one in proven:
        report(f"impossible: {one.reason}")
    solver = chosen("pools") if choice is None else choice
    make_ready(solver, problem, measure)
    # reserve part of the time for finishing with rays and glasses
    rest, started = FINISHING * time_s if problem.traced or problem.glasses is not None else 0.0, time.perf_counter()
    limits = Limits(time_s - rest, searches, progress(solver.unit), cancelled)
    if sharing is not None:
        ended = search_restarts(
            solver, problem, state, sharing, limits=limits, measure=measure, threads=threads, report=report
        )
        # the time that remains must not depend on how many restarts ran at a time
        state, started = ended.state, time.perf_counter() - ended.longest_s
    else:
        state = solve_with(
            solver, problem, limits=limits, seed=state.seed, measure=measure, threads=threads, state=state
        ).state
    over = until(time_s - (time.perf_counter() - started), cancelled)
    found, conflict = _best(state, problem, lenses, name or f"After {settled.lens.name}", settled.iris, over)
    return LensSearch(problem, settled, state, found, tuple(proven), conflict)


def _best(
    state: PoolState, problem: Problem, count: int, name: str, iris: Iris | None, over: Over
) -> tuple[tuple[Outcome, ...], tuple[Breach, ...]]:
    """Return the best lenses; if none meets the hard limits, the nearest ones and the contradicting limits."""
    from ...design.finishing.candidate import nearest_outcomes, outcomes
    from ...design.finishing.constraints import without_ghosts

    found = outcomes(state, problem, count=count, name=name, iris=iris, over=over)
    if found or not problem.bounds.hard:
        return found, ()
    nearest = nearest_outcomes(state, problem, count=count, name=name, iris=iris, over=over)
    return nearest, without_ghosts(problem, seed=state.seed)
