"""Variables of a search: the free numbers of a prescription, their bounds, and random starting points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import ProjectError
from ...model.project.design import Bounds
from ...typing import Floats, Indices
from .prescription import Structure

# largest change in one step: log lengths, curvatures (1 / least radius), indices
_LONGEST = (1.5, 0.25, 0.2)
# scale of random curvatures, which are mostly weak: |c| = u^1.5 times this, 1 / thickest glass
_STRONGEST_START = 1.2


@dataclass(frozen=True)
class Variables:
    """One structure's search variables: log stop diameter, log thicknesses, curvatures, indices.

    Attributes
    ----------
    structure : Structure
    low, high : ndarray, shape (1 + 3 K,)
    shortest, largest : ndarray, shape (1 + K,)
        Bounds of the lengths themselves: exp(log x) may differ from x by rounding.
    free : ndarray, shape (F,), int64
    longest : ndarray, shape (F,)
        Longest change in one step.
    strongest_start : float
        Largest random curvature, 1/mm.
    """

    structure: Structure
    low: Floats
    high: Floats
    shortest: Floats
    largest: Floats
    free: Indices
    longest: Floats
    strongest_start: float

    def prescription(self, x: Floats) -> Floats:
        """Convert search variables, shape (..., 1 + 3 K), to a vector as in `prescription.vector_of`."""
        logs = 1 + self.structure.rows
        lengths = np.clip(np.exp(x[..., :logs]), self.shortest, self.largest)
        return np.asarray(np.concatenate([lengths, x[..., logs:]], axis=-1), dtype=np.float64)

    def search_point(self, vector: Floats) -> Floats:
        """Convert a prescription's vector to search variables, clipped to the bounds."""
        logs = 1 + self.structure.rows
        with np.errstate(divide="ignore"):
            x = np.concatenate([np.log(np.maximum(vector[..., :logs], 1e-12)), vector[..., logs:]], axis=-1)
        return np.asarray(np.clip(x, self.low, self.high), dtype=np.float64)

    def with_indices(self, held: dict[int, float]) -> Variables:
        """Fix the index behind some rows, given as n_d by row."""
        low, high = self.low.copy(), self.high.copy()
        for row, n_d in held.items():
            low[1 + 2 * self.structure.rows + row] = high[1 + 2 * self.structure.rows + row] = n_d
        stays = high[self.free] > low[self.free]
        return replace(self, low=low, high=high, free=self.free[stays], longest=self.longest[stays])

    def random_points(self, random: np.random.Generator, count: int) -> Floats:
        """Draw starting points, shape (count, 1 + 3 K): lengths uniform in their logarithm, curvatures mostly weak."""
        rows = self.structure.rows
        x = self.low + random.random((count, len(self.low))) * (self.high - self.low)
        bent = random.random((count, rows)) ** 1.5 * self.strongest_start * random.choice([-1.0, 1.0], (count, rows))
        curved = slice(1 + rows, 1 + 2 * rows)
        x[:, curved] = np.clip(bent, self.low[curved], self.high[curved])
        return np.asarray(x, dtype=np.float64)


def variables(
    structure: Structure,
    bounds: Bounds,
    *,
    stop_diameter: float | None = None,
    fixed: Floats | None = None,
    fixed_rows: tuple[int, ...] = (),
) -> Variables:
    """Return the search variables of a structure.

    Parameters
    ----------
    structure : Structure
    bounds : Bounds
    stop_diameter : float, optional
        Diameter if known, mm.
    fixed : ndarray, shape (1 + 3 K,), optional
        Prescription whose `fixed_rows` stay unchanged.
    fixed_rows : tuple of int

    Raises
    ------
    ProjectError
        When the known stop diameter is outside the bounds.
    """
    rows = structure.rows
    glass = np.array(structure.glass)
    thin = np.where(glass, bounds.glass[0], bounds.air[0])
    thick = np.where(glass, bounds.glass[1], bounds.air[1])
    thin[-1], thick[-1] = bounds.back_focus
    strongest = np.full(rows, 1.0 / bounds.least_radius)
    strongest[structure.stop] = 0.0
    stop = bounds.stop_diameter
    if stop_diameter is not None:
        if not stop[0] <= stop_diameter <= stop[1]:
            raise ProjectError(
                f"the stop's diameter is {stop_diameter:.3g} mm, outside stop_diameter = [{stop[0]:g}, {stop[1]:g}]; "
                "widen these bounds, or choose another f-number"
            )
        stop = (stop_diameter, stop_diameter)
    shortest, largest = np.array([stop[0], *thin]), np.array([stop[1], *thick])
    low = np.concatenate([np.log(shortest), -strongest, np.where(glass, bounds.n_d[0], 1.0)])
    high = np.concatenate([np.log(largest), strongest, np.where(glass, bounds.n_d[1], 1.0)])
    if fixed is not None:
        for k in fixed_rows:
            shortest[1 + k] = largest[1 + k] = max(fixed[1 + k], 1e-12)
            low[1 + k] = high[1 + k] = np.log(shortest[1 + k])
            for v in (1 + rows + k, 1 + 2 * rows + k):
                low[v] = high[v] = fixed[v]
    free = np.flatnonzero(high > low).astype(np.int64)
    kind = np.where(free < 1 + rows, 0, np.where(free < 1 + 2 * rows, 1, 2))
    longest = np.array(_LONGEST) / (1.0, bounds.least_radius, 1.0)
    start = _STRONGEST_START / bounds.glass[1]
    return Variables(structure, low, high, shortest, largest, free, longest[kind], start)
