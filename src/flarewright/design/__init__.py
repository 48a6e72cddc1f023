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

from ..lazy import lazy_names

__all__, __getattr__, __dir__ = lazy_names(__name__)
