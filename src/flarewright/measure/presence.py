"""How much of a ghost each view shows."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..kernels.measure_patches import weigh_presence
from .fit import MODEL_ERROR
from .patches import OUTLIER, laid_out, missed, patches_of
from .shape import Shape
from .views import View

# standard deviations beyond which a pixel counts less and less: other ghosts' edges count so, from the shape's own
# brightness on
_OUTLIER = 4.0 * OUTLIER


@dataclass(frozen=True)
class Presence:
    """How much of a ghost one view shows.

    Attributes
    ----------
    amplitude : float
        1: as bright as the shape says; 0 when the view does not reach it.
    error : float
        Standard deviation of the amplitude; infinite when the view does not reach it.
    """

    amplitude: float
    error: float


def presences(
    shape: Shape,
    views: Sequence[View],
    channel: int,
    error: float = MODEL_ERROR,
    pool: ThreadPoolExecutor | None = None,
) -> list[Presence]:
    """Return how much of a shape each view shows, an even background aside.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
        Their pixels hold this ghost alone, as far as it is known.
    channel : int
    error : float
        Part of the light that the model may miss.
    pool : executor, optional
    """
    patches = patches_of(shape, views, channel)
    whole = laid_out(patches)
    miss = missed(shape, whole, offset=False, error=error, tails=False, pool=pool)
    told = np.empty((len(whole.table), 2))
    weigh_presence(whole.table, whole.pixels, miss.weight, miss.residual, _OUTLIER, told)
    seen = [Presence(0.0, np.inf)] * len(views)
    for patch, (amplitude, deviation) in zip(patches, told, strict=True):
        seen[patch.view] = Presence(float(amplitude), float(deviation))
    return seen


def usual_amplitude(shape: Shape, views: Sequence[View], channel: int, error: float = MODEL_ERROR) -> float | None:
    """Return the median of how much of a shape views show, 0 or more; None when none of them reaches it.

    Parameters
    ----------
    shape, views, channel, error
        As for `presences`.
    """
    sure = [each.amplitude for each in presences(shape, views, channel, error) if np.isfinite(each.error)]
    return max(float(np.median(sure)), 0.0) if sure else None
