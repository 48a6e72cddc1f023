"""Options of `flarewright predict`: a scene: a better camera position, and shots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

PANEL = "Scene"


@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """A scene: a better camera position, and shots. None: not given."""

    near: Annotated[
        str | None,
        typer.Option(metavar="CAMERA", help="Search a better position near this camera.", rich_help_panel=PANEL),
    ] = None
    radius: Annotated[
        float | None, typer.Option(help="For --near: horizontal distance, m (default: 5).", rich_help_panel=PANEL)
    ] = None
    height: Annotated[
        float | None, typer.Option(help="For --near: vertical distance, m (default: 0).", rich_help_panel=PANEL)
    ] = None
    shortest_shot: Annotated[
        float | None,
        typer.Option(help="Shortest time between two camera switches, seconds (default: 0).", rich_help_panel=PANEL),
    ] = None
