"""A photograph under the flare, and how its lights were found."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..base import Frozen
from .light import Light

Transfer = Literal["srgb", "linear", "rec709", "gamma22", "gamma28", "pq", "hlg"]
"""What the codes of a file mean: display codes of sRGB, linear values, the codes of a video camera, ..."""


class PlateSearch(Frozen):
    """Which areas of a plate are lights, and how bright they are; the options of `flarewright sources`.

    Attributes
    ----------
    stops : float
        Threshold in stops above the plate's mean luminance.
    threshold : float or None
        Threshold as a plate value, instead of `stops`.
    least_px : int
        Sources of fewer pixels are left out.
    most_lights : int
        Largest number of lights; the faintest sources are joined, and have ghosts only.
    point_px : float or None
        Sources narrower than this are points, pixels; None: half a percent of the plate's width, at least 3.
    gain : float
        Factor of the brightness of all found lights.
    highlights : float or None
        Plate value that a clipped white stands for.
    white : float or None
        Plate value of white paper in the sun, for `source`.
    source : str or None
        Lamp of known brightness: "sun", "headlight@METRES" or "lamp:LUMEN@METRES".
    """

    stops: float = Field(5.0, ge=-20.0, le=40.0)
    threshold: float | None = Field(None, gt=0.0, le=1e30)
    least_px: int = Field(1, ge=1, le=10**9)
    most_lights: int = Field(32, ge=1, le=5000)
    point_px: float | None = Field(None, ge=0.0, le=1e6)
    gain: float = Field(1.0, gt=0.0, le=1e9)
    highlights: float | None = Field(None, ge=1.0, le=1e6)
    white: float | None = Field(None, gt=0.0, le=1e30)
    source: str | None = Field(None, max_length=60)

    @property
    def brightened(self) -> bool:
        """Whether the lights count as brighter than the plate shows them."""
        return self.gain > 1.0 or self.source is not None or (self.highlights or 1.0) > 1.0


class Backplate(Frozen):
    """A picture of the scene, under the flare.

    A render draws the flare alone, whatever the plate.

    Attributes
    ----------
    image : str
        Path of the picture (EXR, TIFF, PNG, JPEG or WebP).
    layer : str or None
        Layer of an EXR file.
    transfer : str or None
        How codes are read, as `--plate-transfer`; None: srgb for whole numbers, linear for floating-point numbers.
    lights_above : float or None
        Luminance above which pixels of the plate are the project's lights: layers then have the unit of the plate.
        None: the lights are not those of the plate.
    search : PlateSearch
    """

    image: str = Field(min_length=1, max_length=4096)
    layer: str | None = None
    transfer: Transfer | None = None
    lights_above: float | None = Field(None, gt=0.0, le=1e30)
    search: PlateSearch = PlateSearch()

    @property
    def lit(self) -> bool:
        """Whether the project's lights are those of the plate."""
        return self.lights_above is not None


def found_in_plate(light: Light) -> bool:
    """Return whether a light has the name that a search gives.

    Examples
    --------
    >>> from flarewright.model import Light
    >>> found_in_plate(Light(name="plate-12", field_deg=(0, 0))), found_in_plate(Light(field_deg=(0, 0)))
    (True, False)
    """
    before, _, number = light.name.partition("-")
    return before == "plate" and number.isdigit()
