"""Local searches for a lens, and merging of their minima."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...kernels.design.arguments import Effort, FreeVariables, LensStructure
from ...kernels.design.local_search import polish_many
from ...kernels.design.picture_search import polish_by_picture
from ...model.project.design import Bounds
from ...typing import Floats
from ..problem.objective import Objective
from ..problem.prescription import Structure
from ..problem.problem import SOLVED, LensCandidate, Problem
from ..problem.target_image import canvas
from ..problem.variables import Variables

# largest number of steps of a local search, and the cost at which it stops
STEPS = 60
ENOUGH = 1e-18
# number of steps before ghosts are first rematched
_PATIENCE = 4


def polish(
    problem: Problem, starts: Sequence[tuple[Structure, Floats]], *, steps: int = STEPS, worth: float = np.inf
) -> list[LensCandidate]:
    """Run a local search from each of several points.

    Parameters
    ----------
    problem : Problem
    starts : sequence of (Structure, ndarray)
    steps : int
    worth : float
        For a search by picture: a lens with a higher cost before its picture is polished stays as it is.

    Returns
    -------
    list of LensCandidate
        In the same order, inside the bounds for any start points. A search by picture polishes places and sizes first,
        as a picture does not respond to a ghost far from its target; a lens that meets all targets is kept so.
    """
    aim = problem.objective
    groups: dict[Structure, list[int]] = {}
    for k, (structure, _) in enumerate(starts):
        groups.setdefault(structure, []).append(k)
    found: dict[int, LensCandidate] = {}
    for structure, which in groups.items():
        known = problem.variables(structure)
        points = np.array([starts[k][1] for k in which])
        ends, costs = polish_within(known, points, replace(aim, picture=None), steps)
        near = np.flatnonzero((costs > SOLVED) & np.isfinite(costs))
        if aim.picture is not None and near.size:
            ends[near], costs[near] = polish_within(known, ends[near], aim, steps // 2, worth=worth)
        found.update((k, LensCandidate(float(costs[m]), structure, ends[m])) for m, k in enumerate(which))
    return [found[k] for k in range(len(starts))]


def polish_within(
    known: Variables, points: Floats, aim: Objective, steps: int = STEPS, *, worth: float = np.inf
) -> tuple[Floats, Floats]:
    """Run a local search from each of several points of one structure, by picture if the problem asks for it.

    Parameters
    ----------
    known : Variables
        Variables whose bounds are equal stay constant.
    points : ndarray, shape (B, 1 + 3 K)
    aim : Objective
    steps : int
        0: compute the cost only.
    worth : float
        For a search by picture: a point with a higher cost stays where it is.

    Returns
    -------
    ends : ndarray, shape (B, 1 + 3 K)
    costs : ndarray, shape (B,)
    """
    ends, costs = np.empty_like(points), np.empty(len(points))
    lens = LensStructure(known.structure.stop, known.structure.mirrors, aim.entrance)
    space = FreeVariables(known.low, known.high, known.free, known.longest)
    if aim.picture is not None:
        polish_by_picture(points, lens, space, aim.slopes, aim.limits, aim.picture.shown, steps, worth, ends, costs)
        return ends, costs
    matches = np.empty((len(points), len(aim.targets)), np.int64)
    effort = Effort(steps, _PATIENCE, ENOUGH)
    polish_many(points, lens, space, aim.for_kernels, aim.limits, effort, ends, costs, matches)
    return ends, costs


def merge_pools(
    members: Sequence[LensCandidate], found: Sequence[LensCandidate], most: int
) -> tuple[LensCandidate, ...]:
    """Merge minima into a pool, best first, without duplicates and without points that are no lens."""
    out = list(members)
    for one in found:
        # costs equal to seven digits belong to the same minimum
        if np.isfinite(one.cost) and not any(abs(one.cost - other.cost) < 1e-7 * other.cost for other in out):
            out.append(one)
    out.sort(key=lambda one: one.cost)
    return tuple(out[:most])


def finer(problem: Problem) -> Problem:
    """Return the problem for the last steps: with a finer picture, if it has one."""
    picture = problem.objective.picture
    if picture is None or picture.fine is None:
        return problem
    return replace(problem, objective=replace(problem.objective, picture=picture.fine))


def finest(problem: Problem, one: LensCandidate, steps: int) -> LensCandidate:
    """Polish a lens for the last time.

    Parameters
    ----------
    problem : Problem
        `finer` than that of the search.
    one : LensCandidate
    steps : int

    Returns
    -------
    LensCandidate
        With the cost of the finer picture, if there is one.
    """
    aim = problem.objective
    if aim.picture is None or one.cost <= SOLVED:
        return min(polish(problem, [(one.structure, one.x)], steps=steps)[0], one, key=lambda each: each.cost)
    ends, costs = polish_within(problem.variables(one.structure), one.x[None], aim, steps)
    return LensCandidate(float(costs[0]), one.structure, ends[0])


@lru_cache(maxsize=2)
def compile_kernels(picture: bool = False) -> None:
    """Compile the kernels before the search's time counts; `picture`: those of a search by picture as well."""
    structure = Structure(2, (True, False, False, True, False))
    aim = Objective(
        np.array([0.1]), np.array([0, 1]), np.ones((1, 3)), np.ones((1, 3)), True, 0.0, 100.0,
        np.array([[0.0, 1.0, 1.0], [0.0, 9.0, 1.0], [0.0, 1e9, 0.0], [0.1, 0.9, 5.0]]), ("",),
    )  # fmt: skip
    if picture:
        wanted = canvas(aim.targets, aim.spans, [(1.0, 0.0)], light=1.0, half_frame=(20.0, 20.0), blades=6)
        aim = replace(aim, picture=wanted)
    problem = Problem(aim, (structure,), Bounds())
    start = problem.variables(structure).random_points(np.random.default_rng(0), 1)[0]
    polish(problem, [(structure, start)], steps=1)
