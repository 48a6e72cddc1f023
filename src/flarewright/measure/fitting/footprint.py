"""Footprint of a shape in a view, and the overlap of two footprints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...typing import Mask
from ..core.parameters import Shape
from ..core.views import View
from .ghost_fit import render
from .settings import FitSettings


def footprint(shape: Shape, view: View, settings: FitSettings = FitSettings()) -> Mask:
    """Return the mask of the pixels that a shape lights in a view, shape (H, W)."""
    light = render(shape, view)
    return np.asarray(light > settings.lit * float(light.max(initial=0.0)))


def overlap(one: Shape, other: Shape, views: Sequence[View], settings: FitSettings = FitSettings()) -> float:
    """Return intersection over union of the footprints of two shapes, summed over views; 0 when both are dark."""
    shared = covered = 0
    for view in views:
        a, b = footprint(one, view, settings), footprint(other, view, settings)
        shared += int(np.count_nonzero(a & b))
        covered += int(np.count_nonzero(a | b))
    return shared / covered if covered else 0.0
