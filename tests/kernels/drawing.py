"""Planes and scratch for the raster kernels."""

from __future__ import annotations

import numpy as np

from flarewright.kernels.raster import fill_polygon
from flarewright.render import canvas

WHITE = np.ones(3)


def blank(width: int, height: int):
    """Return a plane and its scratch in the order in which kernels take them."""
    return canvas.blank((width, height)).scratch()


def fill(polygon, plane_and_scratch, density=1.0, gx=0.0, gy=0.0, low=-np.inf, high=np.inf, rgb=WHITE) -> None:
    corners = np.ascontiguousarray(polygon, dtype=np.float64)
    fill_polygon(corners, len(corners), density, gx, gy, low, high, np.asarray(rgb, float), *plane_and_scratch)


def area(polygon) -> float:
    x, y = np.asarray(polygon, float).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
