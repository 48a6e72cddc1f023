"""What no lens can do, told before a search: necessary conditions, each with a proven least error."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians, tan

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model import Project
from ..model.design import GhostWish
from .problem import Problem
from .reach import broken_limits, least_distances

Floats = NDArray[np.float64]

# an error that counts as met (`report.MET`), so a smaller proven one is no obstacle, mm
TOLERABLE = 0.005


@dataclass(frozen=True)
class Obstacle:
    """Why a target cannot be met.

    Attributes
    ----------
    target : str
        Its name, or that of a hard limit; several where they contradict each other.
    reason : str
        A sentence.
    least_error_mm : float
        Place or radius of the target, or of one of several, is off by as much in every lens; 0 of a hard limit.
    """

    target: str
    reason: str
    least_error_mm: float


def obstacles(problem: Problem, project: Project | None = None) -> tuple[Obstacle, ...]:
    """List what can be proven impossible about a problem.

    Parameters
    ----------
    problem : Problem
    project : Project, optional
        Where it comes from; its wishes may lie off the line.

    Returns
    -------
    tuple of Obstacle
        Empty does not mean possible.
    """
    off = () if project is None else _off_the_line(project)
    return (*off, *_unkept(problem), *_out_of_reach(problem), *_contradictions(problem))


def _unkept(problem: Problem) -> tuple[Obstacle, ...]:
    """Tell which hard limits no lens within the bounds keeps."""
    found = []
    for one in broken_limits(problem):
        if one.nearest is None:
            reason = (
                f"the hard limits {', '.join(one.names)} contradict each other: no lens within the bounds keeps all"
            )
        else:
            (name,) = one.names
            unit = "f/" if name == "f_number" else ""
            reason = (
                f"no lens within the bounds keeps the hard limit {name}; the nearest has at best "
                f"{unit}{one.nearest:.4g}{'' if unit else ' mm'}"
            )
        found.append(
            Obstacle(", ".join(one.names), f"{reason}; widen it or the bounds of gaps, radii and indices", 0.0)
        )
    return tuple(found)


def on_the_line(wish: GhostWish, number: int, project: Project) -> GhostWish:
    """Turn a wish for a place in the picture into one along the line.

    Parameters
    ----------
    wish : GhostWish
    number : int
        Its place in the list, for messages.
    project : Project

    Returns
    -------
    GhostWish
        With the nearest point of the line; the same when it has no `at_mm`.

    Raises
    ------
    ProjectError
        When it is not clear which light's line is meant.
    """
    if wish.at_mm is None:
        return wish
    if wish.light is None and len(project.lights) > 1:
        raise ProjectError(f"design.wishes[{number}]: at_mm is a place for one light; say which with light = 0")
    along, _ = _along_and_aside(wish, project)
    changed: GhostWish = wish.replace(at_mm=None, place_mm=along)
    return changed


def _along_and_aside(wish: GhostWish, project: Project) -> tuple[float, float]:
    assert wish.at_mm is not None
    if not (wish.light or 0) < len(project.lights):
        return 0.0, 0.0
    x, y = (tan(radians(angle)) for angle in project.lights[wish.light or 0].field_deg)
    slope = hypot(x, y)
    px, py = wish.at_mm
    return (px * x + py * y) / slope, abs(px * y - py * x) / slope


def _off_the_line(project: Project) -> tuple[Obstacle, ...]:
    found = []
    for number, wish in enumerate(() if project.design is None else project.design.wishes):
        if wish.at_mm is None or wish.action != "want":
            continue
        along, aside = _along_and_aside(wish, project)
        if aside > TOLERABLE:
            name = wish.ghost or f"wish {number}"
            found.append(Obstacle(
                name, f"{name} is wanted {aside:.3g} mm beside the line through the middle and the light, which no "
                f"ghost leaves; the nearest place on it is place_mm = {along:.3f}", aside,
            ))  # fmt: skip
    return tuple(found)


def _out_of_reach(problem: Problem) -> tuple[Obstacle, ...]:
    aim = problem.objective
    least = least_distances(problem)
    return tuple(
        Obstacle(
            name, f"{name} is wanted at {target[0]:.4g} mm with radius {target[1]:.4g} mm, but no ghost of a lens "
            f"within the bounds comes nearer than {off:.3g} mm; widen the bounds, or fix fewer rows", float(off),
        )
        for name, target, off in zip(aim.names, aim.targets, least, strict=True) if off > TOLERABLE
    )  # fmt: skip


def _contradictions(problem: Problem) -> tuple[Obstacle, ...]:
    """Look for pairs of lights that ask for more ghosts than there are.

    To first order a ghost's place grows with the light's slope and its radius does not change. So targets at two lights
    can be one ghost only if they agree in that, and those that do not are ghosts of their own.
    """
    aim = problem.objective
    ghosts = max(len(structure.pairs) for structure in problem.structures)
    found = []
    lights = len(aim.slopes)
    for s in range(lights):
        for t in range(s + 1, lights):
            ours, theirs = (range(int(aim.spans[k]), int(aim.spans[k + 1])) for k in (s, t))
            common = len(ours) + len(theirs) - ghosts
            if common <= 0:
                continue
            errors = _as_one_ghost(problem, s, t)
            least, pair = _bottleneck(errors, common)
            if least > TOLERABLE:
                one, other = aim.names[ours[pair[0]]], aim.names[theirs[pair[1]]]
                found.append(Obstacle(
                    f"{one}, {other}", f"lights {s} and {t} ask for more than {ghosts} ghosts, so that some must serve "
                    "both; a ghost's place grows with the light's angle and its size stays, and the wishes differ from "
                    f"that by {least:.3g} mm ({one} and {other}); wish the same at both lights, or give more surfaces",
                    least,
                ))  # fmt: skip
    return tuple(found)


def _as_one_ghost(problem: Problem, s: int, t: int) -> Floats:
    """Return the least error with which each pair of targets of two lights could be one ghost, shape (N_s, N_t)."""
    aim = problem.objective
    (p, ps), (q, qs) = (
        (aim.targets[aim.spans[k] : aim.spans[k + 1]], aim.weights[aim.spans[k] : aim.spans[k + 1]]) for k in (s, t)
    )
    a, b = float(aim.slopes[s]), float(aim.slopes[t])
    # the best ghost shares the error between both lights
    place = np.abs(p[:, None, 0] * b - q[None, :, 0] * a) / (a + b)
    size = 0.5 * np.abs(p[:, None, 1] - q[None, :, 1])
    counts = (ps[:, :2].max(axis=1) > 0.0)[:, None] & (qs[:, :2].max(axis=1) > 0.0)[None, :]
    return np.asarray(np.where(counts, np.maximum(place, size), 0.0), dtype=np.float64)


def _bottleneck(errors: Floats, count: int) -> tuple[float, tuple[int, int]]:
    """Return the least error at which so many pairs exist, no target in two, and a pair that has it."""
    levels = np.unique(errors)
    low, high = 0, len(levels) - 1
    while low < high:
        middle = (low + high) // 2
        if _matching(errors <= levels[middle]) >= count:
            high = middle
        else:
            low = middle + 1
    at = np.argwhere(errors == levels[low])[0]
    return float(levels[low]), (int(at[0]), int(at[1]))


def _matching(allowed: NDArray[np.bool_]) -> int:
    """Count the pairs of a largest matching, by augmenting paths (Kuhn 1955)."""
    partner = np.full(allowed.shape[1], -1)

    def place(row: int, seen: set[int]) -> bool:
        for column in np.flatnonzero(allowed[row]):
            if int(column) not in seen:
                seen.add(int(column))
                if partner[column] < 0 or place(int(partner[column]), seen):
                    partner[column] = row
                    return True
        return False

    return sum(place(row, set()) for row in range(allowed.shape[0]))
