"""Options of `flarewright render`: the lens: aperture, iris, coating, scatter, zoom, filters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Lens")


@dataclass(frozen=True, kw_only=True)
class LensOptions:
    """The lens: aperture, iris, coating, scatter, zoom, filters. None or empty: not given."""

    fstop: Annotated[
        float | None, option(help="f-number (default: two stops down for a library lens, else wide open).")
    ] = None
    blades: Annotated[int | None, option(help="Number of iris blades; 0 is round.")] = None
    rotation: Annotated[float | None, option(help="Rotation of the blades, degrees counter-clockwise.")] = None
    rounding: Annotated[float | None, option(help="Rounding of the blades: 0 straight, 1 a full circle.")] = None
    iris_image: Annotated[Path | None, option(help="A grey image as the iris; white transmits.")] = None
    roughness: Annotated[float | None, option(help="Rms roughness of the blades' edges, micrometres.")] = None
    coating: Annotated[
        str | None,
        option(
            help="none, quarter-wave:NM, preset:NAME, lens, a name of `flarewright coating list`, film:N:NM, "
            "stack:N:NM,... or a coating file."
        ),
    ] = None
    ideal: Annotated[
        bool,
        option(
            "--ideal",
            help="Use a library lens as in its file: wide open, bare unless its file has coatings, straight blades, a "
            "point light (default: stopped down, coated, as photographed).",
        ),
    ] = False
    focus: Annotated[float | None, option(help="Plane in focus, mm in front of the lens (default: infinity).")] = None
    scatter: Annotated[
        str | None, option(metavar="MODEL", help="Scatter model of surfaces: none, harvey-shack, abg, chaumond.")
    ] = None
    surface_roughness: Annotated[
        float | None, option(help="Rms roughness of the surfaces, nm, for scatter (default: 1).")
    ] = None
    cleanliness: Annotated[
        float | None, option(help="Dust on the surfaces: level of IEST-STD-CC1246, for example 300.")
    ] = None
    zoom: Annotated[str | None, option(metavar="MM|NAME", help="Focal length, or a position of the lens file.")] = None
    filter_plate: Annotated[
        str | None,
        option(
            "--filter",
            metavar="GLASS:MM[:GAP]",
            help="Plane filter in front: N-BK7:2, or with its gap to the lens, 1.52:2:10.",
        ),
    ] = None
    imperfection: Annotated[
        str | None,
        option(
            metavar="SEED[:UM:ARCMIN[:NM]]",
            help="Random sample within tolerances: decentre (10 um), tilt (1 arcmin), figure (0 nm rms).",
        ),
    ] = None
