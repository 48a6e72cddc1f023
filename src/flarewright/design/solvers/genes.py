"""A lens as numbers from 0 to 1, for solvers that do not know lenses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import ProjectError
from ...kernels.design import fitness as kernel
from ...kernels.design.arguments import GeneCode
from ...typing import Floats
from ..problem.prescription import Structure
from ..problem.problem import LensCandidate, Problem

Measure = Literal["ours", "algorithm1"]

_KINDS: dict[str, int] = {"ours": kernel.OURS, "algorithm1": kernel.ALGORITHM_1}


@dataclass(frozen=True)
class Genes:
    """Genes of a problem: their decoding and their fitness.

    Attributes
    ----------
    problem : Problem
    measure : {"ours", "algorithm1"}
        The cost of the built-in solver, at the best matching, or Algorithm 1 of Van Acoleyen 2025 with the problem's
        limits.
    code : GeneCode
        How they are decoded.
    """

    problem: Problem
    measure: Measure
    code: GeneCode

    @property
    def count(self) -> int:
        """Number of genes, the size of the decision vector in the thesis."""
        return len(self.code.places)

    def fitness(self, genes: Floats) -> Floats:
        """Compute the fitness of many points, shape (B, D): shape (B,)."""
        aim, out = self.problem.objective, np.empty(len(genes))
        kernel.fitness_of_genes(
            np.ascontiguousarray(genes), self.code, _KINDS[self.measure], aim.entrance, aim.for_kernels, aim.limits, out
        )
        return out

    def candidates(self, genes: Floats, costs: Floats) -> tuple[LensCandidate, ...]:
        """Convert genes, shape (B, D), with their fitness to lenses inside the bounds."""
        size = self.code.low.shape[1]
        xs, stops = np.empty((len(genes), size)), np.empty(len(genes), np.int64)
        glass = np.empty((len(genes), len(self.code.pattern)), np.bool_)
        kernel.decode_many(np.ascontiguousarray(genes), self.code, xs, stops, glass)
        return tuple(
            LensCandidate(float(cost), Structure(int(stop), tuple(bool(one) for one in gaps)), x)
            for cost, stop, gaps, x in zip(costs, stops, glass, xs, strict=True)
        )

    def known(self) -> list[Floats]:
        """Return the lenses of the first population, as genes."""
        return [self.encode(structure, vector) for structure, vector in self.problem.begin_with]

    def encode(self, structure: Structure, vector: Floats) -> Floats:
        """Convert a prescription to genes, clipped to the bounds.

        Parameters
        ----------
        structure : Structure
        vector : ndarray, shape (1 + 3 K,)

        Returns
        -------
        ndarray, shape (D,)
        """
        rows = structure.rows
        x = self.problem.variables(structure).search_point(vector)
        glass = np.array(structure.glass)
        side = np.concatenate([[0], np.tile(glass.astype(int), 3)])
        low, high = (np.take_along_axis(table, side[None], axis=0)[0] for table in (self.code.low, self.code.high))
        span = np.where(high > low, high - low, 1.0)
        part = np.where(high > low, (x - low) / span, 0.5)
        bent = slice(1 + rows, 1 + 2 * rows)
        part[bent] = 0.5 + 0.5 * np.cbrt(2.0 * part[bent] - 1.0)
        index = slice(1 + 2 * rows, None)
        free = self.code.pattern < 0
        chosen = kernel.AIR_PART + (1.0 - kernel.AIR_PART) * part[index]
        part[index] = np.where(free, np.where(glass, chosen, 0.5 * kernel.AIR_PART), part[index])
        stops = self.code.stops
        where = (int(np.flatnonzero(stops == structure.stop)[0]) + 0.5) / len(stops)
        return np.asarray(np.concatenate([[where], part])[self.code.places], dtype=np.float64)


def genes_of(problem: Problem, measure: Measure = "ours") -> Genes:
    """Return the genes of a problem.

    Parameters
    ----------
    problem : Problem
        Several structures mean every pattern without a surface between air and air, at each of their stops.
    measure : {"ours", "algorithm1"}

    Raises
    ------
    ProjectError
        When no structure has enough ghosts, or nothing is free to change.
    """
    problem.check()
    if len(problem.structures) > 1 and problem.fixed_rows:
        raise ProjectError('fixed rows belong to one structure; choose structure = "lens" or another solver')
    first = problem.structures[0]
    rows, several = first.rows, len(problem.structures) > 1
    stops = np.array(sorted({one.stop for one in problem.structures}), dtype=np.int64)
    pattern = np.array([-1] * rows if several else first.glass, dtype=np.int64)
    tables = [
        # the stop is flat: bounds of each curvature come from a structure whose stop is elsewhere
        [problem.variables(one) for one in (_as(first, glass, 0, several), _as(first, glass, 1, several))]
        for glass in (False, True)
    ]
    low = np.array([np.minimum(*(one.low for one in pair)) for pair in tables])
    high = np.array([np.maximum(*(one.high for one in pair)) for pair in tables])
    moves = np.concatenate([[len(stops) > 1], (high > low).any(axis=0)])
    if several:
        # these genes choose between glass and air; behind the last row is air, whatever its gene
        moves[2 + 2 * rows : -1] = True
        moves[-1] = False
    elif first.stop < rows:
        moves[2 + rows + first.stop] = False
    return Genes(problem, measure, GeneCode(stops, pattern, np.flatnonzero(moves).astype(np.int64), low, high))


def _as(first: Structure, glass: bool, stop: int, several: bool) -> Structure:
    """Return a structure with all gaps of one kind, or `first` if there is no choice."""
    return Structure(stop, (glass,) * first.rows) if several else first
