"""Scatter parameters of surfaces: roughness, a measured function, dust, or Chaumond's phase function."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from ..base import Frozen

ScatterModel = Literal["none", "chaumond", "harvey-shack", "abg"]

LARGEST_ROUGHNESS_NM = 50.0
"""Largest rms roughness of a surface."""
LEAST_LEVEL, LARGEST_LEVEL = 10.0, 2000.0
"""Least and largest cleanliness level of IEST-STD-CC1246."""

Roughness = Annotated[float, Field(ge=0.0, le=LARGEST_ROUGHNESS_NM)]
Correlation = Annotated[float, Field(ge=0.5, le=10000.0)]
Slope = Annotated[float, Field(ge=2.05, le=8.0)]
Level = Annotated[float, Field(ge=LEAST_LEVEL, le=LARGEST_LEVEL)]
Share = Annotated[float, Field(ge=0.0, le=0.2)]
Abg = tuple[
    Annotated[float, Field(ge=0.0, le=10.0)],
    Annotated[float, Field(ge=1e-9, le=10.0)],
    Annotated[float, Field(ge=0.5, le=5.0)],
]


class RowScatter(Frozen):
    """Parameters that differ at one row of the lens; None: the value of `Scatter`.

    Attributes
    ----------
    row : int
        Row of the lens, counted from 0.
    roughness_nm, correlation_um, slope, cleanliness_level, abg, share
        As in `Scatter`.
    """

    row: int = Field(ge=0, le=499)
    roughness_nm: Roughness | None = None
    correlation_um: Correlation | None = None
    slope: Slope | None = None
    cleanliness_level: Level | None = None
    abg: Abg | None = None
    share: Share | None = None


class Scatter(Frozen):
    """Scatter parameters of all surfaces of a lens.

    Attributes
    ----------
    model : {"none", "chaumond", "harvey-shack", "abg"}
        none: no scatter. chaumond: a fixed fraction of the light at every surface, by Chaumond's phase function.
        harvey-shack: scatter from surface roughness, by its RMS and correlation length. abg: a measured function. The
        last two also scatter from dust.
    roughness_nm : float
        Root mean square of the surface's height, nm.
    correlation_um : float
        Correlation length of the roughness, micrometres.
    slope : float
        Exponent by which scatter from roughness falls at large angles.
    cleanliness_level : float or None
        Dust on surfaces in air, by IEST-STD-CC1246 (MIL-STD-1246): level L has one particle of L micrometres or more
        on 0.1 m^2. None: no dust.
    abg : tuple of float
        A, B, g of the scatter function A / (B + |beta - beta0|^g), 1/sr, on surfaces in air.
    share : float
        Fraction of the light that Chaumond's model scatters at every surface.
    rows : tuple of RowScatter
        Exceptions.
    """

    model: ScatterModel = "none"
    roughness_nm: Roughness = 1.0
    correlation_um: Correlation = 10.0
    slope: Slope = 2.5
    cleanliness_level: Level | None = None
    abg: Abg = (2e-5, 1e-3, 2.0)
    share: Share = 0.001
    rows: tuple[RowScatter, ...] = ()

    @field_validator("rows")
    @classmethod
    def _rows_differ(cls, exceptions: tuple[RowScatter, ...]) -> tuple[RowScatter, ...]:
        rows = [exception.row for exception in exceptions]
        for row in rows:
            if rows.count(row) > 1:
                raise ValueError(f"row {row} appears {rows.count(row)} times; keep one")
        return exceptions

    def at(self, row: int) -> Scatter:
        """Return the parameters of one row of the lens, exceptions applied."""
        for exception in self.rows:
            if exception.row == row:
                changes = {key: value for key, value in exception if value is not None and key != "row"}
                return self.replace(rows=(), **changes)
        return self
