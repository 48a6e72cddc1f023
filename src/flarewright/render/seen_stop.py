"""Which part of the stop a picture shows: where the rays that come into it cross the stop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.lit_edge import widen_stops
from ..optics.bundle import Bundle
from ..optics.fresnel import Box
from .path_color import place_of
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
    boxes = np.tile([np.inf, -np.inf], (crossings, 2))
    places = np.stack([place_of(shot, place) for place in to_pixels])
    size = np.array(size_px, dtype=np.float64)
    for data in traced:
        for mirror in (1.0, -1.0)[: bundle.halves]:
            widen_stops(data, bundle.triangles, places, size, mirror, shot.incidence.axes, boxes)
    return [((left, right), (low, high)) if right >= left else None for left, right, low, high in boxes.tolist()]
