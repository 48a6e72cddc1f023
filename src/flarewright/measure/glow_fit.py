"""Find the light around the light: what stays beside it at every constellation is halo, and no ghost."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import Halo, Rgb3
from .glow import halo_radiance, offsets
from .numbers import Floats
from .views import Pixels, View, halved

# the constellations' quantile that is taken for light without ghosts
LOW = 0.2
# pictures are halved so often: noise would pull a low quantile down
_HALVINGS = 2
_RINGS = 20


def registered(views: Sequence[View], pixels: Sequence[Pixels], low: float = LOW) -> tuple[Floats, tuple[int, int]]:
    """Return the low quantile over the views, with the light always in one place.

    Parameters
    ----------
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W, 3)
        What they show; not a number where nothing was measured.
    low : float
        Quantile.

    Returns
    -------
    ndarray, shape (2 h, 2 w, 3)
        At a quarter of the resolution; not a number where fewer than a fifth of the views reach.
    tuple of int
        (x, y) of the light in it.
    """
    small = [halved(each, _HALVINGS) for each in pixels]
    height, width = small[0].shape[:2]
    stack = np.full((len(views), 2 * height, 2 * width, 3), np.nan, np.float32)
    for k, view in enumerate(views):
        x, y = (round(at / 2**_HALVINGS) for at in view.light_px)
        left, top = width - x, height - y
        x0, y0 = max(left, 0), max(top, 0)
        x1, y1 = min(left + width, 2 * width), min(top + height, 2 * height)
        if x0 < x1 and y0 < y1:
            stack[k, y0:y1, x0:x1] = small[k][y0 - top : y1 - top, x0 - left : x1 - left]
    count = np.isfinite(stack).sum(axis=0)
    # not a number sorts last, so the quantile's place follows from how many there are
    stack.sort(axis=0)
    at = np.maximum(count - 1, 0) * low
    below = np.floor(at).astype(np.int64)
    first = np.take_along_axis(stack, below[None], axis=0)[0]
    second = np.take_along_axis(stack, np.minimum(below + 1, np.maximum(count - 1, 0))[None], axis=0)[0]
    found = first + (at - below) * (second - first)
    found[count < max(3, len(views) // 5)] = np.nan
    return found.astype(float), (width, height)


def fit_halo(views: Sequence[View], pixels: Sequence[Pixels], low: float = LOW) -> Halo | None:
    """Return the halo: the median of rings around the light in the registered quantile.

    Parameters
    ----------
    views, pixels, low
        As in `registered`.

    Returns
    -------
    Halo or None
        None when there is no light around the light.
    """
    picture, (x0, y0) = registered(views, pixels, low)
    side = 2**_HALVINGS
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    radius = side * np.hypot(x + 0.5 - x0, y + 0.5 - y0)
    far = float(radius.max())
    edges = np.geomspace(side, far + side, _RINGS + 1)
    middles, levels = [], []
    for inner, outer in pairwise(edges):
        ring = picture[(radius >= inner) & (radius < outer)]
        ring = ring[np.isfinite(ring).all(axis=1)]
        if len(ring) >= 4:
            middles.append(float(np.sqrt(inner * outer)))
            levels.append(np.median(ring, axis=0))
    if len(middles) < 3 or not max(level.max() for level in levels) > 0.0:
        return None
    # the outermost ring's level holds to the corners
    middles.append(2.0 * far)
    levels.append(levels[-1])
    radiance: list[Rgb3] = [(max(float(a), 0.0), max(float(b), 0.0), max(float(c), 0.0)) for a, b, c in levels]
    return Halo(radius_px=tuple(middles), radiance=tuple(radiance))


def glow(view: View, halo: Halo | None) -> NDArray[np.float32]:
    """Return a halo as a view sees it, shape (H, W, 3)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    if halo is None:
        return np.zeros((*x.shape, 3), np.float32)
    return halo_radiance(halo, x, y).astype(np.float32)
