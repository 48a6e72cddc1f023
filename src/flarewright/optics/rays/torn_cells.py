"""Flux of a bundle's triangles in which some rays fail: miss a surface, or are totally reflected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...kernels.tracing.torn_triangles import cut_torn
from ...typing import Floats
from .bundle import Bundle


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
    rays, places, parts = cut_torn(data, bundle.pupil, bundle.triangles)
    if not len(rays):
        return bundle, data
    whole = replace(
        bundle, pupil=np.concatenate([bundle.pupil, places]), triangles=np.concatenate([bundle.triangles, parts]),
        traced={},
    )  # fmt: skip
    return whole, np.concatenate([data, rays])
