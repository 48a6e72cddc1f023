"""Canvases: planes of flux per pixel at several resolutions, and their conversion to layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.raster.plane_memory import black_picture
from ...kernels.raster.polygons import BLOCK, blank_plane
from ...kernels.raster.pyramid import add_doubled, collect
from ...model import Layer
from ...typing import Floats, Mask, Pixels

Plane = Pixels | Floats

# a canvas holds planes at full, half and quarter resolution
DETAILS = 3
# rows of a picture that are tested, or copied, together
_STRIP = 32
# contrasts below which ghosts are drawn at half and at quarter resolution
DETAIL_CONTRAST = (1.5e-2, 4e-3)


@dataclass(frozen=True)
class Patch:
    """A part of a picture in full resolution.

    Attributes
    ----------
    pixels : ndarray, shape (H, W, 3)
        Flux per pixel.
    corner : tuple of int
        Column and row of its first pixel.
    """

    pixels: Plane
    corner: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class Canvas:
    """A picture that one worker draws.

    Attributes
    ----------
    size_px : tuple of int
    planes : list of ndarray or None
        Flux per pixel in blocks (`kernels.raster.polygons.blank_plane`) at full, half and quarter resolution; created
        on first use.
    """

    size_px: tuple[int, int]
    planes: list[Plane | None]

    def size(self, detail: int) -> tuple[int, int]:
        """Return width and height after `detail` halvings of the resolution."""
        width, height = (-(-side // 2**detail) for side in self.size_px)
        return width, height

    def plane(self, detail: int = 0) -> Plane:
        """Return the plane after `detail` halvings of the resolution, created if missing."""
        plane = self.planes[detail]
        if plane is None:
            plane = self.planes[detail] = blank_plane(*self.size(detail))
        return plane

    def add(self, pixels: Plane, detail: int = 0, corner: tuple[int, int] = (0, 0)) -> None:
        """Add a picture, flux per pixel, to the plane whose resolution is halved `detail` times.

        Parameters
        ----------
        pixels : ndarray, shape (H, W, 3)
            Lies within the plane.
        detail : int
        corner : tuple of int
            Column and row of its first pixel.
        """
        (x, y), (height, width) = corner, pixels.shape[:2]
        if not pixels.size:
            return
        first, last = x // BLOCK, -(-(x + width) // BLOCK)
        window = self.plane(detail)[y : y + height, first:last]
        # in bands of rows: a padded copy of the whole picture would be large
        for top in range(0, height, _STRIP):
            band = pixels[top : top + _STRIP]
            padded = np.zeros((len(band), (last - first) * BLOCK, 3), dtype=pixels.dtype)
            padded[:, x - first * BLOCK : x - first * BLOCK + width] = band
            window[top : top + _STRIP] += np.moveaxis(padded.reshape(len(band), last - first, BLOCK, 3), 3, 2)


def merge(planes: Sequence[Plane | None], size_px: tuple[int, int]) -> Plane:
    """Add the planes of all resolutions at full resolution.

    Parameters
    ----------
    planes : sequence of ndarray or None
        As `Canvas.planes`, or pictures of shape (H, W, 3).
    size_px : tuple of int
        Width and height.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Flux per pixel; black if there are no planes.
    """
    if planes[0] is not None and planes[0].ndim == 3 and all(plane is None for plane in planes[1:]):
        return planes[0]
    total: Pixels | None = None
    for detail in reversed(range(len(planes))):
        width, height = (-(-side // 2**detail) for side in size_px)
        plane, coarse = planes[detail], total
        if plane is None and coarse is None:
            continue
        total = black_picture(width, height)
        if plane is not None and plane.ndim == 3:
            total += plane
        elif plane is not None:
            collect(plane, total)
        if coarse is not None:
            add_doubled(coarse, total)
    return black_picture(*size_px) if total is None else total


def blank(size_px: tuple[int, int]) -> Canvas:
    """Return an empty canvas of (width, height) pixels."""
    return Canvas(size_px, [None] * DETAILS)


def to_layer(name: str, patch: Patch, divisor: float, about: dict[str, str | float], *, reuse: bool = False) -> Layer:
    """Crop a picture to its lit window and convert it to irradiance.

    Parameters
    ----------
    name : str
    patch : Patch
    divisor : float
        Of flux per pixel the area of a pixel, mm^2; of irradiance 1.
    about : dict
    reuse : bool
        Allow the layer to take over the memory of the patch.

    Returns
    -------
    Layer
        Its window is the smallest that contains all light; one black pixel if there is none.
    """
    pixels, (left, top) = patch.pixels, patch.corner
    x0, y0, x1, y1 = lit_window(pixels)
    if x1 <= x0:
        return Layer(name, np.zeros((1, 1, 3), dtype=np.float32), (0, 0, 1, 1), about)
    shape = (y1 - y0, x1 - x0, 3)
    reused = reuse and pixels.shape == shape and pixels.dtype == np.float32
    irradiance = pixels.astype(np.float32, copy=False) if reused else np.empty(shape, dtype=np.float32)
    if divisor != 1.0 or not reused:
        np.multiply(pixels[y0:y1, x0:x1], 1.0 / divisor, out=irradiance, casting="same_kind")
    return Layer(name, irradiance, (left + x0, top + y0, x1 - x0, y1 - y0), about)


def lit_window(pixels: Plane) -> tuple[int, int, int, int]:
    """Return the bounds x0, y0, x1, y1 of the light in a picture of shape (H, W, 3); all 0 if it is black."""
    # most pictures are lit everywhere
    if pixels.size > 0 and all(side.any() for side in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1])):
        return 0, 0, pixels.shape[1], len(pixels)
    starts = range(0, len(pixels), _STRIP)
    first = next((start for start in starts if pixels[start : start + _STRIP].any()), None)
    if first is None:
        return 0, 0, 0, 0
    # search from both ends, which reads only a few rows
    last = next(start for start in reversed(starts) if pixels[start : start + _STRIP].any())
    rows = [start + np.flatnonzero(_lit(pixels[start : start + _STRIP], 1)) for start in (first, last)]
    y0, y1 = int(rows[0][0]), int(rows[1][-1]) + 1
    if pixels[y0:y1, 0].any() and pixels[y0:y1, -1].any():
        return 0, y0, pixels.shape[1], y1
    columns = np.flatnonzero(_lit(pixels[y0:y1], 0).reshape(-1, pixels.shape[2]).any(axis=1))
    return int(columns[0]), y0, int(columns[-1]) + 1, y1


def _lit(pixels: Plane, axis: int) -> Mask:
    """Return which rows (axis 1) or channels of columns (axis 0) hold light; comparing is faster than casting."""
    return np.asarray((pixels.reshape(len(pixels), -1) != 0.0).any(axis=axis))
