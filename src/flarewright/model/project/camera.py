"""The camera: sensor size and picture size."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, StrictBool, field_validator

from ..base import Frozen
from ..lens.grating import SensorGrating
from ..lens.plate import Plate

# 1 km: larger than every sensor, and small enough for ghosts to have a size in the picture
LARGEST_SENSOR_MM = 1e6
# 1 um: no sensor is smaller, and places in the picture stay small numbers of pixels
SMALLEST_SENSOR_MM = 1e-3
# side lengths in mm, and ratio of the longer to the shorter side, of sensors whose flare is predicted; more extreme
# ratios need too few or too many square pixels along one side
PREDICTED_SIDES_MM = (0.1, 1000.0)
PREDICTED_PROPORTIONS = 10.0


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
    cover_glass : Plate or None
        A plane plate in front of the sensor.
    sensor_reflectance : float
        Reflectance of the sensor as a mirror; 0: none. It makes ghosts "sensor-I".
    sensor_grating : SensorGrating or None
        Pixel structure that diffracts the reflected light (final quality); None: a uniform mirror.
    squeeze : float or None
        Factor by which the lens compresses the picture horizontally. The file's pixel aspect makes viewers widen it
        again. None: the lens file's.
    desqueeze : bool
        Draw the picture desqueezed: `size_px` and the default sensor are those of the wide picture.
    focus_distance : float or None
        Distance of the plane in focus, mm in front of the first vertex, overrides the lens; None: the lens file's,
        else infinity.
    """

    size_px: tuple[int, int] = (1280, 720)
    sensor_mm: tuple[float, float] | None = None
    sensor_distance: float | None = Field(None, gt=0.0)
    focus_distance: float | None = Field(None, gt=0.0)
    cover_glass: Plate | None = None
    sensor_reflectance: float = Field(0.0, ge=0.0, le=1.0)
    sensor_grating: SensorGrating | None = None
    squeeze: float | None = Field(None, ge=0.25, le=4.0)
    desqueeze: StrictBool = False

    # field validators, not model validators: pydantic then reports them together with all other errors of a file
    @field_validator("size_px")
    @classmethod
    def _picture_size_in_range(cls, size_px: tuple[int, int]) -> tuple[int, int]:
        width, height = size_px
        if not (1 <= width <= 32768 and 1 <= height <= 32768):
            raise ValueError(f"{width}x{height} is not between 1 and 32768 pixels a side")
        return size_px

    @field_validator("sensor_mm")
    @classmethod
    def _sensor_size_in_range(cls, sensor_mm: tuple[float, float] | None) -> tuple[float, float] | None:
        if sensor_mm is not None and min(sensor_mm) <= 0.0:
            raise ValueError("a sensor has a width and a height above 0 mm")
        if sensor_mm is not None and not SMALLEST_SENSOR_MM <= min(sensor_mm) <= max(sensor_mm) <= LARGEST_SENSOR_MM:
            width, height = sensor_mm
            word, limit = ("large", "most") if max(sensor_mm) > LARGEST_SENSOR_MM else ("small", "least")
            side = LARGEST_SENSOR_MM if word == "large" else SMALLEST_SENSOR_MM
            raise ValueError(f"{width:g}x{height:g} mm is too {word} for a sensor; give at {limit} {side:g} mm a side")
        return sensor_mm

    @property
    def sensor(self) -> tuple[float, float]:
        """Width and height of the sensor in mm, the default filled in."""
        width, height = self.size_px
        if self.sensor_mm is not None:
            return self.sensor_mm
        # the height without squeeze, and the width at which displayed pixels are square
        high = 36.0 * height / width
        return (36.0 / (self.squeeze or 1.0), high) if self.desqueeze else (36.0, high)

    @property
    def pixel_aspect(self) -> float:
        """Width of a pixel over its height, as a viewer must display it."""
        (width, height), (across, down) = self.size_px, self.sensor
        return (across * (self.squeeze or 1.0) / width) / (down / height)


def checked_sensor_size(sensor_mm: tuple[float, float]) -> tuple[float, float]:
    """Return a sensor size unchanged when flare can be predicted for it.

    Parameters
    ----------
    sensor_mm : tuple of float
        Width and height.

    Raises
    ------
    ValueError
        When a side or the ratio of the sides is out of range.
    """
    least, most = PREDICTED_SIDES_MM
    short, long = sorted(sensor_mm)
    # no quotient, which can overflow; the tolerance accepts 3x0.3, whose ratio rounds above 10
    if not (least <= short and long <= most and long <= PREDICTED_PROPORTIONS * short * (1.0 + 1e-9)):
        raise ValueError(
            f"{sensor_mm[0]:g}x{sensor_mm[1]:g} mm is no sensor; give sides of {least:g} to {most:g} mm, the longer at "
            f"most {PREDICTED_PROPORTIONS:g} times the shorter"
        )
    return sensor_mm


Colorspace = Literal["rec709", "acescg"]
