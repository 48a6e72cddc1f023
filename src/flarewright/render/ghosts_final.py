"""Ghosts, final quality: traced ray bundles on adaptive grids (Hullin et al. 2011).

For every path a pre-pass bounds the accepted pupil, a grid is refined where the map bends, folds or is cut, and each
triangle's flux is spread over its image. Between traced wavelengths the bundles are interpolated, so that lateral
colour runs smoothly instead of in steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from threading import Event

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import draw_bundle, node_densities
from ..kernels.trace import ALIVE, REL, X, Y
from ..model import Quality
from ..optics.bundle import Region, find_region, trace_bundle, trace_grid
from ..optics.paths import LightPath
from .canvas import Canvas
from .shot import Shot

Floats = NDArray[np.float64]

# lateral colour wider than this many pixels between two drawn wavelengths would show as steps
BRIDGE_PX = 2.0
SHIFT_QUANTILE = 0.9
# ghosts fainter than these parts of the picture's mean are drawn at a half and a quarter of the resolution
DETAIL_CONTRAST = (1.5e-2, 4e-3)
# a step of colour fainter than this part of the picture's mean is not seen
STEP_CONTRAST = 2e-3
# never more drawings than this between two traced wavelengths
MOST_BRIDGES = 32


@dataclass(frozen=True)
class FinalPass:
    """A path as one light makes it, found worth drawing.

    Attributes
    ----------
    shot : Shot
    path : LightPath
    region : Region
        Accepted pupil and rough estimates, per unit irradiance.
    """

    shot: Shot
    path: LightPath
    region: Region


def find_final(shot: Shot, path: LightPath) -> FinalPass | None:
    """Look where a path accepts light; None when it passes nothing.

    Parameters
    ----------
    shot : Shot
    path : LightPath

    Returns
    -------
    FinalPass or None
    """
    region = find_region(shot.packed, path, shot.incidence.tilt, shot.opening.radius, shot.view_radius)
    return None if region is None else FinalPass(shot, path, region)


def contrast(item: FinalPass, level: float) -> float:
    """Compare a path's irradiance with the mean of all ghosts in the picture.

    Parameters
    ----------
    item : FinalPass
    level : float
        Mean irradiance of all ghosts in the picture.

    Returns
    -------
    float
    """
    return item.region.brightness * item.shot.light.intensity / level if level > 0.0 else float("inf")


def draw_final(
    item: FinalPass, quality: Quality, canvas: Canvas, visibility: float = float("inf"), stop: Event | None = None
) -> None:
    """Trace one path of one light and add it to a canvas.

    Parameters
    ----------
    item : FinalPass
    quality : Quality
    canvas : Canvas
        Added to.
    visibility : float
        Its `contrast`: what cannot be told from its surroundings needs neither sharp edges nor many wavelengths.
    stop : Event, optional
        Set to leave off between two wavelengths.
    """
    detail = sum(visibility < limit for limit in DETAIL_CONTRAST)
    shot, path = item.shot, item.path
    tilt, opening = shot.incidence.tilt, shot.opening
    to_pixels = shot.to_pixels / 2.0**detail
    scale = float(max(to_pixels[2], to_pixels[3]))
    bundle = trace_grid(
        shot.packed, path, tilt, (opening.radius, opening.inner), item.region,
        tolerance=quality.tolerance_px, scale=scale, view_radius=shot.view_radius,
    )  # fmt: skip
    count = len(shot.packed.wavelengths_nm)
    traced = [trace_bundle(shot.packed, w, bundle, tilt) for w in range(count)]
    pieces = _bridges(traced, shot, scale, visibility) if quality.bridge else [1] * (count - 1)
    steps = [(w, k / n) for w, n in enumerate(pieces) for k in range(n)] + [(count - 1, 0.0)]
    fine_nm = np.interp([w + part for w, part in steps], np.arange(count), shot.packed.wavelengths_nm)
    for (w, part), rgb in zip(steps, shot.weights(fine_nm), strict=True):
        if stop is not None and stop.is_set():
            return
        if rgb.any():
            data = traced[w] if part == 0.0 else _between(traced[w], traced[w + 1], part)
            draw_bundle(
                data, bundle.pupil, bundle.triangles, node_densities(data, bundle.pupil, bundle.triangles),
                path.stop_crossings, opening.blades, opening.mask, opening.half, shot.incidence.axes,
                to_pixels, shot.gain, rgb, *canvas.scratch(detail),
            )  # fmt: skip


def _bridges(traced: list[Floats], shot: Shot, scale: float, visibility: float) -> list[int]:
    """Into how many pieces to divide each gap between traced wavelengths so that no step is seen."""
    most = min(MOST_BRIDGES, max(1, int(visibility / STEP_CONTRAST))) if visibility < float("inf") else MOST_BRIDGES
    pieces = []
    for short, long in pairwise(traced):
        passing = (short[:, ALIVE] * long[:, ALIVE] > 0.0) & (np.minimum(short[:, REL], long[:, REL]) <= 1.0)
        seen = passing & (np.hypot(short[:, X], short[:, Y]) <= shot.view_radius)
        shift = np.hypot(long[seen, X] - short[seen, X], long[seen, Y] - short[seen, Y]) * scale
        # the few nodes that fly farthest carry hardly any light
        wide = float(np.quantile(shift, SHIFT_QUANTILE)) if shift.size else 0.0
        pieces.append(int(np.clip(np.ceil(wide / BRIDGE_PX), 1, most)))
    return pieces


def _between(short: Floats, long: Floats, part: float) -> Floats:
    """Interpolate a bundle between two wavelengths; a ray lives where both live."""
    data = (1.0 - part) * short + part * long
    data[:, ALIVE] = np.minimum(short[:, ALIVE], long[:, ALIVE])
    return data
