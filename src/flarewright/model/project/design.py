"""Targets of the lens design: wanted ghosts, and the bounds of the prescription."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool, WithJsonSchema, field_validator, model_validator

from ..base import Frozen

Length = Annotated[float, Field(gt=0.0, le=1000.0)]
Place = Annotated[float, Field(ge=-10000.0, le=10000.0)]
Index = Annotated[float, Field(gt=1.0, lt=4.0)]

# a single name is accepted without a list
Names = Annotated[
    tuple[str, ...], WithJsonSchema({"anyOf": [{"type": "string"}, {"items": {"type": "string"}, "type": "array"}]})
]


class Bounds(Frozen):
    """Limits of a designed prescription; the defaults are those of Van Acoleyen 2025, section 5.2.

    Attributes
    ----------
    air, glass : tuple of float
        Least and largest thickness of a gap of air and of glass, mm.
    back_focus : tuple of float
        Gap between the last vertex and the sensor, mm.
    n_d : tuple of float
        Index of glass.
    least_radius : float
        Smallest radius of curvature, mm; flat is allowed.
    stop_diameter : tuple of float
    focal_length, f_number : tuple of float
        Limits that keep the lens image-forming.
    length : float or None
        Longest distance from the first vertex to the last, mm.
    edge : float
        Least distance of neighbouring surfaces at the edge of the axial beam, mm (half the gap where it is thinner).
    hard : tuple of str
        Which of focal_length, f_number, length and edges are hard constraints (within 1e-4 of a limit, 0.001 mm of an
        edge). The first three are quadratic penalties otherwise; edges are ignored otherwise.
    center_wavelength_nm : tuple of float
        Quarter-wave coatings.
    film_nm, film_index : tuple of float
        Free films: thickness and index.
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
                raise ValueError(f"{name}: the least, {value[0]:g}, must be above 0 and not above {value[1]:g}")
        if self.f_number[0] <= 0.3 or self.f_number[1] > 256.0:
            raise ValueError("f_number: give limits between f/0.3 and f/256")
        if "length" in self.hard and self.length is None:
            raise ValueError('hard names "length", but no length is given')
        return self


class GhostTarget(Frozen):
    """Target of one ghost.

    Attributes
    ----------
    ghost : str or None
        "j-i" of the project's lens: properties not given here stay as they are. None: a new ghost on any path.
    light : int or None
        Which of the project's lights; None: all of them.
    action : {"want", "ignore", "remove"}
        ignore: any result is accepted; remove: the ghost must not be visible.
    place_mm : float or None
        Centre on the line from the picture's centre towards the light, mm; ghosts lie on that line.
    at_mm : tuple of float or None
        Instead of place_mm: a point in the picture, right and up of its centre, mm. It is projected onto the line.
    move_mm : float
        Displacement along that line, towards the light.
    radius_mm : float or None
        Negative: inverted.
    height : float
        Multiplies the radius.
    brightness : float
        Multiplies the irradiance.
    color : tuple of float or None
        Linear Rec.709; only its hue counts. None: unchanged.
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
    def _is_complete(self) -> GhostTarget:
        nowhere = self.place_mm is None and self.at_mm is None
        if self.ghost is None and (self.action == "remove" or nowhere or self.radius_mm is None):
            raise ValueError(
                'a new ghost needs place_mm (or at_mm) and radius_mm; ghost = "j-i" names one of the lens\' own'
            )
        if self.place_mm is not None and self.at_mm is not None:
            raise ValueError("place_mm and at_mm both give the place; keep one")
        if self.radius_mm == 0.0:
            raise ValueError("radius_mm is 0: give the ghost a size")
        if self.color is not None and (min(self.color) < 0.0 or max(self.color) <= 0.0):
            raise ValueError("color needs three numbers of 0 or more, one of them above 0")
        return self


class Design(Frozen):
    """Settings of `flarewright design`.

    Attributes
    ----------
    own_ghosts : bool
        Start with the ghosts of the project's lens as targets; False: only `ghost_targets`.
    ghost_targets : tuple of GhostTarget
    surfaces : int or None
        Number of surfaces of the designed lens without the stop; None: as in the project's lens, or as the ghosts need.
    structure : {"any", "lens"}
        lens: the sequence of glass, air and stop is that of the project's lens.
    fixed_rows : tuple of int
        Rows that keep shape, thickness, glass and coating of the project's lens (with structure = "lens"), counted
        without its filter.
    signed : bool
        Whether an inverted ghost differs from an upright one.
    weights : {"relative", "absolute"}
        relative: errors count relative to the ghost's size; absolute: in mm.
    brightness : {"none", "stop", "fresnel"}
        none: only place and size count; stop: the brightness gives the stop's diameter, as in the thesis' grey render;
        fresnel: the irradiance of bare surfaces counts, which determines indices.
    extra : float
        Cost of a ghost without a target: this over its radius in mm.
    entrance : float
        Diameter of the entrance during the search, mm.
    glasses : tuple of str
        Makers ("SCHOTT"), glasses ("N-BK7", "OHARA S-BSL7") or "all": every glass of a designed lens is one of these.
        Empty: any index within the bounds. A single name is accepted without a list.
    quality : {"draft", "final"}
        draft: first-order ghosts; final: a polish with traced rays follows the search.
    judge : {"ghosts", "picture"}
        ghosts: errors of places and sizes; picture: near the target, the error of a grey picture in which each ghost's
        brightness is one over its radius.
    bounds : Bounds
    """

    own_ghosts: StrictBool = True
    ghost_targets: tuple[GhostTarget, ...] = ()
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

    @model_validator(mode="before")
    @classmethod
    def _older_files_have_wishes(cls, value: object) -> object:
        if isinstance(value, dict) and "wishes" in value and "ghost_targets" not in value:
            return {("ghost_targets" if key == "wishes" else key): each for key, each in value.items()}
        return value

    @field_validator("glasses", mode="before")
    @classmethod
    def _one_name_is_a_list(cls, value: object) -> object:
        return (value,) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _rows_can_stay(self) -> Design:
        if self.fixed_rows and self.structure != "lens":
            raise ValueError('fixed_rows need structure = "lens": other structures change the order of rows')
        if not self.own_ghosts and not any(ghost_target.ghost is None for ghost_target in self.ghost_targets):
            raise ValueError("own_ghosts is false and no new ghost is a target; add a target")
        return self

    @model_validator(mode="after")
    def _a_picture_can_judge(self) -> Design:
        if self.judge == "picture":
            if self.signed:
                raise ValueError('judge = "picture" needs signed = false: most pictures do not show which end is up')
            if self.brightness == "fresnel" or any(
                ghost_target.action == "ignore" for ghost_target in self.ghost_targets
            ):
                raise ValueError(
                    'judge = "picture" draws every ghost, with a brightness of one over its radius; leave out '
                    'brightness = "fresnel" and ghosts to ignore'
                )
        return self
