"""Options of `flarewright render` and `flarewright shot`: which layers are written, and in what form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Output")


@dataclass(frozen=True, kw_only=True)
class LayerOptions:
    """Which layers are written, and in what form. None or empty: not given."""

    layers: Annotated[
        str | None, option(help="Layers: beauty; passes: also starburst, ghosts; ghosts: also each ghost.")
    ] = None
    brightest: Annotated[int | None, option(help="Largest number of single ghosts to write, brightest first.")] = None
    matte: Annotated[str | None, option(help="ghosts: also a Cryptomatte that picks single ghosts; none: default.")] = (
        None
    )
    matte_ranks: Annotated[
        int | None, option(help="Ghosts a pixel in the Cryptomatte, an even number (default: 8).")
    ] = None
    no_starburst: Annotated[bool, option("--no-starburst", help="Omit the light's direct image.")] = False
    colorspace: Annotated[
        str | None,
        option(metavar="NAME", help="Linear colour space: rec709 (default), acescg, or a name or role of OpenColorIO."),
    ] = None
    ocio: Annotated[
        Path | None,
        option(metavar="FILE", help="OpenColorIO configuration of --colorspace (default: OCIO, or the built-in one)."),
    ] = None
    gamut: Annotated[str | None, option(help="keep negative channels (default), or compress colours.")] = None
    half: Annotated[bool, option("--half", help="Write 16 bits per value (default).")] = False
    float32: Annotated[bool, option("--float", help="Write 32 bits per value, unscaled irradiances.")] = False
    compression: Annotated[
        str | None, option(help="Compression of the EXR: zip, lossless (default), or dwaa, lossy.")
    ] = None
