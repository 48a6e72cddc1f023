"""A scene for light planning: cameras and lights in space and time.

Positions are in metres, x to the right of the plan, y up the plan, z to the sky; y points north unless `north_deg` says
otherwise. Times are seconds after the scene's start.
"""

from __future__ import annotations

from datetime import datetime
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from ..base import Frozen
from .camera import checked_sensor_size
from .light import D65, Spectrum
from .project import AsLens, CoatingChoice

Place3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


class CameraKey(Frozen):
    """Position and aim of a camera at one time; a value of None is interpolated from the other keyframes."""

    at_s: float = Field(ge=0.0)
    position_m: Place3 | None = None
    aim_m: Place3 | None = None


class LampKey(Frozen):
    """Position, aim and gain of a lamp at one time; a value of None is interpolated from the other keyframes."""

    at_s: float = Field(ge=0.0)
    position_m: Place3 | None = None
    aim_m: Place3 | None = None
    gain: float | None = Field(None, ge=0.0)


class SceneCamera(Frozen):
    """A camera.

    Attributes
    ----------
    name : str
    lens : str or None
        A lens of the library or a lens file.
    model : str or None
        A measured flare instead.
    unit_per_cd_m2 : float or None
        Only with `model`: pixel value of its captures per 1 cd/m2 of the scene, from a grey card of known luminance.
    count : {"all", "ghosts"} or None
        Only with `model`: the part of the flare that counts; None: all.
    around_light : float or None
        Only with `model`: distance from the light's image within which only ghosts count, as a fraction of the
        picture's width; None: the radius that `measure` leaves out.
    position_m, aim_m : tuple of float
    up : tuple of float
    f_number : float or None
        None: wide open, or the f-number of the measured flare.
    zoom : float or str or None
    focus_m : float or None
        Distance of the plane in focus; None: infinity.
    coating : CoatingChoice
    sensor_mm : tuple of float
        As `checked_sensor_size`. With `model`: in its captures' proportions, 36 mm wide unless given.
    iso, exposure_s : float
    keyframes : tuple of CameraKey
        Ascending times, straight lines between; the camera's own position applies at time 0 without a keyframe there.
    """

    name: str = Field(min_length=1)
    lens: str | None = None
    model: str | None = None
    unit_per_cd_m2: Positive | None = None
    count: Literal["all", "ghosts"] | None = None
    around_light: float | None = Field(None, ge=0.0)
    position_m: Place3
    aim_m: Place3
    up: Place3 = (0.0, 0.0, 1.0)
    f_number: float | None = Field(None, gt=0.3, le=256.0)
    zoom: str | Positive | None = None
    focus_m: Positive | None = None
    coating: CoatingChoice = AsLens()
    sensor_mm: Annotated[tuple[Positive, Positive], AfterValidator(checked_sensor_size)] = (36.0, 24.0)
    iso: float = Field(100.0, gt=0.0, le=1e7)
    exposure_s: float = Field(0.01, gt=0.0, le=1e5)
    keyframes: tuple[CameraKey, ...] = ()

    @model_validator(mode="after")
    def _one_flare(self) -> SceneCamera:
        if (self.lens is None) == (self.model is None):
            raise ValueError("a camera has a lens or a measured model, and one of them only")
        if self.model is not None and self.unit_per_cd_m2 is None:
            raise ValueError(
                "a camera with a measured model needs unit_per_cd_m2, the value that a grey card of 1 cd/m2 has in its "
                "captures: without it flare cannot be compared with a scene"
            )
        if self.model is None and self.unit_per_cd_m2 is not None:
            raise ValueError("unit_per_cd_m2 is for a measured model; that of a lens follows from its glass")
        for key in ("count", "around_light"):
            if self.model is None and getattr(self, key) is not None:
                raise ValueError(f"{key} is for a measured model; the flare of a lens has no image of the light in it")
        if self.count == "ghosts" and self.around_light is not None:
            raise ValueError('around_light has no effect with count = "ghosts"; leave one of them out')
        _check_keys(self.keyframes)
        return self


class Lamp(Frozen):
    """A light at a finite position.

    Attributes
    ----------
    position_m : tuple of float
    intensity_cd : float or None
        Luminous intensity along its aim, candela.
    luminance_cd_m2, diameter_m : float or None
        Instead of `intensity_cd`, or for its size: a uniform disc that faces the camera.
    aim_m : tuple of float or None
        Target point of a spotlight; None: isotropic.
    beam_deg : float or None
        Full angle of the cone in which the lamp emits more than half of its intensity; needs `aim_m`.
    spectrum : Spectrum
    keyframes : tuple of LampKey
    """

    kind: Literal["lamp"] = "lamp"
    name: str = Field(min_length=1)
    position_m: Place3
    intensity_cd: Positive | None = None
    luminance_cd_m2: Positive | None = None
    diameter_m: Positive | None = None
    aim_m: Place3 | None = None
    beam_deg: float | None = Field(None, gt=0.1, lt=180.0)
    spectrum: Spectrum = D65()
    keyframes: tuple[LampKey, ...] = ()

    @model_validator(mode="after")
    def _one_brightness(self) -> Lamp:
        if self.intensity_cd is not None and self.luminance_cd_m2 is not None:
            raise ValueError("a lamp has intensity_cd or luminance_cd_m2, not both; keep one")
        if self.intensity_cd is None and self.luminance_cd_m2 is None:
            raise ValueError("a lamp needs intensity_cd, or luminance_cd_m2 with diameter_m")
        if self.luminance_cd_m2 is not None and self.diameter_m is None:
            raise ValueError("luminance_cd_m2 needs diameter_m, the size of the lamp")
        if (self.beam_deg is None) != (self.aim_m is None):
            raise ValueError("aim_m and beam_deg go together: where a lamp points, and how wide its beam is")
        if self.aim_m is None and any(key.aim_m is not None for key in self.keyframes):
            raise ValueError("keyframes aim a lamp that has no aim_m and beam_deg; give it both")
        _check_keys(self.keyframes)
        return self


class Distant(Frozen):
    """A light at infinity: the same direction for all cameras.

    Attributes
    ----------
    azimuth_deg : float
        Clockwise from north.
    elevation_deg : float
        Above the horizon.
    illuminance_lx : float
        On a plane facing it.
    diameter_deg : float
        Angular diameter of its disc.
    """

    kind: Literal["distant"] = "distant"
    name: str = Field(min_length=1)
    azimuth_deg: float = Field(ge=-360.0, le=360.0)
    elevation_deg: float = Field(ge=-90.0, le=90.0)
    illuminance_lx: Positive
    diameter_deg: float = Field(0.0, ge=0.0, le=60.0)
    spectrum: Spectrum = D65()


class Sun(Frozen):
    """The sun at the scene's site and time.

    Attributes
    ----------
    illuminance_lx : float or None
        On a plane facing it; None: clear sky at its elevation.
    horizon_deg : float
        Elevation below which hills or buildings hide it.
    """

    kind: Literal["sun"] = "sun"
    name: str = Field("sun", min_length=1)
    illuminance_lx: Positive | None = None
    horizon_deg: float = Field(0.0, ge=-5.0, le=90.0)
    spectrum: Spectrum = D65()


SceneLight = Annotated[Lamp | Distant | Sun, Field(discriminator="kind")]


class Site(Frozen):
    """Location of the scene on the earth; sets the sun's position."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    longitude_deg: float = Field(ge=-180.0, le=180.0)


class Span(Frozen):
    """Time range of a scene.

    Attributes
    ----------
    start : datetime or None
        With its offset from UTC; needed for the sun.
    duration_s : float
        0: one moment.
    step_s : float
    """

    start: datetime | None = None
    duration_s: float = Field(0.0, ge=0.0, le=4e8)
    step_s: float = Field(60.0, gt=0.0)

    @model_validator(mode="after")
    def _is_clear(self) -> Span:
        if self.start is not None and self.start.tzinfo is None:
            raise ValueError("start needs its offset from UTC, 2024-06-21T18:00:00+02:00 say")
        if self.duration_s / self.step_s > 10000.0:
            raise ValueError(f"{self.duration_s / self.step_s:.0f} steps are too many; choose a longer step_s")
        return self


class Scene(Frozen):
    """Cameras and lights, and the luminance of what the cameras see.

    Attributes
    ----------
    luminance_cd_m2 : tuple of float or None
        Darkest and brightest luminance that the cameras see; None: no contrast is reported.
    key_cd_m2 : float or None
        Its log-average; None: geometric mean of the two.
    north_deg : float
        Compass direction of y, clockwise from north.
    site : Site or None
    time : Span
    """

    schema_version: Literal[1] = 1
    name: str = "scene"
    luminance_cd_m2: tuple[Annotated[float, Field(ge=0.0)], Positive] | None = None
    key_cd_m2: Positive | None = None
    north_deg: float = Field(0.0, ge=-360.0, le=360.0)
    site: Site | None = None
    time: Span = Span()
    cameras: tuple[SceneCamera, ...] = Field(min_length=1, max_length=100)
    lights: tuple[SceneLight, ...] = Field(min_length=1, max_length=1000)

    @model_validator(mode="after")
    def _fits_together(self) -> Scene:
        for what, names in (
            ("cameras", [one.name for one in self.cameras]),
            ("lights", [one.name for one in self.lights]),
        ):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(f"two {what} are called {twice[0]!r}; give each its own name")
        if self.luminance_cd_m2 is not None and self.luminance_cd_m2[0] >= self.luminance_cd_m2[1]:
            raise ValueError("luminance_cd_m2: give the darkest first, then the brightest")
        if any(light.kind == "sun" for light in self.lights):
            if self.site is None:
                raise ValueError("the sun needs [site] with latitude_deg and longitude_deg")
            if self.time.start is None:
                raise ValueError("the sun needs time.start, a date and time with its offset from UTC")
        return self


def _check_keys(keys: tuple[CameraKey, ...] | tuple[LampKey, ...]) -> None:
    for before, after in pairwise([key.at_s for key in keys]):
        if after <= before:
            raise ValueError(f"keyframes must rise in time: {after:g} s follows {before:g} s")
