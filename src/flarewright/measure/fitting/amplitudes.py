"""Measure the amplitude of a ghost in each view."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.patches import weigh_presence
from ..core.parameters import Shape
from ..core.views import View
from .patches import laid_out, patches_of, residual_in
from .settings import FitSettings


@dataclass(frozen=True)
class Presence:
    """Amplitude of a ghost in one view.

    Attributes
    ----------
    amplitude : float
        Brightness over that of the shape; 0 when the ghost is outside the view.
    error : float
        Standard deviation of the amplitude; infinite when the ghost is outside the view.
    """

    amplitude: float
    error: float


def presences(
    shape: Shape, views: Sequence[View], channel: int, error: float | None = None,
    pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> list[Presence]:  # fmt: skip
    """Return the amplitude of a shape in each view, without a uniform background.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
        Their pixels hold this ghost alone: all other known ghosts are subtracted.
    channel : int
    error : float, optional
        Expected model error, as a fraction of the light; default: that of `settings`.
    pool : executor, optional
    settings : FitSettings
    """
    patches = patches_of(shape, views, channel, settings=settings)
    whole = laid_out(patches)
    error = settings.model_error if error is None else error
    miss = residual_in(shape, whole, offset=False, error=error, tails=False, pool=pool, settings=settings)
    found = np.empty((len(whole.table), 2))
    weigh_presence(whole.table, whole.pixels, miss.weight, miss.residual, settings.amplitude_outlier, found)
    seen = [Presence(0.0, np.inf)] * len(views)
    for patch, (amplitude, deviation) in zip(patches, found, strict=True):
        seen[patch.view] = Presence(float(amplitude), float(deviation))
    return seen


def usual_amplitude(
    shape: Shape, views: Sequence[View], channel: int, error: float | None = None, settings: FitSettings = FitSettings()
) -> float | None:
    """Return the median amplitude of a shape over the views, at least 0; None when it is outside all views.

    Parameters
    ----------
    shape, views, channel, error
        As for `presences`.
    settings : FitSettings
    """
    sure = [
        each.amplitude for each in presences(shape, views, channel, error, settings=settings) if np.isfinite(each.error)
    ]
    return max(float(np.median(sure)), 0.0) if sure else None
