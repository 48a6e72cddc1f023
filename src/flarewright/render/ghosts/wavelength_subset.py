"""Faint ghosts at few wavelengths: the shapes of some traced wavelengths with the flux and colour of all."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...kernels.tracing.sequential import WEIGHT
from ...optics.rays.bundle import Bundle, trace_points
from ...optics.rays.pack import PackedLens
from ...typing import Floats
from ..scene.path_color import RayFilter, spread_rays

# number of rays that compare the throughput of a path at different wavelengths
SAMPLE_RAYS = 128
# a wavelength with less than this part of the largest flux cannot stand for its neighbours
LEAST_PART = 0.1
# largest part of rays with different visibility for which a wavelength can stand for another
MOST_UNLIKE = 0.25


def gathered_weights(
    packed: PackedLens,
    bundle: Bundle,
    tilt: float,
    weights: Floats,
    shown: tuple[int, ...],
    seen: Sequence[RayFilter],
    *,
    careful: bool = True,
) -> dict[int, Floats] | None:
    """Assign the light of all traced wavelengths to a few of them.

    Parameters
    ----------
    packed : PackedLens
    bundle : Bundle
        Traced at least at the wavelengths `shown`.
    tilt : float
        From `optics.rays.bundle.incidence`.
    weights : ndarray, shape (W, 3)
        Weight of each wavelength in each channel.
    shown : tuple of int
        The wavelengths to draw where bright enough, rising.
    seen : sequence of callable
        For each half of the bundle, a mask of the traced rays that pass and land in the picture (`visible_rays`).
    careful : bool
        Whether to compare the cut and position of the path at the ends of the spectrum, and to draw all of `shown` or
        none.

    Returns
    -------
    dict of int to ndarray, shape (3,), or None
        The drawn wavelengths, rising, with weights that include those of their neighbours: the bright ones of `shown`,
        or the brightest of all where these are dark. None where they cannot stand for the others: no ray is visible or
        carries light; or, with `careful`, the path is dark at one of them, or its cut or position differs at the ends
        of the spectrum.

    Notes
    -----
    The weight of a wavelength is split linearly between the drawn neighbours, as in
    `optics.colour.spectrum.band_weights`, times the ratio of its flux to theirs: coatings reflect by wavelength, and a
    ghost keeps its flux at each. The ratio is a mean over the same rays, spread over the bundle.
    """
    count = len(weights)
    if len(shown) == count:
        return dict(enumerate(weights))
    where, half = spread_rays(bundle, shown, seen, SAMPLE_RAYS)
    if where.size == 0 or (careful and not _seen_alike(packed, bundle, tilt, shown, seen)):
        return None
    places, held = bundle.pupil[where], bundle.traced
    rays = np.concatenate([
        held[w][where] if w in held else trace_points(packed, w, bundle.path, tilt, places) for w in range(count)
    ])  # fmt: skip
    passing = np.stack([one(rays) for one in seen])[np.tile(half, count), np.arange(len(rays))]
    flux = (passing * rays[:, WEIGHT]).reshape(count, -1).sum(axis=1)
    # a coating can make a path dark at a wavelength; there is little light to redistribute then
    least = LEAST_PART * flux.max()
    drawn = tuple(w for w in shown if flux[w] > least) or (int(flux.argmax()),)
    if least == 0.0 or (careful and drawn != shown):
        return None
    gathered = (_hats(count, drawn) * flux / flux[list(drawn), None]) @ weights
    return dict(zip(drawn, gathered, strict=True))


@lru_cache(maxsize=64)
def _hats(count: int, drawn: tuple[int, ...]) -> Floats:
    """Return how wavelengths are split between the drawn ones, shape (len(drawn), count)."""
    return np.stack([np.interp(np.arange(count), drawn, row) for row in np.eye(len(drawn))])


def _seen_alike(
    packed: PackedLens, bundle: Bundle, tilt: float, shown: tuple[int, ...], seen: Sequence[RayFilter]
) -> bool:
    """Return whether the same rays are visible at the ends of the spectrum as at the nearest drawn wavelengths."""
    where, _ = spread_rays(bundle, (), seen, 2 * SAMPLE_RAYS)
    last = len(packed.wavelengths_nm) - 1
    for end, near in ((0, shown[0]), (last, shown[-1])):
        if end == near:
            continue
        rays = bundle.traced[near][where], trace_points(packed, end, bundle.path, tilt, bundle.pupil[where])
        here, there = (np.concatenate([one(at) for one in seen]) for at in rays)
        if (there != here).sum() > MOST_UNLIKE * max(int(here.sum()), 1):
            return False
    return True
