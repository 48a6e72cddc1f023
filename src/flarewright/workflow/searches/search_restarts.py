"""Independent searches of one problem, in turn, by processes of this machine, or on a cluster."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

from ...errors import FlarewrightError, ProjectError
from ...io.files.atomic_write import make_folder, write_bytes_atomically
from ...jobs.cluster.executor import open_cluster, workers_of
from ...jobs.processes import fitting, shares, work_off
from ...jobs.worker import WRITING

if TYPE_CHECKING:
    from ...design.problem.problem import Problem
    from ...design.solvers.evolution_log import Limits
    from ...design.solvers.genes import Measure
    from ...design.solvers.pool_search import Observer, PoolState
    from ...design.solvers.solvers import Choice
    from ...jobs.cluster.executor import Cluster
    from ...typing import Report

FOLDER = "restarts"
"""Folder, in that of a search, with the states of its restarts."""
_SEARCH = "flarewright.workflow.searches.search_restarts:restart_on_worker"
_RUNNING = ".searching-"
# time between two checkpoints, and between two looks at whether the command still runs, seconds
_STORE_S, _LOOK_S = 10.0, 1.0
# memory of a process, bytes
_PROCESS_BYTES = 4e8


@dataclass(frozen=True)
class Sharing:
    """Who works off the restarts of a search; the lenses do not depend on it.

    Attributes
    ----------
    folder : Path
        Existing folder of the search. Restarts keep their states in `FOLDER` there, and go on from those.
    processes : int or None
        1: one restart after the other in this process. None: one process per core.
    cluster : str or None
        Workers of a Dask cluster: "local:4", "tcp://HOST:PORT" or "slurm:FILE" (docs/many-machines.md).
    announce : callable
        Called with sentences about the cluster as they arise.
    """

    folder: Path
    processes: int | None = None
    cluster: str | None = None
    announce: Report = lambda _: None


@dataclass(frozen=True)
class RestartPlan:
    """What all restarts share.

    Attributes
    ----------
    problem : Problem
    choice : Choice
    measure : {"ours", "algorithm1"}
    most : int or None
        Local searches of each.
    running : Path
        File that exists as long as the command that wants the results; its folder holds the states.
    """

    problem: Problem
    choice: Choice
    measure: Measure
    most: int | None
    running: Path

    def state_file(self, number: int) -> Path:
        """Return the file with the state of a restart."""
        return self.running.parent / f"{number + 1:04}.json"


@dataclass(frozen=True)
class Restart:
    """One of the restarts; `until_s` is the sum of seconds, over all commands, at which it ends."""

    number: int
    seed: int
    until_s: float | None

    def __str__(self) -> str:
        return str(self.number + 1)


@dataclass(frozen=True)
class Ended:
    """What restarts have found, and the seconds that the longest one took in this command."""

    state: PoolState
    longest_s: float


class _StoppedError(Exception):
    """The user ends the search."""


class _Board:
    """The states of all restarts, as this process knows them.

    Parameters
    ----------
    plan : RestartPlan
    seed : int
    restarts : int
    progress : callable, optional
        Called with their sums.
    """

    def __init__(self, plan: RestartPlan, seed: int, restarts: int, progress: Observer | None) -> None:
        from ...design.solvers.pool_search import PoolState
        from ...design.solvers.restarts import restart_seed

        self.plan, self.seed, self.progress = plan, seed, progress
        seeds = [restart_seed(seed, number) for number in range(restarts)]
        self.states = [_stored(plan, number, one) or PoolState(one) for number, one in enumerate(seeds)]
        self.known = sum(one.searches > 0 for one in self.states)
        self.before_s = [one.seconds for one in self.states]

    def items(self, time_s: float | None) -> list[Restart]:
        """Return the restarts that are not finished, each for a time from now."""
        from ...design.solvers.pool_search import finished

        return [
            Restart(number, one.seed, None if time_s is None else one.seconds + time_s)
            for number, one in enumerate(self.states)
            if not finished(one, self.plan.most)
        ]

    def note(self, number: int, now: PoolState) -> None:
        """Note the newest state of a restart, and show it."""
        self.states[number] = now
        self.show()

    def show(self) -> None:
        """Report the sums."""
        from ...design.solvers.restarts import so_far

        if self.progress is not None:
            self.progress(so_far(self.seed, self.states))

    def reread(self) -> None:
        """Take over what other processes have stored since."""
        for number, one in enumerate(self.states):
            stored = _stored(self.plan, number, one.seed)
            if stored is not None and stored.searches > one.searches:
                self.states[number] = stored

    @property
    def longest_s(self) -> float:
        """Seconds of the longest restart since the start."""
        return max(one.seconds - start for one, start in zip(self.states, self.before_s, strict=True))


def search_restarts(
    choice: Choice,
    problem: Problem,
    state: PoolState,
    sharing: Sharing,
    *,
    limits: Limits,
    measure: Measure = "ours",
    threads: int | None = None,
    report: Report = lambda _: None,
) -> Ended:
    """Search `state.restarts` times, each with another seed, and return the best minima of all.

    Parameters
    ----------
    choice : Choice
    problem : Problem
    state : PoolState
        Its seed and number of restarts count.
    sharing : Sharing
    limits : Limits
        Of each restart; `progress` gets their sums.
    measure : {"ours", "algorithm1"}
    threads : int, optional
        Of all processes together; None: the cores.
    report : callable
        Called with a sentence when restarts of an earlier command go on.

    Returns
    -------
    Ended
        The same minima for any number of processes.

    Raises
    ------
    FlarewrightError
        A state is damaged, cannot be written, or belongs to another project; there is no such cluster.
    """
    from ...design.solvers.restarts import merged

    processes = workers_of(sharing.cluster, sharing.processes, threads)
    running = _folder(sharing.folder) / f"{_RUNNING}{uuid4().hex}"
    plan = RestartPlan(problem, choice, measure, limits.most, running)
    board = _Board(plan, state.seed, state.restarts, limits.progress)
    if board.known:
        report(f"{board.known} of {state.restarts} searches go on where they were")
    items = board.items(limits.time_s)
    with open_cluster(sharing.cluster if items else None, sharing.folder, sharing.announce) as executor:
        number, each = shares(len(items), processes or fitting(_PROCESS_BYTES, threads), threads)
        write_bytes_atomically(running, b"A command searches; its restarts are here.\n")
        board.show()
        asked = limits.cancelled or (lambda: False)
        try:
            if executor is None and number == 1:
                _in_turn(board, items, threads, asked)
            else:
                _elsewhere(board, items, number, each, executor, asked)
        finally:
            # workers that still search end when the file is gone
            with suppress(OSError):
                running.unlink()
    board.reread()
    return Ended(merged(state.seed, board.states), board.longest_s)


def _in_turn(board: _Board, items: Sequence[Restart], threads: int | None, asked: Callable[[], bool]) -> None:
    for item in items:
        board.note(item.number, search_restart(board.plan, item, threads, partial(board.note, item.number), asked))
        if asked():
            return


def _elsewhere(
    board: _Board,
    items: Sequence[Restart],
    processes: int,
    threads: int,
    executor: Cluster | None,
    asked: Callable[[], bool],
) -> None:
    looked = time.monotonic()

    def look() -> None:
        nonlocal looked
        if asked():
            raise _StoppedError
        if board.progress is not None and time.monotonic() - looked > _STORE_S:
            board.reread()
            board.show()
            looked = time.monotonic()

    with suppress(_StoppedError):
        for done in work_off(
            _SEARCH, board.plan, items, processes=processes, threads=threads, what="search", executor=executor,
            watch=look,
        ):  # fmt: skip
            board.note(done.item.number, done.result)


def _folder(folder: Path) -> Path:
    """Return the folder of the states, without the marks of commands that were killed: their workers end."""
    path = folder / FOLDER
    make_folder(path)
    for mark in path.glob(f"{_RUNNING}*"):
        mark.unlink(missing_ok=True)
    return path


def _stored(plan: RestartPlan, number: int, seed: int) -> PoolState | None:
    """Return the state that a restart has stored; None: it has not started."""
    from ...design.solvers.search_state import read_state

    path = plan.state_file(number)
    if not path.exists():
        return None
    state = read_state(path)
    if state.seed != seed or not state.fits(plan.problem):
        raise ProjectError(f"{path} belongs to another search; remove the folder {path.parent} and start again")
    return state


def restart_on_worker(plan: RestartPlan, item: Restart, threads: int | None) -> PoolState:
    """Search once in a process that works off a list; parameters and errors as of `search_restart`."""
    return search_restart(plan, item, threads)


def search_restart(
    plan: RestartPlan,
    item: Restart,
    threads: int | None,
    progress: Observer | None = None,
    asked: Callable[[], bool] = lambda: False,
) -> PoolState:
    """Search once, from where this restart has stopped; its state is stored every 10 s and at the end.

    Parameters
    ----------
    plan : RestartPlan
    item : Restart
    threads : int or None
    progress : callable, optional
        Called with the state after every round.
    asked : callable
        Whether to end early.

    Raises
    ------
    FlarewrightError
        The stored state is damaged, or a state cannot be written.
    """
    from ...design.solvers.evolution_log import Limits
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.search_state import write_state
    from ...design.solvers.solvers import make_ready, solve_with

    state = _stored(plan, item.number, item.seed) or PoolState(item.seed)
    left = None if item.until_s is None else item.until_s - state.seconds
    if left is not None and left <= 0.0:
        return state
    make_ready(plan.choice, plan.problem, plan.measure)
    latest = kept = state
    stored = looked = -inf
    wanted = True

    def store() -> None:
        nonlocal kept, stored
        # after a command that was killed, another one may go on with this restart
        if latest is not kept and plan.running.exists():
            with WRITING:
                write_state(latest, plan.state_file(item.number))
            kept = latest
        stored = time.monotonic()

    def note(now: PoolState) -> None:
        nonlocal latest
        latest = now
        if time.monotonic() - stored > _STORE_S:
            store()
        if progress is not None:
            progress(now)

    def over() -> bool:
        nonlocal looked, wanted
        if time.monotonic() - looked > _LOOK_S:
            wanted, looked = plan.running.exists(), time.monotonic()
        return not wanted or asked()

    try:
        latest = solve_with(
            plan.choice, plan.problem, limits=Limits(left, plan.most, note, over), seed=item.seed,
            measure=plan.measure, threads=threads, state=state,
        ).state  # fmt: skip
    finally:
        store()
    if not wanted:
        raise FlarewrightError(f"search {item} ends: nothing waits for it, or {plan.running.parent} is not seen here")
    return latest
