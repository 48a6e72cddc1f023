"""`Problem`, the input of every solver, and `LensCandidate`, a local minimum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...errors import ProjectError
from ...model import Stop, Surface
from ...model.project.design import Bounds
from ...typing import Floats
from .glass_list import GlassList
from .objective import Objective
from .prescription import Structure
from .variables import Variables, variables

Over = Callable[[], bool]

# cost below which the targets count as met
SOLVED = 1e-14


def never() -> bool:
    """Return False: the search has no time limit."""
    return False


@dataclass(frozen=True)
class Problem:
    """Input of a solver.

    Attributes
    ----------
    objective : Objective
    structures : tuple of Structure
        All with the same number of rows.
    bounds : Bounds
    stop_diameter : float or None
        Diameter if known, mm.
    fixed : ndarray, shape (1 + 3 K,), or None
        Prescription whose `fixed_rows` stay unchanged.
    fixed_rows : tuple of int
    begin_with : tuple of (Structure, ndarray)
        Prescriptions that join the first run.
    glasses : GlassList or None
        Glasses that a lens may use; the bounds of n_d follow from them.
    own_rows : tuple of Surface or Stop
        Rows of that prescription; the fixed ones keep their glass, shape and coating.
    traced : bool
        Finish the found lenses with traced rays.
    """

    objective: Objective
    structures: tuple[Structure, ...]
    bounds: Bounds
    stop_diameter: float | None = None
    fixed: Floats | None = None
    fixed_rows: tuple[int, ...] = ()
    begin_with: tuple[tuple[Structure, Floats], ...] = ()
    glasses: GlassList | None = None
    own_rows: tuple[Surface | Stop, ...] = ()
    traced: bool = False

    def check(self) -> None:
        """Raise an error unless a solver can start.

        Raises
        ------
        ProjectError
            When no structure has enough ghosts, or nothing is free to change.
        """
        if not self.structures:
            raise ProjectError(
                f"no lens of that many surfaces has {self.objective.wanted} ghosts; ask for fewer, or give more "
                "surfaces"
            )
        if self.variables(self.structures[0]).free.size == 0:
            raise ProjectError("every row is fixed, so there is nothing to search; free some rows")

    def variables(self, structure: Structure) -> Variables:
        """Return the variables of a structure."""
        return variables(
            structure, self.bounds, stop_diameter=self.stop_diameter, fixed=self.fixed, fixed_rows=self.fixed_rows
        )


@dataclass(frozen=True)
class LensCandidate:
    """A local minimum: cost, structure and search variables."""

    cost: float
    structure: Structure
    x: Floats
