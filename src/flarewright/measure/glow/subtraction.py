"""Subtract the glow from views: fit halo and star with the known ghosts removed."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...model.measurement.ghost_model import Halo, Star
from ...typing import Floats, Mask, Pixels
from ..core.parallel import map_batched
from ..core.views import View, all_finite
from ..fitting.detected_ghost import DetectedGhost
from ..fitting.ghost_fit import light_of
from .fit import fit_halo, followed
from .laws import halo_at, offsets, star_at
from .settings import GlowSettings

# radius of the masked disc around the light, over the picture's width
AROUND_LIGHT = 40.0 / 720.0


@dataclass(frozen=True)
class WithoutGlow:
    """Views with the glow subtracted, and the glow.

    Attributes
    ----------
    views : list of View
        Pixels to ignore have infinite variance; the variance of others includes the error of the subtracted glow.
    halo : Halo or None
    star : Star or None
    """

    views: list[View]
    halo: Halo | None
    star: Star | None


def fit_and_subtract_glow(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], star: Star | None, pool: ThreadPoolExecutor,
    settings: GlowSettings = GlowSettings(),
) -> WithoutGlow:  # fmt: skip
    """Fit the halo and the strength of a star with known ghosts removed, and subtract both from the views."""
    left = map_batched(partial(without, ghosts), views, range(len(views)), pool=pool)
    masks = masks_of(views, pool)
    halo, star = followed(
        views, left, masks, fit_halo(views, left, pool=pool, settings=settings.halo), star, pool, settings
    )
    return WithoutGlow(_subtract_glow(views, masks, halo, star, pool, settings), halo, star)


def without(ghosts: Sequence[DetectedGhost], view: View, number: int) -> Pixels:
    """Return the pixels of a view with its visible ghosts subtracted, shape (H, W, 3); NaN where not measured."""
    left = view.measured.astype(np.float64)
    for ghost in ghosts:
        if ghost.first <= number <= ghost.last:
            for m in range(3):
                part, light = light_of(ghost.shapes[m], view)
                left[part][..., m] -= light
    return left.astype(np.float32)


def subtract_glow(
    views: Sequence[View], halo: Halo | None, star: Star | None, pool: ThreadPoolExecutor | None = None,
    settings: GlowSettings = GlowSettings(),
) -> list[View]:  # fmt: skip
    """Subtract halo and star from views, add their error to the variance, and mask the disc around the light."""
    return _subtract_glow(views, masks_of(views, pool), halo, star, pool, settings)


def _subtract_glow(
    views: Sequence[View], masks: Sequence[Mask], halo: Halo | None, star: Star | None, pool: ThreadPoolExecutor | None,
    settings: GlowSettings,
) -> list[View]:  # fmt: skip
    """Subtract halo and star from views; pixels outside the masks get infinite variance."""

    def one(view: View, mask: Mask) -> View:
        light = light_around(halo, star, view)
        variance = np.where(mask[..., None], view.variance + (settings.left_behind * light) ** 2, np.inf).astype(
            np.float32
        )
        return replace(view, pixels=view.pixels - light, variance=variance)

    return map_batched(one, views, masks, pool=pool)


def light_around(halo: Halo | None, star: Star | None, view: View) -> Pixels:
    """Draw halo and star for a view, shape (H, W, 3)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    light = np.zeros(view.pixels.shape, np.float32)
    if halo is not None:
        light += halo_at(halo, view.constellation_deg, x, y).astype(np.float32)
    if star is not None:
        light += star_at(star, view.constellation_deg, x, y).astype(np.float32)
    return light


def masks_of(views: Sequence[View], pool: ThreadPoolExecutor | None = None) -> list[Mask]:
    """Return the masks of the ghost search: pixels with all colours measured, outside the disc around the light."""

    def one(view: View) -> Mask:
        far = off_light(view) > AROUND_LIGHT * view.size_px[0]
        return np.asarray(far & all_finite(view.variance))

    return map_batched(one, views, pool=pool)


def off_light(view: View) -> Floats:
    """Return the distance of each pixel from the light, pixels, shape (H, W)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    return np.asarray(np.hypot(x, y))
