"""Record of an evolutionary search: the best point, its history, and the conditions to end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from ...typing import Floats
from ..problem.problem import SOLVED, LensCandidate, Over
from .pool_search import KEPT, Observer, PoolState


class SearchSpace(Protocol):
    """A search space: points of numbers from 0 to 1, each with a fitness to minimise."""

    @property
    def count(self) -> int:
        """Number of coordinates of a point."""

    def fitness(self, genes: Floats) -> Floats:
        """Compute the fitness of many points, shape (B, D): shape (B,)."""

    def known(self) -> Sequence[Floats]:
        """Return points for the first population, each of shape (D,)."""


@dataclass(frozen=True)
class Limits:
    """Conditions to end a solver, and its callbacks.

    Attributes
    ----------
    time_s : float or None
        Seconds; None: no limit.
    most : int or None
        Number of evaluations (local searches), approximate, but the same on every machine.
    progress : callable or None
        Called with the state from time to time.
    cancelled : callable or None
        Called from time to time.
    cpu_s : float or None
        Seconds of processor time of this process, all its threads together; None: no limit.
    """

    time_s: float | None = 60.0
    most: int | None = None
    progress: Observer | None = None
    cancelled: Callable[[], bool] | None = None
    cpu_s: float | None = None

    def from_now(self) -> Limits:
        """Return the same limits with processor time counted from now."""
        if self.cpu_s is None:
            return self
        end, asked = time.process_time() + self.cpu_s, self.cancelled

        def over() -> bool:
            return time.process_time() >= end or (asked is not None and asked())

        return replace(self, cancelled=over, cpu_s=None)


# least time for finishing after a search, so that it returns usable lenses, seconds
GRACE_S = 1.0


def until(seconds: float, asked: Callable[[], bool], *, clock: Callable[[], float] = time.perf_counter) -> Over:
    """Return a function that returns whether the time for finishing lenses is up, counted from now.

    Parameters
    ----------
    seconds : float
        At least `GRACE_S`.
    asked : callable
        Whether the user wants to stop. If so already now, `GRACE_S` remain; a later request ends at once.
    clock : callable
        Seconds.

    Returns
    -------
    callable
    """
    started, hurried = clock(), asked()
    allowed = GRACE_S if hurried else max(GRACE_S, seconds)

    def over() -> bool:
        return clock() - started >= allowed or (asked() and not hurried)

    return over


@dataclass(frozen=True)
class LogStep:
    """A new best lens: seconds since the start, evaluations (local searches) so far, and the lens."""

    seconds: float
    work: int
    best: LensCandidate


@dataclass(frozen=True)
class Solution:
    """Result of a solver with the built-in costs, and its history with the fitness that the solver saw."""

    state: PoolState
    steps: tuple[LogStep, ...]


@dataclass(frozen=True)
class Improvement:
    """A new best point: seconds since the start, evaluations so far, its fitness, and the point."""

    seconds: float
    work: int
    cost: float
    genes: Floats


@dataclass
class SearchRecord:
    """Record of an evolutionary search.

    Attributes
    ----------
    space : SearchSpace
    limits : Limits
    seed : int
    tell : callable or None
        Called from time to time with the best point so far and the number of evaluations.
    work : int
        Evaluations so far.
    best : float
        Lowest fitness so far.
    improvements : list of Improvement
        All improvements of the best point.
    pool : list of (float, ndarray)
        The best distinct points with their fitness.
    """

    space: SearchSpace
    limits: Limits
    seed: int
    tell: Callable[[Improvement, int], None] | None = None
    work: int = 0
    best: float = np.inf
    improvements: list[Improvement] = field(default_factory=list)
    pool: list[tuple[float, Floats]] = field(default_factory=list)
    _started: float = field(default_factory=time.perf_counter)

    def note(self, genes: Floats, costs: Floats, work: int) -> bool:
        """Record points found with `work` evaluations; return whether the search ends.

        Parameters
        ----------
        genes : ndarray, shape (B, D)
        costs : ndarray, shape (B,)
        work : int
        """
        self.work += work
        worst = self.pool[-1][0] if len(self.pool) == KEPT else np.inf
        better = [k for k in np.argsort(costs, kind="stable")[:KEPT] if costs[k] < worst]
        if better:
            self.pool = _distinct(self.pool + [(float(costs[k]), genes[k].copy()) for k in better])
        k = int(np.argmin(costs))
        if costs[k] < self.best:
            self.best = float(costs[k])
            self.improvements.append(Improvement(self.seconds, self.work, self.best, genes[k].copy()))
        limits = self.limits
        if self.tell is not None and self.improvements:
            self.tell(self.improvements[-1], self.work)
        over = limits.time_s is not None and self.seconds >= limits.time_s
        over = over or (limits.most is not None and self.work >= limits.most) or self.best <= SOLVED
        return over or (limits.cancelled is not None and limits.cancelled())

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._started


def _distinct(pool: Sequence[tuple[float, Floats]]) -> list[tuple[float, Floats]]:
    """Return the best points without those of equal fitness."""
    found: list[tuple[float, Floats]] = []
    for cost, genes in sorted(pool, key=lambda one: one[0]):
        if not found or cost - found[-1][0] > 1e-7 * cost:
            found.append((cost, genes))
    return found[:KEPT]
