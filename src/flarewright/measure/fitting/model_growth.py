"""Increase the complexity of a ghost step by step: free parameters and rims.

A step stays only if it lowers the cost by at least a set fraction.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ...kernels.ghost_model.pupil_mesh import DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, MOST_DISCS
from ...typing import Indices
from ..core.parallel import map_batched
from ..core.parameters import Shape, free_numbers
from ..core.views import View
from .ghost_fit import Fit, cost_of, improve, refine
from .patches import Patch, coarser_patches, patches_of, shows
from .settings import FitSettings, Growth


def grow(
    shape: Shape, views: Sequence[View], channel: int, *, most: Growth = Growth(),
    pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> Fit | None:  # fmt: skip
    """Fit a ghost in stages.

    Parameters
    ----------
    shape : Shape
        Rough position, size and brightness.
    views : sequence of View
        Their pixels hold this ghost alone: all other known ghosts are subtracted.
    channel : int
    most : Growth
    pool : executor, optional
    settings : FitSettings

    Returns
    -------
    Fit or None
        None when the ghost is outside all views.
    """
    width = views[0].size_px[0]
    refined = partial(
        refine, width=width, offset=most.offset, error=most.error, alike=most.alike, pool=pool, settings=settings
    )
    cost = partial(cost_of, offset=most.offset, error=most.error, settings=settings)

    def polish(start: Shape, order: int, light: int, steps: int, old: Shape | None) -> tuple[Fit, list[Patch]] | None:
        # the patches include the old area, so that a ghost pays for light it no longer covers after shrinking
        patches = patches_of(start, views, channel, beside=old, area=most.area, settings=settings)
        if not patches or not shows(start, views):
            return None
        free = free_numbers(order, start.discs, light, most.soft and order > 0, below=most.below and order > 0)
        return refined(start, patches, free, steps=steps), patches

    found = polish(shape, 0, 0, 8, None)
    order = 0
    while found is not None:
        fit, patches = found
        grown: Shape | None = None
        if fit.shape.discs < most.discs:
            grown = _with_rim(fit.shape, patches, free_numbers(order, 0, min(order, 1)), width, most, pool, settings)
            before = cost(fit.shape, patches)
            if grown is not None and cost(grown, patches) < (1.0 - settings.growth.rim_pays) * before:
                # the rim may leave too little area to fit; drop it then
                rimmed = polish(grown, order, min(order, most.intensity_order), 6, fit.shape)
                if rimmed is not None:
                    found = rimmed
                    continue
        if order >= most.order:
            break
        higher = polish(fit.shape, order + 1, min(order + 1, most.intensity_order), 10, shape)
        if higher is None:
            break
        before = cost(fit.shape, higher[1])
        if order == 1 and higher[0].cost > (1.0 - settings.growth.order_pays) * before:
            break
        found, order = higher, order + 1
    return None if found is None else found[0]


def _with_rim(
    shape: Shape, patches: Sequence[Patch], free: np.ndarray, width: int, most: Growth, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> Shape | None:  # fmt: skip
    """Return the best shape with one more rim, from several start values on about eight of the patches."""
    if shape.discs >= MOST_DISCS:
        return None
    few = patches[:: max(1, len(patches) // 8)]
    rough = [coarser_patches(patch) if patch.pixels.size > settings.growth.fine_pixels else patch for patch in few]
    at = FIRST_DISC + DISC_NUMBERS * shape.discs
    largest = max(patch.sigma for patch in patches)
    own = np.concatenate([free[free >= FIRST_I], [at, at + 2]])
    starts = []
    for centre in settings.growth.rim_centres:
        for cut in settings.growth.rim_cuts:
            numbers = shape.numbers.copy()
            numbers[at : at + 3] = centre, 0.0, 1.0 + abs(centre) * largest - cut
            # the visible part is what the rim leaves: the full ghost is larger, its centre closer to the cut
            away = 0.5 * cut * np.sign(centre)
            numbers[0] -= 0.5 * away * numbers[FIRST_G] / max(largest, 0.1)
            numbers[FIRST_G] *= 1.0 + 0.25 * cut
            starts.append(replace(shape, numbers=numbers, discs=shape.discs + 1))

    def tried(look: Sequence[Patch], numbers: Indices, steps: int, start: Shape) -> tuple[Shape, float]:
        return improve(
            start, look, numbers, width=width, steps=steps, offset=most.offset, error=most.error, alike=most.alike,
            settings=settings,
        )  # fmt: skip

    # one task per trial: a trial is too small to split among threads
    trials = map_batched(partial(tried, rough, own, 3), starts, pool=pool)
    promising = [trial for trial, _ in sorted(trials, key=lambda each: each[1])[:3]]
    best = map_batched(partial(tried, few, np.concatenate([free, [at, at + 2]]), 6), promising, pool=pool)
    return min(best, key=lambda each: each[1])[0]
