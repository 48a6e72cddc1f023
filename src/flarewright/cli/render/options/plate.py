"""Options of `flarewright shot` and `flarewright sources`: a plate, and which areas of it are light sources."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Plate")


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

    plate_layer: Annotated[str | None, option(metavar="NAME", help="Layer of an EXR plate.")] = None
    plate_transfer: Annotated[
        str | None,
        option(
            metavar="NAME", help="Codes: srgb, linear, rec709, gamma22, gamma28, pq or hlg (default: as the file is)."
        ),
    ] = None
    threshold: Annotated[float | None, option(help="Plate value above which a pixel is a light (luminance).")] = None
    stops: Annotated[float | None, option(help="The same in stops above the plate's mean (default: 5).")] = None
    flare_matte: Annotated[
        str | None, option(metavar="FILE", help="Picture or sequence; black areas do not flare.")
    ] = None
    least_pixels: Annotated[int | None, option(help="Leave out sources of fewer pixels (default: 1).")] = None
    most_lights: Annotated[int | None, option(help="Lights a frame; fainter ones are joined (default: 32).")] = None
    point_size: Annotated[
        float | None, option(metavar="PX", help="Sources narrower than this are points (default: 0.5 % of the width).")
    ] = None
    fade: Annotated[
        int | None, option(metavar="FRAMES", help="Time in which lights near the threshold fade (default: 4).")
    ] = None
    plate_gain: Annotated[float | None, option(metavar="FACTOR", help="Factor of the lights found in the plate.")] = (
        None
    )
    highlights: Annotated[
        float | None, option(metavar="VALUE", help="Value that white of a display plate stands for, such as 50.")
    ] = None
    white: Annotated[
        float | None, option(metavar="VALUE", help="Plate value of white paper in the sun, for --source.")
    ] = None
    source: Annotated[
        str | None, option(metavar="LAMP", help="The light is the sun, headlight@METRES or lamp:LUMEN@METRES.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class CompOptions:
    """The comp. None: not given."""

    over: Annotated[str | None, option(metavar="NAME.####.exr", help="Also write the plate with its flare.")] = None
