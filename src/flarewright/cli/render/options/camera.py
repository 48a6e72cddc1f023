"""Options of `flarewright render`: the sensor and the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

PANEL = "Camera"


@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """The sensor and the picture. None or empty: not given."""

    cover_glass: Annotated[
        str | None,
        typer.Option(
            metavar="GLASS:MM[:GAP]", help="Plane glass in front of the sensor: N-BK7:2:0.5.", rich_help_panel=PANEL
        ),
    ] = None
    sensor_reflectance: Annotated[
        float | None,
        typer.Option(help="Reflectance of the sensor, 0 to 1 (default: 0).", rich_help_panel=PANEL),
    ] = None
    sensor_grating: Annotated[
        str | None,
        typer.Option(
            metavar="UM[:FILL[:ORDERS]]",
            help="Period of its pixels, which diffract reflected light (final): 8:0.7:3.",
            rich_help_panel=PANEL,
        ),
    ] = None
    squeeze: Annotated[
        float | None,
        typer.Option(help="Squeeze of an anamorphic lens (default: from its file).", rich_help_panel=PANEL),
    ] = None
    desqueeze: Annotated[
        bool, typer.Option("--desqueeze", help="Draw an anamorphic picture wide.", rich_help_panel=PANEL)
    ] = False
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Picture in pixels (default: 1280x720).", rich_help_panel=PANEL)
    ] = None
    sensor: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Sensor in mm (default: 36 wide, square pixels).", rich_help_panel=PANEL),
    ] = None
    sensor_distance: Annotated[
        float | None,
        typer.Option(help="Last vertex to sensor, mm (default: the paraxial focus).", rich_help_panel=PANEL),
    ] = None
