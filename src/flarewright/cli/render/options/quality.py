"""Options of `flarewright render`: how the picture is computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

PANEL = "Quality"


@dataclass(frozen=True, kw_only=True)
class QualityOptions:
    """How the picture is computed. None or empty: not given."""

    quality: Annotated[
        str | None,
        typer.Option(
            help="draft: matrices, milliseconds; final: traced rays; reference: Monte Carlo, all orders, with errors.",
            rich_help_panel=PANEL,
        ),
    ] = None
    wavelengths: Annotated[
        int | None,
        typer.Option(help="Number of traced wavelengths: 3 for a draft, 7 to 31 for final.", rich_help_panel=PANEL),
    ] = None
    paths: Annotated[
        str | None, typer.Option(help="Ghost paths: all, or same-side of the stop.", rich_help_panel=PANEL)
    ] = None
    ringing: Annotated[
        str | None,
        typer.Option(
            help="Rings inside ghosts, final quality: collins, exact paraxial diffraction (default); frft, Hullin's "
            "estimate; off.",
            rich_help_panel=PANEL,
        ),
    ] = None
    threads: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number of threads, without effect on pixels (default: all cores).", rich_help_panel=PANEL
        ),
    ] = None
    orders: Annotated[
        int | None,
        typer.Option(help="Reflections: 4 also draws ghosts of four (final; default: 2).", rich_help_panel=PANEL),
    ] = None
    order4_limit: Annotated[
        float | None,
        typer.Option(
            help="Draw those above this fraction of the two-reflection light (default: 1e-4).", rich_help_panel=PANEL
        ),
    ] = None
