"""Hard constraints of a designed lens: measure violations, and remove them at least cost."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...kernels.design.local_search import LIMITS, limit_excess
from ...typing import Floats
from ..problem.prescription import Structure
from ..problem.problem import LensCandidate, Problem
from ..problem.variables import Variables
from ..solvers.polish import polish_within

# tolerance: fraction of a limit; for edges and steepness at the beam, mm and fraction
TOLERANCE = 1e-4
EDGE_TOLERANCE = 1e-3
# rounds of `kept`, and number of first rounds that stiffen the penalties
ROUNDS, STIFFER, STEPS = 8, 3, 100
_NAMES = ("focal_length", "f_number", "length")


@dataclass(frozen=True)
class Breach:
    """Violation of one hard constraint by a lens.

    Attributes
    ----------
    name : {"focal_length", "f_number", "length", "edges"}
    amount : float
        Fraction of the limit; for edges, mm or fraction of the radius of curvature.
    """

    name: str
    amount: float


def breaches(problem: Problem, structure: Structure, vector: Floats) -> tuple[Breach, ...]:
    """Return the hard constraints that a prescription breaks by more than the tolerance.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    """
    missed, parts = _missed(problem, structure, vector, problem.objective.limits)
    found = [
        Breach(name, float(abs(parts[m])))
        for m, name in enumerate(_NAMES)
        if name in problem.bounds.hard and abs(parts[m]) > TOLERANCE
    ]
    worst = float(missed[LIMITS:].max(initial=0.0))
    if "edges" in problem.bounds.hard and worst > EDGE_TOLERANCE:
        found.append(Breach("edges", worst))
    return tuple(found)


def keeps_limits(problem: Problem, one: LensCandidate, known: Variables | None = None) -> LensCandidate | None:
    """Change a lens at least cost until it keeps its hard constraints.

    Parameters
    ----------
    problem : Problem
    one : LensCandidate
    known : Variables, optional
        None: the problem's; otherwise variables with some indices fixed.

    Returns
    -------
    LensCandidate or None
        The same lens if it breaks none; None if no feasible lens was found.

    Notes
    -----
    The method of multipliers (Hestenes 1969, Powell 1969): each round moves the start of a penalty inside the limit by
    the violation that remains, and the first rounds stiffen the penalties, until all violations are within tolerance.
    """
    known = problem.variables(one.structure) if known is None else known
    aim, x, hard = problem.objective, one.x, problem.bounds.hard
    limits = aim.limits.copy()
    for number in range(ROUNDS + 1):
        vector = known.prescription(x)
        if not breaches(problem, one.structure, vector):
            if number == 0:
                return one
            return LensCandidate(float(polish_within(known, x[None], aim, 0)[1][0]), one.structure, x)
        missed, _ = _missed(problem, one.structure, vector, aim.limits)
        for m, name in enumerate(_NAMES):
            if name in hard:
                limits[m, 1 if missed[m] > 0.0 else 0] -= missed[m]
                limits[m, 2] *= 5.0 if number < STIFFER else 1.0
        if "edges" in hard:
            limits[LIMITS, 0] += missed[LIMITS : LIMITS + one.structure.rows].max()
            limits[LIMITS, 1] -= 0.5 * missed[LIMITS + one.structure.rows :].max()
            limits[LIMITS, 2] *= 5.0 if number < STIFFER else 1.0
        x = polish_within(known, x[None], replace(aim, limits=limits), STEPS)[0][0]
    return None


def without_ghosts(problem: Problem, *, searches: int = 96, seed: int = 0) -> tuple[Breach, ...]:
    """Search for any lens that keeps the hard constraints, ignoring its ghosts.

    Parameters
    ----------
    problem : Problem
    searches : int
        Number of local searches, spread evenly over the structures.
    seed : int

    Returns
    -------
    tuple of Breach
        Violations of the nearest lens; empty if one keeps all. A violation is not proven to be unavoidable.
    """
    aim = problem.objective
    free = stiff(replace(problem, objective=replace(aim, weights=np.zeros_like(aim.weights), extra=0.0, picture=None)))
    random, found = np.random.default_rng(seed), []
    chosen = problem.structures[:: max(1, len(problem.structures) // 12)][:12]
    for structure in chosen:
        known = problem.variables(structure)
        points = known.random_points(random, max(1, searches // len(chosen)))
        ends, costs = polish_within(known, points, free.objective, STEPS)
        found += [LensCandidate(float(cost), structure, x) for x, cost in zip(ends, costs, strict=True)]
    found.sort(key=lambda one: one.cost)
    for one in found[:8]:
        if keeps_limits(free, one) is not None:
            return ()
    best = found[0]
    return breaches(problem, best.structure, problem.variables(best.structure).prescription(best.x))


def stiff(problem: Problem) -> Problem:
    """Return the problem with stiffer penalties on its hard constraints, for searches close to them."""
    limits = problem.objective.limits.copy()
    for m, name in enumerate((*_NAMES, "edges")):
        limits[m, 2] *= 5.0**STIFFER if name in problem.bounds.hard else 1.0
    return replace(problem, objective=replace(problem.objective, limits=limits))


def _missed(problem: Problem, structure: Structure, vector: Floats, limits: Floats) -> tuple[Floats, Floats]:
    """Return violations in the limits' own units (1/efl and 1/f-number included), and as fractions of the limit."""
    raw = limits.copy()
    raw[:, 2] = (raw[:, 2] > 0.0).astype(float)
    missed = np.empty(LIMITS + 2 * structure.rows)
    limit_excess(vector, structure.stop, problem.objective.entrance, raw, missed)
    limit = np.where(missed[:LIMITS] > 0.0, limits[:LIMITS, 1], limits[:LIMITS, 0])
    return missed, missed[:LIMITS] / np.maximum(limit, 1e-12)
