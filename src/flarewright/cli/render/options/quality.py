"""Options of `flarewright render`: how the picture is computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Quality")


@dataclass(frozen=True, kw_only=True)
class QualityOptions:
    """How the picture is computed. None or empty: not given."""

    quality: Annotated[
        str | None,
        option(
            help="draft: matrices, milliseconds; final: traced rays; reference: Monte Carlo, all orders, with errors."
        ),
    ] = None
    wavelengths: Annotated[
        int | None, option(help="Number of traced wavelengths: 3 for a draft, 7 to 31 for final.")
    ] = None
    paths: Annotated[str | None, option(help="Ghost paths: all, or same-side of the stop.")] = None
    ringing: Annotated[
        str | None,
        option(
            help="Rings inside ghosts, final quality: collins, exact paraxial diffraction (default); frft, Hullin's "
            "estimate; off."
        ),
    ] = None
    threads: Annotated[
        int | None, option(min=1, help="Number of threads, without effect on pixels (default: all cores).")
    ] = None
    orders: Annotated[int | None, option(help="Reflections: 4 also draws ghosts of four (final; default: 2).")] = None
    order4_limit: Annotated[
        float | None, option(help="Draw those above this fraction of the two-reflection light (default: 1e-4).")
    ] = None
