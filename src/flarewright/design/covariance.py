"""CMA-ES, by the package cmaes: one swarm that learns the shape of the valley, begun anew with twice as many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError, optional
from .hunt import Hunt

Floats = NDArray[np.float64]

# of a gene's range from 0 to 1
FIRST_SPREAD = 0.2
# a population larger than this many times the first is begun again from the first
LARGEST = 32


def adapt(hunt: Hunt, *, first_size: int | None = None) -> None:
    """Search with CMA-ES, begun anew with twice the population whenever it has converged.

    Parameters
    ----------
    hunt : Hunt
        Gets what is found.
    first_size : int, optional
        Population of the first; None: twice the number of genes, for there are many valleys.

    Raises
    ------
    ProjectError
        Without cmaes.

    Notes
    -----
    Hansen and Ostermeier 2001; restarts as Auger and Hansen 2005. It knows no bounds: what leaves 0 to 1 is folded
    back (`folded`).
    """
    strategy = imported_cmaes()
    ground, begun = hunt.ground, 0
    size, known = first_size or 2 * ground.count, ground.known()
    while True:
        random = np.random.default_rng([hunt.seed, begun])
        start = random.random(ground.count)
        if begun < len(known):
            start = known[begun]
            # a swarm around it need not find anything as good
            if hunt.note(start[None], ground.fitness(start[None]), 1):
                return
        population = size * min(2**begun, LARGEST) if begun % 7 else size
        swarm = strategy.CMA(
            mean=start, sigma=FIRST_SPREAD, population_size=population, seed=int(random.integers(2**31))
        )
        if _converge(swarm, hunt):
            return
        begun += 1


def _converge(swarm: Any, hunt: Hunt) -> bool:
    """Let a swarm converge (False) unless the work is over before (True)."""
    while not swarm.should_stop():
        asked = [swarm.ask() for _ in range(swarm.population_size)]
        inside = folded(np.array(asked))
        costs = hunt.ground.fitness(inside)
        if hunt.note(inside, costs, len(asked)):
            return True
        swarm.tell([(x, float(cost)) for x, cost in zip(asked, costs, strict=True)])
    return False


def folded(x: Floats) -> Floats:
    """Fold the real line into 0 to 1, like a strip of paper."""
    turned = np.mod(x, 2.0)
    return np.asarray(np.where(turned > 1.0, 2.0 - turned, turned), dtype=np.float64)


def imported_cmaes() -> Any:
    """Import cmaes.

    Raises
    ------
    ProjectError
        When it is not there.
    """
    return optional("cmaes", "evo", "the solver cmaes", kind=ProjectError)
