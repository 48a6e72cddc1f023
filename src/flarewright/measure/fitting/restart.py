"""Refit all detected ghosts jointly from plain start values.

Ghosts detected early absorb light of ghosts not yet known, by extra rims and brightness that varies over the pupil. A
joint restart from round, uniform ghosts removes that bias.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ...kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_I
from ..core.checkpoint import Journal
from ..core.parameters import Shape, without_discs
from ..core.views import View
from .detected_ghost import DetectedGhost, by_brightness, exchange, isolated_views, residual_of
from .ghost_fit import cost_of
from .joint_intensities import solve_intensities
from .joint_shapes import fit_shapes_jointly
from .patches import patches_of
from .settings import FitSettings


def restart_jointly(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], *, pool: ThreadPoolExecutor | None = None,
    journal: Journal | None = None, settings: FitSettings = FitSettings(),
) -> list[DetectedGhost]:  # fmt: skip
    """Fit all ghosts at once, starting from plain ghosts at the same positions.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
        With equal colours.
    views : sequence of View
        With the glow subtracted and the colours mixed to one (`mixed`); pixels to ignore have infinite variance.
    pool : executor, optional
    journal : Journal, optional
        Records the expensive steps.
    settings : FitSettings

    Returns
    -------
    list of DetectedGhost
        All ghosts, each with one shape for all colours. A ghost keeps its former shape with rims only where that lowers
        the cost enough.
    """
    pixels, steps = [view.pixels[..., 1] for view in views], journal or Journal()
    # keep redundant ghosts: their positions are not yet known well enough to decide
    out = solve_intensities([_plain(ghost) for ghost in ghosts], views, needed=-np.inf, pool=pool, settings=settings)
    for _ in range(settings.restart.rounds):
        shapes = steps.step(partial(
            fit_shapes_jointly, out, views, pixels, 1, steps=settings.restart.steps, pool=pool, settings=settings,
        ))  # fmt: skip
        out = [replace(ghost, shapes=(one, one, one)) for ghost, one in zip(out, shapes, strict=True)]
        out = solve_intensities(out, views, needed=-np.inf, pool=pool, settings=settings)
    return solve_intensities(
        _with_rims(ghosts, out, views, pool, settings), views, needed=-np.inf, pool=pool, settings=settings
    )


def _with_rims(
    before: Sequence[DetectedGhost], after: Sequence[DetectedGhost], views: Sequence[View],
    pool: ThreadPoolExecutor | None, settings: FitSettings,
) -> list[DetectedGhost]:  # fmt: skip
    """Return the plain ghosts, or a former ghost with rims where it fits enough better."""
    out, rest = list(after), residual_of(after, views, 1, pool)
    for k in by_brightness(after):
        old, new = before[k].shapes[1], after[k].shapes[1]
        if not old.discs:
            continue
        alone = isolated_views(after[k], 1, views, rest, settings.restart.views, pool)
        patches = patches_of(new, alone, 1, beside=old, area=settings.restart.area_px, settings=settings)
        if not patches:
            continue
        costs = [cost_of(each, patches, offset=False, settings=settings) for each in (old, new)]
        if costs[0] >= (1.0 - settings.restart.rim_pays) ** old.discs * costs[1]:
            continue
        exchange(new, old, after[k], views, rest, pool)
        out[k] = before[k]
    return out


def _plain(ghost: DetectedGhost) -> DetectedGhost:
    """Return a ghost without discs, uniformly bright over pupil and field."""
    red, green, blue = (_plain_shape(shape) for shape in ghost.shapes)
    return replace(ghost, shapes=(red, green, blue))


def _plain_shape(shape: Shape) -> Shape:
    numbers = without_discs(shape).numbers
    numbers[FIRST_I + 1 : FIRST_DISC] = 0.0
    return Shape(numbers)
