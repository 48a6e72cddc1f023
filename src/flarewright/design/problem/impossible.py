"""Targets that no lens can meet, found before a search: necessary conditions, each with a proven least error."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians, tan

import numpy as np

from ...errors import ProjectError
from ...model import Project
from ...model.project.design import GhostTarget
from ...typing import Floats, Mask
from .problem import Problem
from .reachable_range import broken_limits, least_distances

# an error below this counts as met (`report.MET`): a smaller proven error is no obstacle, mm
TOLERABLE = 0.005


@dataclass(frozen=True)
class Obstacle:
    """Why a target cannot be met.

    Attributes
    ----------
    target : str
        Name of the target or of a hard limit; several names where they contradict each other.
    reason : str
        One sentence.
    least_error_mm : float
        Least error in place or radius of the target (or of one of several) over all lenses; 0 for a hard limit.
    """

    target: str
    reason: str
    least_error_mm: float


def obstacles(problem: Problem, project: Project | None = None) -> tuple[Obstacle, ...]:
    """List the targets and limits of a problem that are proven impossible.

    Parameters
    ----------
    problem : Problem
    project : Project, optional
        The project of the problem; its ghost targets may lie off the line.

    Returns
    -------
    tuple of Obstacle
        Empty: nothing is proven; the problem may still be impossible.
    """
    off = () if project is None else _off_the_line(project)
    return (*off, *_broken_limits(problem), *_out_of_reach(problem), *_contradictions(problem))


def _broken_limits(problem: Problem) -> tuple[Obstacle, ...]:
    """List the hard limits that no lens within the bounds meets."""
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


def on_the_line(ghost_target: GhostTarget, number: int, project: Project) -> GhostTarget:
    """Convert a ghost target at a point of the picture to one along the line.

    Parameters
    ----------
    ghost_target : GhostTarget
    number : int
        Its index in the list, for messages.
    project : Project

    Returns
    -------
    GhostTarget
        With the nearest point of the line; unchanged without `at_mm`.

    Raises
    ------
    ProjectError
        When the target names no light and the project has several.
    """
    if ghost_target.at_mm is None:
        return ghost_target
    if ghost_target.light is None and len(project.lights) > 1:
        raise ProjectError(f"design.ghost_targets[{number}]: at_mm holds for one light; name it, e.g. light = 0")
    along, _ = _along_and_aside(ghost_target, project)
    return ghost_target.replace(at_mm=None, place_mm=along)


def _along_and_aside(ghost_target: GhostTarget, project: Project) -> tuple[float, float]:
    assert ghost_target.at_mm is not None
    if not (ghost_target.light or 0) < len(project.lights):
        return 0.0, 0.0
    x, y = (tan(radians(angle)) for angle in project.lights[ghost_target.light or 0].field_deg)
    slope = hypot(x, y)
    px, py = ghost_target.at_mm
    return (px * x + py * y) / slope, abs(px * y - py * x) / slope


def _off_the_line(project: Project) -> tuple[Obstacle, ...]:
    found = []
    for number, ghost_target in enumerate(() if project.design is None else project.design.ghost_targets):
        if ghost_target.at_mm is None or ghost_target.action != "want":
            continue
        along, aside = _along_and_aside(ghost_target, project)
        if aside > TOLERABLE:
            name = ghost_target.ghost or f"target {number}"
            found.append(Obstacle(
                name, f"{name} lies {aside:.3g} mm beside the line through the middle and the light, but every ghost "
                f"lies on it; the nearest place on the line is place_mm = {along:.3f}", aside,
            ))  # fmt: skip
    return tuple(found)


def _out_of_reach(problem: Problem) -> tuple[Obstacle, ...]:
    aim = problem.objective
    least = least_distances(problem)
    return tuple(
        Obstacle(
            name, f"{name} has its target at {target[0]:.4g} mm with radius {target[1]:.4g} mm, but no ghost of a lens "
            f"within the bounds comes nearer than {off:.3g} mm; widen the bounds, or fix fewer rows", float(off),
        )
        for name, target, off in zip(aim.names, aim.targets, least, strict=True) if off > TOLERABLE
    )  # fmt: skip


def _contradictions(problem: Problem) -> tuple[Obstacle, ...]:
    """Find pairs of lights whose targets need more ghosts than a lens has.

    To first order a ghost's place grows with the light's slope and its radius is constant. So one ghost can meet
    targets at two lights only if they agree in that; other targets need separate ghosts.
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
                    f"{one}, {other}", f"lights {s} and {t} need more than {ghosts} ghosts, so some ghosts must serve "
                    "both; a ghost's place grows with the light's angle and its size is constant, but the targets "
                    f"differ from that by {least:.3g} mm ({one} and {other}); use equal targets, or more surfaces",
                    least,
                ))  # fmt: skip
    return tuple(found)


def _as_one_ghost(problem: Problem, s: int, t: int) -> Floats:
    """Return the least error for one ghost to meet each pair of targets of two lights, shape (N_s, N_t)."""
    aim = problem.objective
    (p, ps), (q, qs) = (
        (aim.targets[aim.spans[k] : aim.spans[k + 1]], aim.weights[aim.spans[k] : aim.spans[k + 1]]) for k in (s, t)
    )
    a, b = float(aim.slopes[s]), float(aim.slopes[t])
    # the best ghost splits the error evenly between both lights
    place = np.abs(p[:, None, 0] * b - q[None, :, 0] * a) / (a + b)
    size = 0.5 * np.abs(p[:, None, 1] - q[None, :, 1])
    counts = (ps[:, :2].max(axis=1) > 0.0)[:, None] & (qs[:, :2].max(axis=1) > 0.0)[None, :]
    return np.asarray(np.where(counts, np.maximum(place, size), 0.0), dtype=np.float64)


def _bottleneck(errors: Floats, count: int) -> tuple[float, tuple[int, int]]:
    """Return the least error that admits `count` disjoint pairs of targets, and a pair that has this error."""
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


def _matching(allowed: Mask) -> int:
    """Return the size of a maximum matching, by augmenting paths (Kuhn 1955)."""
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
