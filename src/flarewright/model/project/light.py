"""Lights and their spectra."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, StrictBool, ValidationInfo, field_validator, model_validator

from ..base import Frozen
from .animation import LARGEST_INTENSITY, LAST_S, LightCurve, Motion, one_curve_each
from .holdout import Holdout


class EqualEnergy(Frozen):
    """The same power at every wavelength."""

    kind: Literal["equal-energy"] = "equal-energy"


class D65(Frozen):
    """CIE daylight D65: white of Rec.709."""

    kind: Literal["d65"] = "d65"


class BlackBody(Frozen):
    """Planck spectrum of a temperature in kelvin."""

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
    """A smooth spectrum of a linear Rec.709 colour; only the ratios of the numbers count.

    D65 times a smooth curve, so white is D65 (`optics.colour.rgb_to_spectrum`).
    """

    kind: Literal["rgb"] = "rgb"
    rgb: tuple[Annotated[float, Field(ge=0.0)], Annotated[float, Field(ge=0.0)], Annotated[float, Field(ge=0.0)]]

    @model_validator(mode="after")
    def _is_lit(self) -> Rgb:
        if max(self.rgb) <= 0.0:
            raise ValueError("black has no colour; give red, green or blue above 0")
        return self


Spectrum = Annotated[EqualEnergy | D65 | BlackBody | Lines | Tabulated | Rgb, Field(discriminator="kind")]

LEAST_LIGHT_DEG = 1e-6
"""Least diameter or width of a light that is no point, degrees: a 50 mm lens images it 1 nm wide."""

SUN_DEG = 0.53
"""Angular diameter of the sun, degrees."""


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
    size_deg: tuple[
        Annotated[float, Field(ge=LEAST_LIGHT_DEG, le=120.0)], Annotated[float, Field(ge=LEAST_LIGHT_DEG, le=120.0)]
    ]
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


FieldAngles = tuple[Annotated[float, Field(gt=-90.0, lt=90.0)], Annotated[float, Field(gt=-90.0, lt=90.0)]]

Shape = Annotated[Rectangle | Polygon, Field(discriminator="kind")]


class LightKey(Frozen):
    """Position of a light at one time, seconds."""

    at_s: float = Field(ge=0.0, le=LAST_S)
    field_deg: FieldAngles


class Light(Frozen):
    """A light, distant or near.

    Attributes
    ----------
    field_deg : tuple of float
        Field angles (X, Y) in degrees: the direct image lies near (+efl tan X right, +efl tan Y up) in the upright
        picture. Those of a near light are seen from the middle of the entrance pupil.
    distance : float or None
        Distance of the light in front of the first vertex, mm along the axis, like the camera's focus distance; None:
        infinity, so that its rays are parallel.
    intensity : float
        Irradiance (luminous, so a white light of 1 is RGB 1, 1, 1) on a plane that faces the light; for a near light,
        at the middle of the entrance pupil.
    spectrum : Spectrum
    diameter_deg : float
        Angular diameter of a round light, 0.53 for the sun, 0 for a point.
    shape : Rectangle or Polygon or None
        Area light instead of a disc or point. Its radiance is uniform; `intensity` is its total.
    starburst : bool
        Whether its direct image is drawn, with its diffraction. False for a light that the plate below shows already.
    holdout : Holdout or None
        Holdout of this light, in addition to the project's.
    keyframes : tuple of LightKey
        The light's path in a shot: ascending times. A render without a time draws the light at `field_deg`.
    motion : {"linear", "smooth"}
        Interpolation of the path.
    curves : tuple of LightCurve
        Intensity and colour in a shot.
    """

    name: str = "light"
    field_deg: FieldAngles
    distance: float | None = Field(None, gt=0.0, le=1e9)
    intensity: float = Field(1.0, ge=0.0, le=LARGEST_INTENSITY)
    spectrum: Spectrum = D65()
    diameter_deg: float = Field(0.0, ge=0.0, le=60.0)
    shape: Shape | None = None
    starburst: StrictBool = True
    holdout: Holdout | None = None
    # as many as a curve has: one a frame of a long track
    keyframes: tuple[LightKey, ...] = Field((), max_length=10000)
    motion: Motion = "linear"
    curves: Annotated[tuple[LightCurve, ...], AfterValidator(one_curve_each)] = ()

    @field_validator("diameter_deg")
    @classmethod
    def _point_or_disc(cls, diameter_deg: float) -> float:
        if 0.0 < diameter_deg < LEAST_LIGHT_DEG:
            raise ValueError(f"a disc has at least {LEAST_LIGHT_DEG:g} degrees, not {diameter_deg:g}; 0 is a point")
        return diameter_deg

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
        """Whether the light is larger than a point."""
        return self.diameter_deg > 0.0 or self.shape is not None
