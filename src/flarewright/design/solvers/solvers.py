"""One interface to every solver: the built-in pool search, and the evolutionary ones."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from ...errors import ProjectError
from ..problem.problem import LensCandidate, Problem
from .cma_es import adapt, imported_cmaes
from .evolution import ALGORITHMS, Archipelago, evolve, imported_pygmo
from .evolution_log import Improvement, Limits, LogStep, SearchRecord, Solution
from .genes import Genes, Measure, genes_of
from .polish import compile_kernels, merge_pools
from .pool_search import KEPT, PoolState, solve

OURS, CMAES = "pools", "cmaes"
NAMES = (OURS, *ALGORITHMS, CMAES)


@dataclass(frozen=True)
class Choice:
    """A solver and the size of its archipelago.

    Attributes
    ----------
    name : str
        One of `NAMES`.
    archipelago : Archipelago
        For the solvers of pygmo.
    label : str
        The text that the user gave.
    """

    name: str
    archipelago: Archipelago
    label: str

    @property
    def evolves(self) -> bool:
        """Whether it is evolutionary: it works on genes and accepts another fitness."""
        return self.name != OURS

    @property
    def unit(self) -> str:
        """Unit of its work."""
        return "evaluations" if self.evolves else "local searches"


def chosen(text: str) -> Choice:
    """Parse `NAME` or `NAME:ISLANDSxPER_GENE` and raise an error if the solver's package is not installed.

    Parameters
    ----------
    text : str
        Like "pso" or "pso:5x30", the thesis' notation of a population (figure 6.5).

    Raises
    ------
    ProjectError
    """
    name, colon, size = text.strip().lower().partition(":")
    name = OURS if name == "ours" else name
    if name not in NAMES:
        raise ProjectError(f"there is no solver {name!r}; choose from {', '.join(NAMES)}")
    archipelago = Archipelago()
    if colon:
        found = re.fullmatch(r"(\d{1,4})x(\d{1,5}(?:\.\d+)?)", size)
        if name not in ALGORITHMS or found is None or not (int(found[1]) > 0 and float(found[2]) > 0.0):
            raise ProjectError(
                f"{text!r} is no size of an archipelago; write islands x individuals for each gene behind one of "
                f"{', '.join(ALGORITHMS)}, like pso:15x15"
            )
        archipelago = Archipelago(int(found[1]), float(found[2]))
    if name in ALGORITHMS:
        imported_pygmo(name)
    elif name == CMAES:
        imported_cmaes()
    return Choice(name, archipelago, text.strip().lower())


def solve_with(
    choice: Choice,
    problem: Problem,
    *,
    limits: Limits,
    seed: int = 0,
    measure: Measure = "ours",
    threads: int | None = None,
    state: PoolState | None = None,
) -> Solution:
    """Search with any solver until the targets are met, the time is up, or the caller cancels.

    Parameters
    ----------
    choice : Choice
    problem : Problem
    limits : Limits
    seed : int
    measure : {"ours", "algorithm1"}
        Fitness for evolutionary solvers; the built-in solver ignores it.
    threads : int, optional
        Of the built-in solver; the others use one.
    state : PoolState, optional
        Search for the built-in solver to resume; its seed replaces `seed`.

    Raises
    ------
    ProjectError
        When there is nothing to search, or a package is missing.
    """
    limits = limits.from_now()
    if choice.evolves:
        return _evolve_lenses(choice, genes_of(problem, measure), seed, limits)
    steps: list[LogStep] = []

    def note(now: PoolState) -> None:
        best = now.best
        if best is not None and (not steps or best.cost < steps[-1].best.cost):
            steps.append(LogStep(now.seconds, now.searches, best))
        if limits.progress is not None:
            limits.progress(now)

    ended = solve(
        problem, seed=seed, time_limit=limits.time_s, most_searches=limits.most, threads=threads, progress=note,
        cancelled=limits.cancelled, state=state,
    )  # fmt: skip
    return Solution(ended, tuple(steps))


def evolve_with(choice: Choice, record: SearchRecord) -> None:
    """Run an evolutionary solver on any search space.

    Parameters
    ----------
    choice : Choice
    record : SearchRecord
        Records the points found.
    """
    if choice.name == CMAES:
        adapt(record)
    else:
        evolve(record, choice.name, choice.archipelago)


def _evolve_lenses(choice: Choice, genes: Genes, seed: int, limits: Limits) -> Solution:
    """Search lenses with an evolutionary solver; return them with the costs of the built-in solver."""

    def lens(improvement: Improvement) -> LensCandidate:
        return genes.candidates(improvement.genes[None], np.array([improvement.cost]))[0]

    progress, tell = limits.progress, None
    if progress is not None:

        def tell(best: Improvement, work: int) -> None:
            progress(PoolState(seed, ended=(lens(best),), searches=work))

    record = SearchRecord(genes, limits, seed, tell)
    evolve_with(choice, record)
    many = np.array([one for _, one in record.pool])
    ours = replace(genes, measure="ours")
    found = merge_pools((), ours.candidates(many, ours.fitness(many)), KEPT)
    state = PoolState(seed, ended=found, searches=record.work, seconds=record.seconds)
    return Solution(
        state,
        tuple(LogStep(improvement.seconds, improvement.work, lens(improvement)) for improvement in record.improvements),
    )


def make_ready(choice: Choice, problem: Problem, measure: Measure = "ours") -> None:
    """Compile the kernels that a solver calls, before its time counts."""
    compile_kernels(problem.objective.picture is not None)
    if choice.evolves:
        genes = genes_of(problem, measure)
        start = np.full((1, genes.count), 0.5)
        genes.candidates(start, genes.fitness(start))
