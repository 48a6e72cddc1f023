"""Learn what views show beside a model's ghosts, star and halo, as sprites."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ..model.ghost_model import GhostModel
from .detail_fit import with_detail
from .dimmed import AROUND_LIGHT, light_around, masks_of, off_light
from .journal import Journal
from .light_law import light_of_view
from .moves_fit import with_moves
from .packed import pack
from .reach import with_reaches
from .replay import draw
from .shared_out import shared_out
from .speck_sprites import all_hidden, covered, speck_sprites, specks_of
from .specks_drawn import draw_specks
from .spike_fit import spike_sprites
from .sprite_fit import axis_sprite, beside_sprites, light_sprites
from .views import Pixels, View

# nothing but what goes with the light is learned nearer to it than this, part of a picture's width
NEXT_TO_LIGHT = 24.0 / 720.0


def with_rest(
    model: GhostModel, views: Sequence[View], threads: int | None = None, journal: Journal | None = None
) -> GhostModel:
    """Return a model with what views show beside its ghosts, star and halo as sprites, in the place of old ones.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        As photographed.
    threads : int, optional
    journal : Journal, optional
        Of an earlier run that was stopped; the result is the same with and without.
    """
    steps = journal or Journal()
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        placed = [replace(view, light_px=light_of_view(model, view)) for view in views]
        left = shared_out(partial(_left_by, model), placed, pool=pool)
        specks = specks_of(model, placed)
        # a speck is so much brighter than what is around it that coarse cells would spread its errors over that
        masks = covered(specks, placed, left)
        spikes = steps.step(lambda: spike_sprites(placed, all_hidden(left, masks, pool), model.star))
        left = beside_sprites(left, spikes, placed, pool)
        # coarse pictures overshoot beside the light's image, which finer ones only mend where something is known
        around = shared_out(around_light, placed, all_hidden(left, masks, pool), pool=pool)
        going = steps.step(lambda: light_sprites(placed, around, model.star is not None, pool))
        left = beside_sprites(left, going, placed, pool)
        # next to the light a pixel's error is brighter than all that turns about the axis
        next_to_light = [off_light(view) < NEXT_TO_LIGHT * view.size_px[0] for view in placed]
        axis = steps.step(
            lambda: axis_sprite(placed, all_hidden(all_hidden(left, masks, pool), next_to_light, pool), pool)
        )
        left = beside_sprites(left, (axis,), placed, pool)
        small = steps.step(lambda: speck_sprites(specks, placed, left, masks_of(placed)))
    still = model.replace(sprites=(*spikes, *going, axis, *small))
    moving = still.replace(sprites=steps.step(lambda: with_moves(still, threads).sprites))
    packed = pack(moving)
    left = [
        each - draw_specks(small, packed, moving, view.constellation_deg, view.frame, view.size_px)
        for each, view in zip(left, placed, strict=True)
    ]
    return with_reaches(with_detail(moving, placed, all_hidden(left, next_to_light), threads), placed, threads)


def _left_by(model: GhostModel, view: View) -> Pixels:
    """Return what a view shows beside a model's ghosts, halo and star; not a number where it was not measured."""
    ghosts = draw(model, view.constellation_deg, view.roll_deg, view.size_px)
    return np.asarray(view.measured - ghosts - light_around(model.halo, model.star, view), dtype=np.float32)


def around_light(view: View, pixels: Pixels) -> Pixels:
    """Fill what is not known near the light with the median of what is known as far from it.

    Parameters
    ----------
    view : View
    pixels : ndarray, shape (H, W, 3)
        Not a number where nothing was measured.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Farther off than where ghosts are looked for, and where nothing at a distance is known, as it was. So is what
        the view itself does not show, its clipped middle above all.
    """
    rings = off_light(view).astype(np.int64)
    near = rings < AROUND_LIGHT * view.size_px[0]
    ring, light = rings[near], pixels[near]
    known = np.isfinite(light).all(axis=1)
    gaps = np.isnan(light).any(axis=1) & np.isfinite(view.variance[near]).all(axis=1)
    for far in np.unique(ring[gaps]):
        told = light[known & (ring == far)]
        if told.size:
            light[gaps & (ring == far)] = np.median(told, axis=0)
    out = pixels.copy()
    out[near] = light
    return out
