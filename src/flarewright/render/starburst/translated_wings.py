"""Wings of many starbursts that share one pattern of any shape: drawn once, then shifted to every light.

An atlas holds the pattern's means over pixels around a centre, over the range that any light needs, at several subpixel
offsets. Each light's wings are read from it by linear interpolation, which preserves sums and leaves no dark gaps
beside spikes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernels.diffraction.wings import add_moved
from ...typing import Floats, Indices, Pixels
from .bands import BAND, in_threads
from .pattern import Painter

# a light farther outside the picture, in parts of its side, would make the atlas large and is drawn separately
FAR_PART = 0.5
# subpixel offsets of the atlas per axis
PARTS, DRAFT_PARTS = 2, 1
# largest size of the atlas in memory; a larger one is drawn in pieces
ATLAS_BYTES = 100_000_000


def add_moved_wings(
    total: Pixels, painter: Painter, centres_px: Floats, gains: Floats, windows: Indices,
    pixel_mm: tuple[float, float], *, draft: bool, threads: int | None,
) -> None:  # fmt: skip
    """Add the wings of many starbursts beyond a window around each centre.

    Parameters
    ----------
    total : ndarray of float32, shape (height, width, 3)
        Added to.
    painter : Painter
    centres_px : ndarray, shape (L, 2)
        Columns and rows.
    gains : ndarray, shape (L, 3)
    windows : ndarray, shape (L, 4)
        Pixels around each centre that are drawn elsewhere: first and one past the last column, then rows.
    pixel_mm : tuple of float
    draft : bool
        Use fewer subpixel offsets, which can widen spikes by a fraction of a pixel.
    threads : int or None
        None: all cores. The pixels do not depend on it.
    """
    height, width = total.shape[:2]
    size = np.array([width, height])
    near = np.all((centres_px > -FAR_PART * size) & (centres_px < (1.0 + FAR_PART) * size), axis=1)
    for centre, gain in zip(centres_px[~near], gains[~near], strict=True):
        alone = np.zeros_like(total)
        x_edges, y_edges = (np.arange(side + 1) - at for side, at in zip(size, centre, strict=True))
        painter.paint(x_edges * pixel_mm[0], -y_edges * pixel_mm[1], pixel_mm, alone, threads)
        total += alone * gain.astype(np.float32)
    if not near.any():
        return
    centres, gains, windows = centres_px[near], np.ascontiguousarray(gains[near]), windows[near]
    # range of the atlas in pixels from its centre, with one more for interpolation
    low = np.floor(0.5 - centres.max(axis=0)).astype(int) - 1
    high = np.ceil(size - 0.5 - centres.min(axis=0)).astype(int) + 2
    parts = DRAFT_PARTS if draft else PARTS
    rows = max(2 * BAND, ATLAS_BYTES // (12 * parts**2 * int(high[0] - low[0])))
    for first in range(low[1], high[1], rows):
        # one row more, for interpolation at the last row
        corner = np.array([low[0], first]), np.array([high[0], min(first + rows + 1, high[1])])
        atlas = _draw_atlas(painter, *corner, parts, pixel_mm, threads)

        def band(start: int, atlas: Pixels = atlas, first: int = first) -> None:
            end = min(start + BAND, height)
            add_moved(atlas, first, int(low[0]), rows, centres, gains, windows, start, total[start:end])

        in_threads(band, range(0, height, BAND), threads)


def _draw_atlas(
    painter: Painter, low: NDArray[np.intp], high: NDArray[np.intp], parts: int, pixel_mm: tuple[float, float],
    threads: int | None,
) -> Pixels:  # fmt: skip
    """Draw the pattern between two corners, in pixels from its centre, at every offset; shape (N, N, 3, H, W)."""
    wide, tall = high - low
    atlas = np.empty((parts, parts, 3, tall, wide), dtype=np.float32)
    for y in range(parts):
        for x in range(parts):
            x_edges = (np.arange(wide + 1) + low[0] - 0.5 + x / parts) * pixel_mm[0]
            y_edges = -(np.arange(tall + 1) + low[1] - 0.5 + y / parts) * pixel_mm[1]
            picture = np.zeros((tall, wide, 3), dtype=np.float32)
            painter.paint(x_edges, y_edges, pixel_mm, picture, threads)
            atlas[y, x] = np.moveaxis(picture, 2, 0)
    return atlas
