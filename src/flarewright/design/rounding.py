"""From any index to catalogue glasses: branch over the nearest ones, and let everything else make up for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .glass_list import GlassList
from .objective import Objective
from .polish import polish_within
from .problem import Candidate, Over, Problem, never
from .variables import Variables

Floats = NDArray[np.float64]

# glasses tried in each gap, branches kept, and the local searches that branching may take about
NEAREST = 6
WIDEST = 4
SEARCHES = 160
# how often every glass is tried again beside its neighbours in the list, and how many of them
ROUNDS = 3
BESIDE = 2
STEPS, LAST_STEPS = 60, 200


@dataclass(frozen=True)
class _Branch:
    """Glasses chosen so far, by gap, and the best lens that has them."""

    held: dict[int, int]
    x: Floats
    cost: float


def rounded(problem: Problem, one: Candidate, over: Over = never) -> tuple[Candidate, dict[int, int]]:
    """Give a lens glasses from the problem's list so that its cost grows little.

    Parameters
    ----------
    problem : Problem
        With `glasses`.
    one : Candidate
    over : callable
        Whether the time is up: then every gap gets the glass that is nearest.

    Returns
    -------
    found : Candidate
        Its indices are those of glasses, but for rows that are fixed.
    chosen : dict of int to int
        Number in the list of the glass behind each row.

    Notes
    -----
    A beam search. The gap that costs most when it alone is rounded comes first; in each gap the glasses of nearest
    index are tried, with Levenberg-Marquardt over all that is still free, and the best branches go on. Then every glass
    is exchanged for its neighbours in the list as long as that helps.
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
    return Candidate(best.cost, one.structure, best.x), best.held


def held_indices(problem: Problem, chosen: dict[int, int]) -> dict[int, float]:
    """Return n_d by row of chosen glasses."""
    if problem.glasses is None:
        return {}
    return {gap: float(problem.glasses.n_d[number]) for gap, number in chosen.items()}


def _index(known: Variables, x: Floats, gap: int) -> float:
    return float(x[1 + 2 * known.structure.rows + gap])


def _hardest_first(known: Variables, aim: Objective, glasses: GlassList, start: _Branch, over: Over) -> list[int]:
    """List the gaps of glass whose index is free, the one that costs most when rounded alone first."""
    fixed = known.high == known.low
    indices = 1 + 2 * known.structure.rows
    # a list of one glass leaves no index free, but its glass is still to be named
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
    """Exchange one glass for its neighbours in the list."""
    at = branch.held[gap]
    others = [k for k in range(at - BESIDE, at + BESIDE + 1) if k != at and 0 <= k < len(glasses.glasses)]
    return [_with(known, aim, glasses, branch, gap, number) for number in others]
