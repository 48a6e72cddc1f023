"""Mix all colours to one picture for the search, weighted by their noise."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ...typing import Floats, Pixels
from ..core.parallel import map_batched
from ..core.views import View
from ..fitting.detected_ghost import channel_noise

_LEAST_NOISE = 1e-30


def channel_weights(views: Sequence[View]) -> Floats:
    """Return the weights of red, green and blue in the mixture, shape (3,), with sum 1.

    The weights are inverse variances, which maximizes the signal-to-noise ratio of light equal in all colours.
    """
    # noise-free pictures get equal weights
    counts = np.maximum(channel_noise(views).astype(np.float64), _LEAST_NOISE) ** -2.0
    return np.asarray(counts / counts.sum(), dtype=np.float64)


def mix_channels(
    views: Sequence[View],
    cleaned: Sequence[View],
    share: Floats,
    left_behind: float,
    pool: ThreadPoolExecutor | None = None,
) -> list[View]:
    """Return views with the mixture of the colours in every channel, and its variance.

    Parameters
    ----------
    views : sequence of View
        As photographed.
    cleaned : sequence of View
        The same views with the glow subtracted; pixels to ignore have infinite variance.
    share : ndarray, shape (3,)
        Weights of red, green and blue.
    left_behind : float
        Expected error of the subtracted glow, as a fraction of it. It is common to all colours, unlike noise.
    pool : executor, optional
    """

    def one(view: View, clean: View) -> View:
        left = left_behind * mixture(view.pixels - clean.pixels, share)
        noise = np.where(np.isfinite(clean.variance), view.variance, np.inf) @ (share**2).astype(np.float32)
        variance = np.broadcast_to((noise + left**2)[..., None], clean.variance.shape)
        return replace(clean.showing_one(mixture(clean.pixels, share)), variance=variance)

    return map_batched(one, views, cleaned, pool=pool)


def mixture(pixels: Pixels, share: Floats) -> Pixels:
    """Mix the colours of a picture of shape (H, W, 3) to one picture of shape (H, W)."""
    return np.asarray(pixels @ share.astype(np.float32), dtype=np.float32)
