"""Where a shape has light, and how much of that two shapes share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .fit import render
from .shape import Shape
from .views import View

# a shape is where it is brighter than this part of its brightest place
LIT = 0.1


def footprint(shape: Shape, view: View) -> NDArray[np.bool_]:
    """Return where a shape has light in a view, shape (H, W)."""
    light = render(shape, view)
    return np.asarray(light > LIT * float(light.max(initial=0.0)))


def overlap(one: Shape, other: Shape, views: Sequence[View]) -> float:
    """Return the part of what either of two shapes covers that both do, all in all; 0 where neither has light."""
    shared = covered = 0
    for view in views:
        a, b = footprint(one, view), footprint(other, view)
        shared += int(np.count_nonzero(a & b))
        covered += int(np.count_nonzero(a | b))
    return shared / covered if covered else 0.0
