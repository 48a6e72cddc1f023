"""What a designed lens shall do: wanted ghosts, and the bounds that its prescription keeps."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool, WithJsonSchema, field_validator, model_validator

from .base import Frozen

Length = Annotated[float, Field(gt=0.0, le=1000.0)]
Place = Annotated[float, Field(ge=-10000.0, le=10000.0)]
Index = Annotated[float, Field(gt=1.0, lt=4.0)]

# a single name may stand without a list
Names = Annotated[
    tuple[str, ...],
    WithJsonSchema({"anyOf": [{"type": "string"}, {"items": {"type": "string"}, "type": "array"}]}),
]


class Bounds(Frozen):
    """Limits of a designed prescription; the defaults are those of Van Acoleyen 2025, section 5.2.

    Attributes
    ----------
    air, glass : tuple of float
        Least and largest thickness of a gap of air and of glass, mm.
    back_focus : tuple of float
        Of the gap between the last vertex and the sensor.
    n_d : tuple of float
        Of glass.
    least_radius : float
        No surface is bent more than this; flat is allowed.
    stop_diameter : tuple of float
    focal_length, f_number : tuple of float
        A lens that makes no image is none, so both have limits.
    length : float or None
        Longest distance from the first vertex to the last, mm.
    edge : float
        Neighbouring surfaces are so far apart where the axial beam passes them, mm (half the gap where it is thinner).
    hard : tuple of str
        Which of focal_length, f_number, length and edges are never broken (beyond 1e-4 of a limit, 0.001 mm of an
        edge); the first three pull like springs otherwise, edges are left alone.
    center_wavelength_nm : tuple of float
        Of quarter-wave coatings.
    film_nm, film_index : tuple of float
        Of free films.
    """

    air: tuple[Length, Length] = (0.1, 100.0)
    glass: tuple[Length, Length] = (1.0, 15.0)
    back_focus: tuple[Length, Length] = (0.1, 100.0)
    n_d: tuple[Index, Index] = (1.5, 2.0)
    least_radius: Length = 5.0
    stop_diameter: tuple[Length, Length] = (1.0, 50.0)
    focal_length: tuple[float, float] = (5.0, 2000.0)
    f_number: tuple[float, float] = (0.5, 128.0)
    length: float | None = Field(None, gt=0.0)
    edge: float = Field(0.1, ge=0.0, le=100.0)
    hard: tuple[Literal["focal_length", "f_number", "length", "edges"], ...] = ("edges",)
    center_wavelength_nm: tuple[float, float] = (380.0, 750.0)
    film_nm: tuple[float, float] = (25.0, 750.0)
    film_index: tuple[float, float] = (1.38, 1.9)

    @model_validator(mode="after")
    def _in_order(self) -> Bounds:
        for name in type(self).model_fields:
            value = getattr(self, name)
            if name != "hard" and isinstance(value, tuple) and not 0.0 < value[0] <= value[1]:
                raise ValueError(f"{name}: the least, {value[0]:g}, should be above 0 and not above {value[1]:g}")
        if self.f_number[0] <= 0.3 or self.f_number[1] > 256.0:
            raise ValueError("f_number: lenses here are between f/0.3 and f/256")
        if "length" in self.hard and self.length is None:
            raise ValueError('hard names "length", but no length is given')
        return self


class GhostWish(Frozen):
    """What one ghost shall become.

    Attributes
    ----------
    ghost : str or None
        "j-i" of the project's lens: what is not said here stays as it is. None: a new ghost, placed freely.
    light : int or None
        Which of the project's lights; None: all of them.
    action : {"want", "ignore", "remove"}
        ignore: whatever it does is fine; remove: it shall not be seen.
    place_mm : float or None
        Centre on the line from the picture's middle towards the light, mm; a ghost cannot leave that line.
    at_mm : tuple of float or None
        Instead of place_mm: a place in the picture, right and up of its middle, mm. The nearest one on the line counts.
    move_mm : float
        Along that line, towards the light.
    radius_mm : float or None
        Negative: upside down.
    height : float
        Multiplies the radius.
    brightness : float
        Multiplies the irradiance.
    color : tuple of float or None
        Linear Rec.709; only its hue counts. None: as it is.
    weight : float
    """

    ghost: str | None = Field(None, pattern=r"^\d+-\d+$")
    light: int | None = Field(None, ge=0)
    action: Literal["want", "ignore", "remove"] = "want"
    place_mm: float | None = Field(None, ge=-10000.0, le=10000.0)
    at_mm: tuple[Place, Place] | None = None
    move_mm: float = Field(0.0, ge=-10000.0, le=10000.0)
    radius_mm: float | None = Field(None, ge=-10000.0, le=10000.0)
    height: float = Field(1.0, gt=0.0, le=1000.0)
    brightness: float = Field(1.0, gt=0.0, le=1e6)
    color: tuple[float, float, float] | None = None
    weight: float = Field(1.0, ge=0.0, le=1e6)

    @model_validator(mode="after")
    def _is_complete(self) -> GhostWish:
        nowhere = self.place_mm is None and self.at_mm is None
        if self.ghost is None and (self.action == "remove" or nowhere or self.radius_mm is None):
            raise ValueError(
                'a new ghost has place_mm (or at_mm) and radius_mm, or names the lens\' own with ghost = "j-i"'
            )
        if self.place_mm is not None and self.at_mm is not None:
            raise ValueError("place_mm and at_mm say the same thing twice; keep one")
        if self.radius_mm == 0.0:
            raise ValueError("radius_mm is 0: give the ghost a size")
        if self.color is not None and (min(self.color) < 0.0 or max(self.color) <= 0.0):
            raise ValueError("color has three parts that are not negative, one of them above 0")
        return self


class Design(Frozen):
    """The target of `flarewright design`.

    Attributes
    ----------
    own_ghosts : bool
        Begin with the ghosts of the project's lens; False: only the wishes.
    wishes : tuple of GhostWish
    surfaces : int or None
        Of the designed lens, without the stop; None: as many as the project's lens has, or as the ghosts need.
    structure : {"any", "lens"}
        lens: glass, air and stop stay where they are in the project's lens.
    fixed_rows : tuple of int
        Rows that keep the curvature, thickness and glass of the project's lens (with structure = "lens").
    signed : bool
        Whether an upside-down ghost differs from an upright one.
    weights : {"relative", "absolute"}
        relative: a small ghost must be met more closely than a large one; absolute: all in mm.
    brightness : {"none", "stop", "fresnel"}
        none: only place and size count; stop: the stop's diameter is known from the brightness, as in the thesis' grey
        render; fresnel: the irradiance of bare surfaces counts, which tells indices.
    extra : float
        A ghost that nobody wants costs this over its radius in mm.
    entrance : float
        Diameter of the entrance while searching, mm.
    glasses : tuple of str
        Makers ("SCHOTT"), glasses ("N-BK7", "OHARA S-BSL7") or "all": every glass of a designed lens is one of these.
        Empty: any index within the bounds. A single name may stand without a list.
    quality : {"draft", "final"}
        draft: ghosts to first order; final: lenses that were found are finished with traced rays.
    judge : {"ghosts", "picture"}
        ghosts: places and sizes count; picture: once they are near, the error of a grey picture, each ghost as bright
        as one over its radius.
    bounds : Bounds
    """

    own_ghosts: StrictBool = True
    wishes: tuple[GhostWish, ...] = ()
    surfaces: int | None = Field(None, ge=2, le=60)
    structure: Literal["any", "lens"] = "any"
    fixed_rows: tuple[int, ...] = ()
    signed: StrictBool = True
    weights: Literal["relative", "absolute"] = "relative"
    brightness: Literal["none", "stop", "fresnel"] = "none"
    extra: float = Field(500.0, ge=0.0, le=1e9)
    entrance: float = Field(100.0, gt=0.0, le=10000.0)
    glasses: Names = ()
    quality: Literal["draft", "final"] = "draft"
    judge: Literal["ghosts", "picture"] = "ghosts"
    bounds: Bounds = Bounds()

    @field_validator("glasses", mode="before")
    @classmethod
    def _one_name_is_a_list(cls, value: object) -> object:
        return (value,) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _rows_can_stay(self) -> Design:
        if self.fixed_rows and self.structure != "lens":
            raise ValueError('fixed_rows need structure = "lens", for only then rows keep their place')
        if not self.own_ghosts and not any(wish.ghost is None for wish in self.wishes):
            raise ValueError("own_ghosts is false and no new ghost is wished for, so there is nothing to aim at")
        return self

    @model_validator(mode="after")
    def _a_picture_can_judge(self) -> Design:
        if self.judge == "picture":
            if self.signed:
                raise ValueError('judge = "picture" needs signed = false, for few pictures show which end is up')
            if self.brightness == "fresnel" or any(wish.action == "ignore" for wish in self.wishes):
                raise ValueError(
                    'judge = "picture" draws every ghost, as bright as it is small; leave out brightness = "fresnel" '
                    "and ghosts to ignore"
                )
        return self
