"""Go on with what is left where no photograph showed it.

With the light in another direction than it was photographed in, or in a picture of other sides, places are seen that
no photograph showed. Ghosts are drawn there as anywhere. What is left of them does not end where the photographs end:
it goes on outwards from the axis as it is along their border, the smoother the farther.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# pixels beyond the border over which means grow from one pixel to two
_GROWS_PX = 3.0


def shown(
    axis_px: tuple[float, float],
    photographed_px: tuple[float, float, float, float],
    turned_deg: float,
    size_px: tuple[int, int],
) -> Mask:
    """Tell which pixels of a picture photographs show.

    Parameters
    ----------
    axis_px : tuple of float
        In the picture.
    photographed_px : tuple of float
        How far photographs reach from the axis: left, up, right, down; pixels of the picture.
    turned_deg : float
        By how much the picture is turned against them, counterclockwise.
    size_px : tuple of int
        Width and height of the picture.

    Returns
    -------
    ndarray, shape (H, W)
    """
    left, up, right, down = photographed_px
    turn = np.radians(turned_deg)
    dx, dy = np.arange(size_px[0]) + 0.5 - axis_px[0], np.arange(size_px[1])[:, None] + 0.5 - axis_px[1]
    x, y = np.cos(turn) * dx - np.sin(turn) * dy, np.sin(turn) * dx + np.cos(turn) * dy
    return np.asarray((x >= -left) & (x <= right) & (y >= -up) & (y <= down))


def gone_on(light: Floats, known: Mask, axis_px: tuple[float, float]) -> Floats:
    """Return a picture that goes on where it is not known.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3)
    known : ndarray, shape (H, W)
        A convex part of the picture that holds the axis.
    axis_px : tuple of float

    Returns
    -------
    ndarray, shape (H, W, 3)
    """
    if known.all() or not known.any():
        return light
    row, column = np.nonzero(~known)
    down, right = row + 0.5 - float(axis_px[1]), column + 0.5 - float(axis_px[0])
    border, off = _inwards(known, np.asarray(down, np.float64), np.asarray(right, np.float64), axis_px)
    level = np.log2(1.0 + off / _GROWS_PX)
    sums, weights = np.where(known[..., None], light, 0.0), known[..., None].astype(np.float64)
    values = np.zeros((row.size, 3))
    for k in range(int(level.max()) + 2):
        near = np.maximum(1.0 - np.abs(level - k), 0.0)
        here = near > 0.0
        at = (border[:, here] / 2.0**k) - 0.5
        values[here] += near[here, None] * _read(sums, at) / np.maximum(_read(weights, at), 1e-9)
        sums, weights = _halved(sums), _halved(weights)
    out = light.copy()
    out[row, column] = values
    return out


def _inwards(known: Mask, down: Floats, right: Floats, axis_px: tuple[float, float]) -> tuple[Floats, Floats]:
    """Return where the way from each place to the axis meets what is known, (row, column), and how far that is."""
    low, high = np.zeros(down.size), np.ones(down.size)
    for _ in range(12):
        part = 0.5 * (low + high)
        r = np.clip((axis_px[1] + part * down).astype(np.int64), 0, known.shape[0] - 1)
        c = np.clip((axis_px[0] + part * right).astype(np.int64), 0, known.shape[1] - 1)
        inside = known[r, c]
        low, high = np.where(inside, part, low), np.where(inside, high, part)
    return np.stack([axis_px[1] + low * down, axis_px[0] + low * right]), (1.0 - low) * np.hypot(down, right)


def _read(values: Floats, at: Floats) -> Floats:
    """Read between cells' middles, linearly, as at the border beyond it; shape (N, C)."""
    most = np.array(values.shape[:2])[:, None] - 1.0
    at = np.clip(at, 0.0, most)
    low = np.minimum(np.floor(at), np.maximum(most - 1.0, 0.0)).astype(np.int64)
    high = np.minimum(low + 1, most.astype(np.int64))
    part = (at - low)[..., None]
    upper = (1.0 - part[1]) * values[low[0], low[1]] + part[1] * values[low[0], high[1]]
    lower = (1.0 - part[1]) * values[high[0], low[1]] + part[1] * values[high[0], high[1]]
    return np.asarray((1.0 - part[0]) * upper + part[0] * lower)


def _halved(values: Floats) -> Floats:
    """Return means of four cells; beyond the border there is nothing."""
    rows, columns = values.shape[:2]
    even = np.pad(values, ((0, rows % 2), (0, columns % 2), (0, 0)))
    return np.asarray(0.25 * (even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]))
