"""Hard constraints: what a designed lens keeps, how far it is off, and the way back."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.design_search import WISHES, wishes_missed
from .polish import polish_within
from .prescription import Structure
from .problem import Candidate, Problem
from .variables import Variables

Floats = NDArray[np.float64]

# a lens that offends by less keeps its constraints: part of a limit; edges and steepness at the beam, mm and part
TOLERANCE = 1e-4
EDGE_TOLERANCE = 1e-3
# the way back takes so many rounds, of which the first ones stiffen the springs
ROUNDS, STIFFER, STEPS = 8, 3, 100
_NAMES = ("focal_length", "f_number", "length")


@dataclass(frozen=True)
class Breach:
    """How far a lens is off one hard constraint.

    Attributes
    ----------
    name : {"focal_length", "f_number", "length", "edges"}
    amount : float
        Part of the limit; of edges, mm or part of the radius of curvature.
    """

    name: str
    amount: float


def breaches(problem: Problem, structure: Structure, vector: Floats) -> tuple[Breach, ...]:
    """Tell which hard constraints a prescription breaks by more than the tolerance.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)

    Returns
    -------
    tuple of Breach
    """
    missed, parts = _missed(problem, structure, vector, problem.objective.wishes)
    found = [
        Breach(name, float(abs(parts[m])))
        for m, name in enumerate(_NAMES)
        if name in problem.bounds.hard and abs(parts[m]) > TOLERANCE
    ]
    worst = float(missed[WISHES:].max(initial=0.0))
    if "edges" in problem.bounds.hard and worst > EDGE_TOLERANCE:
        found.append(Breach("edges", worst))
    return tuple(found)


def kept(problem: Problem, one: Candidate, known: Variables | None = None) -> Candidate | None:
    """Lead a lens back inside its hard constraints at least cost.

    Parameters
    ----------
    problem : Problem
    one : Candidate
    known : Variables, optional
        None: the problem's; else those with some indices held.

    Returns
    -------
    Candidate or None
        The same where it breaks none; None where no way back was found.

    Notes
    -----
    The method of multipliers (Hestenes 1969, Powell 1969): springs that begin further inside by what was missed, and
    that are stiffer in the first rounds, until nothing is missed beyond the tolerance.
    """
    known = problem.variables(one.structure) if known is None else known
    aim, x, hard = problem.objective, one.x, problem.bounds.hard
    wishes = aim.wishes.copy()
    for number in range(ROUNDS + 1):
        vector = known.prescription(x)
        if not breaches(problem, one.structure, vector):
            if number == 0:
                return one
            return Candidate(float(polish_within(known, x[None], aim, 0)[1][0]), one.structure, x)
        missed, _ = _missed(problem, one.structure, vector, aim.wishes)
        for m, name in enumerate(_NAMES):
            if name in hard:
                wishes[m, 1 if missed[m] > 0.0 else 0] -= missed[m]
                wishes[m, 2] *= 5.0 if number < STIFFER else 1.0
        if "edges" in hard:
            wishes[WISHES, 0] += missed[WISHES : WISHES + one.structure.rows].max()
            wishes[WISHES, 1] -= 0.5 * missed[WISHES + one.structure.rows :].max()
            wishes[WISHES, 2] *= 5.0 if number < STIFFER else 1.0
        x = polish_within(known, x[None], replace(aim, wishes=wishes), STEPS)[0][0]
    return None


def without_ghosts(problem: Problem, *, searches: int = 96, seed: int = 0) -> tuple[Breach, ...]:
    """Look for any lens that keeps the hard constraints, whatever its ghosts are.

    Parameters
    ----------
    problem : Problem
    searches : int
        Local searches, over structures evenly spread.
    seed : int

    Returns
    -------
    tuple of Breach
        By how much the nearest lens breaks them; empty when one keeps them. That there is none is not proven.
    """
    aim = problem.objective
    free = stiff(replace(problem, objective=replace(aim, weights=np.zeros_like(aim.weights), extra=0.0, picture=None)))
    random, found = np.random.default_rng(seed), []
    chosen = problem.structures[:: max(1, len(problem.structures) // 12)][:12]
    for structure in chosen:
        known = problem.variables(structure)
        points = known.random_points(random, max(1, searches // len(chosen)))
        ends, costs = polish_within(known, points, free.objective, STEPS)
        found += [Candidate(float(cost), structure, x) for x, cost in zip(ends, costs, strict=True)]
    found.sort(key=lambda one: one.cost)
    for one in found[:8]:
        if kept(free, one) is not None:
            return ()
    best = found[0]
    return breaches(problem, best.structure, problem.variables(best.structure).prescription(best.x))


def stiff(problem: Problem) -> Problem:
    """Return the problem with stiffer springs at its hard constraints, for what is searched near them."""
    wishes = problem.objective.wishes.copy()
    for m, name in enumerate((*_NAMES, "edges")):
        wishes[m, 2] *= 5.0**STIFFER if name in problem.bounds.hard else 1.0
    return replace(problem, objective=replace(problem.objective, wishes=wishes))


def _missed(problem: Problem, structure: Structure, vector: Floats, wishes: Floats) -> tuple[Floats, Floats]:
    """Return what is missed in the limits' own units, 1/efl and 1/f-number among them, and as a part of the limit."""
    raw = wishes.copy()
    raw[:, 2] = (raw[:, 2] > 0.0).astype(float)
    missed = np.empty(WISHES + 2 * structure.rows)
    wishes_missed(vector, structure.stop, problem.objective.entrance, raw, missed)
    limit = np.where(missed[:WISHES] > 0.0, wishes[:WISHES, 1], wishes[:WISHES, 0])
    return missed, missed[:WISHES] / np.maximum(limit, 1e-12)
