"""A prescription as one vector of numbers, and the structure that gives the numbers their meaning."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import LensError
from ...model import Lens, Stop, Surface
from ...typing import Floats, Mask


@dataclass(frozen=True)
class Structure:
    """The discrete part of a lens: number of rows, place of the stop, and which gaps hold glass.

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
    def mirrors(self) -> Mask:
        """Which rows reflect, shape (K,): those with glass on at least one side."""
        glass = np.array(self.glass)
        found = glass | np.concatenate([[False], glass[:-1]])
        found[self.stop] = False
        return np.asarray(found, dtype=np.bool_)

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Mirrors (j, i) of every ghost, in the order of the kernels: in front of the stop, then behind it."""
        halves = (range(self.stop), range(self.stop + 1, self.rows))
        return tuple(
            (j, i)
            for half in halves
            for j in half
            for i in reversed(half)
            if i < j and self.mirrors[j] and self.mirrors[i]
        )

    @cached_property
    def number_of(self) -> dict[tuple[int, int], int]:
        """Index in `pairs` of each pair of mirrors."""
        return {pair: g for g, pair in enumerate(self.pairs)}

    def numbers(self, pairs: Iterable[tuple[int, int]]) -> list[int]:
        """Return the indices of some pairs of mirrors in `pairs`."""
        return [self.number_of[pair] for pair in pairs]

    @property
    def standing_in_air(self) -> bool:
        """Whether the stop and the sensor stand in air, as design requires."""
        return not (self.glass[self.stop] or self.glass[-1] or (self.stop > 0 and self.glass[self.stop - 1]))


def structure_of(lens: Lens) -> Structure:
    """Return the structure of a lens.

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
    """Return a lens as one vector.

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


def structures(surfaces: int, least_ghosts: int, most: int = 4096) -> tuple[Structure, ...]:
    """List the structures with enough ghosts in which every surface touches glass, fewest ghosts first.

    Parameters
    ----------
    surfaces : int
        Without the stop.
    least_ghosts : int
    most : int
        Largest number of structures; more are thinned evenly.

    Returns
    -------
    tuple of Structure
        Those with the fewest ghosts; empty when no structure has enough.
    """
    rows = surfaces + 1
    # a single surface cannot touch glass and stand in air
    stops = [stop for stop in range(rows) if 1 not in (stop, surfaces - stop)]
    counts = {stop: _pairs(stop) + _pairs(surfaces - stop) for stop in stops}
    enough = [count for count in counts.values() if count >= least_ghosts]
    if not enough:
        return ()
    stops = [stop for stop, count in counts.items() if count == min(enough)]
    found: list[Structure] = []
    for stop in stops:
        front, rear = glass_patterns(stop), glass_patterns(surfaces - stop)
        pairs = [(f, r) for f in front for r in rear]
        step = max(1, len(pairs) * len(stops) // most)
        found += [Structure(stop, (*f, False, *r)) for f, r in pairs[::step]]
    return tuple(found)


def _pairs(surfaces: int) -> int:
    return surfaces * (surfaces - 1) // 2


def glass_patterns(surfaces: int) -> list[tuple[bool, ...]]:
    """List the glass patterns of a group of surfaces in air in which every surface touches glass.

    Returns
    -------
    list of tuple of bool
        The last of each is False; empty for a single surface.
    """
    if surfaces == 0:
        return [()]
    found: list[tuple[bool, ...]] = [(True,)]
    for _ in range(surfaces - 2):
        found = [(*one, after) for one in found for after in (True, False) if after or one[-1]]
    # air follows the last surface, so the gap in front of it is glass
    return [(*one, False) for one in found if one[-1]] if surfaces > 1 else []


def surfaces_for(ghosts: int) -> int:
    """Return the fewest surfaces that give that many ghosts, with the stop in the middle.

    Returns
    -------
    int
        Without the stop.

    Notes
    -----
    Van Acoleyen 2025, equation 5.5, whose n includes the stop.
    """
    n = 4
    while _pairs((n - 1) // 2) + _pairs(n // 2) < ghosts:
        n += 1
    return n - 1
