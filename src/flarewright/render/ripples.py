"""Which rings inside ghosts can be seen: how high their ripples stand out of the light that they lie in."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import node_densities
from ..kernels.lit_edge import largest_part
from ..optics.border import points
from ..optics.bundle import Bundle
from ..optics.ringing import ripple_height
from .path_color import place_of
from .surroundings import Surroundings, unit

if TYPE_CHECKING:
    from .final_pass import FinalPass
    from .ringing import Rings

Floats = NDArray[np.float64]

LEAST_RIPPLE = 0.01
"""A ripple less high than this part of the light that it lies in is not seen: Weber's fraction at its best."""

SCREEN_RIPPLE = 0.06
"""And of the light on a screen: a few steps of its 255 codes, where rings are a line of a pixel or two."""

# directions in which the width of a light's spread is measured, over half a turn
_DIRECTIONS = 16


def ripples_seen(
    item: FinalPass, rings: Rings, bundle: Bundle, around: Surroundings | None, pixel_px: float = 1.0,
    least: float = LEAST_RIPPLE,
) -> bool:  # fmt: skip
    """Tell whether any ripple of a ghost's rings can be seen.

    Parameters
    ----------
    item : FinalPass
    rings : Rings
    bundle : Bundle
        Traced as far as the iris.
    around : Surroundings or None
        None: the ghost is looked at by itself.
    pixel_px : float
        Side of the pixels that it is drawn on, in those of `item`.
    least : float
        A ripple less high than this part of the light that it lies in is not seen.

    Returns
    -------
    bool
    """
    fringe = rings.widest_px * pixel_px
    height = ripple_height(pixel_px / fringe)
    if item.source is not None:
        height = min(height, ripple_height(narrowest(item.source) / fringe))
    if height < least:
        return False
    return around is None or height * _largest_part(item, rings, bundle, around) >= least


def narrowest(border: Floats) -> float:
    """Return a shape's least width over all directions."""
    turn = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    along = points(border) @ np.stack([np.cos(turn), np.sin(turn)])
    return float(np.ptp(along, axis=0).min())


def _largest_part(item: FinalPass, rings: Rings, bundle: Bundle, around: Surroundings) -> float:
    """Compare a ghost's irradiance at its lit edge with all light there, where it is in the picture."""
    held = sorted(bundle.traced)
    data = bundle.traced[held[len(held) // 2]]
    own = node_densities(data, bundle.pupil, bundle.triangles) * unit(item, bundle, data)
    place, edges = place_of(item.shot, item.to_pixels), rings.edges
    parts = [
        largest_part(data, bundle.triangles, own, rings.ringed, *edges, place, around.corners_px, mirror, around.least)
        for mirror in (1.0, -1.0)[: bundle.halves]
    ]
    return float(max(parts))
