"""A camera and a light in space, for the replay of a measured flare."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ..base import Frozen

Vector = tuple[float, float, float]
Side = Annotated[int, Field(ge=1, le=65536)]


class ReplayCamera(Frozen):
    """Contents of the file of `flarewright measure replay --camera FILE`.

    Attributes
    ----------
    schema_version : 1
    position, forward, up : tuple of float
        In any right-handed frame.
    light : tuple of float or None
        Position of the light in the same frame and unit; None: constellation and roll come from elsewhere.
    size_px : tuple of int or None
        Width and height of the picture; None: as the captures. The horizontal field of view stays the same.
    f_number, iso, exposure_s : float or None
        None: as in the captures.
    luminance_cd_m2, solid_angle_sr : float or None
        Of the light; None: as in the captures.
    """

    schema_version: Literal[1] = 1
    position: Vector = (0.0, 0.0, 0.0)
    forward: Vector = (0.0, 0.0, -1.0)
    up: Vector = (0.0, 1.0, 0.0)
    light: Vector | None = None
    size_px: tuple[Side, Side] | None = None
    f_number: float | None = Field(None, gt=0.0)
    iso: float | None = Field(None, gt=0.0)
    exposure_s: float | None = Field(None, gt=0.0)
    luminance_cd_m2: float | None = Field(None, gt=0.0)
    solid_angle_sr: float | None = Field(None, gt=0.0)
