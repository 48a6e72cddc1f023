"""Reject detected ghosts that are residual glow around the light.

Halo and star are known to a few percent. Their residual surrounds the light and moves with it. Over many
constellations it looks like a ghost, and a fit describes it as one. A photograph cannot distinguish a faint disc that
never leaves the light from the halo, or light below 0.5 % of the glow from an error of the glow's law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from ...kernels.ghost_model.pupil_centre import fill_middles
from ...typing import Floats, Mask
from ..core.parameters import Shape
from ..core.sampling import evenly_spaced
from ..core.views import View
from ..fitting.detected_ghost import CHANNELS, DetectedGhost, channel_noise, leading
from ..fitting.ghost_fit import light_of
from .settings import RejectionSettings
from .subtraction import AROUND_LIGHT, masks_of


def is_residual_glow(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], settings: RejectionSettings = RejectionSettings()
) -> list[bool]:
    """Return for each detected ghost whether it is residual glow.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
    views : sequence of View
        As photographed, in the same pixels.
    settings : RejectionSettings

    Returns
    -------
    list of bool
        True for ghosts centred on the light in all their views that are faint or hardly larger than the masked disc
        around the light. Also true for ghosts that are a negligible fraction of the light at their position.
    """
    noise, masks = channel_noise(views), masks_of(views)
    return [_is_glow(ghost, leading(ghost, noise), views, masks, settings) for ghost in ghosts]


def with_glow_unwanted(
    detected: Sequence[DetectedGhost], views: Sequence[View], settings: RejectionSettings = RejectionSettings()
) -> list[DetectedGhost]:
    """Mark ghosts detected at the light, faint or hidden, as unwanted before they are fitted together.

    Where two of them describe the same residual glow, a joint fit determines only their sum: one can drift away from
    the light, where `is_residual_glow` takes it for a ghost. So a ghost at the light is judged where it is detected.

    Parameters
    ----------
    detected : sequence of DetectedGhost
    views : sequence of View
        As photographed, in the same pixels.
    settings : RejectionSettings
        A limit without a largest offset waits for the fit, which knows the brightness better.

    Returns
    -------
    list of DetectedGhost
        The fit keeps the unwanted ones, the model omits them.
    """
    near = replace(settings, limits=tuple(limit for limit in settings.limits if isfinite(limit[0])))
    glow = is_residual_glow(detected, views, near)
    return [
        replace(ghost, unwanted=ghost.unwanted or left, glow=ghost.glow or left)
        for ghost, left in zip(detected, glow, strict=True)
    ]


def with_glow_among_removed(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], settings: RejectionSettings = RejectionSettings()
) -> list[DetectedGhost]:
    """Mark which of the ghosts that an earlier search or the user removed are residual glow.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
        As the search left them.
    views : sequence of View
        As photographed, in the same pixels.
    settings : RejectionSettings
    """
    glow = is_residual_glow(ghosts, views, settings)
    return [replace(ghost, glow=ghost.unwanted and left) for ghost, left in zip(ghosts, glow, strict=True)]


def without_glow(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], settings: RejectionSettings = RejectionSettings()
) -> list[DetectedGhost]:
    """Return the fitted ghosts that are not residual glow.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
        Fitted together.
    views : sequence of View
        As photographed, in the same pixels.
    settings : RejectionSettings

    Returns
    -------
    list of DetectedGhost
        Without those that are unwanted or that `is_residual_glow` rejects, and without those outshone by residual glow
        where they lie: a fit determines only the sum of such a ghost and the residual glow.
    """
    near = is_residual_glow(ghosts, views, settings)
    glow = [ghost for ghost, left in zip(ghosts, near, strict=True) if left or ghost.glow]
    masks = masks_of(views)
    return [
        ghost
        for ghost, left in zip(ghosts, near, strict=True)
        if not (left or ghost.unwanted or _is_outshone(ghost, glow, views, masks, settings))
    ]


def _is_outshone(
    ghost: DetectedGhost, glow: Sequence[DetectedGhost], views: Sequence[View], masks: Sequence[Mask],
    settings: RejectionSettings,
) -> bool:  # fmt: skip
    """Return whether a ghost has less light than the residual glow at its position."""
    own, other = 0.0, 0.0
    for k in evenly_spaced(range(ghost.first, ghost.last + 1), settings.views) if glow else ():
        for m in range(CHANNELS):
            part, light = light_of(ghost.shapes[m], views[k])
            beside = np.zeros(masks[k].shape)
            for one in glow:
                where, found = light_of(one.shapes[m], views[k])
                beside[where] += found
            there = masks[k][part] & (light > 0.0)
            own += float(light[there].sum())
            other += float(beside[part][there].sum())
    return own < other


def _is_glow(
    ghost: DetectedGhost, lead: int, views: Sequence[View], masks: Sequence[Mask], settings: RejectionSettings
) -> bool:
    seen = views[ghost.first : ghost.last + 1]
    place, size = _centre_and_size(ghost.shapes[lead], np.array([view.sigma for view in seen]))
    light = np.array([view.off_axis_px for view in seen])
    off = np.abs(place - light)
    # largest offset, over the size or over the light's distance from the axis
    far = max((off / np.maximum(size, 1e-9)).max(), off.max() / max(light.max(), 1e-9))
    hidden = settings.hidden_size * AROUND_LIGHT * views[0].size_px[0] + settings.coarse_px
    if far <= settings.hidden_offset and size.max() <= hidden:
        return True
    part = _brightness_fraction(ghost, views, masks, settings)
    return any(far <= least and part <= most for least, most in settings.limits)


def _centre_and_size(shape: Shape, sigma: Floats) -> tuple[Floats, Floats]:
    """Return position along the line through axis and light, and size, of the pupil centre's image, pixels."""
    middles = np.zeros((3, sigma.size))
    fill_middles(np.tile(shape.numbers, (sigma.size, 1)), sigma, middles)
    return middles[0], np.abs(middles[1])


def _brightness_fraction(
    ghost: DetectedGhost, views: Sequence[View], masks: Sequence[Mask], settings: RejectionSettings
) -> float:
    """Return the light of a ghost over all light at its position, within the masks; 0 when there is none."""
    own, every = 0.0, 0.0
    for k in evenly_spaced(range(ghost.first, ghost.last + 1), settings.views):
        for m in range(CHANNELS):
            part, light = light_of(ghost.shapes[m], views[k])
            there = masks[k][part] & (light > 0.0)
            own += float(light[there].sum())
            every += float(views[k].pixels[part][..., m][there].sum())
    return own / every if every > 0.0 else 0.0
