"""What is drawn on: planes of flux per pixel, and the scratch that drawing needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.interleave import interleave, lit_window
from ..model import Layer

Plane = NDArray[np.float32] | NDArray[np.float64]

# a canvas can also hold light at half and at a quarter of the resolution
DETAILS = 3


@dataclass(frozen=True)
class Canvas:
    """A picture being drawn by one worker.

    Attributes
    ----------
    size_px : tuple of int
    planes : list of ndarray or None
        Flux per pixel, shape (3, H, W), float32: at full resolution, at half and at a quarter; made when first used.
    strip : ndarray
        Scratch of `kernels.raster.fill_polygon`.
    """

    size_px: tuple[int, int]
    planes: list[Plane | None]
    strip: NDArray[np.float32]

    def scratch(self, detail: int = 0) -> tuple[Plane, NDArray[np.float32]]:
        """Return plane and scratch in the order in which kernels take them; `detail` halves the resolution."""
        plane = self.planes[detail]
        if plane is None:
            width, height = (-(-side // 2**detail) for side in self.size_px)
            plane = self.planes[detail] = np.zeros((3, height, width), dtype=np.float32)
        return plane, self.strip


def merge(planes: Sequence[Plane | None], size_px: tuple[int, int]) -> Plane:
    """Bring the light of all resolutions to full resolution.

    Parameters
    ----------
    planes : sequence of ndarray or None
        As `Canvas.planes`.
    size_px : tuple of int
        Width and height.

    Returns
    -------
    ndarray, shape (3, H, W)
        Flux per pixel; black when nothing was drawn.
    """
    width, height = size_px
    total = planes[0]
    if total is None:
        total = np.zeros((3, height, width), dtype=np.float32)
    for detail, plane in enumerate(planes):
        if detail > 0 and plane is not None:
            fine = plane
            for _ in range(detail):
                fine = _double(_double(fine, 1), 2)
            total = total + fine[:, :height, :width]
    return total


def _double(plane: Plane, axis: int) -> NDArray[np.float32]:
    """Double the resolution along an axis by linear interpolation of irradiance; the flux stays."""
    plane = np.moveaxis(plane, axis, -1)
    padded = np.concatenate([plane[..., :1], plane, plane[..., -1:]], axis=-1)
    fine = np.empty((*plane.shape[:-1], 2 * plane.shape[-1]), dtype=np.float32)
    # a pixel's halves lie a quarter pixel from its centre, and each holds half its flux
    fine[..., 0::2] = np.float32(0.375) * plane + np.float32(0.125) * padded[..., :-2]
    fine[..., 1::2] = np.float32(0.375) * plane + np.float32(0.125) * padded[..., 2:]
    return np.moveaxis(fine, -1, axis)


def blank(size_px: tuple[int, int]) -> Canvas:
    """Return an empty canvas of (width, height) pixels."""
    return Canvas(size_px, [None] * DETAILS, np.empty(size_px[0] + 1, dtype=np.float32))


def to_layer(name: str, plane: Plane, pixel_area: float, about: dict[str, str | float]) -> Layer:
    """Crop a plane of flux to what is not black and turn it into irradiance.

    Parameters
    ----------
    name : str
    plane : ndarray, shape (3, H, W)
        Flux per pixel.
    pixel_area : float
        mm^2.
    about : dict

    Returns
    -------
    Layer
        Its window is the smallest that holds all light; one black pixel when there is none.
    """
    x0, y0, x1, y1 = lit_window(plane)
    if x1 <= x0:
        return Layer(name, np.zeros((1, 1, 3), dtype=np.float32), (0, 0, 1, 1), about)
    pixels = np.empty((y1 - y0, x1 - x0, 3), dtype=np.float32)
    interleave(plane, x0, y0, 1.0 / pixel_area, pixels)
    return Layer(name, pixels, (x0, y0, x1 - x0, y1 - y0), about)
