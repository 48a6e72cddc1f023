"""Lights and their spectra."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from .base import Frozen
from .holdout import Holdout


class EqualEnergy(Frozen):
    """The same power at every wavelength."""

    kind: Literal["equal-energy"] = "equal-energy"


class D65(Frozen):
    """CIE daylight D65: white of Rec.709."""

    kind: Literal["d65"] = "d65"


class BlackBody(Frozen):
    """Planck's law at a temperature."""

    kind: Literal["black-body"] = "black-body"
    temperature_k: float = Field(ge=500.0, le=100000.0)


class Lines(Frozen):
    """Spectral lines: (wavelength in nm, relative power) each."""

    kind: Literal["lines"] = "lines"
    lines: tuple[tuple[Annotated[float, Field(ge=360.0, le=830.0)], Annotated[float, Field(ge=0.0)]], ...] = Field(
        min_length=1
    )


class Tabulated(Frozen):
    """Relative power at rising wavelengths in nm, linear between; zero outside (a CSV file of two columns)."""

    kind: Literal["table"] = "table"
    wavelength_nm: tuple[float, ...] = Field(min_length=2)
    power: tuple[Annotated[float, Field(ge=0.0)], ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _columns_match(self) -> Tabulated:
        if len(self.wavelength_nm) != len(self.power):
            raise ValueError("a spectrum table needs as many powers as wavelengths")
        if any(b <= a for a, b in zip(self.wavelength_nm, self.wavelength_nm[1:], strict=False)):
            raise ValueError("the wavelengths of a spectrum table must rise")
        return self


class Rgb(Frozen):
    """A smooth spectrum of a colour: linear Rec.709, any scale, for its colour alone counts.

    D65 times a smooth curve, so white is D65 (`optics.uplift`).
    """

    kind: Literal["rgb"] = "rgb"
    rgb: tuple[Annotated[float, Field(ge=0.0)], Annotated[float, Field(ge=0.0)], Annotated[float, Field(ge=0.0)]]

    @model_validator(mode="after")
    def _is_lit(self) -> Rgb:
        if max(self.rgb) <= 0.0:
            raise ValueError("black has no colour; give red, green or blue above 0")
        return self


Spectrum = Annotated[EqualEnergy | D65 | BlackBody | Lines | Tabulated | Rgb, Field(discriminator="kind")]

LARGEST_INTENSITY = 1e20
"""Far beyond every light, and far enough below what 32 bits hold for all that multiplies it."""
SUN_DEG = 0.53
"""Angle across the sun's disc, degrees."""


class Rectangle(Frozen):
    """A bright rectangle, parallel to the sensor.

    Attributes
    ----------
    size_deg : tuple of float
        Width and height in degrees of field angle.
    rotation_deg : float
        Counter-clockwise in the picture.
    """

    kind: Literal["rectangle"] = "rectangle"
    size_deg: tuple[Annotated[float, Field(gt=0.0, le=120.0)], Annotated[float, Field(gt=0.0, le=120.0)]]
    rotation_deg: float = Field(0.0, ge=-360.0, le=360.0)


class Polygon(Frozen):
    """A bright polygon, parallel to the sensor; it may be concave but must not cross itself.

    Attributes
    ----------
    corners_deg : tuple of tuple of float
        Right and up from the light's own field angles, degrees.
    """

    kind: Literal["polygon"] = "polygon"
    corners_deg: tuple[tuple[float, float], ...] = Field(min_length=3, max_length=256)


FieldAngles = tuple[
    Annotated[float, Field(gt=-90.0, lt=90.0)],
    Annotated[float, Field(gt=-90.0, lt=90.0)],
]

Shape = Annotated[Rectangle | Polygon, Field(discriminator="kind")]


class LightKey(Frozen):
    """Where a light stands at one time, seconds."""

    at_s: float = Field(ge=0.0, le=86400.0)
    field_deg: FieldAngles


class Light(Frozen):
    """A light, distant or near.

    Attributes
    ----------
    field_deg : tuple of float
        Field angles (X, Y) in degrees: the direct image lies near (+efl tan X right, +efl tan Y up) in the upright
        picture. Those of a near light are seen from the middle of the entrance pupil.
    distance : float or None
        How far in front of the first vertex the light stands, mm along the axis, as the camera's focus distance; None:
        so far away that its rays are parallel.
    intensity : float
        Irradiance (luminous, so a white light of 1 is RGB 1, 1, 1) on a plane that faces the light; of a near light at
        the middle of the entrance pupil.
    spectrum : Spectrum
    diameter_deg : float
        Angle across the light's round disc, 0.53 for the sun, 0 for a point.
    shape : Rectangle or Polygon or None
        What else the light is than a point or a disc. Its radiance is even, and `intensity` is all of it together.
    holdout : Holdout or None
        What hides this light, besides the project's.
    keyframes : tuple of LightKey
        A path that the editor plays: rising in time, straight lines in field angles between. A render draws the light
        where `field_deg` says.
    """

    name: str = "light"
    field_deg: FieldAngles
    distance: float | None = Field(None, gt=0.0, le=1e9)
    intensity: float = Field(1.0, ge=0.0, le=LARGEST_INTENSITY)
    spectrum: Spectrum = D65()
    diameter_deg: float = Field(0.0, ge=0.0, le=60.0)
    shape: Shape | None = None
    holdout: Holdout | None = None
    keyframes: tuple[LightKey, ...] = Field((), max_length=1000)

    @field_validator("shape")
    @classmethod
    def _one_shape(cls, shape: Shape | None, info: ValidationInfo) -> Shape | None:
        if shape is not None and info.data.get("diameter_deg", 0.0) > 0.0:
            raise ValueError("a light is a disc (diameter_deg) or has a shape, not both; keep one")
        return shape

    @field_validator("keyframes")
    @classmethod
    def _keyframes_rise(cls, keyframes: tuple[LightKey, ...]) -> tuple[LightKey, ...]:
        for before, after in pairwise(key.at_s for key in keyframes):
            if after <= before:
                raise ValueError(f"keyframes must rise in time: {after:g} s follows {before:g} s")
        return keyframes

    @property
    def extended(self) -> bool:
        """Whether the light is more than a point."""
        return self.diameter_deg > 0.0 or self.shape is not None
