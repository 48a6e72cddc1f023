"""The part of the stop that is visible in a picture: where rays that land in the picture cross the stop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.tracing.iris_edge import widen_stops
from ...optics.diffraction.fresnel import Box
from ...optics.rays.bundle import Bundle
from ...typing import Floats
from ..scene.path_color import pixel_frame
from ..scene.shot import Shot


def seen_in_stop(
    shot: Shot, bundle: Bundle, traced: Sequence[Floats], crossings: int, to_pixels: Sequence[Floats],
    size_px: tuple[int, int],
) -> list[Box | None]:  # fmt: skip
    """Bound the visible part of the stop for each crossing.

    Parameters
    ----------
    shot : Shot
    bundle : Bundle
    traced : sequence of ndarray, shape (N, K)
        The bundle's rays at each wavelength.
    crossings : int
        Number of crossings.
    to_pixels : sequence of ndarray, shape (4,)
        Positions of the ghost, for each wavelength and each order of a grating.
    size_px : tuple of int
        Width and height of the picture.

    Returns
    -------
    list of Box or None
        In the frame of the upright stop, mm; None where no triangle touches the picture.
    """
    boxes = np.tile([np.inf, -np.inf], (crossings, 2))
    places = np.stack([pixel_frame(shot, place) for place in to_pixels])
    size = np.array(size_px, dtype=np.float64)
    for data in traced:
        for mirror in (1.0, -1.0)[: bundle.halves]:
            widen_stops(data, bundle.triangles, places, size, mirror, shot.incidence.axes, boxes)
    return [((left, right), (low, high)) if right >= left else None for left, right, low, high in boxes.tolist()]
