"""Design: find a lens whose flare meets given targets (Van Acoleyen 2025, and beyond).

A project becomes a `Problem`, a solver searches lenses, and the best ones are finished and written to a folder.

Main names: `Problem`, `problem_of`, `solve`, `State`, `Outcome`, `outcomes`, `identify`, `Identification`.

- `problem`: ghost targets, prescriptions, and the misfit between both
- `solvers`: the built-in pool search and evolutionary algorithms
- `finishing`: hard constraints, catalogue glasses, traced rays, and direct edits of a lens
- `coatings`: coatings for target ghost colours
- `results`: verdict, files, report, and what ghosts determine of a lens
- `thesis`: the tests of the thesis as a benchmark
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazy_names

if TYPE_CHECKING:
    from .finishing.candidate import Outcome as Outcome
    from .finishing.candidate import outcomes as outcomes
    from .problem.problem import Problem as Problem
    from .problem.target import problem_of as problem_of
    from .results.identify import Identification as Identification
    from .results.identify import identify as identify
    from .solvers.pool_search import PoolState as PoolState
    from .solvers.pool_search import solve as solve

__all__, __getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".problem.problem": ("Problem",),
        ".problem.target": ("problem_of",),
        ".solvers.pool_search": ("PoolState", "solve"),
        ".finishing.candidate": ("Outcome", "outcomes"),
        ".results.identify": ("Identification", "identify"),
    },
)
