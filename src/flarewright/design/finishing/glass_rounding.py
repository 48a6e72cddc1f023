"""Replace free indices by catalogue glasses: a beam search over the nearest glasses that refits all other variables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...typing import Floats
from ..problem.glass_list import GlassList
from ..problem.objective import Objective
from ..problem.problem import LensCandidate, Over, Problem, never
from ..problem.variables import Variables
from ..solvers.polish import polish_within

# glasses tried in each gap, branches kept, and approximate number of local searches
NEAREST = 6
WIDEST = 4
SEARCHES = 160
# rounds in which every glass is exchanged for its neighbours in the list, and number of neighbours
ROUNDS = 3
BESIDE = 2
STEPS, LAST_STEPS = 60, 200


@dataclass(frozen=True)
class _Branch:
    """Glasses chosen so far, by gap, and the best lens with them."""

    held: dict[int, int]
    x: Floats
    cost: float


def with_catalogue_glasses(
    problem: Problem, one: LensCandidate, over: Over = never
) -> tuple[LensCandidate, dict[int, int]]:
    """Give a lens glasses from the problem's list at little extra cost.

    Parameters
    ----------
    problem : Problem
        With `glasses`.
    one : LensCandidate
    over : callable
        Whether the time is up. Then every gap gets the glass of nearest index.

    Returns
    -------
    found : LensCandidate
        Its indices are those of glasses, except in fixed rows.
    chosen : dict of int to int
        Index in the list of the glass behind each row.

    Notes
    -----
    A beam search. The gap that costs most when rounded alone comes first. In each gap the glasses of nearest index are
    tried, with Levenberg-Marquardt over all variables that are still free, and the best branches continue. Then every
    glass is exchanged for its neighbours in the list while that reduces the cost.
    """
    assert problem.glasses is not None
    known, aim, glasses = problem.variables(one.structure), problem.objective, problem.glasses
    first = _Branch({}, one.x, one.cost)
    gaps = _hardest_first(known, aim, glasses, first, over)
    if not gaps:
        return one, {}
    branches = [first]
    width = int(np.clip(SEARCHES // (NEAREST * len(gaps)), 1, WIDEST))
    for gap in gaps:
        branches = branches[:1] if over() else branches
        tried = [
            _with(known, aim, glasses, branch, gap, number)
            for branch in branches
            for number in glasses.nearest(_index(known, branch.x, gap), 1 if over() else NEAREST)
        ]
        branches = sorted(tried, key=lambda branch: branch.cost)[:width]
    best = branches[0]
    for _ in range(ROUNDS):
        before = best.cost
        for gap in gaps:
            if not over():
                best = min([best, *_beside(known, aim, glasses, best, gap)], key=lambda branch: branch.cost)
        if best.cost > 0.99 * before or over():
            break
    best = min(best, _polished(known, aim, glasses, best.held, best.x, LAST_STEPS), key=lambda branch: branch.cost)
    return LensCandidate(best.cost, one.structure, best.x), best.held


def held_indices(problem: Problem, chosen: dict[int, int]) -> dict[int, float]:
    """Return n_d of chosen glasses by row."""
    if problem.glasses is None:
        return {}
    return {gap: float(problem.glasses.n_d[number]) for gap, number in chosen.items()}


def _index(known: Variables, x: Floats, gap: int) -> float:
    return float(x[1 + 2 * known.structure.rows + gap])


def _hardest_first(known: Variables, aim: Objective, glasses: GlassList, start: _Branch, over: Over) -> list[int]:
    """List the gaps of glass whose index is free, by falling cost of rounding each alone."""
    fixed = known.high == known.low
    indices = 1 + 2 * known.structure.rows
    # with a single glass in the list no index is free, but the gap still gets that glass
    gaps = [
        k for k, glass in enumerate(known.structure.glass)
        if glass and (not fixed[indices + k] or np.any(glasses.n_d == known.low[indices + k]))
    ]  # fmt: skip
    if over():
        return gaps
    alone = {
        gap: _with(known, aim, glasses, start, gap, glasses.nearest(_index(known, start.x, gap), 1)[0]).cost
        for gap in gaps
    }
    return sorted(gaps, key=lambda gap: -alone[gap])


def _with(
    known: Variables, aim: Objective, glasses: GlassList, branch: _Branch, gap: int, number: int, steps: int = STEPS
) -> _Branch:
    return _polished(known, aim, glasses, {**branch.held, gap: number}, branch.x, steps)


def _polished(
    known: Variables, aim: Objective, glasses: GlassList, held: dict[int, int], x: Floats, steps: int
) -> _Branch:
    within = known.with_indices({gap: float(glasses.n_d[number]) for gap, number in held.items()})
    ends, costs = polish_within(within, x[None], aim, steps)
    return _Branch(held, ends[0], float(costs[0]))


def _beside(known: Variables, aim: Objective, glasses: GlassList, branch: _Branch, gap: int) -> list[_Branch]:
    """Try the neighbours in the list of one glass."""
    at = branch.held[gap]
    others = [k for k in range(at - BESIDE, at + BESIDE + 1) if k != at and 0 <= k < len(glasses.glasses)]
    return [_with(known, aim, glasses, branch, gap, number) for number in others]
