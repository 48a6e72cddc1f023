"""What is searched for, where, and what is found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model import Medium
from ..model.design import Bounds
from .glass_list import GlassList
from .objective import Objective
from .prescription import Structure
from .variables import Variables, variables

Floats = NDArray[np.float64]
Over = Callable[[], bool]

# a cost at which the wanted ghosts are met
SOLVED = 1e-14


def never() -> bool:
    """Tell that the time is not up."""
    return False


@dataclass(frozen=True)
class Problem:
    """What a solver needs to know.

    Attributes
    ----------
    objective : Objective
    structures : tuple of Structure
        All of the same number of rows.
    bounds : Bounds
    stop_diameter : float or None
        When it is known, mm.
    fixed : ndarray, shape (1 + 3 K,), or None
        Prescription whose `fixed_rows` are kept.
    fixed_rows : tuple of int
    begin_with : tuple of (Structure, ndarray)
        Prescriptions that join the first run.
    glasses : GlassList or None
        Every lens is made of these; the bounds of n_d are theirs.
    fixed_media : tuple of Medium or None
        Behind each row of the prescription whose `fixed_rows` are kept.
    traced : bool
        Lenses that were found are finished with traced rays.
    """

    objective: Objective
    structures: tuple[Structure, ...]
    bounds: Bounds
    stop_diameter: float | None = None
    fixed: Floats | None = None
    fixed_rows: tuple[int, ...] = ()
    begin_with: tuple[tuple[Structure, Floats], ...] = ()
    glasses: GlassList | None = None
    fixed_media: tuple[Medium | None, ...] = ()
    traced: bool = False

    def check(self) -> None:
        """Refuse what no solver can begin with.

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
            raise ProjectError("every row is fixed, so there is nothing to search; leave some rows free")

    def variables(self, structure: Structure) -> Variables:
        """Return the variables of a structure."""
        return variables(
            structure, self.bounds, stop_diameter=self.stop_diameter, fixed=self.fixed, fixed_rows=self.fixed_rows
        )


@dataclass(frozen=True)
class Candidate:
    """A local minimum: cost, structure and search variables."""

    cost: float
    structure: Structure
    x: Floats
