"""The null space of the targets: among lenses with the same ghosts, choose the most moderate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...kernels.design import ghosts as columns
from ...typing import Floats
from ..problem.ghosts import differentiate, evaluate
from ..problem.objective import Objective, misfits
from ..problem.prescription import Structure
from ..problem.problem import SOLVED, LensCandidate, Over, Problem, never
from ..problem.variables import Variables
from ..solvers.least_squares import bounded_step
from ..solvers.polish import STEPS, polish
from ..solvers.pool_search import MOST_STRUCTURES, solve

# weight of a misfit against a variable at its bound, inverse squared, round by round
TIGHTER = (1e-1, 1e-2, 1e-3, 1e-4)
# most steps of a round, and the relative gain below which a round ends
MOST, LEAST_GAIN = 200, 1e-8
# number of local searches for the same ghosts in another structure
SEARCHES = 5000


def moderation(known: Variables, x: Floats) -> float:
    """Return the sum of squared distances of the free variables from the middle of their bounds: 0 middle, 1 bound.

    Parameters
    ----------
    known : Variables
    x : ndarray, shape (1 + 3 K,)
    """
    return float((_off_middle(known, x[known.free]) ** 2).sum())


def lenses_with_same_ghosts(
    problem: Problem, solved: LensCandidate, *, seed: int = 0, over: Over = never
) -> tuple[LensCandidate, ...]:
    """Find lenses of several structures with the same ghosts as a lens that meets its targets.

    Parameters
    ----------
    problem : Problem
    solved : LensCandidate
    seed : int
    over : callable
        Whether the time is up. Then the function returns the lenses found so far.

    Returns
    -------
    tuple of LensCandidate
        One per structure, the most moderate first. Other structures are tried only if they are few and the targets have
        no signs. Only `solved` if its cost is above `problem.SOLVED`.

    Notes
    -----
    The slow part is to find the signs: with known signs, a lens of another structure is found within a second, or does
    not exist.
    """
    if solved.cost > SOLVED:
        return (solved,)
    found = [to_the_middle(problem, solved, over)]
    if not problem.objective.signed and len(problem.structures) <= MOST_STRUCTURES:
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


def to_the_middle(problem: Problem, solved: LensCandidate, over: Over = never) -> LensCandidate:
    """Move the variables of a lens towards the middle of their bounds while its ghosts stay on target.

    Parameters
    ----------
    problem : Problem
    solved : LensCandidate
    over : callable
        Whether the time is up. Then the variables stay.

    Returns
    -------
    LensCandidate
        The same where its cost is above `problem.SOLVED`, or where there is no gain.

    Notes
    -----
    A penalty method: squares of the misfits, with increasing weight, and of the distances from the middle.
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
            step = bounded_step(
                x, old, by, residuals, damping, free=free, low=known.low, high=known.high, longest=known.longest
            )
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
    """Return weighted misfits of the matched ghosts, and their derivatives: (3 N,), (3 N, F)."""
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
    # residuals without weight may be infinite
    counts = aim.weights > 0.0
    off = np.where(counts, aim.weights * (found - aim.targets), 0.0)
    slopes = np.where(counts[:, :, None], aim.weights[:, :, None] * slopes, 0.0)
    return off.ravel(), slopes[:, :, known.free].reshape(off.size, -1)


def _with_signs(problem: Problem, solved: LensCandidate) -> Objective:
    """Return the objective with target signs set to those of a lens' ghosts."""
    aim, structure = problem.objective, solved.structure
    vector = problem.variables(structure).prescription(solved.x)
    _, _, ghosts = misfits(aim, structure, vector)
    radii = evaluate(structure, vector[None], aim.entrance)[0][structure.numbers(ghosts), columns.RADIUS]
    targets = aim.targets.copy()
    targets[:, 1] = np.copysign(targets[:, 1], radii)
    return replace(aim, targets=targets, signed=True, picture=None)


def _off_middle(known: Variables, z: Floats) -> Floats:
    """Return the distance of free variables from the middle of their bounds, -1 to 1."""
    low, high = known.low[known.free], known.high[known.free]
    return np.asarray((2.0 * z - low - high) / (high - low), dtype=np.float64)
