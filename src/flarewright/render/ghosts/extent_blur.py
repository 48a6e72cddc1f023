"""Convolution of a picture with a shape: the extent of a light source, or the spot of a defocused lens."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...kernels.raster.spread import spread_taps
from ...optics.diffraction.fft_size import fast_size
from ...optics.pupil.polygon import END, START, WEIGHT, mapped, points
from ...typing import Floats, Pixels
from ..image.canvas import lit_window

_Light = TypeVar("_Light", Pixels, Floats)

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
    lit, seen, corner = _landing(picture, kernel)
    rows, columns = picture.shape[0] - kernel.shape[0] + 1, picture.shape[1] - kernel.shape[1] + 1
    return placed(_transformed(picture[lit], kernel, seen), corner, (columns, rows))


def spread_window(picture: Pixels, kernel: Floats) -> tuple[Pixels, tuple[int, int]]:
    """As `spread_within`, but return only the part of the result that may hold light.

    Parameters
    ----------
    picture : ndarray, shape (H + 2 a, W + 2 b, C), float32
    kernel : ndarray, shape (2 a + 1, 2 b + 1)

    Returns
    -------
    light : ndarray, shape (H', W', C), float32
        Empty where there is no light.
    corner : tuple of int
        Column and row of its first pixel.
    """
    lit, seen, corner = _landing(picture, kernel)
    if np.count_nonzero(kernel) > MOST_TAPS:
        return _transformed(picture[lit], kernel, seen).astype(np.float32), corner
    rows, columns = seen
    light = np.zeros((rows.stop - rows.start, columns.stop - columns.start, picture.shape[2]), dtype=np.float32)
    window = np.ascontiguousarray(picture[lit], dtype=np.float32)
    spread_taps(window, kernel.astype(np.float32), rows.start, columns.start, light)
    return light, corner


def placed(light: _Light, corner: tuple[int, int], size_px: tuple[int, int]) -> _Light:
    """Return a picture of width and height `size_px` with light at a corner, column and row, else dark."""
    whole = np.zeros((size_px[1], size_px[0], light.shape[2]), dtype=light.dtype)
    (x, y), (height, width) = corner, light.shape[:2]
    whole[y : y + height, x : x + width] = light
    return whole


def _landing(
    picture: NDArray[np.floating], kernel: Floats
) -> tuple[tuple[slice, slice], tuple[slice, slice], tuple[int, int]]:
    """Find where the light of a picture lands when it is spread.

    Returns rows and columns of the picture with light; the rows and columns of their whole convolution that lie within
    the picture without its border, empty if there are none; and the column and row there of the first of these.
    """
    x0, y0, x1, y1 = lit_window(picture)
    seen, corner = [], []
    for start, end, side, taps in zip((y0, x0), (y1, x1), picture.shape, kernel.shape, strict=False):
        # the convolution begins at this row or column of the result
        first = start - taps + 1
        low = max(first, 0)
        seen.append(slice(low - first, max(min(end, side - taps + 1), low) - first))
        corner.append(low)
    if x1 <= x0 or any(part.stop <= part.start for part in seen):
        seen, corner = [slice(0, 0)] * 2, [0, 0]
    return (slice(y0, y1), slice(x0, x1)), (seen[0], seen[1]), (corner[1], corner[0])


def _transformed(window: NDArray[np.floating], kernel: Floats, seen: tuple[slice, slice]) -> Floats:
    """Return a part of the whole convolution of a window, by FFT."""
    if seen[0].stop <= seen[0].start:
        return np.zeros((0, 0, window.shape[2]))
    around = [(side // 2,) * 2 for side in kernel.shape]
    return blur_by_extent(np.pad(window, (*around, (0, 0))), kernel)[seen]


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
