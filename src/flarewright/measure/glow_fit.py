"""Find the light around the light: what stays beside it at every constellation is halo and star, and no ghost."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import Halo, Rgb3, Star
from .numbers import Floats
from .views import Pixels, View, halved

# the constellations' quantile that is taken for light without ghosts
LOW = 0.3
# the halo's pictures are halved so often: noise would pull a low quantile down
_HALVINGS = 2
_RINGS = 20
# directions in which the star is looked at, and by how much a ridge must outshine what lies between
_DIRECTIONS = 1440
_SPIKY = 1.25
_MOST_SPIKES = 48


@dataclass(frozen=True)
class Registered:
    """The low quantile over the constellations, with the light always in one place.

    Attributes
    ----------
    picture : ndarray, shape (2 h, 2 w, 3)
        Not a number where fewer than a fifth of the views reach.
    side : int
        Pixels of the views per pixel of the picture.
    """

    picture: Pixels
    side: int

    @property
    def origin(self) -> tuple[int, int]:
        """(x, y) of the light in the picture."""
        return self.picture.shape[1] // 2, self.picture.shape[0] // 2

    def polar(self) -> tuple[Floats, Floats]:
        """Return right and up of every pixel's middle from the light, pixels of the views."""
        y, x = np.mgrid[: self.picture.shape[0], : self.picture.shape[1]]
        return self.side * (x + 0.5 - self.origin[0]), self.side * (self.origin[1] - y - 0.5)


def register(views: Sequence[View], pixels: Sequence[Pixels], low: float = LOW, halvings: int = 0) -> Registered:
    """Lay all views over each other by the light and take a low quantile.

    Parameters
    ----------
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W, 3)
        What they show; not a number where nothing was measured.
    low : float
        Quantile.
    halvings : int
        Of the resolution.
    """
    return Registered(
        np.stack([_register(views, [each[..., m] for each in pixels], low, halvings) for m in range(3)], axis=-1),
        2**halvings,
    )


def _register(views: Sequence[View], pixels: Sequence[Pixels], low: float, halvings: int) -> Pixels:
    """Register one channel, shape (2 h, 2 w)."""
    small = [halved(each, halvings) for each in pixels]
    height, width = small[0].shape
    stack = np.full((len(views), 2 * height, 2 * width), np.nan, np.float32)
    for k, view in enumerate(views):
        x, y = (round(at / 2**halvings) for at in view.light_px)
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
    return np.asarray(found, dtype=np.float32)


def fit_halo(views: Sequence[View], pixels: Sequence[Pixels], low: float = LOW) -> Halo | None:
    """Return the halo: the median of rings around the light in the registered quantile.

    Parameters
    ----------
    views, pixels, low
        As for `register`.

    Returns
    -------
    Halo or None
        None when there is no light around the light.
    """
    known = register(views, pixels, low, _HALVINGS)
    right, up = known.polar()
    radius = np.hypot(right, up)
    far, side = float(radius.max()), known.side
    middles, levels = [], []
    for inner, outer in pairwise(np.geomspace(side, far + side, _RINGS + 1)):
        ring = known.picture[(radius >= inner) & (radius < outer)]
        ring = ring[np.isfinite(ring).all(axis=1)]
        if len(ring) >= 4:
            middles.append(float(np.sqrt(inner * outer)))
            levels.append(np.median(ring, axis=0))
    if len(middles) < 3 or not max(level.max() for level in levels) > 0.0:
        return None
    # the outermost ring's level holds to the corners
    middles.append(2.0 * far)
    levels.append(levels[-1])
    return Halo(radius_px=tuple(middles), radiance=tuple(_rgb(level) for level in levels))


def _rgb(level: NDArray[np.floating]) -> Rgb3:
    return max(float(level[0]), 0.0), max(float(level[1]), 0.0), max(float(level[2]), 0.0)


def fit_star(known: Registered) -> Star | None:
    """Return the star: spikes that stand out from what lies between them, at all distances alike.

    Parameters
    ----------
    known : Registered
        At full resolution.

    Returns
    -------
    Star or None
        None when no comb of spikes stands out.
    """
    # medians meet rings that no view reached
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return _fit_star(known)


def _fit_star(known: Registered) -> Star | None:
    (x0, y0), width = known.origin, known.picture.shape[1] // 2
    radii = np.geomspace(0.06 * width, 0.35 * width, 24)
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    columns = np.clip((x0 + radii[:, None] * np.cos(angles)).astype(int), 0, known.picture.shape[1] - 1)
    rows = np.clip((y0 - radii[:, None] * np.sin(angles)).astype(int), 0, known.picture.shape[0] - 1)
    ring = known.picture[rows, columns]
    between = np.nanmedian(ring[..., 1], axis=1)
    if not np.isfinite(between).all() or not between.min() > 0.0:
        return None
    shape = np.nan_to_num(np.nanmedian(ring[..., 1] / between[:, None], axis=0), nan=1.0)
    # one strong ridge shall not speak for a comb
    harmonics = np.fft.rfft(np.minimum(shape, 4.0))
    strength = np.abs(harmonics[2 : _MOST_SPIKES + 1])
    # the comb's own number is the lowest of its harmonics
    strong = np.flatnonzero(strength > 0.6 * strength.max()) + 2
    spikes = int(strong[0])
    first = -float(np.angle(harmonics[spikes])) / spikes
    ridges = np.round((first + 2.0 * np.pi * np.arange(spikes) / spikes) / (2.0 * np.pi) * _DIRECTIONS).astype(int)
    near = (ridges[:, None] + np.arange(-2, 3)) % _DIRECTIONS
    if np.median(shape[near].max(axis=1)) < _SPIKY:
        return None
    # a ridge's height over what lies between, and its width by the light across it
    height = np.nan_to_num(np.nanmedian(np.nanmax(ring[:, near], axis=2), axis=1) - np.nanmedian(ring, axis=1))
    step = 2.0 * np.pi / _DIRECTIONS
    half = max(int(0.4 * _DIRECTIONS / spikes), 3)
    across = (ridges[:, None] + np.arange(-half, half + 1)) % _DIRECTIONS
    light = np.nansum(np.maximum(ring[:, across, 1] - between[:, None, None], 0.0), axis=2)
    widths = np.nanmedian(light, axis=1) * step * radii / np.maximum(height[:, 1], 1e-30) / np.sqrt(2.0 * np.pi)
    # the law from the light's neighbourhood to beyond the picture: the outer slope goes on
    slope = np.log(np.maximum(height[-1], 1e-30) / np.maximum(height[-8], 1e-30)) / np.log(radii[-1] / radii[-8])
    end = 4.0 * width
    beyond = height[-1] * np.exp(np.minimum(slope, -1.0) * np.log(end / radii[-1]))
    radius = (*map(float, radii[::3]), float(radii[-1]), float(end))
    levels = [_rgb(each) for each in (*height[::3], height[-1], beyond)]
    return Star(
        spikes=spikes, first_deg=float(np.degrees(first)) % (360.0 / spikes),
        width_px=max(float(np.nanmedian(widths)), 0.4), radius_px=radius, radiance=tuple(levels),
    )  # fmt: skip


def glow(view: View, known: Registered) -> Pixels:
    """Return the registered light as a view sees it, shape (H, W, 3); 0 where it is not known.

    Parameters
    ----------
    view : View
    known : Registered
        At the view's resolution.
    """
    width, height = view.size_px
    x, y = round(view.light_px[0]), round(view.light_px[1])
    left, top = known.origin[0] - x, known.origin[1] - y
    out = np.zeros((height, width, 3), np.float32)
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + width, known.picture.shape[1]), min(top + height, known.picture.shape[0])
    if x0 < x1 and y0 < y1:
        out[y0 - top : y1 - top, x0 - left : x1 - left] = np.nan_to_num(known.picture[y0:y1, x0:x1])
    return out
