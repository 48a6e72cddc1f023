"""Options of `flarewright render`: what is written, and how the PNG shows it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from .layers import PANEL, LayerOptions


@dataclass(frozen=True, kw_only=True)
class FileOption:
    """Where the picture is written."""

    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="OUT.exr", help="The EXR file.", rich_help_panel=PANEL)
    ]


@dataclass(frozen=True, kw_only=True)
class OutputOptions(LayerOptions, FileOption):
    """What is written, and how the PNG shows it. None or empty: not given."""

    full_windows: Annotated[
        bool,
        typer.Option("--full-windows", help="Write single ghosts at full size, for Blender.", rich_help_panel=PANEL),
    ] = False
    exposure: Annotated[
        float | None, typer.Option(help="Exposure of the PNG in stops (default: automatic).", rich_help_panel=PANEL)
    ] = None
    ev: Annotated[
        float | None, typer.Option(help="Exposure of the PNG as exposure value, log2(N^2 / t).", rich_help_panel=PANEL)
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
        str | None, typer.Option(help="View of the PNG: filmic (default), srgb or aces.", rich_help_panel=PANEL)
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
