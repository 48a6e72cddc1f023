"""Options of `flarewright render`: what is written, and how the PNG shows it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

PANEL = "Output"


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """What is written, and how the PNG shows it. None or empty: not given."""

    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="OUT.exr", help="The EXR file.", rich_help_panel=PANEL)
    ]
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
    no_starburst: Annotated[
        bool, typer.Option("--no-starburst", help="Omit the light's direct image.", rich_help_panel=PANEL)
    ] = False
    colorspace: Annotated[
        str | None, typer.Option(help="Colour space, linear: rec709 or acescg.", rich_help_panel=PANEL)
    ] = None
    gamut: Annotated[
        str | None,
        typer.Option(help="keep negative channels (default), or compress colours.", rich_help_panel=PANEL),
    ] = None
    half: Annotated[bool, typer.Option("--half", help="Write 16 bits per value (default).", rich_help_panel=PANEL)] = (
        False
    )
    float32: Annotated[
        bool, typer.Option("--float", help="Write 32 bits per value, unscaled irradiances.", rich_help_panel=PANEL)
    ] = False
    full_windows: Annotated[
        bool,
        typer.Option("--full-windows", help="Write single ghosts at full size, for Blender.", rich_help_panel=PANEL),
    ] = False
    exposure: Annotated[
        float | None, typer.Option(help="Exposure of the PNG in stops (default: automatic).", rich_help_panel=PANEL)
    ] = None
    ev: Annotated[
        float | None,
        typer.Option(help="Exposure of the PNG as exposure value, log2(N^2 / t).", rich_help_panel=PANEL),
    ] = None
    shutter: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS", help="Exposure of the PNG as shutter time, for example 1/250.", rich_help_panel=PANEL
        ),
    ] = None
    iso: Annotated[
        float | None, typer.Option(help="ISO, with --ev or --shutter (default: 100).", rich_help_panel=PANEL)
    ] = None
    lux: Annotated[
        str | None,
        typer.Option(
            help="Illuminance of a light of intensity 1, with --ev or --shutter (default: sun, 100 000).",
            rich_help_panel=PANEL,
        ),
    ] = None
    view: Annotated[
        str | None,
        typer.Option(help="View of the PNG: filmic (default), srgb or aces.", rich_help_panel=PANEL),
    ] = None
    no_png: Annotated[bool, typer.Option("--no-png", help="Write no PNG beside the EXR.", rich_help_panel=PANEL)] = (
        False
    )
    ledger: Annotated[bool, typer.Option("--ledger", help="Print where the light went.", rich_help_panel=PANEL)] = False
    profile: Annotated[
        bool, typer.Option("--profile", help="Print what each ghost costs to draw.", rich_help_panel=PANEL)
    ] = False
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as one JSON object.", rich_help_panel=PANEL)
    ] = False
