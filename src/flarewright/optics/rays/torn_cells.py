"""Flux of a bundle's triangles in which some rays fail: miss a surface, or are totally reflected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...kernels.tracing.sequential import ALIVE, WEIGHT
from ...kernels.tracing.torn_triangles import find_torn
from ...typing import Floats, Indices, Mask
from .bundle import Bundle

# fraction of a cell's squared size: passing rays that span less lie on a line
_COLLINEAR_AREA = 1e-6


def cut_failed_triangles(bundle: Bundle, data: Floats) -> tuple[Bundle, Floats]:
    """Cut triangles with failed rays halfway between passing and failed rays, instead of leaving them dark.

    Parameters
    ----------
    bundle : Bundle
    data : ndarray, shape (N, 5 + 2 C)
        Its nodes traced at one wavelength.

    Returns
    -------
    bundle : Bundle
        With the passing parts of cut triangles added, for this wavelength only; it holds no traced nodes.
    data : ndarray, shape (M, 5 + 2 C)
        Of all its nodes. Values on the cuts are extrapolated linearly within the cell.

    Notes
    -----
    Failure has no smooth measure, unlike a rim, that could place the cut. Along a border that crosses cells at random,
    cuts at the middles of edges add as much area as they lose.
    """
    torn = find_torn(data, bundle.triangles)
    if not len(torn):
        return bundle, data
    alive = data[:, ALIVE] > 0.0
    slopes = _slopes(bundle, data, alive, torn)
    passing = alive[bundle.triangles[torn]]
    # rotate until the first ray passes and the last one fails
    turn = np.argmax(passing & ~np.roll(passing, 1, axis=1), axis=1)
    a, b, c = (bundle.triangles[torn, (turn + k) % 3] for k in range(3))
    two = passing.sum(axis=1) == 2
    ends, begins = np.concatenate([np.where(two, c, b), c]), np.concatenate([np.where(two, b, a), a])
    step = 0.5 * (bundle.pupil[ends] - bundle.pupil[begins])
    more = data[begins] + np.einsum("nk,nkm->nm", step, np.concatenate([slopes, slopes]))
    more[:, WEIGHT] = np.maximum(more[:, WEIGHT], 0.0)
    more[:, ALIVE] = 1.0
    cuts = len(data) + np.arange(len(torn))
    parts = [np.stack([a, cuts, cuts + len(torn)], axis=1), np.stack([a, b, cuts], axis=1)[two]]
    whole = replace(
        bundle, pupil=np.concatenate([bundle.pupil, bundle.pupil[begins] + step]),
        triangles=np.concatenate([bundle.triangles, *parts]), traced={},
    )  # fmt: skip
    return whole, np.concatenate([data, more])


def _slopes(bundle: Bundle, data: Floats, alive: Mask, torn: Indices) -> Floats:
    """Fit planes to the data of passing rays, in the cells of cut triangles: (len(torn), 2, 5 + 2 C).

    The triangles of a cell are consecutive and share its centre; flat where the passing rays lie on a line.
    """
    middles = bundle.triangles[:, 0]
    cell = np.cumsum(np.append(0, middles[1:] != middles[:-1]))
    cells, own = np.unique(cell[torn], return_inverse=True)
    begins = np.searchsorted(cell, cells)
    sizes = np.searchsorted(cell, cells, side="right") - begins
    # each centre, then its border
    starts = np.append(0, np.cumsum(sizes + 1)[:-1])
    of = np.repeat(np.arange(len(cells)), sizes + 1)
    rank = np.arange(len(of)) - starts[of]
    fan = begins[of] + np.maximum(rank - 1, 0)
    nodes = np.where(rank == 0, middles[fan], bundle.triangles[fan, 1])
    passes = alive[nodes][:, None]
    at = np.where(passes, bundle.pupil[nodes] - bundle.pupil[middles[fan]], 0.0)
    at = np.where(passes, at - (np.add.reduceat(at, starts) / np.add.reduceat(passes, starts, dtype=float))[of], 0.0)
    spp, spq, sqq = np.add.reduceat(np.stack([at[:, 0] ** 2, at[:, 0] * at[:, 1], at[:, 1] ** 2], axis=1), starts).T
    determinant = spp * sqq - spq**2
    line = determinant <= _COLLINEAR_AREA * (spp + sqq) ** 2
    inverse = np.array([[sqq, -spq], [-spq, spp]]) / np.where(line, np.inf, determinant)
    sums = np.add.reduceat(at[:, :, None] * np.where(passes, data[nodes], 0.0)[:, None, :], starts)
    return np.asarray(np.einsum("ijn,njm->nim", inverse, sums)[own])
