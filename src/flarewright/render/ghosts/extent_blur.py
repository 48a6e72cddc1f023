"""Convolution of a picture with a shape: the extent of a light source, or the spot of a defocused lens."""

from __future__ import annotations

from collections.abc import Iterator
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
MOST_TAPS = 600
# rows that are spread tap by tap at once
BAND_ROWS = 64


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
    rows, columns = (
        slice(side // 2, side // 2 + count) for side, count in zip(kernel.shape, picture.shape, strict=False)
    )
    return _convolved(picture, kernel, (rows, columns), np.empty(picture.shape))


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
    x0, y0, x1, y1 = lit_window(picture)
    part, corner, (rows, columns) = _landing((x1 - x0, y1 - y0), (x0, y0), picture.shape[1::-1], kernel)
    light = np.empty((rows, columns, picture.shape[2]))
    inner = picture.shape[1] - kernel.shape[1] + 1, picture.shape[0] - kernel.shape[0] + 1
    return placed(_convolved(picture[y0:y1, x0:x1], kernel, part, light), corner, inner)


def spread_window(
    light: Pixels, corner: tuple[int, int], size_px: tuple[int, int], kernel: Floats
) -> tuple[Pixels, tuple[int, int]]:
    """As `spread_within`, but take the lit window of a picture, and return only what may hold light.

    Parameters
    ----------
    light : ndarray, shape (h, w, C), float32
    corner : tuple of int
        Column and row of its first pixel in the picture.
    size_px : tuple of int
        Width and height of the picture, W + 2 b and H + 2 a.
    kernel : ndarray, shape (2 a + 1, 2 b + 1)

    Returns
    -------
    light : ndarray, shape (H', W', C), float32
        Empty where there is no light.
    corner : tuple of int
        Column and row of its first pixel.
    """
    _, (left, top), shape = _landing(light.shape[1::-1], corner, size_px, kernel)
    out = np.zeros((*shape, light.shape[2]), dtype=np.float32)
    for band, (_, y) in spread_bands(light, corner, size_px, kernel):
        if len(band) == len(out):
            return band, (left, top)
        out[y - top : y - top + len(band)] = band
    return out, (left, top)


def spread_bands(
    light: Pixels, corner: tuple[int, int], size_px: tuple[int, int], kernel: Floats
) -> Iterator[tuple[Pixels, tuple[int, int]]]:
    """As `spread_window`, but in bands of rows, so that no second picture is in memory.

    Yields
    ------
    light : ndarray, shape (R, W', C), float32
        Of `BAND_ROWS` rows, fewer at the end; of all rows where a Fourier transform spreads them.
    corner : tuple of int
        Column and row of its first pixel.
    """
    (rows, columns), (x, y), (height, width) = _landing(light.shape[1::-1], corner, size_px, kernel)
    if np.count_nonzero(kernel) > MOST_TAPS:
        yield _convolved(light, kernel, (rows, columns), np.empty((height, width, light.shape[2]), np.float32)), (x, y)
        return
    taps = kernel.astype(np.float32)
    for top in range(0, height, BAND_ROWS):
        band = np.zeros((min(BAND_ROWS, height - top), width, light.shape[2]), dtype=np.float32)
        # the rows of which a tap lands in the band
        first = max(rows.start + top - len(taps) + 1, 0)
        near = np.ascontiguousarray(light[first : rows.start + top + len(band)])
        spread_taps(near, taps, rows.start + top - first, columns.start, band)
        yield band, (x, y + top)


def placed(light: _Light, corner: tuple[int, int], size_px: tuple[int, int]) -> _Light:
    """Return a picture of width and height `size_px` with light at a corner, column and row, else dark."""
    whole = np.zeros((size_px[1], size_px[0], light.shape[2]), dtype=light.dtype)
    (x, y), (height, width) = corner, light.shape[:2]
    whole[y : y + height, x : x + width] = light
    return whole


def _landing(
    count: tuple[int, int], corner: tuple[int, int], size_px: tuple[int, int], kernel: Floats
) -> tuple[tuple[slice, slice], tuple[int, int], tuple[int, int]]:
    """Find where light lands when it is spread: columns and rows of a window and of its corner in a picture.

    Returns the rows and columns of the window's whole convolution that lie within the picture without its border, empty
    if there are none; the column and row there of the first of these; and the number of rows and of columns.
    """
    parts, landed = [], []
    for lit, start, side, taps in zip(count, corner, size_px, kernel.shape[::-1], strict=True):
        # the convolution begins at this row or column of the result
        first = start - taps + 1
        low = max(first, 0)
        parts.append(slice(low - first, max(min(start + lit, side - taps + 1), low) - first))
        landed.append(low)
    if 0 in count or any(part.stop <= part.start for part in parts):
        parts, landed = [slice(0, 0)] * 2, [0, 0]
    rows, columns = parts[1], parts[0]
    return (rows, columns), (landed[0], landed[1]), (rows.stop - rows.start, columns.stop - columns.start)


def _convolved(window: NDArray[np.floating], kernel: Floats, part: tuple[slice, slice], out: _Light) -> _Light:
    """Fill `out` with these rows and columns of the whole convolution of a window, by FFT."""
    if not out.size:
        return out
    rows, columns = (fast_size(side + taps - 1) for side, taps in zip(window.shape, kernel.shape, strict=False))
    transfer = np.fft.rfft2(kernel, (rows, columns))
    for c in range(window.shape[2]):
        waves = np.fft.rfft2(window[..., c].astype(np.float64), (rows, columns))
        waves *= transfer
        # only these rows are transformed back along themselves
        kept = np.fft.ifft(waves, axis=0)[part[0]]
        out[..., c] = np.fft.irfft(kept, columns, axis=1)[:, part[1]]
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
