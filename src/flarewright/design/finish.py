"""Finish a lens with traced rays, where first order is not enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels import design_ghosts as columns
from ..kernels.design_search import WISHES, wishes_missed
from .constraints import breaches, stiff
from .ghosts import differentiate, evaluate
from .least_squares import damped_step
from .prescription import Structure
from .problem import Over, Problem, never
from .traced import traced_ghosts
from .variables import Variables

Floats = NDArray[np.float64]
Pairs = tuple[tuple[int, int], ...]

STEPS = 60
# what a ghost costs that is lost: as much as one that misses by its own radius
LOST = 1.0
# derivatives by differences where so many ghosts times variables are not too much work, and how often at most
FEW, ANEW = 1500, 8
# steps of differences: log lengths, curvatures (1/mm), indices
_DIFFERENCES = (1e-5, 1e-7, 1e-6)
# an improvement by less than this part is slow, or the end, and so small a cost is
_SLOW, _LEAST_GAIN, _ENOUGH = 0.05, 1e-4, 1e-14
# halvings on the way back inside the hard constraints
_HALVINGS = 12


@dataclass(frozen=True)
class TracedMisfits:
    """How far the ghosts of a lens are off by traced rays.

    Attributes
    ----------
    off : ndarray, shape (N, 2)
        Place and size of each target's ghost, less the target's, mm; of a lost one to first order.
    lost : ndarray of bool, shape (N,)
        Ghosts of which too few rays arrive to tell a disc.
    cost : float
        Mean of squares by the weights of the search: mm^2, or parts of radii where these are relative; a lost ghost
        counts `LOST` more.
    """

    off: Floats
    lost: NDArray[np.bool_]
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
    """Tell for every target how far its ghost is off by traced rays.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    ghosts : tuple of (int, int)
        Mirrors of the ghost that stands for each target (`objective.misfits`).

    Returns
    -------
    TracedMisfits
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
    """Bring the traced ghosts of a lens nearer to their targets, inside its bounds.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    known : Variables
    x : ndarray, shape (1 + 3 K,)
        Search variables that keep the hard constraints.
    ghosts : tuple of (int, int)
        Mirrors of the ghost that stands for each target; that does not change.
    over : callable
        Whether the time is up: then the steps end.

    Returns
    -------
    Finished
        Never worse than the beginning by the weighted sum, and inside the hard constraints.

    Notes
    -----
    Levenberg-Marquardt with an active set, as the search. The first derivatives are those of first order, then they
    learn from every step (Broyden 1965); where that goes no further and ghosts are few, they are taken by differences.
    """
    springs = stiff(problem).objective.wishes

    def missed(at: Floats) -> Floats:
        out = np.empty(WISHES + 2 * structure.rows)
        wishes_missed(known.prescription(at), structure.stop, problem.objective.entrance, springs, out)
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
    anew = ANEW if len(ghosts) * known.free.size <= FEW else 0
    exact = False
    for _ in range(STEPS):
        if over():
            break
        cost = float(old @ old)
        tried = damped_step(known, x, old, J, residuals, damping)
        if tried is not None:
            moved = (tried[0] - x)[known.free]
            J = J + np.outer(tried[1] - old - J @ moved, moved) / max(float(moved @ moved), 1e-300)
            x, old, damping = tried
        gained = 1.0 - float(old @ old) / max(cost, 1e-300)
        if float(old @ old) < _ENOUGH or (gained < _LEAST_GAIN and (exact or anew == 0)):
            break
        exact = gained < _SLOW and anew > 0
        if exact:
            J, anew, damping = _by_differences(known, x, residuals), anew - 1, 1e-3
    return _kept(problem, structure, known, begin, x, ghosts)


def _kept(
    problem: Problem, structure: Structure, known: Variables, begin: Floats, end: Floats, ghosts: Pairs
) -> Finished:
    """Go as far as the hard constraints let, and not where it is worse."""
    end = _inside(problem, structure, known, begin, end)
    before, after = (traced_misfits(problem, structure, known.prescription(one), ghosts) for one in (begin, end))
    return Finished(begin, before, before) if after.cost >= before.cost else Finished(end, before, after)


def _first_order(problem: Problem, structure: Structure, known: Variables, x: Floats, ghosts: Pairs) -> Floats:
    """Differentiate the weighted misfits to first order, shape (2 N, F)."""
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
    """Differentiate by the free variables, shape (M, F)."""
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
    """Return the point farthest on the way that keeps the hard constraints; the beginning does."""

    def keeps(x: Floats) -> bool:
        return not breaches(problem, structure, known.prescription(x))

    if keeps(end):
        return end
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if keeps(begin + middle * (end - begin)) else (low, middle)
    return begin + low * (end - begin)
