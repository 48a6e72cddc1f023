"""Options of `flarewright render` and `flarewright shot`: lights in pixels, tracks, the sun."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Places of lights")


@dataclass(frozen=True, kw_only=True)
class PlaceOptions:
    """Lights in pixels, tracks, the sun. None or empty: not given."""

    light_px: Annotated[
        list[str],
        option(
            metavar="X,Y",
            help="A light whose direct image lies at this pixel, or sun@X,Y; may be repeated, behind those of --light.",
        ),
    ] = field(default_factory=list)
    px_origin: Annotated[
        str | None,
        option(metavar="CORNER", help="Corner from which pixels count: top-left (default) or bottom-left, as in Nuke."),
    ] = None
    sun: Annotated[
        str | None,
        option(
            metavar="WHEN,LAT,LON",
            help="The sun at a time and place, 2024-06-21T18:00+02:00,48.14,11.58 (degrees north and east).",
        ),
    ] = None
    heading: Annotated[
        float | None, option(help="With --sun: where the camera looks, degrees clockwise from north.")
    ] = None
    tilt: Annotated[float | None, option(help="With --sun: degrees above the horizon (default: 0).")] = None
    roll: Annotated[float | None, option(help="With --sun: degrees by which the camera leans right (default: 0).")] = (
        None
    )
    track: Annotated[
        list[str],
        option(
            metavar="[LIGHT=]FILE",
            help="Path of a light in pixels: CSV, Nuke, After Effects, SynthEyes, 3DEqualizer, Blender, USD; LIGHT is "
            "an index, a name or new.",
        ),
    ] = field(default_factory=list)
    track_format: Annotated[
        str | None,
        option(
            metavar="NAME",
            help="csv, nuke, nuke-ascii, after-effects, syntheyes, 3de, blender or usd (default: by contents).",
        ),
    ] = None
    track_size: Annotated[
        str | None, option(metavar="WxH", help="Size of the picture in which tracks count (default: that of the shot).")
    ] = None
    track_offset: Annotated[float | None, option(metavar="FRAMES", help="Frames to add to the frames of tracks.")] = (
        None
    )
