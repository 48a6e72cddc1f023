"""A flare as a function of where the light stands: what every prediction is made from.

The command line builds one from a lens (`lens_flare`) or from a measured model; nothing else here knows which it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model import Layer
from ..optics.color import luminance_weights

Floats = NDArray[np.float64]

# the direct image of the light is no flare, and the beauty holds it; a measured flare's has no layer of its own, so
# that flare comes without what is around the light
NO_FLARE = ("beauty", "starburst")

__all__ = ["Flare", "Frame", "luminance"]


@dataclass(frozen=True)
class Frame:
    """The part of the image that a sensor covers, around the axis: width and height in mm."""

    width: float
    height: float

    @property
    def diagonal(self) -> float:
        """Corner to corner, mm."""
        return float(np.hypot(self.width, self.height))

    @property
    def area(self) -> float:
        """mm^2."""
        return self.width * self.height


@dataclass(frozen=True)
class Flare:
    """What a camera makes of one light.

    Attributes
    ----------
    name : str
    draw : callable
        (constellation_deg, roll_deg) to layers of irradiance on the sensor, relative to the light's irradiance on a
        plane facing it (docs/physics.md, "Radiometry"); a layer of the direct image may be among them.
    size_px : tuple of int
        Of the picture that it draws.
    sensor : Frame
        What that picture covers.
    f_number : float
    efl : float or None
        Focal length, mm; None: not known.
    scene_scale : float
        Irradiance on the sensor per radiance of an extended scene.
    turns_by_deg : float or None
        The roll that only turns the picture, and its multiples: 0 any, a blade's angle, or None: no roll does.
    least_deg, reach_deg : float
        The smallest and the largest constellation that it knows.
    dark_beyond : bool
        Whether a light beyond makes no flare; else nobody knows.
    unit : str
        Of what it draws, in words.
    per_lux : bool
        Whether that is over the light's illuminance; else it is of the light that was photographed, whatever that gave.
    fingerprint : str
        The same for flares that draw the same.
    left_out : str
        What of the light is not in it, in words.
    over_clipping : float or None
        The signal over the one at which the sensor clips, of light 1 of what it draws on a measured camera at its
        settings; None: not known. A lens' sensor clips by its ISO (`photometry.exposure_level`).
    remarks : tuple of str
        What a person should know.
    """

    name: str
    draw: Callable[[float, float], Sequence[Layer]]
    size_px: tuple[int, int]
    sensor: Frame
    f_number: float
    scene_scale: float
    efl: float | None = None
    turns_by_deg: float | None = 0.0
    least_deg: float = 0.0
    reach_deg: float = 85.0
    dark_beyond: bool = True
    unit: str = "irradiance on the sensor over the illuminance that the light gives on a plane facing it"
    per_lux: bool = True
    fingerprint: str = ""
    left_out: str = "the light's own image is left out"
    over_clipping: float | None = None
    remarks: tuple[str, ...] = ()

    def covers(self, constellation_deg: Floats) -> NDArray[np.bool_]:
        """Tell of each constellation whether it can be drawn."""
        return np.asarray((constellation_deg >= self.least_deg) & (constellation_deg <= self.reach_deg))

    @property
    def aperture(self) -> str:
        """The f-number in words."""
        return f"f/{self.f_number:.3g}" if np.isfinite(self.f_number) else "f-number not told"

    @property
    def pitch_mm(self) -> float:
        """Side of a pixel, of the same area as its pixels when those are oblong."""
        width, height = self.size_px
        return float(np.sqrt(self.sensor.area / (width * height)))

    def picture(self, constellation_deg: float, roll_deg: float = 0.0) -> NDArray[np.float32]:
        """Draw the flare without the direct image, shape (H, W, 3), relative irradiance."""
        width, height = self.size_px
        total = np.zeros((height, width, 3), dtype=np.float32)
        for layer in self.draw(constellation_deg, roll_deg):
            if layer.name not in NO_FLARE:
                x, y, w, h = layer.window
                total[y : y + h, x : x + w] += layer.pixels
        return total


def luminance(picture: NDArray[np.float32]) -> Floats:
    """Return the luminance of linear Rec.709 pixels, shape (H, W); colours outside the triangle give no less than 0."""
    return np.maximum(picture.astype(np.float64) @ luminance_weights("rec709"), 0.0)
