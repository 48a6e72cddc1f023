"""The sensor and the picture made from it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from .base import Frozen


class Camera(Frozen):
    """Sensor size in mm, picture size in pixels.

    Attributes
    ----------
    size_px : tuple of int
        Width and height of the picture.
    sensor_mm : tuple of float or None
        Width and height of the sensor that the picture covers; None: 36 mm wide, square pixels.
    sensor_distance : float or None
        Last vertex to sensor in mm, overrides the lens; None: the lens file's, else the paraxial focus.
    focus_distance : float or None
        Distance of the plane in focus, mm in front of the first vertex, overrides the lens; None: the lens file's,
        else infinity.
    """

    size_px: tuple[int, int] = (1280, 720)
    sensor_mm: tuple[float, float] | None = None
    sensor_distance: float | None = Field(None, gt=0.0)
    focus_distance: float | None = Field(None, gt=0.0)

    @property
    def sensor(self) -> tuple[float, float]:
        """Width and height of the sensor in mm, the default filled in."""
        width, height = self.size_px
        return self.sensor_mm or (36.0, 36.0 * height / width)


Colorspace = Literal["rec709", "acescg"]
