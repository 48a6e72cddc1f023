"""Options of `flarewright render`: dirt in the pupil and its effect on the starburst."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Starburst")


@dataclass(frozen=True, kw_only=True)
class StarburstOptions:
    """Dirt in the pupil and its effect on the starburst. None or empty: not given."""

    dust: Annotated[float | None, option(help="Dust grains per mm^2 of the stop.")] = None
    scratches: Annotated[float | None, option(help="Scratches per cm^2 of the stop.")] = None
    fingerprint: Annotated[float | None, option(help="Light absorbed by the ridges of a fingerprint, 0 to 1.")] = None
    dirt_image: Annotated[Path | None, option(help="A grey image of dirt over the stop; white transmits.")] = None
    cats_eye: Annotated[bool, option("--cats-eye", help="Use the pupil as clipped by rims for the starburst.")] = False
