"""Faint ghosts in few wavelengths: the shapes of some traced wavelengths, the flux and colour of all of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..kernels.trace import WEIGHT
from ..optics.bundle import Bundle, trace_points
from ..optics.pack import PackedLens
from .path_color import Bools, spread_rays

Floats = NDArray[np.float64]

# so many rays tell how much more or less a path passes at one wavelength than at another
SAMPLE = 48
# a wavelength that carries less than this part of the brightest cannot stand for its neighbours
LEAST_PART = 0.1
# nor can it where more of its rays than this part are not seen at the other
MOST_UNLIKE = 0.25

__all__ = ["gathered_weights"]


def gathered_weights(
    packed: PackedLens,
    bundle: Bundle,
    tilt: float,
    weights: Floats,
    shown: tuple[int, ...],
    seen: Callable[[Floats], Bools],
    *,
    careful: bool = True,
) -> dict[int, Floats] | None:
    """Give the light of all traced wavelengths to a few of them.

    Parameters
    ----------
    packed : PackedLens
    bundle : Bundle
        Traced at the wavelengths `shown`, at least.
    tilt : float
        From `optics.bundle.incidence`.
    weights : ndarray, shape (W, 3)
        What each wavelength adds to each channel.
    shown : tuple of int
        The wavelengths that are drawn where they are bright enough, rising.
    seen : callable
        Tells which traced rays (`optics.bundle.trace_points`) pass and land in the picture.
    careful : bool
        Whether to look where the path is cut and lands at the ends of the spectrum, and to draw all of `shown` or none.

    Returns
    -------
    dict of int to ndarray, shape (3,), or None
        The wavelengths that are drawn, rising, and what each adds in place of its neighbours too: those of `shown` that
        are not dark, or the brightest of all where all of these are. None where they cannot stand for the others: no
        ray is seen, or none carries light; or, for who is careful, the path is dark at one of them, or it is cut
        elsewhere, or lands elsewhere, at the ends of the spectrum.

    Notes
    -----
    A wavelength is split between its neighbours among those drawn, linearly, as `optics.spectrum.band_weights` splits
    the spectrum, times what it passes in comparison with them: coatings reflect by wavelength, and a ghost keeps its
    flux in each. The comparison is the mean over the same rays, spread over the bundle.
    """
    count = len(weights)
    if len(shown) == count:
        return dict(enumerate(weights))
    where = spread_rays(bundle, shown, seen, SAMPLE)
    if where.size == 0 or (careful and not _seen_alike(packed, bundle, tilt, shown, seen)):
        return None
    places, held = bundle.pupil[where], bundle.traced
    rays = np.concatenate([
        held[w][where] if w in held else trace_points(packed, w, bundle.path, tilt, places) for w in range(count)
    ])  # fmt: skip
    flux = np.where(seen(rays), rays[:, WEIGHT], 0.0).reshape(count, -1).sum(axis=1)
    # where a coating quenches a path in the middle of the spectrum, little of its light needs to be there
    least = LEAST_PART * flux.max()
    drawn = tuple(w for w in shown if flux[w] > least) or (int(flux.argmax()),)
    if least == 0.0 or (careful and drawn != shown):
        return None
    gathered = (_hats(count, drawn) * flux / flux[list(drawn), None]) @ weights
    return dict(zip(drawn, gathered, strict=True))


@lru_cache(maxsize=64)
def _hats(count: int, drawn: tuple[int, ...]) -> Floats:
    """Return how wavelengths are split between those that are drawn, shape (len(drawn), count)."""
    return np.stack([np.interp(np.arange(count), drawn, row) for row in np.eye(len(drawn))])


def _seen_alike(
    packed: PackedLens, bundle: Bundle, tilt: float, shown: tuple[int, ...], seen: Callable[[Floats], Bools]
) -> bool:
    """Tell whether the same rays are seen at the ends of the spectrum as at the drawn wavelengths next to them."""
    where = spread_rays(bundle, (), seen, 2 * SAMPLE)
    last = len(packed.wavelengths_nm) - 1
    for end, near in ((0, shown[0]), (last, shown[-1])):
        if end == near:
            continue
        here = seen(bundle.traced[near][where])
        there = seen(trace_points(packed, end, bundle.path, tilt, bundle.pupil[where]))
        if (there != here).sum() > MOST_UNLIKE * max(here.sum(), 1):
            return False
    return True
