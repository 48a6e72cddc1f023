"""Visibility of rings inside ghosts: the height of their ripples relative to the surrounding light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kernels.raster.bundle import node_densities
from ...kernels.tracing.iris_edge import largest_part
from ...optics.diffraction.collins import ripple_height
from ...optics.pupil.polygon import points
from ...optics.rays.bundle import Bundle
from ...typing import Floats
from ..scene.path_color import pixel_frame
from .background_level import Surroundings, flux_scale

if TYPE_CHECKING:
    from .diffraction_rings import Rings
    from .final_pass import FinalPass


LEAST_RIPPLE = 0.01
"""Lowest visible ripple relative to the surrounding light: the smallest Weber fraction."""

SCREEN_RIPPLE = 0.06
"""The same on a screen, where rings are lines one or two pixels wide: a few of its 255 codes."""

SPREAD_PART = 1.0 / 3.0
"""Resolution of a pattern for an area light: that of pixels as wide as this part of the light's spread."""

# directions over half a turn in which fringes are compared with their blur
_DIRECTIONS = 64


def ripples_seen(
    item: FinalPass, rings: Rings, bundle: Bundle, around: Surroundings | None, pixel_px: float = 1.0,
    least: float = LEAST_RIPPLE,
) -> bool:  # fmt: skip
    """Return whether any ripple of a ghost's rings is visible.

    Parameters
    ----------
    item : FinalPass
    rings : Rings
    bundle : Bundle
        Traced up to the iris.
    around : Surroundings or None
        Surrounding light; None: the ghost is judged alone.
    pixel_px : float
        Side of the drawn pixels, in pixels of `item`.
    least : float
        Lowest visible ripple relative to the surrounding light.
    """
    height = ripple_height(least_blur(rings.squares_px2, item.source, pixel_px))
    if height < least:
        return False
    return around is None or height * _largest_part(item, rings, bundle, around) >= least


def least_blur(squares_px2: Floats, source: Floats | None, pixel_px: float = 1.0) -> float:
    """Return the smallest ratio of blur to the scale of fringes, sqrt(lambda L / 2), over all directions.

    Parameters
    ----------
    squares_px2 : ndarray, shape (C, 2)
        As in `Rings`.
    source : ndarray, shape (N, 5), or None
        The shape over which an area light spreads each point, pixels.
    pixel_px : float
        Side of the drawn pixels, in pixels of `source`.

    Notes
    -----
    Fringes run along an edge. With the normal (n_x, n_y) in the stop, an edge has lambda L = n_x^2 lambda L_x + n_y^2
    lambda L_y. On the sensor, where its normal (cos t, sin t) is proportional to (n_x / M_x, n_y / M_y), the square of
    its scale is cos^2 t M_x^2 lambda L_x / 2 + sin^2 t M_y^2 lambda L_y / 2. A pixel and a light's spread blur it by
    their widths along that normal.
    """
    turn = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    along = np.stack([np.cos(turn), np.sin(turn)])
    scale = np.sqrt(np.abs(np.asarray(squares_px2) @ along**2).max(axis=0)) * pixel_px
    width = np.full(_DIRECTIONS, pixel_px)
    if source is not None:
        width = np.maximum(width, np.ptp(points(source) @ along, axis=0))
    return float((width / np.maximum(scale, 1e-12)).min())


def blurs(source: Floats | None, pixel_px: float) -> tuple[float, float]:
    """Return the least width, across and down a picture, over which an area light averages fringes.

    Parameters
    ----------
    source, pixel_px
        As in `least_blur`.

    Returns
    -------
    tuple of float
        In pixels, at least 1, rounded down to eighths of an octave so that neighbouring lights share patterns.

    Notes
    -----
    Fringes with their normal at the angle t from the rows are averaged out if they are finer than the spread's width w
    along it, so across the picture if finer than w / |cos t|. With w instead of w times `SPREAD_PART`, ghosts of an
    anamorphic lens have two to fifteen times the error of patterns as fine as pixels; with 1/2 up to four times; with
    `SPREAD_PART` up to twice.
    """
    if source is None:
        return 1.0, 1.0
    turn = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    along = np.stack([np.cos(turn), np.sin(turn)])
    width = np.ptp(points(source) @ along, axis=0) / pixel_px
    least = SPREAD_PART * (width / np.maximum(np.abs(along), 1e-12)).min(axis=1)
    across, down = (2.0 ** (0.125 * np.floor(8.0 * np.log2(np.maximum(least, 1.0))))).tolist()
    return across, down


def _largest_part(item: FinalPass, rings: Rings, bundle: Bundle, around: Surroundings) -> float:
    """Return the largest ratio of a ghost's irradiance at its lit edge to all light there, within the picture."""
    held = sorted(bundle.traced)
    data = bundle.traced[held[len(held) // 2]]
    own = node_densities(data, bundle.pupil, bundle.triangles) * flux_scale(item, bundle, data)
    place, edges = pixel_frame(item.shot, item.to_pixels), rings.edges
    parts = [
        largest_part(data, bundle.triangles, own, rings.ringed, *edges, place, around.corners_px, mirror, around.least)
        for mirror in (1.0, -1.0)[: bundle.halves]
    ]
    return float(max(parts))
