"""Find the light around the light: what stays beside it at every constellation is halo and star, and no ghost."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from statistics import NormalDist

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ..model.ghost_model import Blades, Halo, Rgb3, Star
from .glow import halo_radiance, offsets, star_radiance
from .numbers import Floats
from .shared_out import shared_out
from .views import Pixels, View, all_known, halved

# the constellations' quantile that is taken for light without ghosts
LOW = 0.3
# the halo's pictures are halved so often: noise would pull a low quantile down
_HALVINGS = 2
_RINGS = 20
# parts of a ring whose difference tells how well its light is known, and standard deviations of a normal law by its
# median distance from the median
_SECTORS, _MAD = 12, 1.4826
# rows of the registered picture that are sorted at once
_BAND = 16
# there is no more halo than anything shows: the part of a ring that may be darker, the part of the views that may
# be darker still, for rims shade the light in some, and how many places a ring must have
_DARKER, _DARKER_VIEWS, _LEAST_PLACES = 0.02, 0.1, 12
# by how many standard deviations noise makes that part darker
_DARKER_NOISE = -NormalDist().inv_cdf(_DARKER)
# so many places of a view must be brighter than noise for it to bound its glow
_BRIGHT_PLACES = 50
# directions in which the star is looked at, and by how much a ridge must outshine what lies between
_DIRECTIONS = 1440
_SPIKY = 1.25
_MOST_SPIKES = 48
# no iris makes fewer spikes: two are ghosts along the light's line. This part of them may be hidden
_FEWEST_SPIKES, _HIDDEN = 4, 0.4
# spikes are narrower than this, degrees; what is wider along a ring is ghosts
_SPIKE_DEG = 7.0
# an iris of more blades is round
_MOST_BLADES = 20
# how strong halo and star are is learned from about so many pixels of a view, in so many rounds; the part of them that
# their laws may miss
_SAMPLES, _ROUNDS, _GLOW_ERROR = 8000, 12, 0.1
# the highest power of the distance by which a halo falls within a ring
_STEEPEST = 4.0
# quantile of the directions that is taken for light between spikes
_GAPS = 0.1
# part of the noise that halo or star must reach somewhere for their strength to be asked
_SEEN = 0.1


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


def register(
    views: Sequence[View],
    pixels: Sequence[Pixels],
    low: float = LOW,
    halvings: int = 0,
    pool: ThreadPoolExecutor | None = None,
) -> Registered:
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
    pool : executor, optional
    """
    small = shared_out(partial(halved, times=halvings), pixels, pool=pool)
    lights = [(round(view.light_px[0] / 2**halvings), round(view.light_px[1] / 2**halvings)) for view in views]
    first_rows = range(0, 2 * small[0].shape[0], _BAND)
    bands = shared_out(partial(_registered, small, lights, low), first_rows, pool=pool)
    return Registered(np.concatenate(bands), 2**halvings)


def _registered(pixels: Sequence[Pixels], lights: Sequence[tuple[int, int]], low: float, first_row: int) -> Pixels:
    """Register some rows, shape (rows, 2 w, 3)."""
    height, width = pixels[0].shape[:2]
    last_row = min(first_row + _BAND, 2 * height)
    # each place's values beside each other: they are sorted
    stack = np.full((last_row - first_row, 2 * width, 3, len(pixels)), np.nan, np.float32)
    for k, (picture, (x, y)) in enumerate(zip(pixels, lights, strict=True)):
        left, top = width - x, height - y
        x0, y0 = max(left, 0), max(top, first_row)
        x1, y1 = min(left + width, 2 * width), min(top + height, last_row)
        if x0 < x1 and y0 < y1:
            stack[y0 - first_row : y1 - first_row, x0:x1, :, k] = picture[y0 - top : y1 - top, x0 - left : x1 - left]
    count = np.isfinite(stack).sum(axis=-1)
    # not a number sorts last, so the quantile's place follows from how many there are
    stack.sort(axis=-1)
    at = np.maximum(count - 1, 0) * low
    below = np.floor(at).astype(np.int64)
    first = np.take_along_axis(stack, below[..., None], axis=-1)[..., 0]
    second = np.take_along_axis(stack, np.minimum(below + 1, np.maximum(count - 1, 0))[..., None], axis=-1)[..., 0]
    found = first + (at - below) * (second - first)
    found[count < max(3, len(pixels) // 5)] = np.nan
    return np.asarray(found, dtype=np.float32)


def fit_halo(
    views: Sequence[View], pixels: Sequence[Pixels], low: float = LOW, pool: ThreadPoolExecutor | None = None
) -> Halo | None:
    """Return the halo: the median of rings around the light in the registered quantile, as far as any place is as dark.

    Ghosts that go along with the light are beside it at every constellation, but not all around it.

    Parameters
    ----------
    views, pixels, low, pool
        As for `register`.

    Returns
    -------
    Halo or None
        None when there is no light around the light.
    """
    known = register(views, pixels, low, _HALVINGS, pool)
    right, up = known.polar()
    radius = np.hypot(right, up)
    seen = shared_out(_around, views, pool=pool)
    sector = np.floor(_SECTORS * (np.arctan2(up, right) / (2.0 * np.pi) + 0.5)).astype(np.int64) % _SECTORS
    far, side = float(radius.max()), known.side
    rings, medians, spreads = [], [], []
    for inner, outer in pairwise(np.geomspace(side, far + side, _RINGS + 1)):
        here = (radius >= inner) & (radius < outer) & all_known(known.picture)
        ring = known.picture[here]
        if len(ring) >= 4:
            rings.append((float(inner), float(outer)))
            medians.append(np.median(ring, axis=0))
            spreads.append(_differ(ring, sector[here]))
    if len(rings) < 3:
        return None
    middles = [float(np.sqrt(inner * outer)) for inner, outer in rings]
    falls = _falls(np.array(middles), np.array(medians))
    levels = [
        np.minimum(median, _darkest(seen, ring, fall)) for median, ring, fall in zip(medians, rings, falls, strict=True)
    ]
    # where darker places tell, what lies beside them does not; noise draws a low quantile down; and near the light
    # a ring is as narrow as the pixels that it is made of
    noise = -NormalDist().inv_cdf(low) * _noise(seen)
    errors = [
        np.sqrt(spread**2 + (median - level) ** 2 + noise**2 + (0.5 * (side / middle) ** 2 * level) ** 2)
        for spread, median, level, middle in zip(spreads, medians, levels, middles, strict=True)
    ]
    if not max(level.max() for level in levels) > 0.0:
        return None
    # the outermost ring's level holds to the corners
    middles.append(2.0 * far)
    return Halo(
        radius_px=tuple(middles), radiance=tuple(_rgb(level) for level in (*levels, levels[-1])),
        uncertainty=tuple(_rgb(error) for error in (*errors, errors[-1])),
    )  # fmt: skip


def _differ(ring: Pixels, sector: NDArray[np.int64]) -> Floats:
    """Return the standard error of a ring's median by how far its sectors' medians differ, shape (3,)."""
    each = [np.median(ring[sector == k], axis=0) for k in range(_SECTORS) if np.any(sector == k)]
    return _error_of_median(np.array(each))


def _error_of_median(values: Floats) -> Floats:
    """Return the standard error of a median by the spread of what it is taken of, along the first axis."""
    if len(values) < 2:
        return np.asarray(np.abs(values[0]))
    spread = _MAD * np.nanmedian(np.abs(values - np.nanmedian(values, axis=0)), axis=0)
    return np.asarray(np.sqrt(0.5 * np.pi / len(values)) * spread)


@dataclass(frozen=True)
class _Around:
    """A view's pixels, halved, by how far they are from the light: radius (N,), light and its variance (N, 3)."""

    radius: Floats
    light: Pixels
    variance: Pixels


def _around(view: View) -> _Around:
    """Return what was measured of a view, ghosts and all."""
    light = halved(view.measured, _HALVINGS)
    variance = halved(view.variance, _HALVINGS, variance=True)
    side = 2.0**-_HALVINGS
    at = view.light_px[0] * side, view.light_px[1] * side
    radius = np.hypot(*offsets(at, (light.shape[1], light.shape[0]), side))
    known = all_known(light) & all_known(variance)
    return _Around(radius[known], light[known], variance[known])


def _noise(seen: Sequence[_Around]) -> Floats:
    """Return the noise of a place, shape (3,)."""
    medians = [np.median(one.variance, axis=0) for one in seen if len(one.variance)]
    return np.asarray(np.sqrt(np.median(np.array(medians), axis=0))) if medians else np.zeros(3)


def _falls(middles: Floats, medians: Floats) -> Floats:
    """Return by which power of the distance light falls at each ring, shape (R, 3): never towards the light."""
    falls = -np.gradient(np.log(np.maximum(medians, 1e-30)), np.log(middles), axis=0)
    # what is dark tells no law
    return np.asarray(np.clip(np.where(medians > 0.0, falls, 0.0), 0.0, _STEEPEST))


def _darkest(seen: Sequence[_Around], ring: tuple[float, float], fall: Floats) -> Floats:
    """Return the light of the darkest places of a ring, of most views, shape (3,); noise is made good.

    Every place is asked what it would be in the ring's middle: else those at its outer border would be the darkest.
    """
    found = []
    for one in seen:
        here = (one.radius >= ring[0]) & (one.radius < ring[1])
        if np.count_nonzero(here) >= _LEAST_PLACES:
            brighter = (one.radius[here, None] / np.sqrt(ring[0] * ring[1])) ** fall
            noise = np.sqrt(np.median(one.variance[here] * brighter**2, axis=0))
            found.append(np.quantile(one.light[here] * brighter, _DARKER, axis=0) + _DARKER_NOISE * noise)
    if len(found) < 3:
        return np.full(3, np.inf)
    return np.asarray(np.maximum(np.quantile(np.array(found), _DARKER_VIEWS, axis=0), 0.0))


def _rgb(level: NDArray[np.floating]) -> Rgb3:
    return max(float(level[0]), 0.0), max(float(level[1]), 0.0), max(float(level[2]), 0.0)


def followed(
    views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[NDArray[np.bool_]], halo: Halo | None,
    star: Star | None, pool: ThreadPoolExecutor | None = None,
) -> tuple[Halo | None, Star | None]:  # fmt: skip
    """Return halo and star with how strong they are at each constellation.

    Parameters
    ----------
    views : sequence of View
        By rising constellation.
    pixels : sequence of ndarray, shape (H, W, 3)
        What they show beside the ghosts; not a number where nothing was measured.
    masks : sequence of ndarray of bool, shape (H, W)
        Where to look.
    halo, star : Halo or None, Star or None
    pool : executor, optional

    Returns
    -------
    halo, star

    Notes
    -----
    Least squares in every view, light that is missed (ghosts not known) counting less and less. The rims of a lens
    shade the light's image as the constellation grows, and so all that spreads from it.
    """
    parts = np.array(shared_out(partial(_parts, halo, star), views, pixels, masks, pool=pool))
    padded = np.concatenate([parts[:1], parts, parts[-1:]])
    smooth = np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)
    told = [(view.constellation_deg, *map(float, row)) for view, row in zip(views, smooth, strict=True)]
    return (
        None if halo is None else halo.model_copy(update={
            "strength": tuple((row[0], row[1]) for row in told), "even": tuple((row[0], row[3:6]) for row in told),
        }),
        None if star is None else star.model_copy(update={"strength": tuple((row[0], row[2]) for row in told)}),
    )  # fmt: skip


def _parts(halo: Halo | None, star: Star | None, view: View, pixels: Pixels, mask: NDArray[np.bool_]) -> Floats:
    """Return how strong halo, star and an even red, green and blue are in a view, shape (5,)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    none = np.broadcast_to(0.0, pixels.shape)
    shapes = [none if halo is None else halo_radiance(halo, x, y), none if star is None else star_radiance(star, x, y)]
    known = np.isfinite(pixels) & mask[..., None]
    every = max(1, int(np.sqrt(np.count_nonzero(known) / _SAMPLES)))
    spots = known[::every, ::every]
    few = [one[::every, ::every][spots] for one in (*shapes, pixels, view.variance)]
    basis = np.concatenate([np.stack(few[:2], axis=1), np.eye(3)[np.nonzero(spots)[2]]], axis=1)
    parts = _strengths(basis, few[2].astype(float), few[3].astype(float))
    glow = np.broadcast_to(parts[2:], pixels.shape).copy()
    for part, shape in zip(parts, shapes, strict=False):
        if part > 0.0:
            glow += part * shape
    return parts * _bound(np.where(known, glow, np.nan), view)


def _bound(glow: Floats, view: View) -> float:
    """Return by which factor glow, not a number where it is not asked, is dimmed to be no more than a view shows."""
    light = halved(glow.astype(np.float32), _HALVINGS)
    noise = np.sqrt(halved(view.variance, _HALVINGS, variance=True))
    bright = light > 2.0 * noise
    if np.count_nonzero(bright) < _BRIGHT_PLACES:
        return 1.0
    seen = halved(view.pixels, _HALVINGS)
    parts = (seen[bright] + _DARKER_NOISE * noise[bright]) / light[bright]
    return min(max(float(np.quantile(parts, _DARKER)), 0.0), 1.0)


def _strengths(basis: Floats, seen: Floats, variance: Floats) -> Floats:
    """Return factors at least 0 by weighted least squares, outliers counting less."""
    scale = basis.max(axis=0, initial=0.0)
    # what noise hides at its full strength tells none: beyond the picture's border it may be next to nothing
    free = scale > _SEEN * np.sqrt(np.median(variance)) if variance.size else scale < 0.0
    if not free.any():
        return np.zeros(scale.size)
    parts = np.where(free, 1.0, 0.0) * (np.arange(scale.size) < 2)
    whole = basis[:, free] / scale[free]
    for _ in range(_ROUNDS):
        model = basis @ parts
        # equal parts of the light count alike
        spread = np.sqrt(variance + (_GLOW_ERROR * np.maximum(model, seen)) ** 2)
        weight = 1.0 / (spread**2 * (1.0 + ((seen - model) / (2.0 * spread)) ** 2))
        picked, part = free.copy(), whole
        while picked.any():
            weighed = part.T * weight
            solved = np.linalg.lstsq(weighed @ part, weighed @ seen, rcond=1e-9)[0] / scale[picked]
            if (solved >= 0.0).all():
                break
            # what would take light away is left out
            picked[np.flatnonzero(picked)[int(np.argmin(solved * scale[picked]))]] = False
            part = basis[:, picked] / scale[picked]
        parts = np.zeros(scale.size)
        if picked.any():
            parts[picked] = solved
    return parts


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
    # neither one strong ridge nor what ghosts leave along the light's line shall speak for a comb
    half = round(_SPIKE_DEG / 360.0 * _DIRECTIONS)
    wide = np.median(sliding_window_view(np.pad(shape, half, mode="wrap"), 2 * half + 1), axis=1)
    harmonics = np.fft.rfft(np.clip(shape - wide, 0.0, 1.0))
    strength = np.abs(harmonics[_FEWEST_SPIKES : _MOST_SPIKES + 1])
    # the comb's own number is the lowest of its harmonics
    strong = np.flatnonzero(strength > 0.6 * strength.max()) + _FEWEST_SPIKES
    spikes = int(strong[0])
    first = -float(np.angle(harmonics[spikes])) / spikes
    ridges = np.round((first + 2.0 * np.pi * np.arange(spikes) / spikes) / (2.0 * np.pi) * _DIRECTIONS).astype(int)
    near = (ridges[:, None] + np.arange(-2, 3)) % _DIRECTIONS
    standing = shape[near].max(axis=1) / np.maximum(wide[ridges % _DIRECTIONS], 1e-30)
    if np.quantile(standing, _HIDDEN, method="lower") < _SPIKY:
        return None
    # a ridge's height over what lies between, and its width by the light across it
    tops = np.nanmax(ring[:, near], axis=2)
    low = np.nanmedian(ring, axis=1)
    height = np.nan_to_num(np.nanmedian(tops, axis=1) - low)
    # near the light spikes fill the gaps between them, and what lies there is no more than light without them
    filled = low - np.nanquantile(ring, _GAPS, axis=1)
    error = np.nan_to_num(np.hypot(_error_of_median(tops.swapaxes(0, 1)), filled), nan=np.inf)
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
    # beyond, at least as badly known as where it was seen last
    part = np.minimum(error[-1] / np.maximum(height[-1], 1e-30), 1.0)
    errors = [_rgb(np.minimum(each, top)) for each, top in zip(error, height, strict=True)]
    errors = [*errors[::3], errors[-1], _rgb(np.maximum(part, 0.5) * beyond)]
    return Star(
        spikes=spikes, first_deg=float(np.degrees(first)) % (360.0 / spikes),
        width_px=max(float(np.nanmedian(widths)), 0.4), radius_px=radius, radiance=tuple(levels),
        uncertainty=tuple(errors),
    )  # fmt: skip


def iris_of(star: Star | None) -> Blades | None:
    """Return the iris that makes a star: every side makes two spikes at right angles to it; None when none is known.

    Notes
    -----
    Of blades of an even number two make the same two spikes. So 2 n spikes may be n odd blades or 2 n; as most irises
    are made, 10 and more spikes whose half is odd are taken for half as many blades.
    """
    if star is None or star.spikes % 2 or star.spikes < 4:
        return None
    half = star.spikes // 2
    count = half if half % 2 and half >= 5 else star.spikes
    return Blades(count=count, first_deg=star.first_deg) if count <= _MOST_BLADES else None
