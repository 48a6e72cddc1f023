"""Options of `flarewright render`: overrides of the artist."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import typer

PANEL = "Art direction"


@dataclass(frozen=True, kw_only=True)
class ArtOptions:
    """Overrides of the artist. None or empty: not given."""

    starburst_size: Annotated[
        float | None, typer.Option(help="Factor on the size of the starburst; 1 is physical.", rich_help_panel=PANEL)
    ] = None
    starburst_spiral: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Blur the starburst over an angle, to hide fringes.", rich_help_panel=PANEL),
    ] = None
    ghost_offset: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Standard deviation of random ghost shifts; seeded by --imperfection, else --seed.",
            rich_help_panel=PANEL,
        ),
    ] = None
    rule: Annotated[
        list[str],
        typer.Option(
            metavar="RULE",
            help="Add a rule of [\\[art.rules]]: 'select = \"row:7\", tint = [1, 0.6, 0.3], scale = 2'; repeatable.",
            rich_help_panel=PANEL,
        ),
    ] = field(default_factory=list)
    mute: Annotated[
        list[str],
        typer.Option(
            metavar="GHOSTS",
            help="Hide ghosts: 7-3, row:7, brightest:5, largest:10, bounded:stop, 'not 7-3'; may be repeated.",
            rich_help_panel=PANEL,
        ),
    ] = field(default_factory=list)
    solo: Annotated[
        list[str],
        typer.Option(metavar="GHOSTS", help="Draw these ghosts only; may be repeated.", rich_help_panel=PANEL),
    ] = field(default_factory=list)
    gain: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=FACTOR", help="Multiply a pass (ghosts, starburst) or ghosts (7-3).", rich_help_panel=PANEL
        ),
    ] = field(default_factory=list)
    physical: Annotated[bool, typer.Option("--physical", help="Ignore all overrides.", rich_help_panel=PANEL)] = False
