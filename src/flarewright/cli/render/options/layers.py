"""Options of `flarewright render` and `flarewright shot`: which layers are written, and in what form."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

PANEL = "Output"


@dataclass(frozen=True, kw_only=True)
class LayerOptions:
    """Which layers are written, and in what form. None or empty: not given."""

    layers: Annotated[
        str | None,
        typer.Option(
            help="Layers: beauty; passes: also starburst, ghosts; ghosts: also each ghost.", rich_help_panel=PANEL
        ),
    ] = None
    brightest: Annotated[
        int | None,
        typer.Option(help="Largest number of single ghosts to write, brightest first.", rich_help_panel=PANEL),
    ] = None
    matte: Annotated[
        str | None,
        typer.Option(help="ghosts: also a Cryptomatte that picks single ghosts; none: default.", rich_help_panel=PANEL),
    ] = None
    matte_ranks: Annotated[
        int | None,
        typer.Option(help="Ghosts a pixel in the Cryptomatte, an even number (default: 8).", rich_help_panel=PANEL),
    ] = None
    no_starburst: Annotated[
        bool, typer.Option("--no-starburst", help="Omit the light's direct image.", rich_help_panel=PANEL)
    ] = False
    colorspace: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Linear colour space: rec709 (default), acescg, or a name or role of OpenColorIO.",
            rich_help_panel=PANEL,
        ),
    ] = None  # fmt: skip
    ocio: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="OpenColorIO configuration of --colorspace (default: OCIO, or the built-in one).",
            rich_help_panel=PANEL,
        ),
    ] = None  # fmt: skip
    gamut: Annotated[
        str | None, typer.Option(help="keep negative channels (default), or compress colours.", rich_help_panel=PANEL)
    ] = None
    half: Annotated[bool, typer.Option("--half", help="Write 16 bits per value (default).", rich_help_panel=PANEL)] = (
        False
    )
    float32: Annotated[
        bool, typer.Option("--float", help="Write 32 bits per value, unscaled irradiances.", rich_help_panel=PANEL)
    ] = False
    compression: Annotated[
        str | None,
        typer.Option(help="Compression of the EXR: zip, lossless (default), or dwaa, lossy.", rich_help_panel=PANEL),
    ] = None
