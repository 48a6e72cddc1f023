"""Options of `flarewright render`: overrides of the artist."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

import typer

option = partial(typer.Option, rich_help_panel="Art direction")


@dataclass(frozen=True, kw_only=True)
class ArtOptions:
    """Overrides of the artist. None or empty: not given."""

    starburst_size: Annotated[float | None, option(help="Factor on the size of the starburst; 1 is physical.")] = None
    starburst_spiral: Annotated[
        float | None, option(metavar="DEG", help="Blur the starburst over an angle, to hide fringes.")
    ] = None
    ghost_offset: Annotated[
        float | None,
        option(metavar="MM", help="Standard deviation of random ghost shifts; seeded by --imperfection, else --seed."),
    ] = None
    rule: Annotated[
        list[str],
        option(
            metavar="RULE",
            help="Add a rule of [\\[art.rules]]: 'select = \"row:7\", tint = [1, 0.6, 0.3], scale = 2'; repeatable.",
        ),
    ] = field(default_factory=list)
    mute: Annotated[
        list[str],
        option(
            metavar="GHOSTS",
            help="Hide ghosts: 7-3, row:7, brightest:5, largest:10, bounded:stop, 'not 7-3'; may be repeated.",
        ),
    ] = field(default_factory=list)
    solo: Annotated[list[str], option(metavar="GHOSTS", help="Draw these ghosts only; may be repeated.")] = field(
        default_factory=list
    )
    gain: Annotated[
        list[str], option(metavar="NAME=FACTOR", help="Multiply a pass (ghosts, starburst) or ghosts (7-3).")
    ] = field(default_factory=list)
    physical: Annotated[bool, option("--physical", help="Ignore all overrides.")] = False
