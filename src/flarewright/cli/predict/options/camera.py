"""Options of `flarewright predict`: the lens and the camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

import typer

option = partial(typer.Option, rich_help_panel="Camera")


@dataclass(frozen=True, kw_only=True)
class PredictCameraOptions:
    """The lens and the camera. None: not given."""

    fstop: Annotated[float | None, option(help="f-number (default: wide open).")] = None
    coating: Annotated[
        str | None, option(help="lens, none, preset:NAME, quarter-wave:NM, or others as in `render`.")
    ] = None
    zoom: Annotated[str | None, option(metavar="MM|NAME", help="Focal length, or a position of the lens file.")] = None
    focus: Annotated[float | None, option(help="Plane in focus, mm (default: infinity).")] = None
    sensor: Annotated[str | None, option(metavar="WxH", help="Sensor in mm (36x24).")] = None
    unit_per_cd_m2: Annotated[
        float | None,
        option(
            help="Of a measured flare: value of a grey card of 1 cd/m² in its captures; without "
            "it there is no veil and no contrast."
        ),
    ] = None
    count: Annotated[
        Literal["all", "ghosts"] | None,
        option(
            metavar="all|ghosts",
            help="Of a measured flare: all light except around the light source (default), or ghosts only.",
        ),
    ] = None
    around_light: Annotated[
        float | None,
        option(
            metavar="PART",
            help="Of a measured flare: radius around the light's image in which only ghosts count, as a fraction of "
            "the picture's width (default: 0.0556); 0 counts the light's image too.",
        ),
    ] = None
