"""All colours as one picture: ghosts are looked for in what every colour tells of them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from .found import noise_of
from .numbers import Floats
from .shared_out import shared_out
from .views import Pixels, View

_LEAST_NOISE = 1e-30


def shares(views: Sequence[View]) -> Floats:
    """Return how much red, green and blue count when they are mixed, shape (3,), summing to 1.

    The less noise a colour has the more it counts, by its variance: of light that stands out alike in all of them such
    a mixture shows most.
    """
    # pictures that are told to be without noise count alike
    counts = np.maximum(noise_of(views).astype(np.float64), _LEAST_NOISE) ** -2.0
    return np.asarray(counts / counts.sum(), dtype=np.float64)


def mixed(
    views: Sequence[View],
    dimmed: Sequence[View],
    share: Floats,
    left_behind: float,
    pool: ThreadPoolExecutor | None = None,
) -> list[View]:
    """Return views that show the mixture of their colours as every colour, as certain as it is.

    Parameters
    ----------
    views : sequence of View
        As photographed.
    dimmed : sequence of View
        Without the light around the light; what shall not count has infinite variance.
    share : ndarray, shape (3,)
        Of red, green and blue.
    left_behind : float
        Part of the light taken off that may stay behind. It does so in all colours alike, where noise is every
        colour's own.
    pool : executor, optional
    """

    def one(view: View, dim: View) -> View:
        left = left_behind * mixture(view.pixels - dim.pixels, share)
        noise = np.where(np.isfinite(dim.variance), view.variance, np.inf) @ (share**2).astype(np.float32)
        variance = np.broadcast_to((noise + left**2)[..., None], dim.variance.shape)
        return replace(dim.showing_one(mixture(dim.pixels, share)), variance=variance)

    return shared_out(one, views, dimmed, pool=pool)


def mixture(pixels: Pixels, share: Floats) -> Pixels:
    """Return a picture of one mixture of colours, shape (H, W), of a picture of shape (H, W, 3)."""
    return np.asarray(pixels @ share.astype(np.float32), dtype=np.float32)
