"""Lateral colour of a single ghost, a step behind `model_growth.grow` that a run does not take (ADR 0027)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flarewright.kernels.ghost_model.ghost_mesh import parting_of
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, LATERAL, SOFT
from flarewright.measure.core.parameters import Shape
from flarewright.measure.core.views import View
from flarewright.measure.fitting.ghost_fit import Fit, cost_of, refine
from flarewright.measure.fitting.patches import patches_of
from flarewright.measure.fitting.settings import Growth

LEAST_SOFT_PX = 0.5
"""Minimum softness of borders that can show lateral colour, pixels."""
SPREAD = 0.4
"""Largest deviation of colours over the least radius; beyond, more than the rim moves."""
PAYS = 0.02
"""Minimum fraction by which lateral colour must lower the cost."""


def spread_by_colour(fit: Fit, views: Sequence[View], channel: int, *, spread: float = SPREAD) -> Fit:
    """Add lateral colour to a ghost, which makes its borders softer on one side.

    Parameters
    ----------
    fit : Fit
        From `grow`.
    views : sequence of View
        Their pixels hold this ghost alone: all other known ghosts are subtracted.
    channel : int
    spread : float
        As `SPREAD`.

    Returns
    -------
    Fit
        The given one if the cost does not fall enough or the wavelengths spread too far.
    """
    start, most = with_lateral_start(fit.shape), Growth()
    patches = patches_of(start, views, channel)
    if fit.shape.numbers[SOFT] < LEAST_SOFT_PX**2 or not patches:
        return fit
    free = np.union1d(fit.free, np.array([SOFT, LATERAL, LATERAL + 1]))
    apart = refine(start, patches, free, width=views[0].size_px[0], steps=20, error=most.error, alike=most.alike)
    shape = apart.shape
    farthest = max(parting_of(shape.numbers, shape.discs, patch.sigma, patch.frame) for patch in patches)
    pays = apart.cost < (1.0 - PAYS) * cost_of(fit.shape, patches, error=most.error)
    return apart if pays and farthest < spread else fit


def with_lateral_start(shape: Shape) -> Shape:
    """Return a shape with start values of lateral colour: half of its border softness becomes wavelength spread.

    The picture is an even function of the spread, so the gradient at zero spread is zero and a fit could not leave it.
    """
    numbers = shape.numbers.copy()
    if not numbers[LATERAL:BELOW].any():
        numbers[SOFT] *= 0.5
        numbers[LATERAL : LATERAL + 2] = np.sqrt(numbers[SOFT])
    return replace(shape, numbers=numbers)
