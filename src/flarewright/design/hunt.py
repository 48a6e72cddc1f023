"""What every solver reports: the best so far, how it came about, and when to end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .genes import Genes
from .search import KEPT, SOLVED, Candidate, Progress, State, merge

Floats = NDArray[np.float64]


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
    """

    time_s: float | None = 60.0
    most: int | None = None
    progress: Progress | None = None
    cancelled: Callable[[], bool] | None = None


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


@dataclass
class Hunt:
    """The books of a solver that works on genes.

    Attributes
    ----------
    genes : Genes
    limits : Limits
    seed : int
    work : int
        Evaluations so far.
    best : float
        Least fitness so far.
    """

    genes: Genes
    limits: Limits
    seed: int
    work: int = 0
    best: float = np.inf
    _begun: float = field(default_factory=time.perf_counter)
    _steps: list[Step] = field(default_factory=list)
    _pool: list[tuple[float, Floats]] = field(default_factory=list)

    def note(self, genes: Floats, costs: Floats, work: int) -> bool:
        """Take in what was found with so many evaluations; return whether the work is over.

        Parameters
        ----------
        genes : ndarray, shape (B, D)
        costs : ndarray, shape (B,)
        work : int
        """
        self.work += work
        worst = self._pool[-1][0] if len(self._pool) == KEPT else np.inf
        better = [k for k in np.argsort(costs, kind="stable")[:KEPT] if costs[k] < worst]
        if better:
            self._pool = _distinct(self._pool + [(float(costs[k]), genes[k].copy()) for k in better])
        k = int(np.argmin(costs))
        if costs[k] < self.best:
            self.best = float(costs[k])
            self._steps.append(
                Step(self._elapsed(), self.work, self.genes.candidates(genes[k : k + 1], costs[k : k + 1])[0])
            )
        limits = self.limits
        if limits.progress is not None and self._steps:
            limits.progress(State(self.seed, ended=(self._steps[-1].best,), searches=self.work))
        over = limits.time_s is not None and self._elapsed() >= limits.time_s
        over = over or (limits.most is not None and self.work >= limits.most) or self.best <= SOLVED
        return over or (limits.cancelled is not None and limits.cancelled())

    def solution(self) -> Solution:
        """Return the best lenses, with the costs that our search gives them."""
        many = np.array([genes for _, genes in self._pool])
        ours = replace(self.genes, measure="ours")
        found = ours.candidates(many, ours.fitness(many))
        state = State(self.seed, ended=merge((), found, KEPT), searches=self.work, seconds=self._elapsed())
        return Solution(state, tuple(self._steps))

    def _elapsed(self) -> float:
        return time.perf_counter() - self._begun


def _distinct(pool: Sequence[tuple[float, Floats]]) -> list[tuple[float, Floats]]:
    """Return the best, without those of the same fitness."""
    found: list[tuple[float, Floats]] = []
    for cost, genes in sorted(pool, key=lambda one: one[0]):
        if not found or cost - found[-1][0] > 1e-7 * cost:
            found.append((cost, genes))
    return found[:KEPT]
