"""Exposures of one light of which one has far more or less than time and ISO promise: swapped, black or mistold."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..errors import FlarewrightError
from .merge import COMPARE, ROWS, Exposure, smooth_any
from .noise import smooth

# light of an exposure over what time and ISO promise, as far as it is believed: shutters lie by 15 %, lights flicker
_BELIEVED = (0.7, 1.4)
# it is looked for where there is so much light, of full, the most telling first; black is known to a part of full; so
# many numbers must be there, and so large a part of them must agree: hot pixels do not
_TELLING, _BLACK_KNOWN, _FEWEST, _MOST = (0.1, 0.02), 1e-4, 150, 0.75


def refuse_contradiction(exposures: Sequence[Exposure], *, rows: int = ROWS) -> None:
    """Refuse exposures of one light of which one has far more or less than time and ISO promise beside the next.

    Parameters
    ----------
    exposures : sequence of Exposure
        Their `noise` counts only where nothing clips.
    rows : int
        Of a band.

    Raises
    ------
    FlarewrightError
        When two of them contradict each other; it names both.
    """
    for short, long in pairwise(sorted(exposures, key=lambda one: one.seconds)):
        ratio = _contradiction(short, long, rows)
        if ratio is not None:
            raise FlarewrightError(
                f"{short.photo.path} and {long.photo.path.name} contradict the list: the first should have "
                f"{short.seconds / long.seconds:.2g} of the second's light, and has {_times(ratio)} that; check their "
                "exposure_s and iso in captures.csv, that they are not swapped, that the cap was off, and black_level "
                "if you gave it"
            )


def _times(ratio: float) -> str:
    if ratio > 100.0:
        return "more than 100 times"
    return f"{ratio:.2g} times" if ratio > 0.01 else "less than a hundredth of"


def _contradiction(short: Exposure, long: Exposure, rows: int) -> float | None:
    """Return what `short` has over what it should have where that cannot be believed.

    Pixels vote, means of their neighbours each, so that noise need not be known. A clipped number counts as what it is
    at least: it may have too much light, never too little.
    """
    height = short.photo.size_px[1]
    part = short.seconds / long.seconds
    full = long.full if np.isfinite(long.white) else np.percentile(long.read(0, height)[0][::4, ::4], 99.0, axis=(0, 1))
    low, high = _BELIEVED
    # of each level: all numbers that may vote, those for too much or too little, and their light in both exposures
    much, little = np.zeros((len(_TELLING), 4)), np.zeros((len(_TELLING), 4))
    for top in range(0, height, rows):
        (a, a_clipped), (b, b_clipped) = (one.read(top, min(top + rows, height)) for one in (short, long))
        a, b = smooth(a), smooth(b) * part
        a_free, b_free = ~smooth_any(a_clipped), ~smooth_any(b_clipped)
        if np.isfinite(long.white):
            b_free &= b < COMPARE[1] * full * part
            noise = np.zeros(3)
        else:
            noise = 5.0 * np.sqrt(long.variance(b / part))
        for k, level in enumerate(_TELLING):
            lit = np.maximum(a, b / part) > np.maximum(level * full, noise)
            more, less = a > high * b + _BLACK_KNOWN * full, a < low * b - _BLACK_KNOWN * full
            for votes, free, so in ((much, b_free, more), (little, a_free, less)):
                may, yes = lit & free, lit & free & so
                votes[k] += may.sum(), yes.sum(), a[yes].sum(dtype=np.float64), b[yes].sum(dtype=np.float64)
    for count, so, have, expected in np.stack([much, little], axis=1).reshape(-1, 4):
        if count >= _FEWEST and so > _MOST * count:
            return float(max(have, 0.0) / max(expected, 1e-9 * abs(have)))
    return None
