"""Fit the glow, halo and star: the light that keeps its offset from the light source in all constellations."""

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

from ...model.measurement.ghost_model import Blades, Halo, Rgb3, Star
from ...typing import Floats, Indices, Mask, Pixels
from ..core.parallel import map_batched
from ..core.robust import MAD_TO_SIGMA
from ..core.views import View, all_finite, halved_pixels
from .laws import halo_radiance, offsets, star_radiance
from .settings import GlowSettings, HaloSettings, StarSettings, StrengthSettings

# number of rows of the registered picture that are sorted at once
_BAND = 16


@dataclass(frozen=True)
class Registered:
    """Low quantile over the constellations, registered by the position of the light.

    Attributes
    ----------
    picture : ndarray, shape (2 h, 2 w, 3)
        NaN where fewer than a fifth of the views have pixels.
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
        """Return the offsets of all pixel centres from the light, to the right and upwards, pixels of the views."""
        y, x = np.mgrid[: self.picture.shape[0], : self.picture.shape[1]]
        return self.side * (x + 0.5 - self.origin[0]), self.side * (self.origin[1] - y - 0.5)


def register(
    views: Sequence[View], pixels: Sequence[Pixels], low: float | None = None, halvings: int = 0,
    pool: ThreadPoolExecutor | None = None, settings: HaloSettings = HaloSettings(),
) -> Registered:  # fmt: skip
    """Register all views by the position of the light and compute a low quantile.

    Parameters
    ----------
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W, 3)
        Pictures of the views; NaN where nothing was measured.
    low : float, optional
        Quantile; default: `settings.low`.
    halvings : int
        Number of halvings of the pictures.
    pool : executor, optional
    settings : HaloSettings
    """
    low = settings.low if low is None else low
    small = map_batched(partial(halved_pixels, times=halvings), pixels, pool=pool)
    lights = [(round(view.light_px[0] / 2**halvings), round(view.light_px[1] / 2**halvings)) for view in views]
    first_rows = range(0, 2 * small[0].shape[0], _BAND)
    bands = map_batched(partial(_registered, small, lights, low), first_rows, pool=pool)
    return Registered(np.concatenate(bands), 2**halvings)


def _registered(pixels: Sequence[Pixels], lights: Sequence[tuple[int, int]], low: float, first_row: int) -> Pixels:
    """Return some rows of the registered quantile, shape (rows, 2 w, 3)."""
    height, width = pixels[0].shape[:2]
    last_row = min(first_row + _BAND, 2 * height)
    # the values of each pixel are contiguous for the sort
    stack = np.full((last_row - first_row, 2 * width, 3, len(pixels)), np.nan, np.float32)
    for k, (picture, (x, y)) in enumerate(zip(pixels, lights, strict=True)):
        left, top = width - x, height - y
        x0, y0 = max(left, 0), max(top, first_row)
        x1, y1 = min(left + width, 2 * width), min(top + height, last_row)
        if x0 < x1 and y0 < y1:
            stack[y0 - first_row : y1 - first_row, x0:x1, :, k] = picture[y0 - top : y1 - top, x0 - left : x1 - left]
    count = np.isfinite(stack).sum(axis=-1)
    # NaN sorts last, so the index of the quantile follows from the number of finite values
    stack.sort(axis=-1)
    at = np.maximum(count - 1, 0) * low
    below = np.floor(at).astype(np.int64)
    first = np.take_along_axis(stack, below[..., None], axis=-1)[..., 0]
    second = np.take_along_axis(stack, np.minimum(below + 1, np.maximum(count - 1, 0))[..., None], axis=-1)[..., 0]
    found = first + (at - below) * (second - first)
    found[count < max(3, len(pixels) // 5)] = np.nan
    return np.asarray(found, dtype=np.float32)


def fit_halo(
    views: Sequence[View], pixels: Sequence[Pixels], pool: ThreadPoolExecutor | None = None,
    settings: HaloSettings = HaloSettings(),
) -> Halo | None:  # fmt: skip
    """Fit the halo: the median of rings around the light in the registered quantile, bounded by the darkest places.

    The bound excludes ghosts that move with the light: they keep their offset, but do not surround the light.

    Parameters
    ----------
    views, pixels, pool
        As for `register`.
    settings : HaloSettings

    Returns
    -------
    Halo or None
        None when no halo is visible.
    """
    known = register(views, pixels, settings.low, settings.halvings, pool, settings)
    right, up = known.polar()
    radius = np.hypot(right, up)
    seen = map_batched(partial(_measured_pixels, settings=settings), views, pool=pool)
    sector = (
        np.floor(settings.sectors * (np.arctan2(up, right) / (2.0 * np.pi) + 0.5)).astype(np.int64) % settings.sectors
    )
    far, side = float(radius.max()), known.side
    rings, medians, spreads = [], [], []
    for inner, outer in pairwise(np.geomspace(side, far + side, settings.rings + 1)):
        here = (radius >= inner) & (radius < outer) & all_finite(known.picture)
        ring = known.picture[here]
        if len(ring) >= 4:
            rings.append((float(inner), float(outer)))
            medians.append(np.median(ring, axis=0))
            spreads.append(_sector_error(ring, sector[here], settings))
    if len(rings) < 3:
        return None
    middles = [float(np.sqrt(inner * outer)) for inner, outer in rings]
    exponents = _exponents(np.array(middles), np.array(medians), settings)
    levels = [
        np.minimum(median, _darkest(seen, ring, exponent, settings))
        for median, ring, exponent in zip(medians, rings, exponents, strict=True)
    ]
    # errors: differences between sectors, distance from the median to the bound, bias of the low quantile by noise, and
    # the pixel size near the light, where rings are as narrow as pixels
    noise = -NormalDist().inv_cdf(settings.low) * _noise(seen)
    errors = [
        np.sqrt(spread**2 + (median - level) ** 2 + noise**2 + (0.5 * (side / middle) ** 2 * level) ** 2)
        for spread, median, level, middle in zip(spreads, medians, levels, middles, strict=True)
    ]
    if not max(level.max() for level in levels) > 0.0:
        return None
    # extend the level of the outermost ring to the corners
    middles.append(2.0 * far)
    return Halo(
        radius_px=tuple(middles), radiance=tuple(_rgb(level) for level in (*levels, levels[-1])),
        uncertainty=tuple(_rgb(error) for error in (*errors, errors[-1])),
    )  # fmt: skip


def _sector_error(ring: Pixels, sector: Indices, settings: HaloSettings) -> Floats:
    """Return the standard error of a ring's median from the spread of the medians of its sectors, shape (3,)."""
    each = [np.median(ring[sector == k], axis=0) for k in range(settings.sectors) if np.any(sector == k)]
    return _error_of_median(np.array(each))


def _error_of_median(values: Floats) -> Floats:
    """Return the standard error of a median along the first axis from the spread of the values."""
    if len(values) < 2:
        return np.asarray(np.abs(values[0]))
    spread = MAD_TO_SIGMA * np.nanmedian(np.abs(values - np.nanmedian(values, axis=0)), axis=0)
    return np.asarray(np.sqrt(0.5 * np.pi / len(values)) * spread)


@dataclass(frozen=True)
class _MeasuredPixels:
    """Measured pixels of a halved view: distance from the light (N,), radiance and its variance (N, 3)."""

    radius: Floats
    light: Pixels
    variance: Pixels


def _measured_pixels(view: View, settings: HaloSettings) -> _MeasuredPixels:
    """Return the measured pixels of a view, including ghosts."""
    light = halved_pixels(view.measured, settings.halvings)
    variance = halved_pixels(view.variance, settings.halvings, variance=True)
    side = 2.0**-settings.halvings
    at = view.light_px[0] * side, view.light_px[1] * side
    radius = np.hypot(*offsets(at, (light.shape[1], light.shape[0]), side))
    known = all_finite(light) & all_finite(variance)
    return _MeasuredPixels(radius[known], light[known], variance[known])


def _noise(seen: Sequence[_MeasuredPixels]) -> Floats:
    """Return the noise of a halved pixel, shape (3,)."""
    medians = [np.median(one.variance, axis=0) for one in seen if len(one.variance)]
    return np.asarray(np.sqrt(np.median(np.array(medians), axis=0))) if medians else np.zeros(3)


def _exponents(middles: Floats, medians: Floats, settings: HaloSettings) -> Floats:
    """Return the exponent of the fall of light with distance at each ring, shape (R, 3), at least 0."""
    exponents = -np.gradient(np.log(np.maximum(medians, 1e-30)), np.log(middles), axis=0)
    # dark rings do not determine an exponent
    return np.asarray(np.clip(np.where(medians > 0.0, exponents, 0.0), 0.0, settings.most_exponent))


def _darkest(
    seen: Sequence[_MeasuredPixels], ring: tuple[float, float], exponent: Floats, settings: HaloSettings
) -> Floats:
    """Return the level of the darkest pixels of a ring over most views, corrected for noise, shape (3,).

    The fall with distance is divided out first; otherwise the pixels at the outer border would be the darkest.
    """
    found = []
    for one in seen:
        here = (one.radius >= ring[0]) & (one.radius < ring[1])
        if np.count_nonzero(here) >= settings.least_pixels:
            brighter = (one.radius[here, None] / np.sqrt(ring[0] * ring[1])) ** exponent
            noise = np.sqrt(np.median(one.variance[here] * brighter**2, axis=0))
            dark = np.quantile(one.light[here] * brighter, settings.dark_quantile, axis=0)
            found.append(dark + settings.dark_noise_bias * noise)
    if len(found) < 3:
        return np.full(3, np.inf)
    return np.asarray(np.maximum(np.quantile(np.array(found), settings.dark_views, axis=0), 0.0))


def _rgb(level: NDArray[np.floating]) -> Rgb3:
    return max(float(level[0]), 0.0), max(float(level[1]), 0.0), max(float(level[2]), 0.0)


def followed(
    views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask], halo: Halo | None,
    star: Star | None, pool: ThreadPoolExecutor | None = None, settings: GlowSettings = GlowSettings(),
) -> tuple[Halo | None, Star | None]:  # fmt: skip
    """Fit the strength of halo and star at each constellation.

    Parameters
    ----------
    views : sequence of View
        In order of rising constellation.
    pixels : sequence of ndarray, shape (H, W, 3)
        Pictures with the ghosts subtracted; NaN where nothing was measured.
    masks : sequence of ndarray of bool, shape (H, W)
        Pixels to use.
    halo, star : Halo or None, Star or None
    pool : executor, optional
    settings : GlowSettings

    Returns
    -------
    halo, star

    Notes
    -----
    Least squares in every view, with reduced weight for outliers (unknown ghosts). The strength falls with the
    constellation as the rims of the lens shade the image of the light, and with it the glow.
    """
    parts = np.array(
        map_batched(partial(_strengths_in_view, halo, star, settings=settings), views, pixels, masks, pool=pool)
    )
    padded = np.concatenate([parts[:1], parts, parts[-1:]])
    smooth = np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)
    rows = [(view.constellation_deg, *map(float, row)) for view, row in zip(views, smooth, strict=True)]
    return (
        None if halo is None else halo.model_copy(update={
            "strength": tuple((row[0], row[1]) for row in rows), "even": tuple((row[0],
            row[3:6]) for row in rows), }),
        None if star is None else star.model_copy(update={"strength": tuple((row[0], row[2]) for row in rows)}),
    )  # fmt: skip


def _strengths_in_view(
    halo: Halo | None, star: Star | None, view: View, pixels: Pixels, mask: Mask, settings: GlowSettings
) -> Floats:
    """Return the strengths of halo and star, and a uniform red, green and blue, in one view, shape (5,)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    none = np.broadcast_to(0.0, pixels.shape)
    shapes = [none if halo is None else halo_radiance(halo, x, y), none if star is None else star_radiance(star, x, y)]
    known = np.isfinite(pixels) & mask[..., None]
    every = max(1, int(np.sqrt(np.count_nonzero(known) / settings.strength.samples)))
    spots = known[::every, ::every]
    few = [one[::every, ::every][spots] for one in (*shapes, pixels, view.variance)]
    basis = np.concatenate([np.stack(few[:2], axis=1), np.eye(3)[np.nonzero(spots)[2]]], axis=1)
    parts = _strengths(basis, few[2].astype(float), few[3].astype(float), settings.strength)
    glow = np.broadcast_to(parts[2:], pixels.shape).copy()
    for part, shape in zip(parts, shapes, strict=False):
        if part > 0.0:
            glow += part * shape
    return parts * _glow_bound(np.where(known, glow, np.nan), view, settings)


def _glow_bound(glow: Floats, view: View, settings: GlowSettings) -> float:
    """Return the factor, at most 1, that keeps the glow below the pixels of a view; NaN pixels are ignored."""
    light = halved_pixels(glow.astype(np.float32), settings.halo.halvings)
    noise = np.sqrt(halved_pixels(view.variance, settings.halo.halvings, variance=True))
    bright = light > 2.0 * noise
    if np.count_nonzero(bright) < settings.strength.bright_pixels:
        return 1.0
    seen = halved_pixels(view.pixels, settings.halo.halvings)
    parts = (seen[bright] + settings.halo.dark_noise_bias * noise[bright]) / light[bright]
    return min(max(float(np.quantile(parts, settings.halo.dark_quantile)), 0.0), 1.0)


def _strengths(basis: Floats, seen: Floats, variance: Floats, settings: StrengthSettings) -> Floats:
    """Return the factors of a basis, at least 0, by weighted least squares with reduced weight for outliers."""
    scale = basis.max(axis=0, initial=0.0)
    # skip a component that noise hides at full strength: its factor is undetermined
    free = scale > settings.least_signal * np.sqrt(np.median(variance)) if variance.size else scale < 0.0
    if not free.any():
        return np.zeros(scale.size)
    parts = np.where(free, 1.0, 0.0) * (np.arange(scale.size) < 2)
    whole = basis[:, free] / scale[free]
    for _ in range(settings.rounds):
        model = basis @ parts
        # the relative error gives equal fractions of the light equal weight
        spread = np.sqrt(variance + (settings.glow_error * np.maximum(model, seen)) ** 2)
        weight = 1.0 / (spread**2 * (1.0 + ((seen - model) / (2.0 * spread)) ** 2))
        picked, part = free.copy(), whole
        while picked.any():
            weighed = part.T * weight
            solved = np.linalg.lstsq(weighed @ part, weighed @ seen, rcond=1e-9)[0] / scale[picked]
            if (solved >= 0.0).all():
                break
            # drop the most negative component
            picked[np.flatnonzero(picked)[int(np.argmin(solved * scale[picked]))]] = False
            part = basis[:, picked] / scale[picked]
        parts = np.zeros(scale.size)
        if picked.any():
            parts[picked] = solved
    return parts


def fit_star(known: Registered, settings: StarSettings = StarSettings()) -> Star | None:
    """Fit the star: a regular comb of spikes that stand out equally at all distances.

    Parameters
    ----------
    known : Registered
        At full resolution.
    settings : StarSettings

    Returns
    -------
    Star or None
        None when no comb of spikes stands out.
    """
    # NumPy warns about medians of empty rings
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return _fit_star(known, settings)


def _fit_star(known: Registered, settings: StarSettings) -> Star | None:
    (x0, y0), width = known.origin, known.picture.shape[1] // 2
    radii = np.geomspace(settings.inner * width, settings.outer * width, settings.rings)
    angles = 2.0 * np.pi * np.arange(settings.directions) / settings.directions
    columns = np.clip((x0 + radii[:, None] * np.cos(angles)).astype(int), 0, known.picture.shape[1] - 1)
    rows = np.clip((y0 - radii[:, None] * np.sin(angles)).astype(int), 0, known.picture.shape[0] - 1)
    ring = known.picture[rows, columns]
    between = np.nanmedian(ring[..., 1], axis=1)
    if not np.isfinite(between).all() or not between.min() > 0.0:
        return None
    shape = np.nan_to_num(np.nanmedian(ring[..., 1] / between[:, None], axis=0), nan=1.0)
    # limit each ridge and remove wide features, so that one strong ridge or residual ghosts do not look like a comb
    half = round(settings.spike_deg / 360.0 * settings.directions)
    wide = np.median(sliding_window_view(np.pad(shape, half, mode="wrap"), 2 * half + 1), axis=1)
    harmonics = np.fft.rfft(np.clip(shape - wide, 0.0, 1.0))
    strength = np.abs(harmonics[settings.least_spikes : settings.most_spikes + 1])
    # the number of spikes is the lowest strong harmonic
    strong = np.flatnonzero(strength > settings.strong * strength.max()) + settings.least_spikes
    spikes = int(strong[0])
    first = -float(np.angle(harmonics[spikes])) / spikes
    ridges = np.round((first + 2.0 * np.pi * np.arange(spikes) / spikes) / (2.0 * np.pi) * settings.directions).astype(
        int
    )
    near = (ridges[:, None] + np.arange(-2, 3)) % settings.directions
    standing = shape[near].max(axis=1) / np.maximum(wide[ridges % settings.directions], 1e-30)
    if np.quantile(standing, settings.hidden, method="lower") < settings.least_ridge:
        return None
    # the height of the ridges over the light between them; the width follows from the light across them
    tops = np.nanmax(ring[:, near], axis=2)
    low = np.nanmedian(ring, axis=1)
    height = np.nan_to_num(np.nanmedian(tops, axis=1) - low)
    # near the light, spikes fill the gaps between them: the light there is uncertain by this much
    filled = low - np.nanquantile(ring, settings.gap_quantile, axis=1)
    error = np.nan_to_num(np.hypot(_error_of_median(tops.swapaxes(0, 1)), filled), nan=np.inf)
    step = 2.0 * np.pi / settings.directions
    half = max(int(settings.width_part * settings.directions / spikes), 3)
    across = (ridges[:, None] + np.arange(-half, half + 1)) % settings.directions
    light = np.nansum(np.maximum(ring[:, across, 1] - between[:, None, None], 0.0), axis=2)
    widths = np.nanmedian(light, axis=1) * step * radii / np.maximum(height[:, 1], 1e-30) / np.sqrt(2.0 * np.pi)
    # extrapolate the law beyond the picture with its outer slope
    slope = np.log(np.maximum(height[-1], 1e-30) / np.maximum(height[-8], 1e-30)) / np.log(radii[-1] / radii[-8])
    end = 4.0 * width
    beyond = height[-1] * np.exp(np.minimum(slope, -1.0) * np.log(end / radii[-1]))
    radius = (*map(float, radii[::3]), float(radii[-1]), float(end))
    levels = [_rgb(each) for each in (*height[::3], height[-1], beyond)]
    # the relative error beyond is at least that of the last measured radius
    part = np.minimum(error[-1] / np.maximum(height[-1], 1e-30), 1.0)
    errors = [_rgb(np.minimum(each, top)) for each, top in zip(error, height, strict=True)]
    errors = [*errors[::3], errors[-1], _rgb(np.maximum(part, 0.5) * beyond)]
    return Star(
        spikes=spikes, first_deg=float(np.degrees(first)) % (360.0 / spikes),
        width_px=max(float(np.nanmedian(widths)), settings.least_width_px), radius_px=radius, radiance=tuple(levels),
        uncertainty=tuple(errors),
    )  # fmt: skip


def iris_of(star: Star | None, settings: StarSettings = StarSettings()) -> Blades | None:
    """Return the iris that makes a star; None when the star does not determine it.

    Notes
    -----
    Each blade makes two spikes at right angles to its edge; opposite blades of an even number share their spikes. A
    star of 2 n spikes thus has n blades (n odd) or 2 n blades. For 10 or more spikes with odd n, n is assumed, as is
    usual for irises.
    """
    if star is None or star.spikes % 2 or star.spikes < 4:
        return None
    half = star.spikes // 2
    count = half if half % 2 and half >= 5 else star.spikes
    return Blades(count=count, first_deg=star.first_deg) if count <= settings.most_blades else None
