"""What the wanted ghosts leave free: of all lenses that have the very same ghosts, the most moderate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..kernels import design_ghosts as columns
from .ghosts import differentiate, evaluate
from .least_squares import damped_step
from .objective import Objective, misfits
from .polish import STEPS, polish
from .prescription import Structure
from .problem import SOLVED, Candidate, Over, Problem, never
from .search import FEW, solve
from .variables import Variables

Floats = NDArray[np.float64]

# what a misfit weighs against a variable at its bound, squared inversely, round after round
TIGHTER = (1e-1, 1e-2, 1e-3, 1e-4)
# most steps of a round, and the part of its sum that a step must gain for another one
MOST, LEAST_GAIN = 200, 1e-8
# local searches for the same ghosts in another structure
SEARCHES = 5000


def moderation(known: Variables, x: Floats) -> float:
    """Sum how far the free variables are from the middle of their bounds: squares of 0, the middle, to 1, a bound.

    Parameters
    ----------
    known : Variables
    x : ndarray, shape (1 + 3 K,)

    Returns
    -------
    float
    """
    return float((_off_middle(known, x[known.free]) ** 2).sum())


def alike(problem: Problem, solved: Candidate, *, seed: int = 0, over: Over = never) -> tuple[Candidate, ...]:
    """Find lenses of several structures that have the ghosts of one that meets its targets.

    Parameters
    ----------
    problem : Problem
    solved : Candidate
    seed : int
    over : callable
        Whether the time is up: then what was found so far is all.

    Returns
    -------
    tuple of Candidate
        One a structure, the most moderate first; other structures only where they are few and the targets have no
        signs. The candidate alone when its cost is above `problem.SOLVED`.

    Notes
    -----
    Looking for signs is what takes long: once they are known, a lens of another structure takes a second, or there is
    none.
    """
    if solved.cost > SOLVED:
        return (solved,)
    found = [to_the_middle(problem, solved, over)]
    if not problem.objective.signed and len(problem.structures) <= FEW:
        signed = replace(problem, objective=_with_signs(problem, solved), begin_with=())
        for structure in problem.structures:
            if structure == solved.structure or over():
                continue
            state = solve(
                replace(signed, structures=(structure,)), seed=seed, time_limit=None, most_searches=SEARCHES,
                cancelled=over,
            )  # fmt: skip
            if state.best is not None and state.best.cost <= SOLVED:
                found.append(to_the_middle(problem, state.best, over))
    return tuple(sorted(found, key=lambda one: moderation(problem.variables(one.structure), one.x)))


def to_the_middle(problem: Problem, solved: Candidate, over: Over = never) -> Candidate:
    """Move the variables of a lens that meets its targets to the middle of their bounds as far as its ghosts stay.

    Parameters
    ----------
    problem : Problem
    solved : Candidate
    over : callable
        Whether the time is up: then it stays where it is.

    Returns
    -------
    Candidate
        The same where its cost is above `problem.SOLVED`, or where nothing is gained.

    Notes
    -----
    A penalty method: squares of the misfits, weighted ever more, and of the distances from the middle.
    """
    if solved.cost > SOLVED:
        return solved
    known, structure = problem.variables(solved.structure), solved.structure
    _, _, ghosts = misfits(problem.objective, structure, known.prescription(solved.x))
    free = known.free
    slopes = np.diag(2.0 / (known.high[free] - known.low[free]))
    x = solved.x
    for tight in TIGHTER:

        def both(x: Floats, tight: float = tight) -> tuple[Floats, Floats]:
            missed, by = _linearised(problem, structure, known, ghosts, x)
            return np.concatenate([missed / tight, _off_middle(known, x[free])]), np.concatenate([by / tight, slopes])

        def residuals(x: Floats) -> Floats:
            return both(x)[0]

        damping = 1e-3
        for _ in range(MOST):
            if over():
                return solved
            old, by = both(x)
            step = damped_step(known, x, old, by, residuals, damping)
            if step is None:
                break
            x, new, damping = step
            if float(new @ new) > (1.0 - LEAST_GAIN) * float(old @ old):
                break
    done = polish(problem, [(structure, x)], steps=4 * STEPS)[0]
    better = done.cost <= SOLVED and moderation(known, done.x) < moderation(known, solved.x)
    return done if better else solved


def _linearised(
    problem: Problem, structure: Structure, known: Variables, ghosts: tuple[tuple[int, int], ...], x: Floats
) -> tuple[Floats, Floats]:
    """Return the weighted misfits of the ghosts that stand for the targets, and their derivatives: (3 N,), (3 N, F)."""
    aim, vector = problem.objective, known.prescription(x)
    chosen, lights = structure.numbers(ghosts), np.repeat(aim.slopes, np.diff(aim.spans))
    by = differentiate(structure, vector, aim.entrance)
    place, radius = by.values[chosen, columns.PLACE], by.values[chosen, columns.RADIUS]
    sign = np.where(aim.signed | (radius >= 0.0), 1.0, -1.0)
    found = np.stack([lights * place, sign * radius, by.log_irradiance[chosen]], axis=1)
    slopes = np.stack(
        [lights[:, None] * by.place[chosen], sign[:, None] * by.radius[chosen], by.log_irradiance_by[chosen]], axis=1
    )
    logs = 1 + structure.rows
    slopes[:, :, :logs] *= vector[:logs]
    # what does not count may be infinite
    counts = aim.weights > 0.0
    off = np.where(counts, aim.weights * (found - aim.targets), 0.0)
    slopes = np.where(counts[:, :, None], aim.weights[:, :, None] * slopes, 0.0)
    return off.ravel(), slopes[:, :, known.free].reshape(off.size, -1)


def _with_signs(problem: Problem, solved: Candidate) -> Objective:
    """Return the targets with the signs that the ghosts of a lens have."""
    aim, structure = problem.objective, solved.structure
    vector = problem.variables(structure).prescription(solved.x)
    _, _, ghosts = misfits(aim, structure, vector)
    radii = evaluate(structure, vector[None], aim.entrance)[0][structure.numbers(ghosts), columns.RADIUS]
    targets = aim.targets.copy()
    targets[:, 1] = np.copysign(targets[:, 1], radii)
    return replace(aim, targets=targets, signed=True, picture=None)


def _off_middle(known: Variables, z: Floats) -> Floats:
    """Tell how far free variables are from the middle of their bounds, -1 to 1."""
    low, high = known.low[known.free], known.high[known.free]
    return np.asarray((2.0 * z - low - high) / (high - low), dtype=np.float64)
