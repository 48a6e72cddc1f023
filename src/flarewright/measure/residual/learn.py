"""Learn the residual of views beside a model's ghosts, star and halo, as sprites."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite
from ...typing import Mask, Pixels
from ..core.checkpoint import Journal
from ..core.parallel import map_batched
from ..core.views import View
from ..glow.subtraction import AROUND_LIGHT, light_around, off_light
from ..replay.light_law import light_of_view
from ..replay.model_image import draw
from .clamp_range import with_reaches
from .fine_detail_fit import with_detail
from .motion_fit import with_moves
from .sprite_fit import axis_sprite, beside_sprites, light_sprites
from .star_spikes import spike_sprites

# within this distance of the light, part of a picture's width, only sprites that follow the light are learned
NEXT_TO_LIGHT = 24.0 / 720.0


def with_residual(
    model: GhostModel, views: Sequence[View], threads: int | None = None, journal: Journal | None = None
) -> GhostModel:
    """Return a model whose sprites hold the residual of views beside ghosts, star and halo; old sprites are dropped.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        As photographed. Those of each nominal roll make separate sprites, of which a replay draws the nearest.
    threads : int, optional
    journal : Journal, optional
        Journal of an interrupted run to resume; it does not change the result.
    """
    steps = journal or Journal()
    rolls = sorted({view.nominal_roll_deg for view in views})
    # the residual of one roll does not become that of another by turning, so each roll has separate sprites
    series = [[view for view in views if view.nominal_roll_deg == roll] for roll in rolls]
    learned = [_sprites_of(model, each, threads, steps, len(rolls)) for each in series]
    if len(rolls) > 1:
        learned = [
            [one.replace(captured_roll_deg=roll) for one in sprites]
            for roll, sprites in zip(rolls, learned, strict=True)
        ]
    return model.replace(sprites=tuple(one for sprites in learned for one in sprites))


def _sprites_of(
    model: GhostModel, views: Sequence[View], threads: int | None, steps: Journal, series: int
) -> Sequence[Sprite]:
    """Learn the sprites of the views of one roll, of `series` rolls."""
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        placed = [replace(view, light_px=light_of_view(model, view)) for view in views]
        left = map_batched(partial(_left_by, model), placed, pool=pool)
        spikes = steps.step(lambda: spike_sprites(placed, left, model.star, series))
        left = beside_sprites(left, spikes, placed, pool)
        # coarse images overshoot beside the light's image; finer ones correct that only where values are known
        around = map_batched(around_light, placed, left, pool=pool)
        going = steps.step(lambda: light_sprites(placed, around, model.star is not None, pool, series))
        left = beside_sprites(left, going, placed, pool)
        # next to the light a pixel's error exceeds everything that turns about the axis
        next_to_light = [off_light(view) < NEXT_TO_LIGHT * view.size_px[0] for view in placed]
        axis = steps.step(lambda: axis_sprite(placed, all_hidden(left, next_to_light, pool), pool, series))
        left = beside_sprites(left, (axis,), placed, pool)
    still = model.replace(sprites=(*spikes, *going, axis))
    moving = still.replace(sprites=steps.step(lambda: with_moves(still, threads).sprites))
    fine = with_detail(moving, placed, all_hidden(left, next_to_light), threads)
    return with_reaches(fine, placed, threads).sprites


def all_hidden(
    pictures: Sequence[Pixels], masks: Sequence[Mask], pool: ThreadPoolExecutor | None = None
) -> list[Pixels]:
    """Return images with NaN inside their masks."""

    def hidden(pixels: Pixels, mask: Mask) -> Pixels:
        return np.where(mask[..., None], np.float32(np.nan), pixels)

    return map_batched(hidden, pictures, masks, pool=pool)


def _left_by(model: GhostModel, view: View) -> Pixels:
    """Return the residual of a view beside a model's ghosts, halo and star; NaN where it was not measured."""
    ghosts = draw(model, view.constellation_deg, view.roll_deg, view.size_px)
    return np.asarray(view.measured - ghosts - light_around(model.halo, model.star, view), dtype=np.float32)


def around_light(view: View, pixels: Pixels) -> Pixels:
    """Fill unknown pixels near the light with the median of the known pixels at the same distance.

    Parameters
    ----------
    view : View
    pixels : ndarray, shape (H, W, 3)
        NaN where nothing was measured.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Unchanged far from the light, at distances without known pixels, and where the view was not measured, such as
        the clipped middle of the light.
    """
    rings = off_light(view).astype(np.int64)
    near = rings < AROUND_LIGHT * view.size_px[0]
    ring, light = rings[near], pixels[near]
    known = np.isfinite(light).all(axis=1)
    gaps = np.isnan(light).any(axis=1) & np.isfinite(view.variance[near]).all(axis=1)
    for far in np.unique(ring[gaps]):
        beside = light[known & (ring == far)]
        if beside.size:
            light[gaps & (ring == far)] = np.median(beside, axis=0)
    out = pixels.copy()
    out[near] = light
    return out
