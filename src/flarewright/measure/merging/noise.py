"""Noise of a pixel value (photon, read and quantization noise), and its measurement from photographs.

A value x above black stands for x g electrons. Its variance is x / g + (s / g)^2 + q^2 / 12: photon counts are Poisson
distributed, s is the read noise in electrons, q the step between two values (Janesick, "Photon Transfer", 2007,
chapters 4 and 5).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...model.measurement.capture import CameraNoise
from ...typing import Floats, Mask, Pixels
from .settings import CalibrationSettings

# side of the mean that estimates a pixel's level for its variance; the pixel's own noise enters with one ninth
_SIDE = 3


@dataclass(frozen=True)
class Noise:
    """Variance of a value x above black: `slope` * max(x, 0) + `floor`.

    Attributes
    ----------
    slope : float
        1 / electrons per unit.
    floor : float
        Read and quantization noise, units squared.
    """

    slope: float
    floor: float


# electrons; a file of a simulation may have none
LEAST_READ_NOISE = 0.01


def noise_of(camera: CameraNoise, iso: float, step: float) -> Noise:
    """Return the noise at an ISO.

    Parameters
    ----------
    camera : CameraNoise
        With `electrons_per_unit` and `read_noise`.
    iso : float
        Electrons per unit are proportional to 1 / iso; the read noise in electrons is assumed constant.
    step : float
        Step between two values of the file.

    Raises
    ------
    FlarewrightError
        When the camera's noise is unknown.
    """
    if camera.electrons_per_unit is None or camera.read_noise is None:
        raise FlarewrightError("the camera's noise is unknown; give electrons_per_unit and read_noise in camera.json")
    slope = iso / camera.iso / camera.electrons_per_unit
    # without any noise a dark pixel would have an infinite weight
    return Noise(slope, (max(camera.read_noise, LEAST_READ_NOISE) * slope) ** 2 + step**2 / 12.0)


def smooth(band: NDArray[np.floating], side: int = _SIDE) -> NDArray[np.floating]:
    """Return means over squares of pixels, with the border repeated; the shape is unchanged."""
    half = side // 2
    height, width = band.shape[:2]
    down, along = (np.clip(np.arange(-half, size + half), 0, size - 1) for size in (height, width))
    padded = band.take(down, axis=0).take(along, axis=1)
    rows = np.zeros((height, *padded.shape[1:]), band.dtype)
    for k in range(side):
        rows += padded[k : k + height]
    total = np.zeros(band.shape, band.dtype)
    for k in range(side):
        total += rows[:, k : k + width]
    return total / side**2


@dataclass(frozen=True)
class Transfer:
    """One point of a photon transfer: the spread of differences of readings around one level.

    Attributes
    ----------
    level_weight, floor_weight : float
        The spread is `level_weight` * slope + `floor_weight` * floor.
    spread : float
        Measured variance of the differences, units squared.
    count : int
        Number of differences.
    """

    level_weight: float
    floor_weight: float
    spread: float
    count: int


def transfers(
    first: Pixels, second: Pixels, around: Pixels, ratio: float, free: Mask, samples: float,
    black_noise: float = 0.0, settings: CalibrationSettings = CalibrationSettings(),
) -> list[Transfer]:  # fmt: skip
    """Compare two readings of the same light, in bins of its level.

    Parameters
    ----------
    first, second : ndarray of the same shape
        Values above black; the exposure of `first` is shorter or equal.
    around : ndarray of the same shape
        Means of `second` over neighbours (`level_side`), which sort pixels into bins; the readings themselves would
        sort their noise.
    ratio : float
        Light of `first` over that of `second`, at most 1.
    free : ndarray of bool
        Where neither reading is clipped.
    samples : float
        Number of readings averaged in each value.
    black_noise : float
        Variance of the black image that was subtracted from both, over that of a reading in the dark.
    settings : CalibrationSettings

    Notes
    -----
    d = first - ratio * second has mean 0 and the variance (1 + ratio) u slope + (1 + ratio^2) floor at the level u of
    `first`. Textbooks compare two flats of the same exposure, ratio 1.
    """
    level = (ratio * second[free]).astype(np.float64)
    difference = first[free].astype(np.float64) - level
    if level.size < settings.least_samples:
        return []
    order, count = np.argsort(around[free], kind="stable"), min(settings.bins, level.size // settings.least_samples)
    floors = 1.0 + ratio**2 + (1.0 - ratio) ** 2 * black_noise
    return [
        Transfer((1.0 + ratio) * float(inside.mean()), floors, float(apart.var(ddof=1)) * samples, inside.size)
        for inside, apart in zip(*(np.array_split(each[order], count) for each in (level, difference)), strict=True)
    ]


def fit_transfer(
    points: Sequence[Transfer], camera: CameraNoise, step: float, settings: CalibrationSettings = CalibrationSettings()
) -> CameraNoise:
    """Fit electrons per unit and read noise.

    Parameters
    ----------
    points : sequence of Transfer
    camera : CameraNoise
        Its `iso` is that of the readings; values that it contains are kept.
    step : float
        Step between two values of the file.
    settings : CalibrationSettings

    Returns
    -------
    CameraNoise
        With both numbers and their standard errors.

    Raises
    ------
    FlarewrightError
        When the photographs do not determine the noise.

    Notes
    -----
    Weighted least squares; the variance of a measured variance v of n samples is 2 v^2 / (n - 1), evaluated at the
    fitted v so that low values do not bias the fit.
    """
    usable = [point for point in points if np.isfinite(point.spread) and point.spread > 0.0]
    remedy = "give electrons_per_unit and read_noise in camera.json, or add dark frames"
    if len(usable) < settings.least_bins:
        raise FlarewrightError(f"the photographs do not determine the camera's noise, too few pixels overlap; {remedy}")
    A = np.array([[point.level_weight, point.floor_weight] for point in usable])
    v = np.array([point.spread for point in usable])
    n = np.array([point.count for point in usable], dtype=np.float64)
    fitted, covariance = v, np.eye(2)
    for _ in range(8):
        weight = (n - 1.0) / (2.0 * fitted**2)
        covariance = np.linalg.pinv((A.T * weight) @ A)
        slope, floor = covariance @ (A.T * weight) @ v
        fitted = np.maximum(A @ [slope, floor], 1e-3 * v)
    # scatter beyond that of the counts widens the errors
    covariance = covariance * max(1.0, float(np.mean((v - fitted) ** 2 * (n - 1.0) / (2.0 * fitted**2))))
    if not slope > 0.0:
        raise FlarewrightError(
            "the photographs' noise does not grow with the light: either no light was found in them (was the cap on?), "
            f"or else {remedy}"
        )
    return _as_camera(float(slope), float(floor), covariance, camera, step)


def _as_camera(slope: float, floor: float, covariance: Floats, camera: CameraNoise, step: float) -> CameraNoise:
    gain = 1.0 / slope
    reading = max(floor - step**2 / 12.0, 0.0)
    read_noise = gain * sqrt(reading)
    # s = sqrt(floor - q^2/12) / slope
    by_slope = -read_noise / slope
    by_floor = gain / (2.0 * sqrt(reading)) if reading > 0.0 else 0.0
    gradient = np.array([by_slope, by_floor])
    return camera.replace(
        electrons_per_unit=camera.electrons_per_unit or gain,
        electrons_per_unit_error=None if camera.electrons_per_unit else gain**2 * sqrt(covariance[0, 0]),
        read_noise=read_noise if camera.read_noise is None else camera.read_noise,
        read_noise_error=sqrt(gradient @ covariance @ gradient) if camera.read_noise is None else None,
    )


def common_black(
    pairs: Iterable[tuple[Pixels, Pixels, Pixels, Mask]], settings: CalibrationSettings = CalibrationSettings()
) -> float | None:
    """Find the black level from pairs of exposures of the same light: the common origin of both.

    Parameters
    ----------
    pairs : iterable of (first, second, around, free)
        Values as read, of a shorter and a longer exposure; means of the longer one over neighbours; and where neither
        is clipped.
    settings : CalibrationSettings

    Returns
    -------
    float or None
        None when the pairs do not determine it.

    Notes
    -----
    first = ratio * second + (1 - ratio) * black: slope and intercept of the means of bins of `around`.
    """
    found = []
    for first, second, around, free in pairs:
        x, y = second[free].astype(np.float64), first[free].astype(np.float64)
        if x.size < settings.least_samples * settings.least_bins:
            continue
        order = np.argsort(around[free], kind="stable")
        longer, shorter = (np.array_split(each[order], settings.bins) for each in (x, y))
        bx, by = np.array([one.mean() for one in longer]), np.array([one.mean() for one in shorter])
        error = np.array([max(float(one.std()), 1e-12) / sqrt(one.size) for one in shorter])
        (ratio, start), covariance = np.polyfit(bx, by, 1, w=1.0 / error, cov="unscaled")
        if ratio < 0.9 and np.ptp(bx) > 0.0:
            found.append((start / (1.0 - ratio), covariance[1, 1] / (1.0 - ratio) ** 2))
    if not found:
        return None
    values, variances = np.array(found).T
    return float(np.average(values, weights=1.0 / np.maximum(variances, 1e-12)))
