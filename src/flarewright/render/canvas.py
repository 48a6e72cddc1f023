"""What is drawn on: planes of flux per pixel, and the scratch that drawing needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model import Layer


@dataclass(frozen=True)
class Canvas:
    """A picture being drawn by one worker.

    Attributes
    ----------
    plane : ndarray, shape (3, H, W), float32
        Flux per pixel.
    cover, low, high : ndarray
        Scratch of `kernels.raster.fill_polygon`.
    """

    plane: NDArray[np.float32]
    cover: NDArray[np.float64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]

    @property
    def scratch(self) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """The arrays in the order in which kernels take them."""
        return self.plane, self.cover, self.low, self.high


def blank(size_px: tuple[int, int]) -> Canvas:
    """Return an empty canvas of (width, height) pixels."""
    width, height = size_px
    rows = np.zeros((2, height + 2), dtype=np.int64)
    plane = np.zeros((3, height, width), dtype=np.float32)
    return Canvas(plane, np.zeros((height + 2, width + 3)), rows, rows.copy())


def to_layer(name: str, plane: NDArray[np.float32], pixel_area: float, about: dict[str, str | float]) -> Layer:
    """Crop a plane of flux to what is not black and turn it into irradiance.

    Parameters
    ----------
    name : str
    plane : ndarray, shape (3, H, W), float32
        Flux per pixel.
    pixel_area : float
        mm^2.
    about : dict

    Returns
    -------
    Layer
        Its window is the smallest that holds all light; one black pixel when there is none.
    """
    lit = plane.any(axis=0)
    rows, columns = np.flatnonzero(lit.any(axis=1)), np.flatnonzero(lit.any(axis=0))
    if rows.size == 0:
        return Layer(name, np.zeros((1, 1, 3), dtype=np.float32), (0, 0, 1, 1), about)
    y0, y1, x0, x1 = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    pixels = np.ascontiguousarray(plane[:, y0:y1, x0:x1].transpose(1, 2, 0)) * np.float32(1.0 / pixel_area)
    return Layer(name, pixels, (int(x0), int(y0), int(x1 - x0), int(y1 - y0)), about)
