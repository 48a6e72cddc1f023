"""Benchmark of the design solvers: evaluations and local searches per second on one core."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from flarewright.design.problem.ghosts import differentiate, evaluate
from flarewright.design.solvers.polish import polish
from flarewright.design.solvers.pool_search import batch_size
from flarewright.design.thesis.benchmark import task_of
from flarewright.design.thesis.trials import CASES, Trial


def design(seconds: Callable[[Callable[[], Any]], float], row: Callable[..., dict[str, Any]]) -> list[dict[str, Any]]:
    """Measure both lenses of Walch's thesis."""
    found = []
    for case in CASES:
        task = task_of(Trial("heliar" if case == "heliar" else "canon"))
        assert task.lens is not None
        problem, (structure, vector) = task.problem, task.lens
        many = np.repeat(vector[None], 500, axis=0)
        work = seconds(lambda s=structure, m=many: evaluate(s, m, 100.0))
        found.append(row("design", f"{case}: all ghosts", len(many) / work / 1e6, "million/s"))
        work = seconds(lambda s=structure, v=vector: differentiate(s, v, 100.0))
        found.append(row("design", f"{case}: with derivatives", 1.0 / work / 1e3, "thousand/s"))
        known, count = problem.variables(structure), batch_size(problem)
        starts = known.random_points(np.random.default_rng(0), 4 * count)
        points = [(structure, x) for x in starts]
        polish(problem, points[:1])
        started = time.process_time()
        polish(problem, points)
        found.append(row("design", f"{case}: local searches", len(points) / (time.process_time() - started), "1/s"))
    return found
