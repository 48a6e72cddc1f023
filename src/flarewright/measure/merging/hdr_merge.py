"""Merge the exposures of one constellation in linear light.

Each exposure is weighted by the inverse of its variance. The variance is computed from the mean of the neighbours, not
from the pixel itself: weights that depend on a pixel's noise prefer its low readings, and the result would be too dark.
For the same reason the shorter exposures predict whether an exposure is clipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...io.images.photo import Photo
from ...typing import Floats, Mask, Pixels
from .noise import Noise, smooth
from .settings import ExposureSettings

# rows in memory at a time
ROWS = 128


@dataclass(frozen=True)
class Exposure:
    """One photograph, prepared for merging.

    Attributes
    ----------
    photo : Photo
    seconds : float
        Exposure time at the reference ISO; values above black are proportional to it.
    noise : tuple of Noise
        Noise of red, green and blue.
    black : ndarray, shape (3,) or (height, width, 3), float32
        Black level of red, green and blue, or black image, in the file's units.
    white : float
        Clipping level of the file; infinite when nothing clips.
    response : ndarray, shape (height, width, 3), or None
        Response of each pixel over that of its neighbours; None: uniform.
    """

    photo: Photo
    seconds: float
    noise: tuple[Noise, Noise, Noise]
    black: Pixels
    white: float
    response: Pixels | None = None

    def read(self, low: int, high: int) -> tuple[Pixels, Mask]:
        """Return values above black and the mask of clipped ones, of rows low to high."""
        raw = self.photo.rows(low, high)
        clipped = raw >= self.white
        above = raw - (self.black[low:high] if self.black.ndim == 3 else self.black)
        if self.response is not None:
            above = above / self.response[low:high]
        return above, clipped

    @property
    def full(self) -> Pixels:
        """Clipping level above black of red, green and blue, shape (3,)."""
        full: Pixels = np.float32(self.white) - self.black.reshape(-1, 3).mean(axis=0)
        return full

    def variance(self, units: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the variance of values above black with mean `units`, shape (..., 3)."""
        slope = np.array([one.slope for one in self.noise], np.float32)
        floor = np.array([one.floor for one in self.noise], np.float32)
        found: NDArray[np.floating] = np.maximum(units, 0.0) * slope + floor
        return found


def merge_exposures(
    exposures: Sequence[Exposure], *, rows: int = ROWS, settings: ExposureSettings = ExposureSettings()
) -> tuple[Pixels, Pixels]:
    """Merge the exposures of one constellation, one band of rows at a time.

    Parameters
    ----------
    exposures : sequence of Exposure
        At least one; all of equal size.
    rows : int
        Rows per band; the result does not depend on it.
    settings : ExposureSettings

    Returns
    -------
    radiance, variance : ndarray, shape (height, width, 3), float32
        Values above black per second; the variance is infinite where everything was clipped.
    """
    ordered = sorted(exposures, key=lambda one: one.seconds)
    width, height = ordered[0].photo.size_px
    radiance, variance = np.empty((height, width, 3), np.float32), np.empty((height, width, 3), np.float32)
    # overlap of bands: each exposure uses the neighbours' shorter one, which uses its neighbours, and so on
    halo = len(ordered) + 1
    for low in range(0, height, rows):
        high = min(low + rows, height)
        top, bottom = max(low - halo, 0), min(high + halo, height)
        inside = slice(low - top, high - top)
        found = _merge_band(ordered, [one.read(top, bottom) for one in ordered], settings)
        radiance[low:high], variance[low:high] = found[0][inside], found[1][inside]
    return radiance, variance


def without_idle_digits(radiance: Pixels, variance: Pixels) -> tuple[Pixels, Pixels]:
    """Round away digits below the noise, which makes files less than half as large.

    Parameters
    ----------
    radiance, variance : ndarray, shape (height, width, 3), float32

    Returns
    -------
    radiance, variance : ndarray of the same shape
        Radiance in steps of at most a sixteenth of its standard error, which adds less than 1/3000 to its variance;
        variance to 1 in 500.
    """
    known = np.isfinite(variance) & (variance > 0.0)
    step = np.exp2(np.floor(np.log2(np.sqrt(np.where(known, variance, 1.0)))) - 4.0)
    rounded = np.where(known, np.rint(radiance / step) * step, radiance).astype(np.float32)
    bits = np.ascontiguousarray(variance).view(np.uint32)
    coarse = ((bits + np.uint32(1 << 14)) & np.uint32(0xFFFF8000)).view(np.float32)
    return rounded, np.where(known, coarse, variance).astype(np.float32)


def _merge_band(
    exposures: Sequence[Exposure], readings: Sequence[tuple[Pixels, Mask]], settings: ExposureSettings
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    counts = np.zeros(readings[0][0].shape, np.float64)
    seconds = np.zeros(counts.shape, np.float64)
    usable: list[Mask] = []
    for one, (above, clipped) in zip(exposures, readings, strict=True):
        predicted = smooth(above) if not usable else _level(counts, seconds, above / one.seconds) * one.seconds
        safe = ~clipped & (predicted + settings.safe * np.sqrt(one.variance(predicted)) < one.full)
        counts += np.where(safe, above, 0.0)
        seconds += np.where(safe, one.seconds, 0.0)
        usable.append(safe)
    level = _level(counts, seconds, None)
    total, weights = np.zeros(counts.shape), np.zeros(counts.shape)
    for one, (above, _), safe in zip(exposures, readings, usable, strict=True):
        weight = np.where(safe, one.seconds**2 / one.variance(level * one.seconds), 0.0)
        total += weight * above / one.seconds
        weights += weight
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = 1.0 / weights
        mean = np.where(weights > 0.0, total * variance, _brightest(exposures[0]))
    return mean, variance


def _level(counts: Floats, seconds: Floats, otherwise: NDArray[np.floating] | None) -> NDArray[np.floating]:
    """Return counts per second of each pixel's neighbourhood; where there are none, `otherwise` or 0."""
    total, time = smooth(counts), smooth(seconds)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(time > 0.0, total / time, 0.0 if otherwise is None else smooth(otherwise))


def _brightest(shortest: Exposure) -> Pixels:
    """Return the lower bound of a pixel that was clipped in every exposure; 0 when the clipping level is unknown."""
    full = shortest.full / np.float32(shortest.seconds)
    return np.where(np.isfinite(full), full, 0.0).astype(np.float32)


@dataclass(frozen=True)
class Ratio:
    """Measured light of an exposure over the one expected from time and ISO, relative to the longest exposure."""

    value: float
    error: float


def exposure_ratios(exposures: Sequence[Exposure], *, settings: ExposureSettings = ExposureSettings()) -> list[Ratio]:
    """Compare each exposure with the next longer one where both are well lit.

    Returns
    -------
    list of Ratio
        In the order given. Actual exposure times differ from nominal ones (1/60 s is often 1/64 s), and lights flicker.

    Notes
    -----
    Pixels are selected by the mean of their neighbours in the longer exposure, so that noise does not bias the choice.
    """
    order = sorted(range(len(exposures)), key=lambda k: exposures[k].seconds)
    found = [Ratio(1.0, 0.0)] * len(exposures)
    for k in reversed(range(len(order) - 1)):
        short, long = exposures[order[k]], exposures[order[k + 1]]
        one = _ratio(short, long, settings)
        if one is None or one.error > settings.worst_ratio:
            one = Ratio(1.0, settings.worst_ratio)
        longer = found[order[k + 1]]
        found[order[k]] = Ratio(one.value * longer.value, sqrt(one.error**2 + longer.error**2))
    return found


def _ratio(short: Exposure, long: Exposure, settings: ExposureSettings) -> Ratio | None:
    height = short.photo.size_px[1]
    part = short.seconds / long.seconds
    have = expected = variance = 0.0
    for low in range(0, height, ROWS):
        (a, a_clipped), (b, b_clipped) = (one.read(low, min(low + ROWS, height)) for one in (short, long))
        level = smooth(b)
        chosen = (level > settings.compare[0] * long.full) & (level < settings.compare[1] * long.full)
        if not np.isfinite(long.white):
            chosen = level > 5.0 * np.sqrt(long.variance(level))
        chosen &= ~smooth_any(a_clipped | b_clipped)
        have += float(a[chosen].sum(dtype=np.float64))
        expected += float(b[chosen].sum(dtype=np.float64)) * part
        spread = short.variance(level * part) + part**2 * long.variance(level)
        variance += float(spread[chosen].sum(dtype=np.float64))
    if expected <= 0.0 or have <= 0.0:
        return None
    return Ratio(have / expected, sqrt(variance) / expected)


def refuse_damage(one: Exposure, *, settings: ExposureSettings = ExposureSettings()) -> None:
    """Raise when a photograph has values that no sensor gives, such as a file with a block of zeros.

    Raises
    ------
    FlarewrightError
        When many values are far below black.
    """
    width, height = one.photo.size_px
    if not np.isfinite(one.white):
        return
    least = -np.maximum(settings.far_below * one.full, settings.far_spreads * np.sqrt(one.variance(np.zeros(3))))
    low = sum(int((one.read(top, min(top + ROWS, height))[0] < least).sum()) for top in range(0, height, ROWS))
    if low > settings.dead * 3 * width * height:
        raise FlarewrightError(
            f"{one.photo.path} has numbers far below black over {low / (3 * width * height):.0%} of the picture, which "
            "no sensor gives: copy it again, or correct black_level"
        )


def smooth_any(flags: Mask) -> Mask:
    """Return where a pixel or one of its neighbours is flagged."""
    return np.asarray(smooth(flags.astype(np.float32)) > 0.0)
