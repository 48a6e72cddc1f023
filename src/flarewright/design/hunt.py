"""What every solver that evolves reports: the best so far, how it came about, and when to end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .problem import SOLVED, Candidate, Over
from .search import KEPT, Progress, State

Floats = NDArray[np.float64]


class Ground(Protocol):
    """Where a solver hunts: points of numbers from 0 to 1, each with a fitness that is to be least."""

    @property
    def count(self) -> int:
        """Numbers of a point."""

    def fitness(self, genes: Floats) -> Floats:
        """Compute the fitness of many, shape (B, D): shape (B,)."""

    def known(self) -> Sequence[Floats]:
        """List the points that join the first, each of shape (D,)."""


@dataclass(frozen=True)
class Limits:
    """When a solver ends, and whom it tells.

    Attributes
    ----------
    time_s : float or None
        Seconds; None: no limit.
    most : int or None
        Ends after about so many evaluations (local searches), at the same one on every machine.
    progress : callable or None
        Called with the state now and then.
    cancelled : callable or None
        Asked now and then.
    cpu_s : float or None
        Seconds of processor time of this process, all its threads together; None: no limit.
    """

    time_s: float | None = 60.0
    most: int | None = None
    progress: Progress | None = None
    cancelled: Callable[[], bool] | None = None
    cpu_s: float | None = None

    def from_now(self) -> Limits:
        """Return the same limits whose processor time begins to count."""
        if self.cpu_s is None:
            return self
        end, asked = time.process_time() + self.cpu_s, self.cancelled

        def over() -> bool:
            return time.process_time() >= end or (asked is not None and asked())

        return replace(self, cancelled=over, cpu_s=None)


# seconds that may pass after a search, so that it ends with lenses that are worth having
GRACE_S = 1.0


def until(seconds: float, asked: Callable[[], bool], *, clock: Callable[[], float] = time.perf_counter) -> Over:
    """Return what tells whether the time for finishing lenses is up; it begins to count now.

    Parameters
    ----------
    seconds : float
        At least `GRACE_S` count.
    asked : callable
        Whether somebody wants an end. Who wanted that before is given `GRACE_S`; who does later, nothing more.
    clock : callable
        Seconds.

    Returns
    -------
    callable
    """
    begun, hurried = clock(), asked()
    allowed = GRACE_S if hurried else max(GRACE_S, seconds)

    def over() -> bool:
        return clock() - begun >= allowed or (asked() and not hurried)

    return over


@dataclass(frozen=True)
class Step:
    """A new best lens: seconds since the beginning, evaluations (local searches) so far, and the lens."""

    seconds: float
    work: int
    best: Candidate


@dataclass(frozen=True)
class Solution:
    """Where a solver ended, with our costs, and its way there, with the fitness that it saw."""

    state: State
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Find:
    """A new best point: seconds since the beginning, evaluations so far, its fitness, and the point."""

    seconds: float
    work: int
    cost: float
    genes: Floats


@dataclass
class Hunt:
    """The books of a solver that works on genes.

    Attributes
    ----------
    ground : Ground
    limits : Limits
    seed : int
    tell : callable or None
        Called with the best so far and the number of evaluations now and then.
    work : int
        Evaluations so far.
    best : float
        Least fitness so far.
    finds : list of Find
        The best became better so often.
    pool : list of (float, ndarray)
        The best distinct points with their fitness.
    """

    ground: Ground
    limits: Limits
    seed: int
    tell: Callable[[Find, int], None] | None = None
    work: int = 0
    best: float = np.inf
    finds: list[Find] = field(default_factory=list)
    pool: list[tuple[float, Floats]] = field(default_factory=list)
    _begun: float = field(default_factory=time.perf_counter)

    def note(self, genes: Floats, costs: Floats, work: int) -> bool:
        """Take in what was found with so many evaluations; return whether the work is over.

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
            self.finds.append(Find(self.seconds, self.work, self.best, genes[k].copy()))
        limits = self.limits
        if self.tell is not None and self.finds:
            self.tell(self.finds[-1], self.work)
        over = limits.time_s is not None and self.seconds >= limits.time_s
        over = over or (limits.most is not None and self.work >= limits.most) or self.best <= SOLVED
        return over or (limits.cancelled is not None and limits.cancelled())

    @property
    def seconds(self) -> float:
        """Seconds since the beginning."""
        return time.perf_counter() - self._begun


def _distinct(pool: Sequence[tuple[float, Floats]]) -> list[tuple[float, Floats]]:
    """Return the best, without those of the same fitness."""
    found: list[tuple[float, Floats]] = []
    for cost, genes in sorted(pool, key=lambda one: one[0]):
        if not found or cost - found[-1][0] > 1e-7 * cost:
            found.append((cost, genes))
    return found[:KEPT]
