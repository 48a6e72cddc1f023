"""Clamp a replay between two photographs to the range that both show nearby.

Each photograph is drawn by the model. A pixel in between is limited to the darkest and brightest values of both
drawings within the distance that light moves there (`reach`). Renderers of games do the same with the history of
earlier frames: Karis 2014, High-quality temporal supersampling (SIGGRAPH course, Advances in real-time rendering),
"neighborhood clamping". There the neighbourhood is the nearest pixels; here it is learned from photographs.

Next to small bright features the drawing of a photograph is off by a small part of their light, which can exceed the
darker light beside them: single pixels become black. Dark areas narrower than three pixels are therefore filled before
the lower limit is taken, unless no light moves there (closing: Serra 1982, Image analysis and mathematical morphology).
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from ...model.measurement.clamp_ranges import ANYWHERE
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Pixels
from ..core.neighbourhood import brightest, darkest

# half width of a hole to fill, pixels of the model, and the part of the surrounding light to fill it with
_HOLE_PX, _IN_HOLES = 1.0, 0.8


def clamped(
    pixels: Floats, before: Pixels | Floats, after: Pixels | Floats, sprite: Sprite, interval: int, part: float,
    frame: Floats,
) -> Floats:  # fmt: skip
    """Clamp a replay between two photographs to the range that these show.

    Parameters
    ----------
    pixels, before, after : ndarray, shape (H, W, 3)
        The replay, and the replays of the photographs before and after it, with the same roll.
    sprite : Sprite
        Sprite with `reaches`.
    interval : int
        Index of the photograph before.
    part : float
        Relative position between the photographs, 0 to 1; at both ends holes are not filled.
    frame : ndarray, shape (5,)
        Axis, light direction, and picture pixels per model pixel, as `parameter_vector.frame`.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Unchanged beyond the sprite's cells.
    """
    assert sprite.reaches is not None
    reaches = _over_pixels(sprite, interval, frame, pixels.shape[:2])
    light = 4.0 * part * (1.0 - part) * _IN_HOLES
    low = np.minimum(*(np.maximum(one, light * _closed(one, ceil(_HOLE_PX * frame[4]))) for one in (before, after)))
    high = np.maximum(before, after)
    out: Floats = pixels.copy()
    side = sprite.grain_px * float(frame[4])
    grown = 0
    for cells in np.unique(reaches[reaches < ANYWHERE]):
        # inside the interval the nearer photograph is at most half the motion away
        far = ceil(0.5 * side * float(cells))
        # a dilation of a dilation by squares is a dilation by a larger square
        low, high, grown = darkest(low, far - grown), brightest(high, far - grown), far
        here = reaches == cells
        out[here[..., 0]] = np.maximum(out[here[..., 0]], low[here[..., 0]])
        out[here[..., 1]] = np.minimum(out[here[..., 1]], high[here[..., 1]])
    return out


def _over_pixels(sprite: Sprite, interval: int, frame: Floats, size: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return the reaches of each pixel's block, shape (H, W, 2); `ANYWHERE` beyond the cells."""
    assert sprite.reaches is not None
    within = sprite.reaches.within(interval)
    axis_x, axis_y, cosine, sine, scale = frame
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    dx, dy = (x - axis_x) / scale, (y - axis_y) / scale
    side = sprite.grain_px * sprite.reaches.block
    column = np.floor((cosine * dx - sine * dy - sprite.corner_px[0]) / side).astype(np.int64)
    row = np.floor((sine * dx + cosine * dy - sprite.corner_px[1]) / side).astype(np.int64)
    inside = (row >= 0) & (row < within.shape[0]) & (column >= 0) & (column < within.shape[1])
    out = np.full((*size, 2), ANYWHERE, dtype=np.uint8)
    out[inside] = within[row[inside], column[inside]]
    return out


def _closed(pixels: Pixels | Floats, far: int) -> Floats:
    """Fill dark areas of at most `far` pixels half width (morphological closing)."""
    return darkest(brightest(pixels, far), far)
