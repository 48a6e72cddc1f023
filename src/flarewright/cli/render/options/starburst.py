"""Options of `flarewright render`: dirt in the pupil and its effect on the starburst."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

PANEL = "Starburst"


@dataclass(frozen=True, kw_only=True)
class StarburstOptions:
    """Dirt in the pupil and its effect on the starburst. None or empty: not given."""

    dust: Annotated[float | None, typer.Option(help="Dust grains per mm^2 of the stop.", rich_help_panel=PANEL)] = None
    scratches: Annotated[float | None, typer.Option(help="Scratches per cm^2 of the stop.", rich_help_panel=PANEL)] = (
        None
    )
    fingerprint: Annotated[
        float | None, typer.Option(help="Light absorbed by the ridges of a fingerprint, 0 to 1.", rich_help_panel=PANEL)
    ] = None
    dirt_image: Annotated[
        Path | None, typer.Option(help="A grey image of dirt over the stop; white transmits.", rich_help_panel=PANEL)
    ] = None
    cats_eye: Annotated[
        bool,
        typer.Option("--cats-eye", help="Use the pupil as clipped by rims for the starburst.", rich_help_panel=PANEL),
    ] = False
