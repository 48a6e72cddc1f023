"""The picture of the target ghosts, prepared for a search that minimises the picture's error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from ...kernels.design.arguments import TargetPicture
from ...kernels.design.picture_search import AREA, DISTANCE, ROUND, draw_picture
from ...typing import Floats, Indices, Mask

# rows, and pixels along the line: for the search, and for its last steps, whose error equals that of 512 x 512 pixels
ROWS, COLUMNS = 48, 192
FINE_ROWS, FINE_COLUMNS = 96, 640
# rows start at these parts of the half diagonal: t (FLAT + (1 - FLAT) t^STEEP) for even steps of t
_FLAT, _STEEP = 0.25, 1.5


@dataclass(frozen=True)
class TargetCanvas:
    """Target pictures on rows of pixels along the line of each light, for `kernels.design.picture_search`.

    Attributes
    ----------
    shown : TargetPicture
        Its `unit` is one over the mean square of the target pictures, so that black pictures cost 1.
    fine : TargetCanvas or None
        The same at a higher resolution.
    """

    shown: TargetPicture
    fine: TargetCanvas | None = None


def canvas(
    targets: Floats,
    spans: Indices,
    directions: Sequence[tuple[float, float]],
    *,
    light: float,
    half_frame: tuple[float, float],
    blades: int,
    drawn: Mask | None = None,
) -> TargetCanvas:
    """Draw the target ghosts.

    Parameters
    ----------
    targets : ndarray, shape (N, >= 2)
        Place on the line and radius, mm.
    spans : ndarray, shape (L + 1,), int64
        Index of each light's first target.
    directions : sequence of (float, float)
        Unit vector from the middle towards each light.
    light : float
        Level of a ghost times its radius, mm.
    half_frame : tuple of float
        Half the picture's width and height, mm.
    blades : int
        Number of corners of a ghost, the first one to the right; 0 is round.
    drawn : ndarray of bool, shape (N,), optional
        Targets to draw; None: all.

    Returns
    -------
    TargetCanvas
        With its finer version.
    """
    fine, coarse = (
        _canvas(targets, spans, directions, light, half_frame, blades, drawn, size)
        for size in ((FINE_ROWS, FINE_COLUMNS), (ROWS, COLUMNS))
    )
    return replace(coarse, fine=fine)


def _canvas(
    targets: Floats, spans: Indices, directions: Sequence[tuple[float, float]], light: float,
    half_frame: tuple[float, float], blades: int, drawn: Mask | None, size: tuple[int, int],
) -> TargetCanvas:  # fmt: skip
    rows, columns = size
    reach = hypot(*half_frame)
    t = np.linspace(-1.0, 1.0, rows + 1)
    borders = reach * t * (_FLAT + (1.0 - _FLAT) * np.abs(t) ** _STEEP)
    middles, widths = 0.5 * (borders[1:] + borders[:-1]), np.diff(borders)
    # keep one empty pixel at either end
    pixel = 2.0 * reach / (columns - 2)
    table = np.empty((rows, 2))
    table[:, DISTANCE], table[:, AREA] = middles, widths * pixel / (4.0 * half_frame[0] * half_frame[1])
    start = -reach - pixel
    edges = np.array([_edges(direction, blades) for direction in directions])
    limits = np.array([(_inside(direction, middles, half_frame) - start) / pixel for direction in directions])
    wanted = np.zeros((len(directions), rows, columns))
    for number in range(len(directions)):
        here = targets[spans[number] : spans[number + 1]]
        sizes = np.abs(here[:, 1])
        shapes = np.full(len(here), ROUND) if blades == 0 else np.where(here[:, 1] > 0.0, 0, 1)
        levels = light / sizes if drawn is None else light / sizes * drawn[spans[number] : spans[number + 1]]
        shown = np.stack([here[:, 0], sizes, levels, shapes], axis=1)
        draw_picture(shown, edges[number], table, limits[number], start, pixel, wanted[number])
    error = float((table[:, AREA, None] * wanted**2).sum())
    return TargetCanvas(TargetPicture(light, 1.0 / max(error, 1e-12), edges, table, limits, start, pixel, wanted))


def _edges(direction: tuple[float, float], blades: int) -> Floats:
    """Return the edges of a polygon of radius 1 whose line is turned to the right, upright and inverted."""
    out = np.empty((2, blades, 2))
    for side, turn in enumerate((0.0, np.pi)):
        normals = (
            turn + 2.0 * np.pi * (np.arange(blades) + 0.5) / max(blades, 1) - np.arctan2(direction[1], direction[0])
        )
        # an edge along the line has no start or end on a row
        cosines = np.cos(normals)
        cosines = np.where(np.abs(cosines) < 1e-6, np.copysign(1e-6, cosines), cosines)
        out[side, :, 0], out[side, :, 1] = np.cos(np.pi / max(blades, 1)) / cosines, np.sin(normals) / cosines
    return out


def _inside(direction: tuple[float, float], distances: Floats, half_frame: tuple[float, float]) -> Floats:
    """Return where rows beside the line enter and leave the frame, shape (V, 2), mm; leave < enter if empty."""
    dx, dy = direction
    low, high = np.full(len(distances), -np.inf), np.full(len(distances), np.inf)
    # a point is (u dx - v dy, u dy + v dx)
    for along, across, half in ((dx, -distances * dy, half_frame[0]), (dy, distances * dx, half_frame[1])):
        if abs(along) < 1e-9:
            outside = np.abs(across) > half
            low, high = np.where(outside, 0.0, low), np.where(outside, 0.0, high)
            continue
        ends = np.sort(np.stack([(-half - across) / along, (half - across) / along]), axis=0)
        low, high = np.maximum(low, ends[0]), np.minimum(high, ends[1])
    return np.stack([low, np.maximum(low, high)], axis=1)
