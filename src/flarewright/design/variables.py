"""The variables of a search: which numbers of a prescription may change, how far, and where to begin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model.design import Bounds
from .prescription import Structure

Floats = NDArray[np.float64]

# what a step may change at most: log lengths, curvatures (1/mm), indices
_LONGEST = (1.5, 0.05, 0.2)
# curvatures of starting points are mostly weak: |c| = u^1.5 times this, 1/mm
_STRONGEST_START = 0.08


@dataclass(frozen=True)
class Variables:
    """One structure's search variables: log stop diameter, log thicknesses, curvatures, indices.

    Attributes
    ----------
    structure : Structure
    low, high : ndarray, shape (1 + 3 K,)
    shortest, largest : ndarray, shape (1 + K,)
        Bounds of the lengths themselves: exp(log x) may miss x by a rounding.
    free : ndarray, shape (F,), int64
    longest : ndarray, shape (F,)
        Longest change in one step.
    """

    structure: Structure
    low: Floats
    high: Floats
    shortest: Floats
    largest: Floats
    free: NDArray[np.int64]
    longest: Floats

    def prescription(self, x: Floats) -> Floats:
        """Turn search variables, shape (..., 1 + 3 K), into a vector as `prescription.vector_of` writes it."""
        logs = 1 + self.structure.rows
        lengths = np.clip(np.exp(x[..., :logs]), self.shortest, self.largest)
        return np.asarray(np.concatenate([lengths, x[..., logs:]], axis=-1), dtype=np.float64)

    def search_point(self, vector: Floats) -> Floats:
        """Turn a prescription's vector into search variables, cut to the bounds."""
        logs = 1 + self.structure.rows
        with np.errstate(divide="ignore"):
            x = np.concatenate([np.log(np.maximum(vector[..., :logs], 1e-12)), vector[..., logs:]], axis=-1)
        return np.asarray(np.clip(x, self.low, self.high), dtype=np.float64)

    def with_indices(self, held: dict[int, float]) -> Variables:
        """Hold the index behind some rows, given as n_d by row."""
        low, high = self.low.copy(), self.high.copy()
        for row, n_d in held.items():
            low[1 + 2 * self.structure.rows + row] = high[1 + 2 * self.structure.rows + row] = n_d
        stays = high[self.free] > low[self.free]
        return replace(self, low=low, high=high, free=self.free[stays], longest=self.longest[stays])

    def random_points(self, random: np.random.Generator, count: int) -> Floats:
        """Draw starting points, shape (count, 1 + 3 K): lengths evenly by their logarithm, curvatures mostly weak."""
        rows = self.structure.rows
        x = self.low + random.random((count, len(self.low))) * (self.high - self.low)
        bent = random.random((count, rows)) ** 1.5 * _STRONGEST_START * random.choice([-1.0, 1.0], (count, rows))
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
    """Set the bounds of a structure.

    Parameters
    ----------
    structure : Structure
    bounds : Bounds
    stop_diameter : float, optional
        When it is known, mm.
    fixed : ndarray, shape (1 + 3 K,), optional
        Prescription whose `fixed_rows` are kept.
    fixed_rows : tuple of int

    Returns
    -------
    Variables

    Raises
    ------
    ProjectError
        When the known stop diameter lies outside the bounds.
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
    return Variables(structure, low, high, shortest, largest, free, np.array(_LONGEST)[kind])
