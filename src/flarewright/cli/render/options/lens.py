"""Options of `flarewright render`: the lens: aperture, iris, coating, scatter, zoom, filters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

PANEL = "Lens"


@dataclass(frozen=True, kw_only=True)
class LensOptions:
    """The lens: aperture, iris, coating, scatter, zoom, filters. None or empty: not given."""

    fstop: Annotated[
        float | None,
        typer.Option(
            help="f-number (default: two stops down for a library lens, else wide open).", rich_help_panel=PANEL
        ),
    ] = None
    blades: Annotated[int | None, typer.Option(help="Number of iris blades; 0 is round.", rich_help_panel=PANEL)] = None
    rotation: Annotated[
        float | None, typer.Option(help="Rotation of the blades, degrees counter-clockwise.", rich_help_panel=PANEL)
    ] = None
    rounding: Annotated[
        float | None, typer.Option(help="Rounding of the blades: 0 straight, 1 a full circle.", rich_help_panel=PANEL)
    ] = None
    iris_image: Annotated[
        Path | None, typer.Option(help="A grey image as the iris; white transmits.", rich_help_panel=PANEL)
    ] = None
    roughness: Annotated[
        float | None, typer.Option(help="Rms roughness of the blades' edges, micrometres.", rich_help_panel=PANEL)
    ] = None
    coating: Annotated[
        str | None,
        typer.Option(
            help="none, quarter-wave:NM, preset:NAME, lens, a name of `flarewright coating list`, film:N:NM, "
            "stack:N:NM,... or a coating file.",
            rich_help_panel=PANEL,
        ),
    ] = None
    ideal: Annotated[
        bool,
        typer.Option(
            "--ideal",
            help="Use a library lens as in its file: wide open, bare unless its file has coatings, straight blades, a "
            "point light (default: stopped down, coated, as photographed).",
            rich_help_panel=PANEL,
        ),
    ] = False
    focus: Annotated[
        float | None,
        typer.Option(help="Plane in focus, mm in front of the lens (default: infinity).", rich_help_panel=PANEL),
    ] = None
    scatter: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL", help="Scatter model of surfaces: none, harvey-shack, abg, chaumond.", rich_help_panel=PANEL
        ),
    ] = None
    surface_roughness: Annotated[
        float | None,
        typer.Option(help="Rms roughness of the surfaces, nm, for scatter (default: 1).", rich_help_panel=PANEL),
    ] = None
    cleanliness: Annotated[
        float | None,
        typer.Option(help="Dust on the surfaces: level of IEST-STD-CC1246, for example 300.", rich_help_panel=PANEL),
    ] = None
    zoom: Annotated[
        str | None,
        typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.", rich_help_panel=PANEL),
    ] = None
    filter_plate: Annotated[
        str | None,
        typer.Option(
            "--filter",
            metavar="GLASS:MM[:GAP]",
            help="Plane filter in front: N-BK7:2, or with its gap to the lens, 1.52:2:10.",
            rich_help_panel=PANEL,
        ),
    ] = None
    imperfection: Annotated[
        str | None,
        typer.Option(
            metavar="SEED[:UM:ARCMIN[:NM]]",
            help="Random sample within tolerances: decentre (10 um), tilt (1 arcmin), figure (0 nm rms).",
            rich_help_panel=PANEL,
        ),
    ] = None
