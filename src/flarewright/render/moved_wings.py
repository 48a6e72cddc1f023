"""Wings of many starbursts of one pattern, whatever shapes it: drawn once, and moved to every light.

A sheet holds the pattern's means over pixels around a centre, as far as any light sees of it, at every part of a pixel.
Each light's wings are the sheet, moved by linear interpolation: nothing gets darker than it is beside a spike, and sums
stay what they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..kernels.many_wings import add_moved
from .starburst import Painter

Floats = NDArray[np.float64]

# rows drawn by one task
BAND = 64
# a light farther beside the picture than this part of it would make the sheet large, and is drawn by itself
BESIDE = 0.5
# parts of a pixel, a side, at which the sheet is drawn
PARTS, DRAFT_PARTS = 2, 1
# of the sheet, so many bytes are held at a time
HELD_BYTES = 100_000_000

__all__ = ["BAND", "add_moved_wings", "each"]


def each(work: Callable[[int], None], items: Iterable[int], threads: int | None) -> None:
    """Do some work for every item on several cores."""
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, items):
            pass


def add_moved_wings(
    total: NDArray[np.float32], painter: Painter, centres_px: Floats, gains: Floats, windows: NDArray[np.int64],
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
        First and one past the last column, then rows, that another fills.
    pixel_mm : tuple of float
    draft : bool
        Spikes may get wider by a fraction of a pixel.
    threads : int or None
        None: all cores; the pixels do not depend on it.
    """
    height, width = total.shape[:2]
    size = np.array([width, height])
    near = np.all((centres_px > -BESIDE * size) & (centres_px < (1.0 + BESIDE) * size), axis=1)
    for centre, gain in zip(centres_px[~near], gains[~near], strict=True):
        alone = np.zeros_like(total)
        x_edges, y_edges = (np.arange(side + 1) - at for side, at in zip(size, centre, strict=True))
        painter.paint(x_edges * pixel_mm[0], -y_edges * pixel_mm[1], pixel_mm, alone, threads)
        total += alone * gain.astype(np.float32)
    if not near.any():
        return
    centres, gains, windows = centres_px[near], np.ascontiguousarray(gains[near]), windows[near]
    # pixels of the sheet from its centre, and one more for neighbours
    low = np.floor(0.5 - centres.max(axis=0)).astype(int) - 1
    high = np.ceil(size - 0.5 - centres.min(axis=0)).astype(int) + 2
    parts = DRAFT_PARTS if draft else PARTS
    rows = max(2 * BAND, HELD_BYTES // (12 * parts**2 * int(high[0] - low[0])))
    for first in range(low[1], high[1], rows):
        # one row more, at which this part's last row looks too
        corner = np.array([low[0], first]), np.array([high[0], min(first + rows + 1, high[1])])
        sheets = _sheets(painter, *corner, parts, pixel_mm, threads)

        def band(start: int, sheets: NDArray[np.float32] = sheets, first: int = first) -> None:
            end = min(start + BAND, height)
            add_moved(sheets, first, int(low[0]), rows, centres, gains, windows, start, total[start:end])

        each(band, range(0, height, BAND), threads)


def _sheets(
    painter: Painter, low: NDArray[np.intp], high: NDArray[np.intp], parts: int, pixel_mm: tuple[float, float],
    threads: int | None,
) -> NDArray[np.float32]:  # fmt: skip
    """Draw the pattern between two corners, pixels from its centre, at every part of a pixel: (N, N, 3, H, W)."""
    wide, tall = high - low
    sheets = np.empty((parts, parts, 3, tall, wide), dtype=np.float32)
    for y in range(parts):
        for x in range(parts):
            x_edges = (np.arange(wide + 1) + low[0] - 0.5 + x / parts) * pixel_mm[0]
            y_edges = -(np.arange(tall + 1) + low[1] - 0.5 + y / parts) * pixel_mm[1]
            sheet = np.zeros((tall, wide, 3), dtype=np.float32)
            painter.paint(x_edges, y_edges, pixel_mm, sheet, threads)
            sheets[y, x] = np.moveaxis(sheet, 2, 0)
    return sheets
