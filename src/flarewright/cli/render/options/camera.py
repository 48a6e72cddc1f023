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
        float | None, typer.Option(help="Reflectance of the sensor, 0 to 1 (default: 0).", rich_help_panel=PANEL)
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
        typer.Option(
            metavar="WxH|CAMERA",
            help="Sensor in mm (default: 36 wide, square pixels), or one of `flarewright cameras`.",
            rich_help_panel=PANEL,
        ),
    ] = None
    crop: Annotated[
        str | None,
        typer.Option(
            metavar="WxH|P%", help="Middle of the picture that stays, in pixels or percent.", rich_help_panel=PANEL
        ),
    ] = None
    overscan: Annotated[
        str | None,
        typer.Option(
            metavar="P%|PX", help="Part or pixels (on each side) drawn around the picture.", rich_help_panel=PANEL
        ),
    ] = None
    sensor_distance: Annotated[
        float | None,
        typer.Option(help="Last vertex to sensor, mm (default: the paraxial focus).", rich_help_panel=PANEL),
    ] = None
