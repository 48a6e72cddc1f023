"""A prescription as one vector of numbers, and the structure that says what the numbers stand for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..errors import LensError
from ..model import Lens, Stop, Surface

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Structure:
    """What a search does not change by steps: how many rows, where the stop is, which gaps hold glass.

    Attributes
    ----------
    stop : int
        Row of the stop; it stands in air.
    glass : tuple of bool
        Whether glass is behind each row.
    """

    stop: int
    glass: tuple[bool, ...]

    @property
    def rows(self) -> int:
        """Number of rows, the stop's included."""
        return len(self.glass)

    @cached_property
    def mirrors(self) -> NDArray[np.bool_]:
        """Which rows reflect, shape (K,): those with glass on one side at least."""
        glass = np.array(self.glass)
        found = glass | np.concatenate([[False], glass[:-1]])
        found[self.stop] = False
        return found

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Mirrors (j, i) of every ghost, in the order of the kernels: in front of the stop, then behind it."""
        halves = (range(self.stop), range(self.stop + 1, self.rows))
        return tuple(
            (j, i) for half in halves for j in half if self.mirrors[j] for i in reversed(half) if i < j and self.mirrors[i]
        )

    @property
    def standing_in_air(self) -> bool:
        """Whether the stop and the sensor stand in air, as every lens' here must."""
        return not (self.glass[self.stop] or self.glass[-1] or (self.stop > 0 and self.glass[self.stop - 1]))


def structure_of(lens: Lens) -> Structure:
    """Return the structure of a lens.

    Parameters
    ----------
    lens : Lens

    Returns
    -------
    Structure

    Raises
    ------
    LensError
        When the stop stands in glass, or the lens is not one of revolution.
    """
    if any(isinstance(row, Surface) and row.toroidal for row in lens.rows):
        raise LensError(f"{lens.name} has cylinders or toroids; design works with lenses of revolution")
    glass = tuple(isinstance(row, Surface) and row.medium is not None for row in lens.rows)
    found = Structure(lens.stop_row, glass)
    if not found.standing_in_air:
        raise LensError(f"{lens.name}: the stop, row {found.stop}, stands in glass; design needs it in air")
    return found


def vector_of(lens: Lens, stop_diameter: float, sensor_distance: float) -> Floats:
    """Write a lens as one vector.

    Parameters
    ----------
    lens : Lens
    stop_diameter, sensor_distance : float
        mm.

    Returns
    -------
    ndarray, shape (1 + 3 K,)
        Stop diameter; thickness behind each row, the last one to the sensor; curvatures; n_d behind each row.
    """
    d = [row.thickness for row in lens.rows[:-1]]
    c = [0.0 if isinstance(row, Stop) else row.curvature for row in lens.rows]
    n = [1.0 if isinstance(row, Stop) or row.medium is None else row.medium.n_d for row in lens.rows]
    return np.array([stop_diameter, *d, sensor_distance, *c, *n])
