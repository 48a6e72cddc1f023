"""Options of `flarewright render`: reference quality: errors, samples, time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Reference quality")


@dataclass(frozen=True, kw_only=True)
class ReferenceOptions:
    """Reference quality: errors, samples, time. None or empty: not given."""

    seed: Annotated[int | None, option(help="Seed of all random numbers: rays, dirt, rough edges.")] = None
    error: Annotated[float | None, option(help="Trace until this relative standard error (default: 0.02).")] = None
    error_of: Annotated[str | None, option(help="Error of blocks (16x16 pixels) or of the total of all ghosts.")] = None
    rays_from: Annotated[str | None, option(help="Sampling of area lights: auto, light or camera.")] = None
    samples: Annotated[int | None, option(help="Largest number of traced points on the front.")] = None
    time_limit: Annotated[float | None, option(metavar="SECONDS", help="Stop after this time.")] = None
    resume: Annotated[Path | None, option(metavar="FILE", help="Resume from a .state.npz file.")] = None
