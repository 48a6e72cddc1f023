"""Hold a replay between two photographs to what both show nearby.

Each photograph is drawn as the model has it. A pixel between is no darker than the darkest and no brighter than the
brightest of what both show so near as light goes there (`reach`). It is what renderers of games do with what they carry
over from the picture before: Karis 2014, High-quality temporal supersampling (SIGGRAPH course, Advances in real-time
rendering), "neighborhood clamping"; there the nearest pixels are the neighbourhood, here photographs tell it.

Next to small bright things a drawn photograph is off by a little of their light, which in the dark beside them is all
there is: single pixels of it are black. So what is darker than around for less than three pixels is not taken for
darkness, unless no light comes there from elsewhere (closing: Serra 1982, Image analysis and mathematical morphology).
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.reaches import ANYWHERE
from ..model.sprite import Sprite
from .sprites import Pixels

Floats = NDArray[np.float64]

# pixels of the model to each side of a hole that is too narrow, and the part of what is around that is in it still
_HOLE_PX, _IN_HOLES = 1.0, 0.8


def held(
    pixels: Floats, before: Pixels | Floats, after: Pixels | Floats, sprite: Sprite, interval: int, part: float,
    frame: Floats,
) -> Floats:  # fmt: skip
    """Return a replay between two photographs, held to what these show.

    Parameters
    ----------
    pixels, before, after : ndarray, shape (H, W, 3)
        The replay, and that of the photographs before and after it, with the same roll.
    sprite : Sprite
        That has reaches.
    interval : int
        Index of the photograph before.
    part : float
        Of the way from it to the photograph after it; at both ends holes are left as they are.
    frame : ndarray, shape (5,)
        The axis, the light's direction and pixels of the picture per pixel of the model, as `numbers.frame`.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Beyond the sprite's cells as it was.
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
        # within the interval it is at most half as far from one of both
        far = ceil(0.5 * side * float(cells))
        # a square around squares is a larger square
        low, high, grown = darkest(low, far - grown), brightest(high, far - grown), far
        here = reaches == cells
        out[here[..., 0]] = np.maximum(out[here[..., 0]], low[here[..., 0]])
        out[here[..., 1]] = np.minimum(out[here[..., 1]], high[here[..., 1]])
    return out


def _over_pixels(sprite: Sprite, interval: int, frame: Floats, size: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return the reaches of each pixel's block, shape (H, W, 2); beyond the cells `ANYWHERE`."""
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
    """Fill what is darker than around for no more than so many pixels to each side."""
    return darkest(brightest(pixels, far), far)


def brightest(pixels: Pixels | Floats, far: int) -> Floats:
    """Return the largest value of each colour within a square, so many pixels to each side; the border goes on."""
    return _swept(np.maximum, pixels, far)


def darkest(pixels: Pixels | Floats, far: int) -> Floats:
    """Return the smallest value, as `brightest` does the largest."""
    return _swept(np.minimum, pixels, far)


def _swept(how: Callable[[Any, Any], Any], pixels: Pixels | Floats, far: int) -> Floats:
    """Compare all within a square, along one side after the other; twice as far at each step."""
    if far == 0:
        return np.asarray(pixels)
    out, count = np.asarray(pixels), 2 * far + 1
    for axis in (0, 1):
        out = np.pad(out, [(far, far) if m == axis else (0, 0) for m in range(out.ndim)], mode="edge").swapaxes(0, axis)
        width = 1
        while 2 * width <= count:
            out, width = how(out[:-width], out[width:]), 2 * width
        if count > width:
            out = how(out[: width - count], out[count - width :])
        out = out.swapaxes(0, axis)
    return np.asarray(out)
