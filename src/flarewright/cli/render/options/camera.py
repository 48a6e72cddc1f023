"""Options of `flarewright render`: the sensor and the picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Camera")


@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """The sensor and the picture. None or empty: not given."""

    cover_glass: Annotated[
        str | None, option(metavar="GLASS:MM[:GAP]", help="Plane glass in front of the sensor: N-BK7:2:0.5.")
    ] = None
    sensor_reflectance: Annotated[float | None, option(help="Reflectance of the sensor, 0 to 1 (default: 0).")] = None
    sensor_grating: Annotated[
        str | None,
        option(
            metavar="UM[:FILL[:ORDERS]]", help="Period of its pixels, which diffract reflected light (final): 8:0.7:3."
        ),
    ] = None
    squeeze: Annotated[float | None, option(help="Squeeze of an anamorphic lens (default: from its file).")] = None
    desqueeze: Annotated[bool, option("--desqueeze", help="Draw an anamorphic picture wide.")] = False
    size: Annotated[str | None, option(metavar="WxH", help="Picture in pixels (default: 1280x720).")] = None
    sensor: Annotated[
        str | None,
        option(
            metavar="WxH|CAMERA",
            help="Sensor in mm (default: 36 wide, square pixels), or one of `flarewright cameras`.",
        ),
    ] = None
    crop: Annotated[
        str | None, option(metavar="WxH|P%", help="Middle of the picture that stays, in pixels or percent.")
    ] = None
    overscan: Annotated[
        str | None, option(metavar="P%|PX", help="Part or pixels (on each side) drawn around the picture.")
    ] = None
    sensor_distance: Annotated[
        float | None, option(help="Last vertex to sensor, mm (default: the paraxial focus).")
    ] = None
