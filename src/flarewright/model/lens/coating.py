"""Anti-reflection coatings of a surface, as projects and lens files specify them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import Field

from ..base import Frozen

Index = Annotated[float, Field(ge=1.0, le=4.0)]
ThicknessNm = Annotated[float, Field(ge=0.0, le=20000.0)]


class Bare(Frozen):
    """No coating: Fresnel reflection."""

    kind: Literal["none"] = "none"


class QuarterWave(Frozen):
    """One film, a quarter of the centre wavelength thick at normal incidence.

    `index = "real"` takes sqrt(n0 n2) but not less than magnesium fluoride's 1.38; "ideal" takes sqrt(n0 n2) as it is.
    `thickness_offset_nm` thickens the film on purpose (greje656 notes): the anti-reflection gets worse.
    """

    kind: Literal["quarter-wave"] = "quarter-wave"
    center_wavelength_nm: float = Field(ge=100.0, le=3000.0)
    index: Literal["real", "ideal"] | Index = "real"
    thickness_offset_nm: float = Field(0.0, ge=-1000.0, le=5000.0)


class Film(Frozen):
    """One film of stated index and thickness."""

    kind: Literal["film"] = "film"
    index: Index
    thickness_nm: ThicknessNm


class Stack(Frozen):
    """Several films, listed from the side of the lower index (air) to the glass."""

    kind: Literal["stack"] = "stack"
    layers: tuple[Film, ...] = Field(min_length=1, max_length=200)


StandardName = Literal["uncoated-1930s", "single-1950s", "early-multicoat", "modern-broadband"]
STANDARD_NAMES: tuple[StandardName, ...] = get_args(StandardName)


class Standard(Frozen):
    """A typical coating of an era; its films depend on the glass (`optics.coatings.presets`).

    `thickness` multiplies the thickness of every film, as a change of the evaporation does: the whole curve of R moves
    to wavelengths longer by that factor.
    """

    kind: Literal["standard"] = "standard"
    name: StandardName
    thickness: float = Field(1.0, ge=0.5, le=2.0)

    def __init__(self, word: StandardName | None = None, /, **fields: Any) -> None:
        """Accept the name as a positional argument or as a keyword."""
        super().__init__(**({} if word is None else {"name": word}), **fields)

    # as of `Frozen`: inside another record the fields have names
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]


Coating = Annotated[Bare | QuarterWave | Film | Stack | Standard, Field(discriminator="kind")]
COATINGS = (Bare, QuarterWave, Film, Stack, Standard)
"""The types that a `Coating` can have."""
