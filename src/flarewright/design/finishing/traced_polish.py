"""Finish a lens with traced rays, where first order is not accurate enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...kernels.design import ghosts as columns
from ...kernels.design.local_search import LIMITS, limit_excess
from ...typing import Floats, Mask
from ..problem.ghosts import differentiate, evaluate
from ..problem.prescription import Structure
from ..problem.problem import Over, Problem, never
from ..problem.variables import Variables
from ..solvers.least_squares import bounded_step
from .constraints import breaches, stiff
from .traced import traced_ghosts

Pairs = tuple[tuple[int, int], ...]

STEPS = 60
# cost of a lost ghost: that of a ghost that misses by its own radius
LOST = 1.0
# largest number of ghosts times variables for derivatives by differences, and how often these are recomputed at most
MOST_DIFFERENCES, MOST_RECOMPUTED = 1500, 8
# steps of differences: log lengths, curvatures (1/mm), indices
_DIFFERENCES = (1e-5, 1e-7, 1e-6)
# a relative gain below the first counts as slow, below the second as converged; so does a cost below the third
_SLOW, _LEAST_GAIN, _ENOUGH = 0.05, 1e-4, 1e-14
# number of bisections towards the feasible start
_HALVINGS = 12


@dataclass(frozen=True)
class TracedMisfits:
    """Errors of the ghosts of a lens by traced rays.

    Attributes
    ----------
    off : ndarray, shape (N, 2)
        Place and size of each target's ghost minus the target's, mm; first-order values for a lost ghost.
    lost : ndarray of bool, shape (N,)
        Ghosts that too few rays reach for a fit.
    cost : float
        Mean of squares with the weights of the search: mm^2, or fractions of radii for relative weights; plus `LOST`
        for each lost ghost.
    """

    off: Floats
    lost: Mask
    cost: float


@dataclass(frozen=True)
class Finished:
    """A lens finished with traced rays.

    Attributes
    ----------
    x : ndarray, shape (1 + 3 K,)
        Search variables.
    before, after : TracedMisfits
    """

    x: Floats
    before: TracedMisfits
    after: TracedMisfits


def traced_misfits(problem: Problem, structure: Structure, vector: Floats, ghosts: Pairs) -> TracedMisfits:
    """Return place and size errors of every target's ghost by traced rays.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    ghosts : tuple of (int, int)
        Mirrors of the ghost matched to each target (`objective.misfits`).
    """
    aim = problem.objective
    first_order = evaluate(structure, vector[None], aim.entrance)[0]
    off, lost = np.zeros((len(aim.targets), 2)), np.zeros(len(aim.targets), np.bool_)
    for light, slope in enumerate(aim.slopes):
        span = slice(int(aim.spans[light]), int(aim.spans[light + 1]))
        pairs = ghosts[span]
        found = traced_ghosts(structure, vector, float(slope), aim.entrance, pairs)
        rough = first_order[structure.numbers(pairs)]
        rough = np.stack([rough[:, columns.PLACE] * slope, rough[:, columns.RADIUS]], axis=1).reshape(-1, 2)
        lost[span] = ~np.isfinite(found).all(axis=1)
        found = np.where(np.isfinite(found), found, rough)
        if not aim.signed:
            found[:, 1] = np.abs(found[:, 1])
        off[span] = found - aim.targets[span, :2]
    counts = aim.weights[:, :2] > 0.0
    lost &= counts.any(axis=1)
    off = np.where(counts, off, 0.0)
    cost = (float(((aim.weights[:, :2] * off) ** 2).sum()) + LOST * int(lost.sum())) / len(off)
    return TracedMisfits(off, lost, cost)


def finish(
    problem: Problem, structure: Structure, known: Variables, x: Floats, ghosts: Pairs, over: Over = never
) -> Finished:  # fmt: skip
    """Move the traced ghosts of a lens closer to their targets, inside its bounds.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    known : Variables
    x : ndarray, shape (1 + 3 K,)
        Search variables that keep the hard constraints.
    ghosts : tuple of (int, int)
        Mirrors of the ghost matched to each target; the matching is constant.
    over : callable
        Whether the time is up. Then the iteration stops.

    Returns
    -------
    Finished
        Never worse than the start by the weighted sum, and inside the hard constraints.

    Notes
    -----
    Levenberg-Marquardt with an active set, as in the search. The first derivatives are first-order, then updated by
    every step (Broyden 1965). When progress slows and ghosts are few, they are recomputed by finite differences.
    """
    penalties = stiff(problem).objective.limits

    def missed(at: Floats) -> Floats:
        out = np.empty(LIMITS + 2 * structure.rows)
        limit_excess(known.prescription(at), structure.stop, problem.objective.entrance, penalties, out)
        return out

    def residuals(at: Floats) -> Floats:
        ours = traced_misfits(problem, structure, known.prescription(at), ghosts)
        gone = np.sqrt(LOST) * ours.lost
        return np.concatenate([(problem.objective.weights[:, :2] * ours.off).ravel(), gone, missed(at)])

    begin, old, damping = x, residuals(x), 1e-3
    J = np.concatenate([
        _first_order(problem, structure, known, x, ghosts), np.zeros((len(ghosts), known.free.size)),
        _by_differences(known, x, missed),
    ])  # fmt: skip
    recomputations = MOST_RECOMPUTED if len(ghosts) * known.free.size <= MOST_DIFFERENCES else 0
    exact = False
    for _ in range(STEPS):
        if over():
            break
        cost = float(old @ old)
        tried = bounded_step(
            x, old, J, residuals, damping, free=known.free, low=known.low, high=known.high, longest=known.longest
        )
        if tried is not None:
            moved = (tried[0] - x)[known.free]
            J = J + np.outer(tried[1] - old - J @ moved, moved) / max(float(moved @ moved), 1e-300)
            x, old, damping = tried
        gained = 1.0 - float(old @ old) / max(cost, 1e-300)
        if float(old @ old) < _ENOUGH or (gained < _LEAST_GAIN and (exact or recomputations == 0)):
            break
        exact = gained < _SLOW and recomputations > 0
        if exact:
            J, recomputations, damping = _by_differences(known, x, residuals), recomputations - 1, 1e-3
    return _kept(problem, structure, known, begin, x, ghosts)


def _kept(
    problem: Problem, structure: Structure, known: Variables, begin: Floats, end: Floats, ghosts: Pairs
) -> Finished:
    """Return the farthest point that keeps the hard constraints, or the start if that is better."""
    end = _inside(problem, structure, known, begin, end)
    before, after = (traced_misfits(problem, structure, known.prescription(one), ghosts) for one in (begin, end))
    return Finished(begin, before, before) if after.cost >= before.cost else Finished(end, before, after)


def _first_order(problem: Problem, structure: Structure, known: Variables, x: Floats, ghosts: Pairs) -> Floats:
    """Return first-order derivatives of the weighted misfits, shape (2 N, F)."""
    aim, vector = problem.objective, known.prescription(x)
    by = differentiate(structure, vector, aim.entrance)
    chosen = structure.numbers(ghosts)
    slopes = np.repeat(aim.slopes, np.diff(aim.spans))
    turned = np.ones(len(chosen)) if aim.signed else np.where(by.values[chosen, columns.RADIUS] < 0.0, -1.0, 1.0)
    both = np.stack([slopes[:, None] * by.place[chosen], turned[:, None] * by.radius[chosen]], axis=1)
    logs = 1 + structure.rows
    both[:, :, :logs] *= vector[:logs]
    both *= aim.weights[:, :2, None]
    return np.asarray(both[:, :, known.free].reshape(2 * len(chosen), -1), dtype=np.float64)


def _by_differences(known: Variables, x: Floats, residuals: Callable[[Floats], Floats]) -> Floats:
    """Return derivatives by the free variables by finite differences, shape (M, F)."""
    rows, free, old = known.structure.rows, known.free, residuals(x)
    kind = np.where(free < 1 + rows, 0, np.where(free < 1 + 2 * rows, 1, 2))
    J = np.empty((len(old), free.size))
    for v, (k, h) in enumerate(zip(free, np.array(_DIFFERENCES)[kind], strict=True)):
        ahead = x.copy()
        way = h if x[k] + h <= known.high[k] else -h
        ahead[k] += way
        J[:, v] = (residuals(ahead) - old) / way
    return J


def _inside(problem: Problem, structure: Structure, known: Variables, begin: Floats, end: Floats) -> Floats:
    """Return the farthest feasible point between start and end; the start is feasible."""

    def keeps(x: Floats) -> bool:
        return not breaches(problem, structure, known.prescription(x))

    if keeps(end):
        return end
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if keeps(begin + middle * (end - begin)) else (low, middle)
    return begin + low * (end - begin)
