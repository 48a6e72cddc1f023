"""Options of `flarewright predict`: the curves of a lens or a measured flare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

PANEL = "Curves of a lens or a measured flare"


@dataclass(frozen=True, kw_only=True)
class CurveOptions:
    """The curves of a lens or a measured flare. None: not given."""

    spectrum: Annotated[
        str | None,
        typer.Option(help="Spectrum of the light: d65, black-body:K, or others as in `render`.", rich_help_panel=PANEL),
    ] = None
    light_diameter: Annotated[
        float | None,
        typer.Option(help="Angular diameter of the light, degrees; 0.53 for the sun.", rich_help_panel=PANEL),
    ] = None
    roll: Annotated[
        float | None,
        typer.Option(help="Direction of the light around the axis, degrees from the right.", rich_help_panel=PANEL),
    ] = None
    to: Annotated[
        float | None, typer.Option(help="Largest constellation, degrees (default: 85).", rich_help_panel=PANEL)
    ] = None
    bins: Annotated[
        int | None,
        typer.Option(
            min=2, max=20, help="Number of bins between a curve's extremes (default: 5).", rich_help_panel=PANEL
        ),
    ] = None
    illuminance: Annotated[
        float | None,
        typer.Option(
            help="Of the light on a plane facing it, lx (default: 1e5, the sun). For a measured flare: that of the "
            "light to predict; its model must contain the luminance and solid angle of the photographed light.",
            rich_help_panel=PANEL,
        ),
    ] = None
    luminance: Annotated[
        str | None,
        typer.Option(
            metavar="MIN,MAX",
            help="Darkest and brightest luminance of the scene, cd/m², for contrast.",
            rich_help_panel=PANEL,
        ),
    ] = None
    tolerance: Annotated[
        float | None, typer.Option(help="Error of the curves between samples (default: 0.03).", rich_help_panel=PANEL)
    ] = None
    samples: Annotated[
        int | None,
        typer.Option(
            min=5, max=2000, help="Largest number of constellations to render (default: 48).", rich_help_panel=PANEL
        ),
    ] = None
    check: Annotated[
        int | None,
        typer.Option(
            min=0, max=100, help="Number of final renders to check the curves (default: 4).", rich_help_panel=PANEL
        ),
    ] = None
