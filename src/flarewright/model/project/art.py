"""Art direction: the user's changes to ghosts and passes on top of the physics; one switch turns them off."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Annotated, Any

from pydantic import AfterValidator, Field, StrictBool, ValidationInfo, field_validator

from ..base import Frozen

_ROW = r"(?:sensor|\d+)"
# a path by its reflecting rows, or a measured ghost by its number
_NAME = rf"(?:{_ROW}(?:-{_ROW})+|\d+)"
SELECTOR = re.compile(
    r"(?P<opposite>not\s+)?"
    r"(?:(?P<all>all)|row:(?P<row>\d{1,4})|largest:(?P<largest>[1-9]\d{0,5})|brightest:(?P<brightest>[1-9]\d{0,5})|"
    r"bounded:(?P<bounded>stop|entrance)|"
    rf"(?P<names>{_NAME}(?:,{_NAME})*))"
)
"""Syntax of ghost selectors; `Rule` explains each form."""


PASSES = ("starburst", "ghosts", "scatter")
"""Layers that have a gain of their whole light."""


def _selector(text: str) -> str:
    plain = re.sub(r"\s*,\s*", ",", " ".join(text.split()).lower())
    if not SELECTOR.fullmatch(plain):
        raise ValueError(
            f"{text!r} chooses no ghosts; write all, a path like 7-3 (or 7-3,8-2), row:7, brightest:5, largest:10, "
            "bounded:stop or bounded:entrance, or one of these after the word not"
        )
    return plain


Selector = Annotated[str, AfterValidator(_selector)]
Factor = Annotated[float, Field(ge=0.0, le=1e9)]
Colour = tuple[Factor, Factor, Factor]
ExtentPx = Annotated[float, Field(ge=-65536.0, le=65536.0)]
Millimetres = Annotated[float, Field(ge=-1000.0, le=1000.0)]


class Rule(Frozen):
    """A change to some ghosts; its default values change nothing.

    Attributes
    ----------
    select : str
        "all"; path names "7-3" or "7-3,8-2", or ghost numbers of a measured flare; "row:7": paths that reflect at
        row 7; "brightest:5", "largest:10": by throughput and by rms radius as `flarewright ghosts` lists them;
        "bounded:stop", "bounded:entrance": by the limiting aperture in that list; "not " before any of these: all
        others. Ghosts of four reflections have names like "7-3-5-2"; "largest" and "brightest" exclude them.
    enable : bool or None
        False removes the ghosts, True restores what an earlier rule removed.
    gain : float
        Multiplies their light.
    tint : tuple of float
        Multiplies red, green and blue, in the picture's linear colour space.
    ramp : tuple of (position, red, green, blue)
        Multiplies the colour by the distance from the ghost's centre: 0 at the centre, 1 at sqrt(2) times its rms
        radius, the edge of a uniform disc. Linear between the positions, constant beyond them.
    offset_px, offset_mm : tuple of float or None
        Moves the ghosts right and up in the picture (Hullin 2011, section 7); give one of the two.
    scale : float
        Enlarges each ghost about its centre; its flux stays.
    blur_px, blur_mm : float or None
        Standard deviation of a Gaussian blur; give one of the two. The flux stays.
    """

    select: Selector
    enable: StrictBool | None = None
    gain: Factor = 1.0
    tint: Colour = (1.0, 1.0, 1.0)
    ramp: tuple[tuple[Factor, Factor, Factor, Factor], ...] = ()
    offset_px: tuple[ExtentPx, ExtentPx] | None = None
    offset_mm: tuple[Millimetres, Millimetres] | None = None
    scale: float = Field(1.0, ge=0.01, le=100.0)
    blur_px: float | None = Field(None, ge=0.0, le=4096.0)
    blur_mm: float | None = Field(None, ge=0.0, le=1000.0)

    @field_validator("offset_mm", "blur_mm")
    @classmethod
    def _one_unit_only(cls, length: Any, info: ValidationInfo) -> Any:
        name = str(info.field_name).removesuffix("_mm")
        if length is not None and info.data.get(f"{name}_px") is not None:
            raise ValueError(f"{name}_px and {name}_mm are two units of one setting; keep one")
        return length

    @field_validator("ramp")
    @classmethod
    def _positions_rise(cls, ramp: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
        if any(later[0] <= sooner[0] for sooner, later in pairwise(ramp)):
            raise ValueError("positions must rise from each [position, red, green, blue] to the next")
        return ramp


class Art(Frozen):
    """All art direction of a project.

    Attributes
    ----------
    physical : bool
        True ignores all art direction: the picture is the physics alone.
    gain : dict of str to float
        Factors of whole passes by their layer's name, one of `PASSES`.
    rules : tuple of Rule
        Applied in order. Gains, tints, ramps and scales multiply, offsets add, blurs add as Gaussians do, and the last
        rule with `enable` decides.
    """

    physical: StrictBool = False
    gain: dict[str, Factor] = Field(default_factory=dict)
    rules: tuple[Rule, ...] = ()

    @field_validator("gain")
    @classmethod
    def _passes_exist(cls, gain: dict[str, float]) -> dict[str, float]:
        for name in gain:
            if name not in PASSES:
                raise ValueError(f"there is no pass {name!r}; known are {', '.join(PASSES)}")
        return gain
