"""Options of `flarewright predict`: the curves of a lens or a measured flare."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Curves of a lens or a measured flare")


@dataclass(frozen=True, kw_only=True)
class CurveOptions:
    """The curves of a lens or a measured flare. None: not given."""

    spectrum: Annotated[
        str | None, option(help="Spectrum of the light: d65, black-body:K, or others as in `render`.")
    ] = None
    light_diameter: Annotated[
        float | None, option(help="Angular diameter of the light, degrees; 0.53 for the sun.")
    ] = None
    roll: Annotated[float | None, option(help="Direction of the light around the axis, degrees from the right.")] = None
    to: Annotated[float | None, option(help="Largest constellation, degrees (default: 85).")] = None
    bins: Annotated[
        int | None, option(min=2, max=20, help="Number of bins between a curve's extremes (default: 5).")
    ] = None
    illuminance: Annotated[
        float | None,
        option(
            help="Of the light on a plane facing it, lx (default: 1e5, the sun). For a measured flare: that of the "
            "light to predict; its model must contain the luminance and solid angle of the photographed light."
        ),
    ] = None
    luminance: Annotated[
        str | None, option(metavar="MIN,MAX", help="Darkest and brightest luminance of the scene, cd/m², for contrast.")
    ] = None
    tolerance: Annotated[float | None, option(help="Error of the curves between samples (default: 0.03).")] = None
    samples: Annotated[
        int | None, option(min=5, max=2000, help="Largest number of constellations to render (default: 48).")
    ] = None
    check: Annotated[
        int | None, option(min=0, max=100, help="Number of final renders to check the curves (default: 4).")
    ] = None
