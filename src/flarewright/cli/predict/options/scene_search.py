"""Options of `flarewright predict`: a scene: a better camera position, and shots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Scene")


@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """A scene: a better camera position, and shots. None: not given."""

    near: Annotated[str | None, option(metavar="CAMERA", help="Search a better position near this camera.")] = None
    radius: Annotated[float | None, option(help="For --near: horizontal distance, m (default: 5).")] = None
    height: Annotated[float | None, option(help="For --near: vertical distance, m (default: 0).")] = None
    shortest_shot: Annotated[
        float | None, option(help="Shortest time between two camera switches, seconds (default: 0).")
    ] = None
