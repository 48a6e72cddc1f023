"""Which numbers of a prescription its ghosts determine, and which further measurements would determine the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.design.fitness import HIDDEN
from ...typing import Floats, Indices
from ..problem.ghosts import differentiate
from ..problem.objective import seen
from ..problem.prescription import Structure

# singular values below this part of the largest count as 0; rounding leaves 1e-13, the smallest real ones are near 1e-6
SMALLEST = 1e-9
# a variable that moves less than this along every free direction is determined
STILL = 1e-6


@dataclass(frozen=True)
class Identification:
    """Variables of a lens that its ghosts determine, and those that stay free.

    Attributes
    ----------
    rank, unknowns : int
        Number of independent measurements, and of variables.
    fixed, free : tuple of str
        Variables that the ghosts determine near this lens, and those that can change together without any effect.
    remedies : tuple of str
        Measurements that would determine the free variables, one after the other.
    singular_values : ndarray
        Largest first.
    """

    rank: int
    unknowns: int
    fixed: tuple[str, ...]
    free: tuple[str, ...]
    remedies: tuple[str, ...]
    singular_values: Floats


def identify(
    structure: Structure,
    vector: Floats,
    slopes: Floats,
    *,
    entrance: float = 100.0,
    brightness: bool = False,
    stop_known: bool = False,
    ghosts: Sequence[tuple[int, int]] | None = None,
) -> Identification:
    """Return which variables of a lens its ghosts determine.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slopes : ndarray, shape (L,)
        Of the light sources at which ghosts are measured.
    entrance : float
        mm.
    brightness : bool
        Whether the irradiance of every ghost is measured in addition to place and size (uncoated surfaces).
    stop_known : bool
        Whether the stop's diameter is known.
    ghosts : sequence of (int, int), optional
        Mirrors of the measured ghosts; None: all.

    Notes
    -----
    Rank of the Jacobian by its singular values, with every column in the variable's own unit: fraction of a length, of
    the mean curvature, of n - 1; of the mean length for a gap of 0. The result is local: another lens far away may have
    the same ghosts.
    """
    names, columns, unit = _variables(structure, vector, stop_known)
    found = differentiate(structure, vector, entrance)
    measured = np.array([ghosts is None or pair in ghosts for pair in structure.pairs])
    rows = []
    for slope in slopes:
        here = seen(found.values, float(slope))
        for g in np.flatnonzero((here[:, 1] != HIDDEN) & measured):
            size = abs(here[g, 1]) + 0.3
            rows += [found.place[g] * slope / size, found.radius[g] / size]
            if brightness:
                rows.append(found.log_irradiance_by[g])
    table = np.array(rows).reshape(-1, len(vector))[:, columns] * unit
    if not rows:
        table = np.zeros((1, len(names)))
    _, values, turned = np.linalg.svd(table, full_matrices=True)
    rank = int((values > SMALLEST * values[0]).sum()) if values.any() else 0
    free = turned[rank:].T
    moving = np.abs(free).max(axis=1, initial=0.0) > STILL
    remedies: list[str] = []
    while free.shape[1]:
        best = int(np.argmax((free**2).sum(axis=1)))
        remedies.append(names[best])
        # number of free directions when this variable is known
        row = free[best] / np.linalg.norm(free[best])
        rest = np.linalg.svd(row[None])[2][1:].T
        free = free @ rest
    return Identification(
        rank, len(names), tuple(n for n, m in zip(names, moving, strict=True) if not m),
        tuple(n for n, m in zip(names, moving, strict=True) if m), tuple(remedies), values,
    )  # fmt: skip


def _variables(structure: Structure, vector: Floats, stop_known: bool) -> tuple[list[str], Indices, Floats]:
    """Return names, columns and units of the variables."""
    rows, stop = structure.rows, structure.stop
    curvature = float(np.abs(vector[1 + rows : 1 + 2 * rows]).mean()) or 1.0
    # where surfaces touch or the stop stands on one, a fraction of the gap is no change
    length = float(np.abs(vector[1 : 1 + rows]).mean())
    entries = [] if stop_known else [("stop diameter", 0, vector[0])]
    for k in range(rows):
        label = "sensor distance" if k == rows - 1 else f"thickness behind row {k}"
        entries.append((label, 1 + k, vector[1 + k] or length))
    entries += [(f"curvature of row {k}", 1 + rows + k, curvature) for k in range(rows) if k != stop]
    entries += [
        (f"index behind row {k}", 1 + 2 * rows + k, vector[1 + 2 * rows + k] - 1.0)
        for k in range(rows)
        if structure.glass[k]
    ]
    names, columns, unit = zip(*entries, strict=True)
    return list(names), np.array(columns), np.array(unit, dtype=np.float64)
