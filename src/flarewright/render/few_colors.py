"""Faint ghosts in few wavelengths: the shapes of some traced wavelengths, the flux and colour of all of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.trace import ALIVE, REL, WEIGHT
from ..optics.bundle import Bundle, trace_points
from ..optics.pack import PackedLens

Floats = NDArray[np.float64]

# so many rays tell how much more or less a path passes at one wavelength than at another
SAMPLE = 48
# a wavelength that carries less than this part of the brightest cannot stand for its neighbours
LEAST_PART = 0.1

__all__ = ["gathered_weights"]


def gathered_weights(
    packed: PackedLens, bundle: Bundle, tilt: float, weights: Floats, shown: tuple[int, ...]
) -> Floats | None:
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
        The wavelengths that are drawn, rising.

    Returns
    -------
    ndarray, shape (len(shown), 3), or None
        What each drawn wavelength adds in place of its neighbours too. None where they cannot: too few rays pass, or
        the path is dark at one of them.

    Notes
    -----
    A wavelength is split between its neighbours among those shown, linearly, as `optics.spectrum.band_weights` splits
    the spectrum, times what it passes in comparison with them: coatings reflect by wavelength, and a ghost keeps its
    flux in each. The comparison is the mean over the same rays, spread over the bundle.
    """
    passing = np.ones(len(bundle.pupil), dtype=np.bool_)
    for w in shown:
        data = bundle.traced[w]
        passing &= (data[:, ALIVE] > 0.0) & (data[:, REL] <= 1.0)
    where = np.flatnonzero(passing)
    if where.size < SAMPLE // 4:
        return None
    where = where[:: -(-where.size // SAMPLE)]
    count = len(weights)
    flux = np.empty(count)
    for w in range(count):
        held = bundle.traced.get(w)
        rays = trace_points(packed, w, bundle.path, tilt, bundle.pupil[where]) if held is None else held[where]
        flux[w] = float((rays[:, WEIGHT] * rays[:, ALIVE]).sum())
    drawn = flux[list(shown)]
    if not drawn.min() > LEAST_PART * flux.max():
        return None
    hats = np.stack([np.interp(np.arange(count), shown, row) for row in np.eye(len(shown))])
    gathered: Floats = (hats * flux / drawn[:, None]) @ weights
    return gathered
