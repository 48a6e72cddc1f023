"""The table of `flarewright render --profile`: what each ghost costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...render.ghosts.cost import GhostCost, RenderProfile

# ghosts with a row each; the others share one
_SHOWN = 15


def print_profile(profile: RenderProfile) -> None:
    """Print a profile as a table to stderr."""
    from rich.console import Console
    from rich.table import Table

    from ...render.ghosts.cost import STAGES

    drawn, shown = sum(cost.total for cost in profile.ghosts), profile.ghosts[:_SHOWN]
    table = Table(title=f"Processor time: search {profile.search_s:.3f} s, {len(profile.ghosts)} ghosts {drawn:.3f} s")
    table.add_column("ghost")
    for name in ("ms", *STAGES, "rays", "cells", "drawings", "Mpx", "ns/px"):
        table.add_column(name, justify="right")
    for cost in shown:
        table.add_row(cost.path + " ½" * cost.detail, *_numbers([cost]))
    table.add_section()
    if len(profile.ghosts) > _SHOWN:
        table.add_row(f"{len(profile.ghosts) - _SHOWN} others", *_numbers(profile.ghosts[_SHOWN:]))
    table.add_row("all", *_numbers(profile.ghosts))
    console = Console(stderr=True, markup=False, highlight=False)
    if not console.is_terminal:
        console.width = 160
    console.print(table)
    halved: Counter[str] = Counter()
    for cost in profile.ghosts:
        halved.update(cost.halved)
    reasons = ", ".join(f"{count} for {reason}" for reason, count in halved.most_common() if count)
    console.print(f"cells halved: {reasons or 'none'}")


def _numbers(costs: Sequence[GhostCost]) -> list[str]:
    """Return the columns of some ghosts together: times in ms, counts, pixels."""
    from ...render.ghosts.cost import STAGES

    spent = [1e3 * sum(cost.seconds.get(stage, 0.0) for cost in costs) for stage in STAGES]
    pixels, draw = sum(cost.fragments for cost in costs), spent[STAGES.index("draw")]
    counts = [sum(getattr(cost, name) for cost in costs) for name in ("rays", "cells", "drawings")]
    return [
        f"{sum(spent):.1f}", *(f"{time:.1f}" for time in spent), *(str(count) for count in counts),
        f"{1e-6 * pixels:.2f}", f"{1e6 * draw / pixels:.2f}" if pixels > 0.0 else "",
    ]  # fmt: skip
