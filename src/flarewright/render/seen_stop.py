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
    axes, whole = shot.incidence.axes, np.array([(0.0, 0.0), size_px])
    # corner by corner: three long rows are compared many times faster than many rows of three
    corners = np.ascontiguousarray(bundle.triangles.T)
    low, high = np.full((crossings, 2), np.inf), np.full((crossings, 2), -np.inf)
    for data in traced:
        live = corners[:, (data[:, ALIVE] > 0.0)[corners].all(axis=0)]
        for mirror in (1.0, -1.0)[: bundle.halves]:
            seen = np.zeros(live.shape[1], dtype=np.bool_)
            for place in to_pixels:
                columns, rows = places_of(shot, place, mirror * data[live, X], data[live, Y])
                seen |= touching(columns, rows, whole)
            nodes = np.unique(live[:, seen])
            for c in range(crossings if nodes.size else 0):
                stop = data[nodes, STOP_X + 2 * c : STOP_X + 2 * c + 2] * [mirror, 1.0] @ axes
                low[c], high[c] = np.minimum(low[c], stop.min(axis=0)), np.maximum(high[c], stop.max(axis=0))
    return [_box(*ends) if ends[1][0] >= ends[0][0] else None for ends in zip(low, high, strict=True)]


def touching(columns: Floats, rows: Floats, corners_px: Floats) -> NDArray[np.bool_]:
    """Tell which triangles may touch a rectangle, of whose corners, shape (3, T), these are the columns and rows.

    `corners_px` are its upper left and its lower right, shape (2, 2).
    """
    (left, top), (right, bottom) = corners_px
    across = (columns.max(axis=0) >= left) & (columns.min(axis=0) <= right)
    return np.asarray(across & (rows.max(axis=0) >= top) & (rows.min(axis=0) <= bottom))


def _box(low: Floats, high: Floats) -> Box:
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
