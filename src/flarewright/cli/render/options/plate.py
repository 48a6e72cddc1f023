"""Options of `flarewright shot` and `flarewright sources`: a plate, and which areas of it are light sources."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

PANEL = "Plate"


@dataclass(frozen=True, kw_only=True)
class PlateFile:
    """The plate. None: not given."""

    plate: Annotated[
        str | None,
        typer.Argument(
            metavar="PLATE",
            help="A picture, plate.####.exr (EXR, TIFF, PNG, JPEG) or a film, whose bright areas are lights.",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class PlateOptions:
    """How a plate is read and searched. None: not given."""

    plate_layer: Annotated[
        str | None, typer.Option(metavar="NAME", help="Layer of an EXR plate.", rich_help_panel=PANEL)
    ] = None
    plate_transfer: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Codes: srgb, linear, rec709, gamma22, gamma28, pq or hlg (default: as the file is).",
            rich_help_panel=PANEL,
        ),
    ] = None  # fmt: skip
    threshold: Annotated[
        float | None,
        typer.Option(help="Plate value above which a pixel is a light (luminance).", rich_help_panel=PANEL),
    ] = None
    stops: Annotated[
        float | None, typer.Option(help="The same in stops above the plate's mean (default: 5).", rich_help_panel=PANEL)
    ] = None
    flare_matte: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Picture or sequence; black areas do not flare.", rich_help_panel=PANEL),
    ] = None
    least_pixels: Annotated[
        int | None, typer.Option(help="Leave out sources of fewer pixels (default: 1).", rich_help_panel=PANEL)
    ] = None
    most_lights: Annotated[
        int | None, typer.Option(help="Lights a frame; fainter ones are joined (default: 32).", rich_help_panel=PANEL)
    ] = None
    point_size: Annotated[
        float | None,
        typer.Option(
            metavar="PX", help="Sources narrower than this are points (default: 0.5 % of the width).",
            rich_help_panel=PANEL,
        ),
    ] = None  # fmt: skip
    fade: Annotated[
        int | None,
        typer.Option(
            metavar="FRAMES", help="Time in which lights near the threshold fade (default: 4).", rich_help_panel=PANEL
        ),
    ] = None
    plate_gain: Annotated[
        float | None,
        typer.Option(metavar="FACTOR", help="Factor of the lights found in the plate.", rich_help_panel=PANEL),
    ] = None
    highlights: Annotated[
        float | None,
        typer.Option(
            metavar="VALUE", help="Value that white of a display plate stands for, such as 50.", rich_help_panel=PANEL
        ),
    ] = None
    white: Annotated[
        float | None,
        typer.Option(
            metavar="VALUE", help="Plate value of white paper in the sun, for --source.", rich_help_panel=PANEL
        ),
    ] = None
    source: Annotated[
        str | None,
        typer.Option(
            metavar="LAMP", help="The light is the sun, headlight@METRES or lamp:LUMEN@METRES.", rich_help_panel=PANEL
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class CompOptions:
    """The comp. None: not given."""

    over: Annotated[
        str | None,
        typer.Option(
            metavar="NAME.####.exr", help="Also write the plate with its flare.", rich_help_panel=PANEL
        ),
    ] = None  # fmt: skip
