"""Which part of the stop a picture shows: where the rays that come into it cross the stop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.trace import ALIVE, STOP_X, X, Y
from ..optics.bundle import Bundle
from ..optics.fresnel import Box
from .path_color import places_of
from .shot import Shot

Floats = NDArray[np.float64]


def seen_in_stop(
    shot: Shot, bundle: Bundle, traced: Sequence[Floats], crossings: int, to_pixels: Sequence[Floats],
    size_px: tuple[int, int],
) -> list[Box | None]:  # fmt: skip
    """Bound the part of the stop that comes into a picture, for each crossing of it.

    Parameters
    ----------
    shot : Shot
    bundle : Bundle
    traced : sequence of ndarray, shape (N, K)
        The bundle's rays at each wavelength.
    crossings : int
        Of the stop.
    to_pixels : sequence of ndarray, shape (4,)
        Where it is drawn, of each wavelength and each order of a grating.
    size_px : tuple of int
        Width and height of the picture.

    Returns
    -------
    list of Box or None
        In the upright frame, mm; None where no triangle touches the picture.
    """
    axes = shot.incidence.axes
    low, high = np.full((crossings, 2), np.inf), np.full((crossings, 2), -np.inf)
    for data in traced:
        live = bundle.triangles[(data[:, ALIVE] > 0.0)[bundle.triangles].all(axis=1)]
        for mirror in (1.0, -1.0)[: bundle.halves]:
            seen = np.zeros(len(live), dtype=np.bool_)
            for place in to_pixels:
                columns, rows = places_of(shot, place, mirror * data[live, X], data[live, Y])
                within = (columns.max(axis=1) >= 0.0) & (columns.min(axis=1) <= size_px[0])
                seen |= within & (rows.max(axis=1) >= 0.0) & (rows.min(axis=1) <= size_px[1])
            nodes = np.unique(live[seen])
            for c in range(crossings if nodes.size else 0):
                stop = data[nodes, STOP_X + 2 * c : STOP_X + 2 * c + 2] * [mirror, 1.0] @ axes
                low[c], high[c] = np.minimum(low[c], stop.min(axis=0)), np.maximum(high[c], stop.max(axis=0))
    return [_box(*ends) if ends[1][0] >= ends[0][0] else None for ends in zip(low, high, strict=True)]


def _box(low: Floats, high: Floats) -> Box:
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
