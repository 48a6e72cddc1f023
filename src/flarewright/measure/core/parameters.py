"""One colour of one ghost during a fit, and the choice of its free parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ...kernels.ghost_model.pupil_mesh import (
    BELOW,
    BELOW_NUMBERS,
    DISC_NUMBERS,
    FIRST_DISC,
    FIRST_G,
    FIRST_I,
    LATERAL,
    LATERAL_NUMBERS,
    SOFT,
)
from ...typing import Floats, Indices
from .checkpoint import recorded

# largest shift and magnification by lateral colour, over the size of the ghost
_LATERAL_LIMIT = np.tile([1.0, 0.25], LATERAL_NUMBERS // 2)


@recorded
@dataclass(frozen=True)
class Shape:
    """One colour of one ghost during a fit.

    Attributes
    ----------
    numbers : ndarray, shape (53,)
        See `kernels.ghost_model.pupil_mesh`.
    discs : int
    """

    numbers: Floats
    discs: int = 0


def free_numbers(order: int, discs: int, intensity_order: int, soft: bool = False, below: bool = False) -> Indices:
    """Return the indices of the parameters to fit.

    Parameters
    ----------
    order : int
        0: position, size and their change with the field; 1: also Seidel aberrations; 2: all terms.
    discs : int
    intensity_order : int
        0: uniform; 1: first order in u, v, w; 2: all terms.
    soft : bool
        Include the softness of the borders.
    below : bool
        Include the denominator of position and size.
    """
    geometry = {0: (0, 3), 1: (0, 1, 2, 3), 2: tuple(range(10))}[order]
    light = {0: (0,), 1: (0, 1, 2, 3), 2: tuple(range(10))}[intensity_order]
    picked = [*geometry, *(FIRST_G + k for k in geometry), *(FIRST_I + k for k in light)]
    picked += [FIRST_DISC + k for k in range(DISC_NUMBERS * discs)]
    picked += [SOFT] if soft else []
    picked += range(BELOW, BELOW + BELOW_NUMBERS) if below else []
    return np.array(picked, dtype=np.int64)


def largest_size(shape: Shape, sigmas: Iterable[float]) -> float:
    """Return the largest first-order size of a shape over the given fields, pixels."""
    size, growth = shape.numbers[FIRST_G], shape.numbers[FIRST_G + 3]
    return float(max(abs(size + growth * sigma**2) for sigma in sigmas))


def without_discs(shape: Shape) -> Shape:
    """Return a shape without discs, bounded by its first rim alone."""
    numbers = shape.numbers.copy()
    numbers[FIRST_DISC : FIRST_DISC + DISC_NUMBERS * shape.discs] = 0.0
    return replace(shape, numbers=numbers, discs=0)


def stepped(shape: Shape, free: Indices, step: Floats) -> Shape:
    """Return a shape moved by a step and clipped: disc radius at least 0.05, softness at least 0."""
    numbers = shape.numbers.copy()
    numbers[free] += step
    for k in range(shape.discs):
        at = FIRST_DISC + DISC_NUMBERS * k + 2
        numbers[at] = max(numbers[at], 0.05)
    # softer than half its size, a ghost would have no border
    numbers[SOFT] = min(max(numbers[SOFT], 0.0), 0.25 * numbers[FIRST_G] ** 2)
    # large lateral colour would add light
    wide = np.abs(numbers[FIRST_G]) * _LATERAL_LIMIT
    numbers[LATERAL:BELOW] = np.clip(numbers[LATERAL:BELOW], -wide, wide)
    return replace(shape, numbers=numbers)


def rescaled(shape: Shape, factor: float) -> Shape:
    """Return a shape in units of pixels that are smaller by a factor."""
    numbers = shape.numbers.copy()
    numbers[:FIRST_I] *= factor
    numbers[FIRST_I:FIRST_DISC] *= factor**2
    numbers[SOFT] *= factor**2
    numbers[LATERAL:BELOW] *= factor
    return replace(shape, numbers=numbers)
