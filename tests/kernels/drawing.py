"""Pictures for the raster kernels."""

from __future__ import annotations

import numpy as np

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.raster import polygons
from flarewright.kernels.raster.polygons import blank_plane, to_pixels

fill_polygon = for_python(polygons.fill_polygon)

WHITE = np.ones(3)


def blank(width: int, height: int) -> np.ndarray:
    """Return a black picture."""
    return blank_plane(width, height)


def channels(plane: np.ndarray, width: int) -> np.ndarray:
    """Return the channels of a picture, shape (3, H, W)."""
    return np.moveaxis(to_pixels(plane, width), 2, 0)


def fill(polygon, plane, density=1.0, gx=0.0, gy=0.0, low=-np.inf, high=np.inf, rgb=WHITE) -> None:
    corners = np.ascontiguousarray(polygon, dtype=np.float64)
    fill_polygon(corners, len(corners), density, gx, gy, low, high, np.asarray(rgb, float), plane)


def area(polygon) -> float:
    x, y = np.asarray(polygon, float).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
