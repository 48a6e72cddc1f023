"""Options of `flarewright render`: what is rendered: a lens or a measured flare, a project, a look."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer


@dataclass(frozen=True, kw_only=True)
class InputOptions:
    """What is rendered: a lens or a measured flare, a project, a look. None or empty: not given."""

    lens: Annotated[
        str | None, typer.Argument(metavar="LENS", help="A shipped lens, a lens file, or a measured flare (.json).")
    ] = None
    project: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A project file, or an EXR with its project; flags override its settings."),
    ] = None
    look: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="Coatings, iris, dirt and light colours of one of `flarewright looks`; flags override it.",
        ),
    ] = None
    frame: Annotated[int | None, typer.Option(help="Draw this frame of a project that moves.")] = None
    at_s: Annotated[
        float | None, typer.Option("--time", metavar="SECONDS", help="Draw this moment of a project that moves.")
    ] = None
