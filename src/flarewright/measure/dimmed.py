"""Views without the light around the light: halo and star are learned beside known ghosts, and taken off."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import Halo, Star
from .fit import light_of
from .found import Found
from .glow import halo_at, offsets, star_at
from .glow_fit import fit_halo, followed
from .shared_out import shared_out
from .views import Pixels, View, all_known

# nothing is looked for nearer to the light than this, part of a picture's width
AROUND_LIGHT = 40.0 / 720.0
# part of the glow that may stay behind where it was taken off
LEFT_BEHIND = 0.1


@dataclass(frozen=True)
class Dimmed:
    """Views without the light around the light, and that light.

    Attributes
    ----------
    views : list of View
        What shall not count has infinite variance; where glow was taken off they are less certain.
    halo : Halo or None
    star : Star or None
    """

    views: list[View]
    halo: Halo | None
    star: Star | None


def dimmed_beside(
    ghosts: Sequence[Found], views: Sequence[View], star: Star | None, pool: ThreadPoolExecutor
) -> Dimmed:
    """Learn the halo, and how strong a star is, from what is left beside known ghosts, and take both off the views."""
    left = shared_out(partial(without, ghosts), views, range(len(views)), pool=pool)
    masks = masks_of(views, pool)
    halo, star = followed(views, left, masks, fit_halo(views, left, pool=pool), star, pool)
    return Dimmed(_taken_off(views, masks, halo, star, pool), halo, star)


def without(ghosts: Sequence[Found], view: View, number: int) -> Pixels:
    """Return a view's pixels without the ghosts that it shows, shape (H, W, 3); not a number where not measured."""
    left = view.measured.astype(np.float64)
    for ghost in ghosts:
        if ghost.first <= number <= ghost.last:
            for m in range(3):
                part, light = light_of(ghost.shapes[m], view)
                left[part][..., m] -= light
    return left.astype(np.float32)


def beside(
    views: Sequence[View], halo: Halo | None, star: Star | None, pool: ThreadPoolExecutor | None = None
) -> list[View]:
    """Return what views show beside halo and star, less certain where those are bright; nothing around the light."""
    return _taken_off(views, masks_of(views, pool), halo, star, pool)


def _taken_off(
    views: Sequence[View],
    masks: Sequence[NDArray[np.bool_]],
    halo: Halo | None,
    star: Star | None,
    pool: ThreadPoolExecutor | None,
) -> list[View]:
    """Return views beside halo and star; what lies outside the masks does not count."""

    def one(view: View, mask: NDArray[np.bool_]) -> View:
        light = light_around(halo, star, view)
        variance = np.where(mask[..., None], view.variance + (LEFT_BEHIND * light) ** 2, np.inf).astype(np.float32)
        return replace(view, pixels=view.pixels - light, variance=variance)

    return shared_out(one, views, masks, pool=pool)


def light_around(halo: Halo | None, star: Star | None, view: View) -> Pixels:
    """Draw halo and star as a view shows them, shape (H, W, 3)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    light = np.zeros(view.pixels.shape, np.float32)
    if halo is not None:
        light += halo_at(halo, view.constellation_deg, x, y).astype(np.float32)
    if star is not None:
        light += star_at(star, view.constellation_deg, x, y).astype(np.float32)
    return light


def masks_of(views: Sequence[View], pool: ThreadPoolExecutor | None = None) -> list[NDArray[np.bool_]]:
    """Return where ghosts are looked for: where all colours were measured, away from the light."""

    def one(view: View) -> NDArray[np.bool_]:
        far = off_light(view) > AROUND_LIGHT * view.size_px[0]
        return np.asarray(far & all_known(view.variance))

    return shared_out(one, views, pool=pool)


def off_light(view: View) -> NDArray[np.float64]:
    """Return how far each pixel is from the light, pixels, shape (H, W)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    return np.asarray(np.hypot(x, y))
