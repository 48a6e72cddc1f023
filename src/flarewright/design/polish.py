"""Local searches for a lens, and what becomes of their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..kernels.design_picture import polish_by_picture
from ..kernels.design_search import polish_many
from ..model.design import Bounds
from .canvas import canvas
from .objective import Objective
from .prescription import Structure
from .problem import SOLVED, Candidate, Problem
from .variables import Variables

Floats = NDArray[np.float64]

# what a local search may take, and the cost at which it is done
STEPS = 60
ENOUGH = 1e-18


def polish(
    problem: Problem, starts: Sequence[tuple[Structure, Floats]], *, objective: Objective | None = None,
    steps: int = STEPS, worth: float = np.inf,
) -> list[Candidate]:  # fmt: skip
    """Run a local search from each of several points.

    Parameters
    ----------
    problem : Problem
    starts : sequence of (Structure, ndarray)
    objective : Objective, optional
        None: the problem's.
    steps : int
    worth : float
        Where the picture counts: a lens that costs more before its picture is polished stays as it is.

    Returns
    -------
    list of Candidate
        In the same order; inside the bounds whatever the points were. Where the picture counts, places and sizes are
        polished first, for a picture does not feel a ghost that is far off; one that meets them all is kept so.
    """
    aim = problem.objective if objective is None else objective
    groups: dict[Structure, list[int]] = {}
    for k, (structure, _) in enumerate(starts):
        groups.setdefault(structure, []).append(k)
    found: dict[int, Candidate] = {}
    for structure, which in groups.items():
        known = problem.variables(structure)
        points = np.array([starts[k][1] for k in which])
        ends, costs = polish_within(known, points, replace(aim, picture=None), steps)
        near = np.flatnonzero((costs > SOLVED) & np.isfinite(costs))
        if aim.picture is not None and near.size:
            ends[near], costs[near] = polish_within(known, ends[near], aim, steps // 2, worth=worth)
        found.update((k, Candidate(float(costs[m]), structure, ends[m])) for m, k in enumerate(which))
    return [found[k] for k in range(len(starts))]


def polish_within(
    known: Variables, points: Floats, aim: Objective, steps: int = STEPS, *, worth: float = np.inf
) -> tuple[Floats, Floats]:
    """Run a local search from each of several points of one structure, by the picture where that counts.

    Parameters
    ----------
    known : Variables
        Variables whose bounds are equal stay there.
    points : ndarray, shape (B, 1 + 3 K)
    aim : Objective
    steps : int
        0: only the cost is wanted.
    worth : float
        Where the picture counts: a point that costs more stays where it is.

    Returns
    -------
    ends : ndarray, shape (B, 1 + 3 K)
    costs : ndarray, shape (B,)
    """
    structure = known.structure
    ends, costs = np.empty_like(points), np.empty(len(points))
    picture = aim.picture
    if picture is not None:
        polish_by_picture(
            points, structure.stop, structure.mirrors, aim.entrance, known.low, known.high, known.free, known.longest,
            aim.slopes, aim.wishes, picture.light, picture.unit, picture.edges, picture.rows, picture.limits,
            picture.start, picture.pixel, picture.wanted, steps, worth, ends, costs,
        )  # fmt: skip
        return ends, costs
    matches = np.empty((len(points), len(aim.targets)), np.int64)
    polish_many(
        points, structure.stop, structure.mirrors, aim.entrance, known.low, known.high, known.free, known.longest,
        aim.slopes, aim.spans, aim.targets, aim.weights, aim.signed, aim.extra * aim.extra_part, aim.wishes, steps,
        4, ENOUGH, ends, costs, matches,
    )  # fmt: skip
    return ends, costs


def merge(members: Sequence[Candidate], found: Sequence[Candidate], most: int) -> tuple[Candidate, ...]:
    """Add minima to a pool, best first; one that is there already, or no lens, is left out.

    Parameters
    ----------
    members, found : sequence of Candidate
    most : int

    Returns
    -------
    tuple of Candidate
    """
    out = list(members)
    for one in found:
        # the same cost to seven digits is the same minimum
        if np.isfinite(one.cost) and not any(abs(one.cost - other.cost) < 1e-7 * other.cost for other in out):
            out.append(one)
    out.sort(key=lambda one: one.cost)
    return tuple(out[:most])


def finer(problem: Problem) -> Problem:
    """Return the problem for the last steps: with a finer picture, where the picture counts."""
    picture = problem.objective.picture
    if picture is None or picture.fine is None:
        return problem
    return replace(problem, objective=replace(problem.objective, picture=picture.fine))


def finest(problem: Problem, one: Candidate, steps: int) -> Candidate:
    """Polish a lens a last time.

    Parameters
    ----------
    problem : Problem
        `finer` than that of the search.
    one : Candidate
    steps : int

    Returns
    -------
    Candidate
        Its cost is that of the finer picture, where the picture counts.
    """
    aim = problem.objective
    if aim.picture is None or one.cost <= SOLVED:
        return min(polish(problem, [(one.structure, one.x)], steps=steps)[0], one, key=lambda each: each.cost)
    ends, costs = polish_within(problem.variables(one.structure), one.x[None], aim, steps)
    return Candidate(float(costs[0]), one.structure, ends[0])


@lru_cache(maxsize=2)
def compile_kernels(picture: bool = False) -> None:
    """Compile what a search calls, so that its time is spent searching; `picture`: for one by the picture."""
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
