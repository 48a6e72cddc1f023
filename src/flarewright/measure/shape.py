"""One colour of one ghost while it is fitted, and which of its numbers are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_pupil import (
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
from .numbers import Floats

Indices = NDArray[np.int64]

# by which wavelengths of a colour may shift a ghost and make it larger, part of its size
_PART = np.tile([1.0, 0.25], LATERAL_NUMBERS // 2)


@dataclass(frozen=True)
class Shape:
    """One colour of one ghost while it is fitted.

    Attributes
    ----------
    numbers : ndarray, shape (53,)
        See `kernels.measure_pupil`.
    discs : int
    """

    numbers: Floats
    discs: int = 0


def free_numbers(
    order: int, discs: int, intensity_order: int, soft: bool = False, lateral: bool = False, below: bool = False
) -> Indices:
    """Return which numbers to fit.

    Parameters
    ----------
    order : int
        0: place, size and their change with the field; 1: Seidel's aberrations; 2: all.
    discs : int
    intensity_order : int
        0: even; 1: first order in u, v, w; 2: all.
    soft : bool
        Also how soft the borders are.
    lateral : bool
        And how far the channel's wavelengths part, how unevenly, and how that grows with the field.
    below : bool
        And what place and size are divided by.
    """
    geometry = {0: (0, 3), 1: (0, 1, 2, 3), 2: tuple(range(10))}[order]
    light = {0: (0,), 1: (0, 1, 2, 3), 2: tuple(range(10))}[intensity_order]
    picked = [*geometry, *(FIRST_G + k for k in geometry), *(FIRST_I + k for k in light)]
    picked += [FIRST_DISC + k for k in range(DISC_NUMBERS * discs)]
    picked += [SOFT] if soft else []
    picked += range(LATERAL, BELOW) if lateral else []
    picked += range(BELOW, BELOW + BELOW_NUMBERS) if below else []
    return np.array(picked, dtype=np.int64)


def largest_size(shape: Shape, sigmas: Iterable[float]) -> float:
    """Return how large a shape is at the field, of those given, at which it is largest: its first order, pixels."""
    size, growth = shape.numbers[FIRST_G], shape.numbers[FIRST_G + 3]
    return float(max(abs(size + growth * sigma**2) for sigma in sigmas))


def without_discs(shape: Shape) -> Shape:
    """Return a shape that no rim cuts but its first."""
    numbers = shape.numbers.copy()
    numbers[FIRST_DISC : FIRST_DISC + DISC_NUMBERS * shape.discs] = 0.0
    return replace(shape, numbers=numbers, discs=0)


def stepped(shape: Shape, free: Indices, step: Floats) -> Shape:
    """Return a shape moved by a step; a disc never shrinks below a twentieth, and softness not below 0."""
    numbers = shape.numbers.copy()
    numbers[free] += step
    for k in range(shape.discs):
        at = FIRST_DISC + DISC_NUMBERS * k + 2
        numbers[at] = max(numbers[at], 0.05)
    # softer than half as wide as it is, a ghost would be a blot
    numbers[SOFT] = min(max(numbers[SOFT], 0.0), 0.25 * numbers[FIRST_G] ** 2)
    # and what grows much by colour would add light
    wide = np.abs(numbers[FIRST_G]) * _PART
    numbers[LATERAL:BELOW] = np.clip(numbers[LATERAL:BELOW], -wide, wide)
    return replace(shape, numbers=numbers)


def parted(shape: Shape) -> Shape:
    """Return a shape whose wavelengths part by half of what its borders are soft.

    Wavelengths that part one way look as those that part the other way: from where they do not, no search would begin.
    """
    numbers = shape.numbers.copy()
    if not numbers[LATERAL:BELOW].any():
        numbers[SOFT] *= 0.5
        numbers[LATERAL : LATERAL + 2] = np.sqrt(numbers[SOFT])
    return replace(shape, numbers=numbers)


def enlarged(shape: Shape, factor: float) -> Shape:
    """Return a shape in pixels that are smaller by a factor."""
    numbers = shape.numbers.copy()
    numbers[:FIRST_I] *= factor
    numbers[FIRST_I:FIRST_DISC] *= factor**2
    numbers[SOFT] *= factor**2
    numbers[LATERAL:BELOW] *= factor
    return replace(shape, numbers=numbers)
