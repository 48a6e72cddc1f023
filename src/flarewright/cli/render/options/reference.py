"""Options of `flarewright render`: reference quality: errors, samples, time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

PANEL = "Reference quality"


@dataclass(frozen=True, kw_only=True)
class ReferenceOptions:
    """Reference quality: errors, samples, time. None or empty: not given."""

    seed: Annotated[
        int | None, typer.Option(help="Seed of all random numbers: rays, dirt, rough edges.", rich_help_panel=PANEL)
    ] = None
    error: Annotated[
        float | None,
        typer.Option(help="Trace until this relative standard error (default: 0.02).", rich_help_panel=PANEL),
    ] = None
    error_of: Annotated[
        str | None,
        typer.Option(help="Error of blocks (16x16 pixels) or of the total of all ghosts.", rich_help_panel=PANEL),
    ] = None
    rays_from: Annotated[
        str | None, typer.Option(help="Sampling of area lights: auto, light or camera.", rich_help_panel=PANEL)
    ] = None
    samples: Annotated[
        int | None, typer.Option(help="Largest number of traced points on the front.", rich_help_panel=PANEL)
    ] = None
    time_limit: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Stop after this time.", rich_help_panel=PANEL)
    ] = None
    resume: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Resume from a .state.npz file.", rich_help_panel=PANEL)
    ] = None
