"""Detect exposures whose light contradicts their time and ISO: swapped, black or wrongly listed ones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import log

import numpy as np

from ...errors import FlarewrightError
from .hdr_merge import ROWS, Exposure, smooth_any
from .noise import smooth
from .settings import ExposureSettings

GAMMAS = (1.75, 2.45)
"""Range of the gamma of picture files (1.8, 2.2, that of sRGB)."""


def refuse_contradiction(exposures: Sequence[Exposure], *, settings: ExposureSettings = ExposureSettings()) -> None:
    """Raise when two exposures of the same light contradict their times and ISO.

    Parameters
    ----------
    exposures : sequence of Exposure
        Their `noise` is used only where nothing clips.
    settings : ExposureSettings

    Raises
    ------
    FlarewrightError
        When two of them contradict each other; the message names both.
    """
    for short, long in pairwise(sorted(exposures, key=lambda one: one.seconds)):
        ratio = _contradiction(short, long, settings)
        if ratio is not None and _gamma_encoded(short, long, ratio):
            part = short.seconds / long.seconds
            raise FlarewrightError(
                f"{short.photo.path} and {long.photo.path.name} are not linear: the first has {part:.2g} of the "
                f"second's light and {ratio * part:.2g} of its values, as a gamma curve makes them; develop them as "
                "linear 16-bit TIFF"
            )
        if ratio is not None:
            raise FlarewrightError(
                f"{short.photo.path} and {long.photo.path.name} contradict the list: the first should have "
                f"{short.seconds / long.seconds:.2g} of the second's light, and has {_times(ratio)} that; check their "
                "exposure_s and iso in captures.csv, that they are not swapped, that the cap was off, and black_level "
                "if you gave it"
            )


def _gamma_encoded(short: Exposure, long: Exposure, ratio: float) -> bool:
    """Return whether the values of TIFF files follow a power of the light, as those of pictures for screens do."""
    part = short.seconds / long.seconds
    if short.photo.path.suffix.lower() not in (".tif", ".tiff") or part == 1.0:
        return False
    exponent = log(ratio * part) / log(part) if ratio > 0.0 else 0.0
    return 1.0 / GAMMAS[1] <= exponent <= 1.0 / GAMMAS[0]


def _times(ratio: float) -> str:
    if ratio > 100.0:
        return "more than 100 times"
    return f"{ratio:.2g} times" if ratio > 0.01 else "less than a hundredth of"


def _contradiction(short: Exposure, long: Exposure, settings: ExposureSettings) -> float | None:
    """Return the measured over the expected light of `short` when it is implausible, otherwise None.

    Each pixel, averaged over its neighbours, votes, so that the noise need not be known. A clipped value is a lower
    bound: it can vote for too much light, never for too little.
    """
    height = short.photo.size_px[1]
    part = short.seconds / long.seconds
    full = long.full if np.isfinite(long.white) else np.percentile(long.read(0, height)[0][::4, ::4], 99.0, axis=(0, 1))
    low, high = settings.plausible
    # per level: number of eligible pixels, votes for too much or too little, and their light in both exposures
    much, little = np.zeros((len(settings.vote_levels), 4)), np.zeros((len(settings.vote_levels), 4))
    for top in range(0, height, ROWS):
        (a, a_clipped), (b, b_clipped) = (one.read(top, min(top + ROWS, height)) for one in (short, long))
        a, b = smooth(a), smooth(b) * part
        a_free, b_free = ~smooth_any(a_clipped), ~smooth_any(b_clipped)
        if np.isfinite(long.white):
            b_free &= b < settings.compare[1] * full * part
            noise = np.zeros(3)
        else:
            noise = 5.0 * np.sqrt(long.variance(b / part))
        for k, level in enumerate(settings.vote_levels):
            lit = np.maximum(a, b / part) > np.maximum(level * full, noise)
            more, less = a > high * b + settings.black_error * full, a < low * b - settings.black_error * full
            for votes, free, so in ((much, b_free, more), (little, a_free, less)):
                may, yes = lit & free, lit & free & so
                votes[k] += may.sum(), yes.sum(), a[yes].sum(dtype=np.float64), b[yes].sum(dtype=np.float64)
    for count, so, have, expected in np.stack([much, little], axis=1).reshape(-1, 4):
        if count >= settings.least_votes and so > settings.least_majority * count:
            return float(max(have, 0.0) / max(expected, 1e-9 * abs(have)))
    return None
