"""Captures of a light by a turning camera, and the merged frames made from them.

Pixels: x to the right, y down, the top left corner of the picture is (0, 0), the middle of its first pixel (0.5, 0.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians, sin
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, StrictBool, field_validator, model_validator

from ...typing import Mask, Pixels
from ..base import Frozen

Kind = Literal["light", "dark", "flat"]
Positive = Annotated[float, Field(gt=0.0)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]
# the camera sees no image of a light beside or behind it
Constellation = Annotated[float, Field(gt=-90.0, lt=90.0)]
# fields of `CameraNoise` that describe the light; they change neither pixels nor ghosts
OF_LIGHT = {"luminance_cd_m2", "solid_angle_sr"}
Matrix3 = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


class Capture(Frozen):
    """One photograph: a line of captures.csv.

    Attributes
    ----------
    file : str
        Path relative to the folder of captures.csv.
    constellation_deg : float or None
        Angle by which the camera is turned away from the light; positive: the light is right of the axis in the
        upright picture (with `roll_deg` = 0). None only for dark frames and flats.
    exposure_s, iso : float
    f_number : float or None
        None: unknown, but equal for all captures.
    roll_deg : float
        Direction in the upright picture in which the light moves as the constellation grows, counter-clockwise from the
        right: 0 when the camera turns along its horizon, 90 when it is held upright.
    focal_mm : float or None
    light_x_px, light_y_px : float or None
        The user's position of the light in the file's own pixels; overrides the detected one.
    kind : {"light", "dark", "flat"}
        dark: taken with the lens cap on; flat: of an evenly lit surface.
    """

    file: str = Field(min_length=1)
    constellation_deg: Constellation | None = None
    exposure_s: Positive
    iso: Positive = 100.0
    f_number: Positive | None = None
    roll_deg: Degrees = 0.0
    focal_mm: Positive | None = None
    light_x_px: float | None = None
    light_y_px: float | None = None
    kind: Kind = "light"

    @model_validator(mode="after")
    def _is_complete(self) -> Capture:
        if self.kind == "light" and self.constellation_deg is None:
            raise ValueError("constellation_deg is missing; only dark frames and flats have none")
        if (self.light_x_px is None) != (self.light_y_px is None):
            raise ValueError("light_x_px and light_y_px go together")
        return self


class CameraNoise(Frozen):
    """Sensor noise and calibration of a camera, and the brightness of the photographed light: `camera.json`.

    Camera values that are None are read from the files or estimated from the captures.

    Attributes
    ----------
    black_level, white_level : float or None
        Pixel value in darkness, and the smallest pixel value that is clipped, in the units of the file.
    electrons_per_unit : float or None
        Electrons that raise the pixel value by one, at `iso`.
    read_noise : float or None
        Standard deviation of the read noise, electrons.
    iso : float
        ISO at which `electrons_per_unit` holds; it falls as 1 / iso.
    pitch_um : float or None
        Pixel pitch of the file, micrometres.
    electrons_per_unit_error, read_noise_error : float or None
        Their standard errors, when they were estimated.
    luminance_cd_m2, solid_angle_sr : float or None
        Luminance and solid angle of the light as the camera sees it, at most a hemisphere; both or none. Merging does
        not need them; ghost models record them.
    """

    schema_version: Literal[1] = 1
    black_level: float | None = None
    white_level: float | None = None
    electrons_per_unit: Positive | None = None
    read_noise: float | None = Field(None, ge=0.0)
    iso: Positive = 100.0
    pitch_um: Positive | None = None
    electrons_per_unit_error: float | None = Field(None, ge=0.0)
    read_noise_error: float | None = Field(None, ge=0.0)
    luminance_cd_m2: Positive | None = None
    solid_angle_sr: Positive | None = None

    @field_validator("solid_angle_sr")
    @classmethod
    def _light_is_in_front(cls, solid_angle_sr: float | None) -> float | None:
        if solid_angle_sr is not None and solid_angle_sr > 2.0 * pi:
            raise ValueError(
                f"{solid_angle_sr:g} is more than the hemisphere in front of the camera; give at most 2 pi, 6.28"
            )
        return solid_angle_sr

    @model_validator(mode="after")
    def _light_is_whole(self) -> CameraNoise:
        if (self.luminance_cd_m2 is None) != (self.solid_angle_sr is None):
            raise ValueError("luminance_cd_m2 and solid_angle_sr of the light go together; give both or none")
        return self

    @model_validator(mode="after")
    def _clips_above_black(self) -> CameraNoise:
        if self.black_level is not None and self.white_level is not None and self.white_level <= self.black_level:
            raise ValueError(f"white_level {self.white_level:g} is not above black_level {self.black_level:g}")
        return self


class FrameInfo(Frozen):
    """Metadata of one merged frame.

    Attributes
    ----------
    file : str
        The EXR file, relative to the run's folder.
    constellation_deg : float
        Angle between axis and light, corrected for the turntable's jitter; its sign is that of `nominal_deg`.
    nominal_deg, nominal_roll_deg : float
        As listed in captures.csv.
    roll_deg : float
        Measured direction of growing constellation, counter-clockwise from the right.
    light_px : tuple of float
        (x, y) of the light; extrapolated from other frames where it is outside the picture or was not detected.
    light_error_px : float
        Its standard error along each axis.
    light_found : bool
        Whether it was detected in this frame.
    axis_px : tuple of float
        (x, y) of the optical axis.
    exposures_s : tuple of float
        Merged exposure times.
    iso, f_number, focal_mm : float or None
    clipped_share : float
        Fraction of the pixels that were clipped in every exposure.
    gain, gain_error : float
        Brightness of the light in this frame relative to the prediction from its neighbours, 1e-4 to 1e4, and its
        standard error. The file holds the photographed values; `io.measurement.merged.read_frame` divides by the gain.
    """

    file: str
    constellation_deg: Constellation
    nominal_deg: float
    roll_deg: float = 0.0
    nominal_roll_deg: float = 0.0
    light_px: tuple[float, float]
    light_error_px: float = Field(0.0, ge=0.0)
    light_found: StrictBool = True
    axis_px: tuple[float, float]
    exposures_s: tuple[Positive, ...] = ()
    iso: Positive = 100.0
    f_number: Positive | None = None
    focal_mm: Positive | None = None
    clipped_share: float = Field(0.0, ge=0.0, le=1.0)
    gain: float = Field(1.0, ge=1e-4, le=1e4)
    gain_error: float = Field(0.0, ge=0.0)

    @property
    def horizon_deg(self) -> float:
        """Measured minus nominal roll, degrees, from -180 to 180, counter-clockwise."""
        return (self.roll_deg - self.nominal_roll_deg + 180.0) % 360.0 - 180.0

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector (x right, y down) along which the light moves as the constellation grows."""
        angle = radians(self.roll_deg)
        return cos(angle), -sin(angle)


class MergedRun(Frozen):
    """The index of a merged run: `merged.json`.

    Attributes
    ----------
    size_px : tuple of int
        Width and height of every frame.
    frames : tuple of FrameInfo
        By ascending roll and constellation.
    axis_px, axis_error_px : tuple of float
        The optical axis and its standard error in x and y.
    px_per_rad : float
        Distance of the light from the axis in pixels over its angle, near the axis; the focal length in pixels.
    camera : CameraNoise
        The values used, with estimates filled in.
    sensor_width_mm : float or None
        Width of the sensor that a frame shows; None: unknown.
    reference_iso, reference_f_number : float or None
        Radiance 1 saturates the sensor (white level) in one second at these settings.
    white_balance : tuple of float
        Factors that were applied to red, green and blue.
    to_rec709 : tuple of 3 tuples of 3 float, or None
        From the frames' red, green and blue to linear Rec.709, one row each; None: unknown.
    remarks : tuple of str
        Remarks for the user.
    """

    schema_version: Literal[1] = 1
    size_px: tuple[int, int]
    frames: tuple[FrameInfo, ...]
    axis_px: tuple[float, float]
    axis_error_px: tuple[float, float] = (0.0, 0.0)
    px_per_rad: Positive
    camera: CameraNoise = CameraNoise()
    sensor_width_mm: Positive | None = None
    reference_iso: Positive = 100.0
    reference_f_number: Positive | None = None
    white_balance: tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    to_rec709: Matrix3 | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class MergedFrame:
    """One constellation: the mean of its exposures in linear light, and the variance of each pixel.

    Attributes
    ----------
    info : FrameInfo
    radiance : ndarray, shape (height, width, 3), float32
        Linear, scene-referred; 1 saturates the sensor in one second at the run's reference ISO. Noise can make it
        negative.
    variance : ndarray, shape (height, width, 3), float32
        Variance of `radiance`, independent between pixels; infinite where every exposure was clipped.
    """

    info: FrameInfo
    radiance: Pixels
    variance: Pixels

    @property
    def valid(self) -> Mask:
        """Where `radiance` was measured, shape (height, width, 3)."""
        return np.isfinite(self.variance)

    @property
    def constellation_deg(self) -> float:
        """Angle between axis and light."""
        return self.info.constellation_deg

    @property
    def roll_deg(self) -> float:
        """Direction of growing constellation, counter-clockwise from the right."""
        return self.info.roll_deg

    @property
    def light_px(self) -> tuple[float, float]:
        """(x, y) of the light."""
        return self.info.light_px

    @property
    def axis_px(self) -> tuple[float, float]:
        """(x, y) of the optical axis."""
        return self.info.axis_px
