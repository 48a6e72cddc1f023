"""A scene for light planning: cameras and lights in space, and when they are there.

Places are in metres, x to the right of the plan, y up the plan, z to the sky; y points north unless `north_deg` says
otherwise. Times are seconds after the scene's start.
"""

from __future__ import annotations

from datetime import datetime
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from .base import Frozen
from .camera import predicted_sensor
from .light import D65, Spectrum
from .project import AsLens, CoatingChoice

Place3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


class CameraKey(Frozen):
    """Where a camera is and aims at one time; what is left out goes on as its other keyframes say."""

    at_s: float = Field(ge=0.0)
    position_m: Place3 | None = None
    aim_m: Place3 | None = None


class LampKey(Frozen):
    """Where a lamp is and aims at one time, and how much of its light it gives."""

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
        A shipped lens or a lens file.
    model : str or None
        A measured flare instead.
    unit_per_cd_m2 : float or None
        Of a measured flare: which value of its captures a scene of 1 cd/m2 has, from a grey card of known luminance.
    count : {"all", "ghosts"} or None
        Of a measured flare: what of it counts; None: all.
    around_light : float or None
        Of a measured flare: how far around the light's image only ghosts count, part of the picture's width; None: as
        `measure` leaves it out.
    position_m, aim_m : tuple of float
    up : tuple of float
    f_number : float or None
        None: wide open, or that of the measured flare.
    zoom : float or str or None
    focus_m : float or None
        Distance of the plane in focus; None: infinity.
    coating : CoatingChoice
    sensor_mm : tuple of float
        As `predicted_sensor`. Of a measured flare: in its captures' proportions; not told: 36 mm wide.
    iso, exposure_s : float
    keyframes : tuple of CameraKey
        Rising in time, straight lines between; the camera's own place is that at 0 unless a keyframe is.
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
    sensor_mm: Annotated[tuple[Positive, Positive], AfterValidator(predicted_sensor)] = (36.0, 24.0)
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
            raise ValueError("unit_per_cd_m2 is for a measured model; a lens' follows from its glass")
        for key in ("count", "around_light"):
            if self.model is None and getattr(self, key) is not None:
                raise ValueError(f"{key} is for a measured model; a lens' flare has no image of the light in it")
        if self.count == "ghosts" and self.around_light is not None:
            raise ValueError('around_light says where more than ghosts counts; leave it or count = "ghosts" out')
        _check_keys(self.keyframes)
        return self


class Lamp(Frozen):
    """A light at a place.

    Attributes
    ----------
    position_m : tuple of float
    intensity_cd : float or None
        Candela towards its aim.
    luminance_cd_m2, diameter_m : float or None
        Instead of it, or for its size: an evenly bright disc that faces the camera.
    aim_m : tuple of float or None
        Where it points; None: the same every way.
    beam_deg : float or None
        Angle across the cone within which it gives more than half of its intensity; needs `aim_m`.
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
            raise ValueError("aim_m and beam_deg belong together: where a lamp points, and how wide it shines")
        if self.aim_m is None and any(key.aim_m is not None for key in self.keyframes):
            raise ValueError("keyframes aim a lamp that has no aim_m and beam_deg of its own")
        _check_keys(self.keyframes)
        return self


class Distant(Frozen):
    """A light so far away that it stands in one direction for all cameras.

    Attributes
    ----------
    azimuth_deg : float
        Clockwise from north.
    elevation_deg : float
        Above the horizon.
    illuminance_lx : float
        On a plane facing it.
    diameter_deg : float
        Across its disc.
    """

    kind: Literal["distant"] = "distant"
    name: str = Field(min_length=1)
    azimuth_deg: float = Field(ge=-360.0, le=360.0)
    elevation_deg: float = Field(ge=-90.0, le=90.0)
    illuminance_lx: Positive
    diameter_deg: float = Field(0.0, ge=0.0, le=60.0)
    spectrum: Spectrum = D65()


class Sun(Frozen):
    """The sun over the scene's place, at its time.

    Attributes
    ----------
    illuminance_lx : float or None
        On a plane facing it; None: that of a clear sky at its height.
    horizon_deg : float
        Elevation below which hills or houses hide it.
    """

    kind: Literal["sun"] = "sun"
    name: str = Field("sun", min_length=1)
    illuminance_lx: Positive | None = None
    horizon_deg: float = Field(0.0, ge=-5.0, le=90.0)
    spectrum: Spectrum = D65()


SceneLight = Annotated[Lamp | Distant | Sun, Field(discriminator="kind")]


class Site(Frozen):
    """Where on the earth the scene is, for the sun."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    longitude_deg: float = Field(ge=-180.0, le=180.0)


class Span(Frozen):
    """When.

    Attributes
    ----------
    start : datetime or None
        With its offset from UTC; needed for the sun.
    duration_s : float
        0 is one moment.
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
    """Cameras and lights, and what the cameras look at.

    Attributes
    ----------
    luminance_cd_m2 : tuple of float or None
        Darkest and brightest of what the cameras see; None: contrast is not told.
    key_cd_m2 : float or None
        Its log-average; None: the geometric mean of the two.
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
