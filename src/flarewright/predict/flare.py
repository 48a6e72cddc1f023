"""The flare of one light as a function of the light's position, the input of every prediction.

A `Flare` is built from a lens (`lens_flare`) or from a measured model; the predictions do not depend on which.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from .._version import __version__
from ..model import Layer
from ..optics.colour.rgb import luminance_weights
from ..typing import Floats, Mask, Pixels

# layers without flare: the direct image of the light, and the beauty, which includes it; a measured flare has no layer
# of the direct image and leaves out the surroundings of the light instead
NO_FLARE = ("beauty", "starburst")


def fingerprint_of(*inputs: str) -> str:
    """Return a hash of what a flare is drawn from, and of the program's version, whose pictures may differ.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    return hashlib.sha256("\0".join((__version__, *inputs)).encode()).hexdigest()


@dataclass(frozen=True)
class Frame:
    """The part of the image that a sensor covers, around the axis: width and height in mm."""

    width: float
    height: float

    @property
    def diagonal(self) -> float:
        """Length of the diagonal, mm."""
        return float(np.hypot(self.width, self.height))

    @property
    def area(self) -> float:
        """Area, mm^2."""
        return self.width * self.height


@dataclass(frozen=True)
class Flare:
    """Flare of one light in a camera.

    Attributes
    ----------
    name : str
    draw : callable
        Maps (constellation_deg, roll_deg) to layers of irradiance on the sensor, relative to the light's irradiance on
        a plane facing it (docs/physics.md, "Radiometry"); one of them can be the direct image.
    size_px : tuple of int
        Size of the drawn picture.
    sensor : Frame
        Area that the picture covers.
    f_number : float
    efl : float or None
        Focal length, mm; None: unknown.
    scene_scale : float
        Irradiance on the sensor per radiance of an extended scene.
    turns_by_deg : float or None
        Roll whose multiples only rotate the picture: 0 for any roll, or the angle of a blade; None: no such roll.
    least_deg, reach_deg : float
        Smallest and largest known constellation.
    dark_beyond : bool
        Whether a light outside that range makes no flare; otherwise its flare is unknown.
    unit : str
        Unit of the drawn values, in words.
    per_lux : bool
        Whether values are relative to the light's illuminance; otherwise they are those of the photographed light.
    fingerprint : str
        Equal for flares that draw the same pictures.
    left_out : str
        Light that is left out, in words.
    over_clipping : float or None
        Sensor signal over its clipping level for a drawn value of 1, of a measured camera at its settings; None:
        unknown. The clipping of a lens' sensor follows from its ISO (`photometry.exposure_level`).
    remarks : tuple of str
        Remarks for the user.
    recipe : callable or None
        Makes the same flare in another process from a number of threads; it can be pickled. None: this flare is drawn
        here.
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
    recipe: Callable[[int | None], Flare] | None = field(default=None, compare=False, repr=False)

    def covers(self, constellation_deg: Floats) -> Mask:
        """Return for each constellation whether it can be drawn."""
        return np.asarray((constellation_deg >= self.least_deg) & (constellation_deg <= self.reach_deg))

    @property
    def aperture(self) -> str:
        """The f-number in words."""
        return f"f/{self.f_number:.3g}" if np.isfinite(self.f_number) else "f-number unknown"

    @property
    def pitch_mm(self) -> float:
        """Side of a pixel, mm; of a square of equal area for oblong pixels."""
        width, height = self.size_px
        return float(np.sqrt(self.sensor.area / (width * height)))

    def picture(self, constellation_deg: float, roll_deg: float = 0.0) -> Pixels:
        """Draw the flare without the direct image, shape (H, W, 3), relative irradiance."""
        width, height = self.size_px
        total = np.zeros((height, width, 3), dtype=np.float32)
        for layer in self.draw(constellation_deg, roll_deg):
            if layer.name not in NO_FLARE:
                x, y, w, h = layer.window
                total[y : y + h, x : x + w] += layer.pixels
        return total


def luminance(picture: Pixels) -> Floats:
    """Return the luminance of linear Rec.709 pixels, shape (H, W); negative luminance becomes 0."""
    return np.maximum(picture.astype(np.float64) @ luminance_weights("rec709"), 0.0)
