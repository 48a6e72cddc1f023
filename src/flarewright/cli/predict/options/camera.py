"""Options of `flarewright predict`: the lens and the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import typer

PANEL = "Camera"


@dataclass(frozen=True, kw_only=True)
class PredictCameraOptions:
    """The lens and the camera. None: not given."""

    fstop: Annotated[float | None, typer.Option(help="f-number (default: wide open).", rich_help_panel=PANEL)] = None
    coating: Annotated[
        str | None,
        typer.Option(help="lens, none, preset:NAME, quarter-wave:NM, or others as in `render`.", rich_help_panel=PANEL),
    ] = None
    zoom: Annotated[
        str | None,
        typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.", rich_help_panel=PANEL),
    ] = None
    focus: Annotated[
        float | None, typer.Option(help="Plane in focus, mm (default: infinity).", rich_help_panel=PANEL)
    ] = None
    sensor: Annotated[str | None, typer.Option(metavar="WxH", help="Sensor in mm (36x24).", rich_help_panel=PANEL)] = (
        None
    )
    unit_per_cd_m2: Annotated[
        float | None,
        typer.Option(
            help="Of a measured flare: value of a grey card of 1 cd/m² in its captures; without "
            "it there is no veil and no contrast.",
            rich_help_panel=PANEL,
        ),
    ] = None
    count: Annotated[
        Literal["all", "ghosts"] | None,
        typer.Option(
            metavar="all|ghosts",
            help="Of a measured flare: all light except around the light source (default), or ghosts only.",
            rich_help_panel=PANEL,
        ),
    ] = None
    around_light: Annotated[
        float | None,
        typer.Option(
            metavar="PART",
            help="Of a measured flare: radius around the light's image in which only ghosts count, as a fraction of "
            "the picture's width (default: 0.0556); 0 counts the light's image too.",
            rich_help_panel=PANEL,
        ),
    ] = None
