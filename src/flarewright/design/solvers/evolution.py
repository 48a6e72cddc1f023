"""The thesis' evolutionary algorithms, by pygmo, on an archipelago whose islands exchange lenses.

Van Acoleyen 2025, section 5.6.3: 15 islands, 15 individuals for each gene. In the thesis' program the islands have no
topology, so individuals never migrate; here the best of an island migrate to its two neighbours on a ring. In pygmo's
own archipelago islands run asynchronously, so migration depends on the machine; here all islands wait for each other
before a migration, and the same seed gives the same lenses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ProjectError, optional
from ...typing import Floats
from .evolution_log import SearchRecord, SearchSpace

ALGORITHMS = ("pso", "sade", "de", "de1220", "gaco")

# generations between two migrations, and number of migrants from each island to each neighbour
ROUND = 20
MIGRANTS = 2
# generations after which the thesis' program restarts its swarms without velocities
SWARM_GENERATIONS = 200
# generations without improvement after which an archipelago is restarted
PATIENCE = 600
# largest number of evaluations between two checks for the end
_CHECK_EVALUATIONS = 2000
# smallest population that each algorithm accepts
_LEAST_POPULATION = {"gaco": 64, "sade": 8, "de1220": 8, "de": 8, "pso": 8}


@dataclass(frozen=True)
class Archipelago:
    """Number of islands, and of individuals on each for every gene."""

    islands: int = 15
    per_gene: float = 15.0

    def size(self, name: str, genes: int) -> int:
        """Return the population of an island."""
        return max(_LEAST_POPULATION[name], round(self.per_gene * genes))


def evolve(record: SearchRecord, name: str, archipelago: Archipelago) -> None:
    """Search with one of pygmo's algorithms.

    Parameters
    ----------
    record : SearchRecord
        Records the points found.
    name : str
        One of `ALGORITHMS`.
    archipelago : Archipelago

    Raises
    ------
    ProjectError
        When pygmo is not installed.

    Notes
    -----
    Settings are pygmo's defaults, as in the thesis: PSO with constriction, omega 0.7298, both accelerations 2.05 and a
    ring of 4; SADE rand/1/exp with jDE's adaptation; DE F 0.8, CR 0.9. An archipelago without improvement for
    `PATIENCE` generations is restarted; the best point is kept.
    """
    pygmo = imported_pygmo(name)
    seed, settled, size = record.seed, 0, archipelago.size(name, record.space.count)
    problem = pygmo.problem(_PygmoProblem(record.space))
    while True:
        islands = []
        for number in range(archipelago.islands):
            islands.append(pygmo.population(problem, size, seed=_seed(seed, settled, number, 0)))
            if settled == 0:
                _add_known(islands[-1], record.space)
            if record.note(islands[-1].get_x(), islands[-1].get_f()[:, 0], size):
                return
        if _evolve_until_stale(pygmo, name, islands, record, lambda *at, epoch=settled: _seed(seed, epoch, *at)):
            return
        settled += 1


def _evolve_until_stale(
    pygmo: Any, name: str, islands: list[Any], record: SearchRecord, seed_of: Callable[[int, int], int]
) -> bool:
    """Evolve an archipelago until it stops improving (False) or the search ends (True)."""
    size = len(islands[0])
    slice_of = max(1, min(ROUND, _CHECK_EVALUATIONS // size))
    age, best, best_at = 0, record.best, 0
    algorithms: list[Any] = []
    while age - best_at < PATIENCE:
        if age % SWARM_GENERATIONS == 0:
            algorithms = [_algorithm(pygmo, name, seed_of(k, 1 + age), slice_of) for k in range(len(islands))]
        for k, algorithm in enumerate(algorithms):
            for _ in range(0, ROUND, slice_of):
                before = islands[k].problem.get_fevals()
                islands[k] = algorithm.evolve(islands[k])
                spent = int(islands[k].problem.get_fevals() - before)
                if record.note(islands[k].get_x(), islands[k].get_f()[:, 0], spent):
                    return True
        age += ROUND
        migrate(pygmo, islands)
        if record.best < 0.999 * best:
            best, best_at = record.best, age
    return False


def migrate(pygmo: Any, islands: list[Any]) -> int:
    """Copy the best of every island to its neighbours on a ring, where they replace worse individuals.

    Parameters
    ----------
    pygmo : module
    islands : list of pygmo.population
        Modified in place.

    Returns
    -------
    int
        Number of accepted migrants.
    """
    if len(islands) < 2:
        return 0
    ring = pygmo.topology(pygmo.ring(len(islands)))
    choose, settle = pygmo.s_policy(pygmo.select_best(MIGRANTS)), pygmo.r_policy(pygmo.fair_replace(MIGRANTS))
    genes = islands[0].problem.get_nx()
    # one objective, no constraints: pygmo's nx, nix, nobj, nec, nic, tol
    shape: tuple[Any, ...] = (genes, 0, 1, 0, 0, [])
    populations = [(one.get_ID(), one.get_x(), one.get_f()) for one in islands]
    migrants = [choose.select(one, *shape) for one in populations]
    stayed = 0
    for k, island in enumerate(islands):
        neighbours = dict.fromkeys(int(m) for m in ring.get_connections(k)[0])
        arrivals = [np.concatenate(parts) for parts in zip(*(migrants[m] for m in neighbours), strict=True)]
        after = settle.replace(populations[k], *shape, tuple(arrivals))
        known = set(populations[k][0].tolist())
        accepted = [m for m, one in enumerate(after[0].tolist()) if one not in known]
        gone = set(known) - set(after[0].tolist())
        places = [m for m, one in enumerate(populations[k][0].tolist()) if one in gone]
        for place, m in zip(places, accepted, strict=True):
            island.set_xf(place, after[1][m], after[2][m])
        stayed += len(accepted)
    return stayed


def _algorithm(pygmo: Any, name: str, seed: int, generations: int) -> Any:
    """Return an algorithm that keeps its state between calls."""
    match name:
        case "pso":
            made = pygmo.pso(gen=generations, memory=True, seed=seed)
        case "sade":
            made = pygmo.sade(gen=generations, memory=True, ftol=0.0, xtol=0.0, seed=seed)
        case "de":
            made = pygmo.de(gen=generations, ftol=0.0, xtol=0.0, seed=seed)
        case "de1220":
            made = pygmo.de1220(gen=generations, memory=True, ftol=0.0, xtol=0.0, seed=seed)
        case _:
            made = pygmo.gaco(gen=generations, memory=True, impstop=2**31, evalstop=2**31, seed=seed)
            # evaluate all ants of a generation at once
            made.set_bfe(pygmo.bfe())
    return pygmo.algorithm(made)


def _add_known(island: Any, space: SearchSpace) -> None:
    """Put known lenses into the first population, as the thesis does."""
    for place, genes in enumerate(space.known()[: len(island)]):
        island.set_x(place, genes)


def _seed(*numbers: int) -> int:
    return int(np.random.SeedSequence(numbers).generate_state(1)[0] >> 1)


class _PygmoProblem:
    """A search space with the interface of pygmo; shared instead of copied, as it never changes."""

    def __init__(self, space: SearchSpace) -> None:
        self._space = space

    def fitness(self, genes: Floats) -> Floats:
        return self._space.fitness(genes[None])

    def batch_fitness(self, many: Floats) -> Floats:
        return self._space.fitness(many.reshape(-1, self._space.count))

    def get_bounds(self) -> tuple[Floats, Floats]:
        return np.zeros(self._space.count), np.ones(self._space.count)

    def __deepcopy__(self, memory: dict[int, Any]) -> _PygmoProblem:
        return self


def imported_pygmo(name: str) -> Any:
    """Import pygmo.

    Raises
    ------
    ProjectError
        When it is not installed.
    """
    hint = " (Linux; elsewhere pygmo comes from conda-forge)"
    return optional("pygmo", "evo", f"the solver {name}", kind=ProjectError, hint=hint)
