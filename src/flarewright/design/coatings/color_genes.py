"""Coatings as genes from 0 to 1, for evolutionary solvers, and `colors_with`, the interface to every solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...typing import Floats
from ..problem.objective import algorithm_2
from ..solvers.evolution_log import Limits, SearchRecord
from ..solvers.solvers import Choice, evolve_with
from .color_search import ColorStep, Step, run_step, solve_colors
from .colors import Coatings, ColorProblem, color_residuals, colors_of, log_colors, log_reflectances

ColorMeasure = Literal["ours", "algorithm2"]

# below this part of the range of a film's thickness, a second or third film counts as absent
ABSENT_PART = 0.2


@dataclass(frozen=True)
class ColorGenes:
    """A coating problem as a search space for evolutionary solvers.

    Attributes
    ----------
    problem : ColorProblem
    measure : {"ours", "algorithm2"}
        The cost of the built-in solver, or Algorithm 2 of Van Acoleyen 2025.
    """

    problem: ColorProblem
    measure: ColorMeasure = "ours"

    @property
    def count(self) -> int:
        """Number of genes: one or two for each film of each mirror."""
        return len(self.problem.rows) * len(self.problem.limits()[0])

    def values(self, genes: Floats) -> Floats:
        """Convert genes, shape (B, D), to values of coatings, shape (B, M, P)."""
        low, high = self.problem.limits()
        part = np.clip(np.nan_to_num(genes), 0.0, 1.0).reshape(len(genes), -1, len(low))
        if self.problem.kind == "quarter-wave":
            return low + part * (high - low)
        thick = part[..., 3::2]
        absent = thick < ABSENT_PART
        part = part.copy()
        part[..., 3::2] = np.maximum(thick - ABSENT_PART, 0.0) / (1.0 - ABSENT_PART)
        values = low + part * (high - low)
        values[..., 3::2][absent] = 0.0
        return values

    def fitness(self, genes: Floats) -> Floats:
        """Compute the fitness of many points, shape (B, D): shape (B,)."""
        values = self.values(genes)
        if self.measure == "algorithm2":
            return np.asarray(algorithm_2(self.problem.targets, colors_of(self.problem, values)))
        logs = log_colors(self.problem, log_reflectances(self.problem, values))
        residuals = color_residuals(self.problem, logs.transpose(1, 0, 2))
        return np.asarray((residuals**2).sum(axis=(0, 2)), dtype=np.float64)

    def known(self) -> list[Floats]:
        """Return no start points: the lens' coatings need not be of this kind."""
        return []


def colors_with(
    choice: Choice, problem: ColorProblem, *, limits: Limits, starts: int = 64, seed: int = 0,
    measure: ColorMeasure = "ours", threads: int | None = None, note: Callable[[ColorStep], None] | None = None,
    step: Step = run_step,
) -> Coatings:  # fmt: skip
    """Choose coatings with a given solver.

    Parameters
    ----------
    choice : Choice
    problem : ColorProblem
    limits : Limits
        `most` counts evaluations of evolutionary solvers; the built-in solver uses `starts` instead.
    starts : int
    seed : int
    measure : {"ours", "algorithm2"}
        Fitness for evolutionary solvers.
    threads : int, optional
        Of the built-in solver; the others use one.
    note : callable, optional
        Called with every setting that is better than those before.
    step : callable, optional
        As in `solve_colors`; evolutionary solvers have no steps to record.

    Returns
    -------
    Coatings
        With the cost that the solver minimised.

    Raises
    ------
    ProjectError
        When no ghost has a target colour, or no surface can be coated.
    """
    limits = limits.from_now()
    if not choice.evolves:
        return solve_colors(
            problem, seed=seed, starts=starts, threads=threads, time_limit=limits.time_s, cancelled=limits.cancelled,
            note=note, step=step,
        )  # fmt: skip
    problem.check()
    genes = ColorGenes(problem, measure)
    record = SearchRecord(genes, limits, seed)
    evolve_with(choice, record)
    if note is not None:
        for improvement in record.improvements:
            note(ColorStep(improvement.seconds, improvement.work, genes.values(improvement.genes[None])[0]))
    best = record.improvements[-1]
    values = genes.values(best.genes[None])[0]
    return Coatings(best.cost, values, colors_of(problem, values))
