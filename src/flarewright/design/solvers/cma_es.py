"""CMA-ES by the package cmaes, restarted with twice the population after convergence."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import ProjectError, optional
from ...typing import Floats
from .evolution_log import SearchRecord

# initial standard deviation, as a fraction of a gene's range from 0 to 1
FIRST_SPREAD = 0.2
# largest population as a multiple of the first
LARGEST = 32


def adapt(record: SearchRecord) -> None:
    """Search with CMA-ES, restarted with twice the population after every convergence.

    Parameters
    ----------
    record : SearchRecord
        Records the points found.

    Raises
    ------
    ProjectError
        When cmaes is not installed.

    Notes
    -----
    Hansen and Ostermeier 2001; restarts as in Auger and Hansen 2005. CMA-ES has no bounds: points outside 0 to 1 are
    folded back (`folded`).
    """
    strategy = imported_cmaes()
    space, started = record.space, 0
    # a large first population: there are many minima
    size, known = 2 * space.count, space.known()
    while True:
        random = np.random.default_rng([record.seed, started])
        start = random.random(space.count)
        if started < len(known):
            start = known[started]
            # record it now: the population around it may find nothing as good
            if record.note(start[None], space.fitness(start[None]), 1):
                return
        population = size * min(2**started, LARGEST) if started % 7 else size
        swarm = strategy.CMA(
            mean=start, sigma=FIRST_SPREAD, population_size=population, seed=int(random.integers(2**31))
        )
        if _converge(swarm, record):
            return
        started += 1


def _converge(swarm: Any, record: SearchRecord) -> bool:
    """Run a population until it converges; return True if the search ends before."""
    while not swarm.should_stop():
        asked = [swarm.ask() for _ in range(swarm.population_size)]
        inside = folded(np.array(asked))
        costs = record.space.fitness(inside)
        if record.note(inside, costs, len(asked)):
            return True
        swarm.tell([(x, float(cost)) for x, cost in zip(asked, costs, strict=True)])
    return False


def folded(x: Floats) -> Floats:
    """Fold the real line into 0 to 1 by reflection."""
    turned = np.mod(x, 2.0)
    return np.asarray(np.where(turned > 1.0, 2.0 - turned, turned), dtype=np.float64)


def imported_cmaes() -> Any:
    """Import cmaes.

    Raises
    ------
    ProjectError
        When it is not installed.
    """
    return optional("cmaes", "evo", "the solver cmaes", kind=ProjectError)
