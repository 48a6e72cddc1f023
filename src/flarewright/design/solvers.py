"""One way to ask every solver: ours, pools of local minima, and those that evolve."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ProjectError
from .covariance import adapt, imported_cmaes
from .evolution import ALGORITHMS, Settling, evolve, imported_pygmo
from .genes import Genes, Measure, genes_of
from .hunt import Find, Hunt, Limits, Solution, Step
from .polish import compile_kernels, merge
from .problem import Candidate, Problem
from .search import KEPT, State, solve

OURS, CMAES = "pools", "cmaes"
NAMES = (OURS, *ALGORITHMS, CMAES)

__all__ = ["NAMES", "OURS", "Choice", "Limits", "Solution", "chosen", "evolve_with", "make_ready", "solve_with"]


@dataclass(frozen=True)
class Choice:
    """A solver and the size of its archipelago.

    Attributes
    ----------
    name : str
        One of `NAMES`.
    settling : Settling
        Of those that pygmo runs.
    label : str
        As it was asked for.
    """

    name: str
    settling: Settling
    label: str

    @property
    def evolves(self) -> bool:
        """Whether it works on genes, and can be given a fitness to see."""
        return self.name != OURS

    @property
    def unit(self) -> str:
        """What its work is counted in."""
        return "evaluations" if self.evolves else "local searches"


def chosen(text: str) -> Choice:
    """Read `NAME` or `NAME:ISLANDSxPER_GENE` and refuse a solver whose package is not there.

    Parameters
    ----------
    text : str
        Like "pso" or "pso:5x30", the thesis' way to tell a population (figure 6.5).

    Returns
    -------
    Choice

    Raises
    ------
    ProjectError
    """
    name, colon, size = text.strip().lower().partition(":")
    name = OURS if name == "ours" else name
    if name not in NAMES:
        raise ProjectError(f"there is no solver {name!r}; choose from {', '.join(NAMES)}")
    settling = Settling()
    if colon:
        found = re.fullmatch(r"(\d{1,4})x(\d{1,5}(?:\.\d+)?)", size)
        if name not in ALGORITHMS or found is None or not (int(found[1]) > 0 and float(found[2]) > 0.0):
            raise ProjectError(
                f"{text!r} is no size of an archipelago; write islands x individuals for each gene behind one of "
                f"{', '.join(ALGORITHMS)}, like pso:15x15"
            )
        settling = Settling(int(found[1]), float(found[2]))
    if name in ALGORITHMS:
        imported_pygmo(name)
    elif name == CMAES:
        imported_cmaes()
    return Choice(name, settling, text.strip().lower())


def solve_with(
    choice: Choice,
    problem: Problem,
    *,
    limits: Limits,
    seed: int = 0,
    measure: Measure = "ours",
    threads: int | None = None,
    state: State | None = None,
) -> Solution:
    """Search with any solver until the ghosts are met, the time is up, or somebody cancels.

    Parameters
    ----------
    choice : Choice
    problem : Problem
    limits : Limits
    seed : int
    measure : {"ours", "algorithm1"}
        The fitness that solvers see that evolve; ours makes its own least.
    threads : int, optional
        Of ours; the others use one.
    state : State, optional
        Where ours goes on; its seed holds.

    Returns
    -------
    Solution

    Raises
    ------
    ProjectError
        When there is nothing to search, or a package is missing.
    """
    limits = limits.from_now()
    if choice.evolves:
        return _hunted(choice, genes_of(problem, measure), seed, limits)
    steps: list[Step] = []

    def note(now: State) -> None:
        best = now.best
        if best is not None and (not steps or best.cost < steps[-1].best.cost):
            steps.append(Step(now.seconds, now.searches, best))
        if limits.progress is not None:
            limits.progress(now)

    ended = solve(
        problem, seed=seed, time_limit=limits.time_s, most_searches=limits.most, threads=threads, progress=note,
        cancelled=limits.cancelled, state=state,
    )  # fmt: skip
    return Solution(ended, tuple(steps))


def evolve_with(choice: Choice, hunt: Hunt) -> None:
    """Hunt with a solver that evolves, lenses or whatever else has a fitness.

    Parameters
    ----------
    choice : Choice
    hunt : Hunt
        Gets what is found.
    """
    if choice.name == CMAES:
        adapt(hunt)
    else:
        evolve(hunt, choice.name, choice.settling)


def _hunted(choice: Choice, genes: Genes, seed: int, limits: Limits) -> Solution:
    """Hunt lenses; tell them with the costs that our search gives them."""

    def lens(find: Find) -> Candidate:
        return genes.candidates(find.genes[None], np.array([find.cost]))[0]

    progress, tell = limits.progress, None
    if progress is not None:

        def tell(best: Find, work: int) -> None:
            progress(State(seed, ended=(lens(best),), searches=work))

    hunt = Hunt(genes, limits, seed, tell)
    evolve_with(choice, hunt)
    many = np.array([one for _, one in hunt.pool])
    ours = replace(genes, measure="ours")
    found = merge((), ours.candidates(many, ours.fitness(many)), KEPT)
    state = State(seed, ended=found, searches=hunt.work, seconds=hunt.seconds)
    return Solution(state, tuple(Step(find.seconds, find.work, lens(find)) for find in hunt.finds))


def make_ready(choice: Choice, problem: Problem, measure: Measure = "ours") -> None:
    """Compile what a solver calls, so that its time is spent searching."""
    compile_kernels(problem.objective.picture is not None)
    if choice.evolves:
        genes = genes_of(problem, measure)
        start = np.full((1, genes.count), 0.5)
        genes.candidates(start, genes.fitness(start))
