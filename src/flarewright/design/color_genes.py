"""Coatings as numbers from 0 to 1, for solvers that know nothing of coatings, and one way to ask every solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .color_search import ColorStep, solve_colors
from .colors import Coatings, ColorProblem, color_residuals, colors_of, log_colors, log_reflectances
from .hunt import Hunt, Limits
from .objective import algorithm_2
from .solvers import Choice, evolve_with

Floats = NDArray[np.float64]
ColorMeasure = Literal["ours", "algorithm2"]

# of the range of a film's thickness this part means that a second or third film is not there
ABSENT_PART = 0.2


@dataclass(frozen=True)
class ColorGenes:
    """A problem of colours as a hunting ground.

    Attributes
    ----------
    problem : ColorProblem
    measure : {"ours", "algorithm2"}
        The cost that our search makes least, or Algorithm 2 of Van Acoleyen 2025.
    """

    problem: ColorProblem
    measure: ColorMeasure = "ours"

    @property
    def count(self) -> int:
        """Number of genes: one or two for each film of each mirror."""
        return len(self.problem.rows) * len(self.problem.limits()[0])

    def values(self, genes: Floats) -> Floats:
        """Turn many, shape (B, D), into values of coatings, shape (B, M, P)."""
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
        """Compute the fitness of many, shape (B, D): shape (B,)."""
        values = self.values(genes)
        if self.measure == "algorithm2":
            return np.asarray(algorithm_2(self.problem.targets, colors_of(self.problem, values)))
        logs = log_colors(self.problem, log_reflectances(self.problem, values))
        residuals = color_residuals(self.problem, logs.transpose(1, 0, 2))
        return np.asarray((residuals**2).sum(axis=(0, 2)), dtype=np.float64)

    def known(self) -> list[Floats]:
        """List what joins the first: nothing, for the coatings that are there need not be of this kind."""
        return []


def colors_with(
    choice: Choice, problem: ColorProblem, *, limits: Limits, starts: int = 64, seed: int = 0,
    measure: ColorMeasure = "ours", threads: int | None = None, note: Callable[[ColorStep], None] | None = None,
) -> Coatings:  # fmt: skip
    """Choose coatings with any solver.

    Parameters
    ----------
    choice : Choice
    problem : ColorProblem
    limits : Limits
        `most` is for solvers that evolve, whose evaluations it counts; ours makes so many `starts`.
    starts : int
    seed : int
    measure : {"ours", "algorithm2"}
        The fitness that solvers see that evolve.
    threads : int, optional
        Of ours; the others use one.
    note : callable, optional
        Gets every setting that is better than those before.

    Returns
    -------
    Coatings
        With the cost that the solver made least.

    Raises
    ------
    ProjectError
        When no ghost's colour is asked for, or no surface can be coated.
    """
    limits = limits.from_now()
    if not choice.evolves:
        return solve_colors(
            problem, seed=seed, starts=starts, threads=threads, time_limit=limits.time_s, cancelled=limits.cancelled,
            note=note,
        )  # fmt: skip
    problem.check()
    genes = ColorGenes(problem, measure)
    hunt = Hunt(genes, limits, seed)
    evolve_with(choice, hunt)
    if note is not None:
        for find in hunt.finds:
            note(ColorStep(find.seconds, find.work, genes.values(find.genes[None])[0]))
    best = hunt.finds[-1]
    values = genes.values(best.genes[None])[0]
    return Coatings(best.cost, values, colors_of(problem, values))
