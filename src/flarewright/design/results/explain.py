"""Judgement of a search for a measured lens: explained ghosts, and how much of the prescription they determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...sentences import count
from ...typing import Floats
from ..finishing.candidate import Outcome
from ..problem.problem import Problem
from .identify import Identification, identify

# a ghost is explained when place and size errors are below this fraction of its radius, or below this many mm
PART, LEAST_MM = 0.1, 0.1
# lenses explain alike when their misfits differ by less than this factor
ALIKE = 2.0


@dataclass(frozen=True)
class Explanation:
    """What a search found out about a measured lens.

    Attributes
    ----------
    explained : tuple of bool
        For each target, whether the best lens explains it.
    extra : int
        Number of ghosts of that lens at that light that were not measured.
    numbers : int
        Number of places and sizes of the explained ghosts.
    known : Identification
        Which numbers of the prescription they determine near that lens.
    alike : int
        Number of found lenses that explain as many ghosts as well as the best.
    spread : float
        Largest difference of an index of refraction between them; 0 for a single lens.
    """

    explained: tuple[bool, ...]
    extra: int
    numbers: int
    known: Identification
    alike: int
    spread: float


def explain_misfit(problem: Problem, found: Sequence[Outcome]) -> Explanation:
    """Judge the result of a search.

    Parameters
    ----------
    problem : Problem
    found : sequence of Outcome
        Best first, at least one.
    """
    best = found[0]
    explained = _explained(problem, best)
    ghosts = sorted({pair for pair, yes in zip(best.ghosts, explained, strict=True) if yes})
    aim = problem.objective
    known = identify(best.structure, best.vector, aim.slopes, entrance=aim.entrance, ghosts=ghosts)
    alike = [
        one for one in found
        if sum(_explained(problem, one)) == sum(explained) and one.fitness <= ALIKE * best.fitness + 1e-9
    ]  # fmt: skip
    indices = np.array([sorted(_indices(one)) for one in alike if one.structure.rows == best.structure.rows])
    spread = float(np.ptp(indices, axis=0).max()) if len(indices) > 1 else 0.0
    extra = len(set(best.structure.pairs) - set(best.ghosts))
    return Explanation(explained, extra, 2 * len(ghosts), known, len(alike), spread)


def _explained(problem: Problem, one: Outcome) -> tuple[bool, ...]:
    limits = np.maximum(PART * np.abs(problem.objective.targets[:, 1]), LEAST_MM)
    return tuple(bool(off) for off in (np.abs(one.residuals).max(axis=1) < limits))


def _indices(one: Outcome) -> Floats:
    """Return the index behind every row, air included."""
    rows = one.structure.rows
    return np.asarray(one.vector[1 + 2 * rows :], dtype=np.float64)


def sentences(one: Explanation, names: Sequence[str]) -> list[str]:
    """Return sentences on what was found, and on what these ghosts cannot determine.

    Parameters
    ----------
    one : Explanation
    names : sequence of str
        Of the targets.
    """
    missing = [name for name, yes in zip(names, one.explained, strict=True) if not yes]
    said = [f"the best lens explains {sum(one.explained)} of {count(len(one.explained), 'measured ghost')}"
            + (f" (not {', '.join(missing)})" if missing else "")
            + (f", and has {one.extra} more that were not measured" if one.extra else "")]  # fmt: skip
    known = one.known
    loose = known.unknowns - known.rank
    said.append(
        f"their {one.numbers} places and sizes fix {known.rank} combinations of the {known.unknowns} numbers of its "
        f"prescription" + (f"; {loose} stay free" if loose else "")
    )
    if loose:
        said.append(
            f"so this is one lens of a family of {loose} dimensions that make these ghosts, not the camera's own; "
            f"what would fix it: {', '.join(known.remedies)}"
        )
    elif one.alike > 1:
        said.append(f"near it no other lens makes them, but {one.alike} lenses far apart were found that do")
    else:
        said.append("near it no other lens makes them; lenses far from it may")
    if one.alike > 1 and loose:
        said.append(f"{one.alike} lenses were found that explain alike; their indices differ by up to {one.spread:.2f}")
    return said
