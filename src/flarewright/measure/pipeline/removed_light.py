"""Views without the light of the ghosts that the user removed."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ...model.measurement.ghost_model import GhostModel
from ..core.parallel import map_batched
from ..core.views import View
from ..replay.ghost_arrays import pack
from ..replay.model_image import draw_packed


def without_removed(
    views: Sequence[View], model: GhostModel, model_error: float, pool: ThreadPoolExecutor | None = None
) -> list[View]:
    """Subtract the removed ghosts of a model from views, and add their expected error to the variance.

    The photographs still contain their light, which other ghosts must not share.

    Parameters
    ----------
    views : sequence of View
        As large as the model's pictures.
    model : GhostModel
    model_error : float
        Expected error of a drawn ghost, as a fraction of its light.
    pool : executor, optional
    """
    if not model.removed:
        return list(views)
    gone = model.replace(ghosts=model.removed, removed=(), sprites=())
    packed = pack(gone)

    def one(view: View) -> View:
        light = draw_packed(packed, gone, view.constellation_deg, view.roll_deg, view.size_px, None)
        pixels = np.asarray(view.pixels - light, dtype=np.float32)
        variance = np.asarray(view.variance + (model_error * light) ** 2, dtype=np.float32)
        return replace(view, pixels=pixels, variance=variance)

    return map_batched(one, views, pool=pool)
