"""The thesis' evolutionary algorithms, by pygmo, on an archipelago whose islands do exchange lenses.

Van Acoleyen 2025, section 5.6.3: 15 islands, 15 individuals for each gene. In the thesis' program the islands have no
topology, so that nobody ever leaves one; here the best of an island visit its two neighbours on a ring. pygmo's own
archipelago lets islands run when they can, so that who meets whom depends on the machine; here all islands wait for
each other before anybody travels, and the same seed gives the same lenses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError, optional
from .hunt import Ground, Hunt

Floats = NDArray[np.float64]

ALGORITHMS = ("pso", "sade", "de", "de1220", "gaco")

# generations between two exchanges, and how many travel from each island to each neighbour
ROUND = 20
TRAVELLERS = 2
# the thesis' program begins its swarms anew, without velocities, after so many generations
SWARM_LASTS = 200
# generations without a better lens after which an archipelago is settled anew
PATIENCE = 600
# evaluations after which a solver listens at least
_LISTENS = 2000
# the ant colony's archive needs so many
_FEWEST = {"gaco": 64, "sade": 8, "de1220": 8, "de": 8, "pso": 8}


@dataclass(frozen=True)
class Settling:
    """How many islands, and how many individuals on each for every gene."""

    islands: int = 15
    per_gene: float = 15.0

    def size(self, name: str, genes: int) -> int:
        """Return the individuals of an island."""
        return max(_FEWEST[name], round(self.per_gene * genes))


def evolve(hunt: Hunt, name: str, settling: Settling) -> None:
    """Search with one of pygmo's algorithms.

    Parameters
    ----------
    hunt : Hunt
        Gets what is found.
    name : str
        One of `ALGORITHMS`.
    settling : Settling

    Raises
    ------
    ProjectError
        Without pygmo.

    Notes
    -----
    Settings are pygmo's own, as the thesis': PSO with constriction, omega 0.7298, both accelerations 2.05 and a ring of
    4; SADE rand/1/exp with jDE's adaptation; DE F 0.8, CR 0.9. An archipelago that finds nothing better for
    `PATIENCE` generations is settled anew; the best is kept.
    """
    pygmo = imported_pygmo(name)
    seed, settled, size = hunt.seed, 0, settling.size(name, hunt.ground.count)
    problem = pygmo.problem(_Ground(hunt.ground))
    while True:
        islands = []
        for number in range(settling.islands):
            islands.append(pygmo.population(problem, size, seed=_seed(seed, settled, number, 0)))
            if settled == 0:
                _introduce(islands[-1], hunt.ground)
            if hunt.note(islands[-1].get_x(), islands[-1].get_f()[:, 0], size):
                return
        if _live(pygmo, name, islands, hunt, lambda *at, epoch=settled: _seed(seed, epoch, *at)):
            return
        settled += 1


def _live(pygmo: Any, name: str, islands: list[Any], hunt: Hunt, seed_of: Callable[[int, int], int]) -> bool:
    """Let an archipelago evolve until it finds nothing better (False) or the work is over (True)."""
    size = len(islands[0])
    slice_of = max(1, min(ROUND, _LISTENS // size))
    age, best, best_at = 0, hunt.best, 0
    algorithms: list[Any] = []
    while age - best_at < PATIENCE:
        if age % SWARM_LASTS == 0:
            algorithms = [_algorithm(pygmo, name, seed_of(k, 1 + age), slice_of) for k in range(len(islands))]
        for k, algorithm in enumerate(algorithms):
            for _ in range(0, ROUND, slice_of):
                before = islands[k].problem.get_fevals()
                islands[k] = algorithm.evolve(islands[k])
                spent = int(islands[k].problem.get_fevals() - before)
                if hunt.note(islands[k].get_x(), islands[k].get_f()[:, 0], spent):
                    return True
        age += ROUND
        migrate(pygmo, islands)
        if hunt.best < 0.999 * best:
            best, best_at = hunt.best, age
    return False


def migrate(pygmo: Any, islands: list[Any]) -> int:
    """Let the best of every island visit its neighbours on a ring, where they take the place of worse ones.

    Parameters
    ----------
    pygmo : module
    islands : list of pygmo.population
        Changed.

    Returns
    -------
    int
        How many stayed.
    """
    if len(islands) < 2:
        return 0
    ring = pygmo.topology(pygmo.ring(len(islands)))
    choose, settle = pygmo.s_policy(pygmo.select_best(TRAVELLERS)), pygmo.r_policy(pygmo.fair_replace(TRAVELLERS))
    genes = islands[0].problem.get_nx()
    # one objective, no constraints: pygmo's nx, nix, nobj, nec, nic, tol
    shape: tuple[Any, ...] = (genes, 0, 1, 0, 0, [])
    people = [(one.get_ID(), one.get_x(), one.get_f()) for one in islands]
    travellers = [choose.select(everybody, *shape) for everybody in people]
    stayed = 0
    for k, island in enumerate(islands):
        neighbours = dict.fromkeys(int(m) for m in ring.get_connections(k)[0])
        visitors = [np.concatenate(parts) for parts in zip(*(travellers[m] for m in neighbours), strict=True)]
        after = settle.replace(people[k], *shape, tuple(visitors))
        known = set(people[k][0].tolist())
        newcomers = [m for m, one in enumerate(after[0].tolist()) if one not in known]
        gone = set(known) - set(after[0].tolist())
        places = [m for m, one in enumerate(people[k][0].tolist()) if one in gone]
        for place, m in zip(places, newcomers, strict=True):
            island.set_xf(place, after[1][m], after[2][m])
        stayed += len(newcomers)
    return stayed


def _algorithm(pygmo: Any, name: str, seed: int, generations: int) -> Any:
    """Return an algorithm that goes on, call by call, where it was."""
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
            # all ants of a generation at once
            made.set_bfe(pygmo.bfe())
    return pygmo.algorithm(made)


def _introduce(island: Any, ground: Ground) -> None:
    """Put what is there already among the first, as the thesis does."""
    for place, genes in enumerate(ground.known()[: len(island)]):
        island.set_x(place, genes)


def _seed(*numbers: int) -> int:
    return int(np.random.SeedSequence(numbers).generate_state(1)[0] >> 1)


class _Ground:
    """A hunting ground as pygmo wants it; shared, not copied, for it never changes."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground

    def fitness(self, genes: Floats) -> Floats:
        return self._ground.fitness(genes[None])

    def batch_fitness(self, many: Floats) -> Floats:
        return self._ground.fitness(many.reshape(-1, self._ground.count))

    def get_bounds(self) -> tuple[Floats, Floats]:
        return np.zeros(self._ground.count), np.ones(self._ground.count)

    def __deepcopy__(self, memory: dict[int, Any]) -> _Ground:
        return self


def imported_pygmo(name: str) -> Any:
    """Import pygmo.

    Raises
    ------
    ProjectError
        When it is not there.
    """
    hint = " (Linux; elsewhere pygmo comes from conda-forge)"
    return optional("pygmo", "evo", f"the solver {name}", kind=ProjectError, hint=hint)
