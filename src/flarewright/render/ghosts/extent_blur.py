"""Convolution of a picture with a shape: the extent of a light source, or the spot of a defocused lens."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernels.raster.spread import spread_taps
from ...optics.diffraction.fft_size import fast_size
from ...optics.pupil.polygon import END, START, WEIGHT, mapped, points
from ...typing import Floats, Pixels
from ..image.canvas import lit_window

# kernels of more taps are applied by a Fourier transform
MOST_TAPS = 300


def blur_by_extent(picture: NDArray[np.floating], kernel: Floats) -> Floats:
    """Convolve a picture with a kernel, by FFT.

    Parameters
    ----------
    picture : ndarray, shape (H, W, C)
    kernel : ndarray, shape (2 a + 1, 2 b + 1)

    Returns
    -------
    ndarray, shape (H, W, C)
        Light that lands outside is lost.
    """
    height, width = picture.shape[:2]
    reach = [side // 2 for side in kernel.shape]
    rows, columns = fast_size(height + 2 * reach[0]), fast_size(width + 2 * reach[1])
    transfer = np.fft.rfft2(kernel, (rows, columns))
    out = np.empty(picture.shape)
    for c in range(picture.shape[2]):
        wide = np.fft.irfft2(
            np.fft.rfft2(picture[..., c].astype(np.float64), (rows, columns)) * transfer, (rows, columns)
        )
        out[..., c] = wide[reach[0] : reach[0] + height, reach[1] : reach[1] + width]
    return out


def spread_window(picture: Pixels, kernel: Floats) -> tuple[Pixels, tuple[int, int]]:
    """Convolve a picture that is dark outside a small window, and remove a border as wide as the kernel reaches.

    Parameters
    ----------
    picture : ndarray, shape (H + 2 a, W + 2 b, C), float32
    kernel : ndarray, shape (2 a + 1, 2 b + 1)

    Returns
    -------
    light : ndarray, shape (H', W', C), float32
        The part of the result of H x W pixels that may hold light; empty where there is none.
    corner : tuple of int
        Column and row of its first pixel.
    """
    reach = [side // 2 for side in kernel.shape]
    height, width = picture.shape[0] - 2 * reach[0], picture.shape[1] - 2 * reach[1]
    x0, y0, x1, y1 = lit_window(picture)
    # the convolved window, in the result without border
    left, top = max(x0 - 2 * reach[1], 0), max(y0 - 2 * reach[0], 0)
    right, bottom = min(x1, width), min(y1, height)
    if x1 <= x0 or right <= left or bottom <= top:
        return np.zeros((0, 0, picture.shape[2]), dtype=np.float32), (0, 0)
    window = picture[y0:y1, x0:x1]
    if np.count_nonzero(kernel) > MOST_TAPS:
        wide = np.pad(window, ((reach[0],) * 2, (reach[1],) * 2, (0, 0)))
        spread = blur_by_extent(wide, kernel).astype(np.float32)
        cut_x, cut_y = left - (x0 - 2 * reach[1]), top - (y0 - 2 * reach[0])
        return spread[cut_y : cut_y + bottom - top, cut_x : cut_x + right - left], (left, top)
    light = np.zeros((bottom - top, right - left, picture.shape[2]), dtype=np.float32)
    first = top - (y0 - 2 * reach[0]), left - (x0 - 2 * reach[1])
    spread_taps(np.ascontiguousarray(window, dtype=np.float32), kernel.astype(np.float32), *first, light)
    return light, (left, top)


def spread_within(picture: NDArray[np.floating], kernel: Floats) -> Floats:
    """Convolve a picture that is dark outside a small window, and remove a border as wide as the kernel reaches.

    Parameters
    ----------
    picture : ndarray, shape (H + 2 a, W + 2 b, C)
    kernel : ndarray, shape (2 a + 1, 2 b + 1)

    Returns
    -------
    ndarray, shape (H, W, C)
    """
    reach = [side // 2 for side in kernel.shape]
    height, width = picture.shape[0] - 2 * reach[0], picture.shape[1] - 2 * reach[1]
    out = np.zeros((height, width, picture.shape[2]))
    x0, y0, x1, y1 = lit_window(picture)
    if x1 > x0:
        window = np.pad(picture[y0:y1, x0:x1], ((reach[0],) * 2, (reach[1],) * 2, (0, 0)))
        light = blur_by_extent(window, kernel)
        # corner of the convolved window in the result without border
        left, top = x0 - 2 * reach[1], y0 - 2 * reach[0]
        cut_x, cut_y = max(0, -left), max(0, -top)
        seen = light[cut_y : height - top, cut_x : width - left]
        out[top + cut_y : top + cut_y + seen.shape[0], left + cut_x : left + cut_x + seen.shape[1]] = seen
    return out


def joined_parts(one: Floats, other: Floats) -> Floats:
    """Return the convolution of two kernels.

    Parameters
    ----------
    one, other : ndarray, shapes (2 a + 1, 2 b + 1)

    Returns
    -------
    ndarray
    """
    rows, columns = (one.shape[k] + other.shape[k] - 1 for k in (0, 1))
    size = (fast_size(rows), fast_size(columns))
    both = np.fft.irfft2(np.fft.rfft2(one, size) * np.fft.rfft2(other, size), size)[:rows, :columns]
    return np.asarray(np.maximum(both, 0.0))


def shape_kernel(border: Floats, zoom: float = 1.0) -> Floats:
    """Return the coverage of pixels by a shape, normalized to sum 1.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
        Columns and rows, relative to the centre of the middle pixel (`optics.pupil.polygon`); either orientation.
    zoom : float
        Factor by which the shape is enlarged.

    Returns
    -------
    ndarray, shape (2 a + 1, 2 b + 1)
        Exact coverage. A shape without area (a line or a dot) is widened to a hundredth of a pixel.
    """
    ends = points(border) * zoom
    reach = np.maximum(np.ceil(np.abs(ends).max(axis=0) + 0.5), 1.0).astype(int)
    moved = mapped(border, zoom * np.eye(2), reach + 0.5)
    drawn = np.abs(extent_coverage(moved, (2 * int(reach[1]) + 1, 2 * int(reach[0]) + 1)))
    total = float(drawn.sum())
    if total < 1e-4:
        # practically a line: distribute the light along it
        drawn = np.zeros_like(drawn)
        far = ends[np.argmax((ends**2).sum(axis=1))]
        count = 2 * int(np.ceil(np.abs(far).max())) * 4 + 1
        for part in np.linspace(-1.0, 1.0, count):
            column, row = np.floor(part * far + reach + 0.5).astype(int)
            drawn[row, column] += 1.0
        total = float(drawn.sum())
    return np.asarray(drawn / total)


def extent_coverage(border: Floats, shape: tuple[int, int]) -> Floats:
    """Compute the coverage of each pixel by a shape, signed by the orientation of its border.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
        Columns and rows within the picture (`optics.pupil.polygon`).
    shape : tuple of int
        Rows and columns of the picture.

    Returns
    -------
    ndarray, shape (H, W)

    Notes
    -----
    Green's theorem: each piece of an edge within one pixel adds its height times the width right of it to that pixel,
    and its full height to all pixels further right.
    """
    edge, t = _cuts(border)
    along = border[:, END] - border[:, START]
    places = border[edge, START] + t[:, None] * along[edge]
    same = edge[1:] == edge[:-1]
    x, y = (np.stack([places[:-1, k], places[1:, k]])[:, same] for k in (0, 1))
    height, middle = (y[1] - y[0]) * border[edge[1:][same], WEIGHT], 0.5 * (x[0] + x[1])
    column = np.clip(np.floor(middle).astype(int), 0, shape[1] - 1)
    row = np.clip(np.floor(0.5 * (y[0] + y[1])).astype(int), 0, shape[0] - 1)
    right = np.clip(column + 1.0 - middle, 0.0, 1.0)
    change = np.zeros((shape[0], shape[1] + 1))
    np.add.at(change, (row, column), height * right)
    np.add.at(change, (row, column + 1), height * (1.0 - right))
    return np.asarray(np.cumsum(change, axis=1)[:, : shape[1]])


def _cuts(border: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Return edges and parameters, sorted, of the ends of edges and their crossings of the lines between pixels."""
    number = np.arange(len(border))
    edges, parts = [number, number], [np.zeros(len(border)), np.ones(len(border))]
    for axis in (0, 1):
        a, b = border[:, axis], border[:, 2 + axis]
        first = np.floor(np.minimum(a, b)) + 1.0
        count = np.maximum(np.ceil(np.maximum(a, b)) - first, 0.0).astype(int)
        edge = np.repeat(number, count)
        line = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
        edges.append(edge)
        parts.append((line - a[edge]) / (b[edge] - a[edge]))
    edge, t = np.concatenate(edges), np.concatenate(parts)
    order = np.lexsort((t, edge))
    return edge[order], t[order]
