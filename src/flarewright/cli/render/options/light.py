"""Options of `flarewright render`: the lights, and what hides them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Light")


@dataclass(frozen=True, kw_only=True)
class LightOptions:
    """The lights, and what hides them. None or empty: not given."""

    light: Annotated[
        list[str],
        option(
            metavar="X,Y",
            help="Field angles in degrees, right and up, or sun@X,Y for a disc of 0.53 degrees; may be repeated.",
        ),
    ] = field(default_factory=list)
    intensity: Annotated[list[float], option(help="Irradiance of the light; once for all, or once per light.")] = field(
        default_factory=list
    )
    spectrum: Annotated[
        list[str],
        option(
            help="d65, equal-energy, black-body:K, lines:NM,NM*POWER, rgb:R,G,B (linear Rec.709) or a .csv: once for "
            "all, or once per light."
        ),
    ] = field(default_factory=list)
    light_diameter: Annotated[
        list[float], option(help="Angular diameter of the light, degrees; 0.53 for the sun, 0 is a point.")
    ] = field(default_factory=list)
    light_size: Annotated[
        list[str], option(metavar="WxH", help="Width and height of a uniform rectangular light, degrees.")
    ] = field(default_factory=list)
    light_polygon: Annotated[
        list[str], option(metavar="'X,Y X,Y X,Y'", help="Corners of a uniform polygonal light, degrees from its place.")
    ] = field(default_factory=list)
    distance: Annotated[
        list[float],
        option(help="Distance of the light in front of the lens, mm; once for all, or once per light (default: inf)."),
    ] = field(default_factory=list)
    holdout: Annotated[Path | None, option(help="An image in the picture's frame; black hides lights.")] = None
    depth: Annotated[Path | None, option(help="An EXR depth plate in metres; nearer parts hide lights.")] = None
