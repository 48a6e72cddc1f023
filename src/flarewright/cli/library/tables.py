"""A table of records of lenses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..common import console, focal_text

if TYPE_CHECKING:
    from ...io.lens.own.record import LensRecord


_TITLE_WIDTH = 32
# no table is wider: the longest names, makers and patents beside a title of that width
_WIDEST = 400


def print_records(records: Sequence[LensRecord], shipped: frozenset[str] = frozenset()) -> None:
    """Print records as a table, in a file or pipe with one line a lens.

    Parameters
    ----------
    records : sequence of LensRecord
    shipped : frozenset of str
        Names of those that ship with the program.
    """
    from rich.table import Table

    out = Table(caption="Field: half angle in degrees." + ("  * shipped with Flarewright." if shipped else ""))
    terminal = console()
    # on a narrow terminal the texts wrap, so that the numbers stay whole
    lines = not terminal.is_terminal
    out.add_column("name", no_wrap=lines, overflow="fold")
    for column in ("efl mm", "f/", "field", "surfaces"):
        out.add_column(column, justify="right", no_wrap=True)
    out.add_column("maker", no_wrap=lines)
    out.add_column("patent", no_wrap=lines)
    out.add_column("title", overflow="ellipsis", no_wrap=lines, max_width=_TITLE_WIDTH)
    for record in records:
        out.add_row(
            f"{record.name} *" if record.name in shipped else record.name,
            focal_text(record),
            f"{record.f_number:.3g}",
            "-" if record.field_deg is None else f"{record.field_deg:.1f}",
            str(record.surfaces),
            record.maker or "-",
            record.patent or "-",
            record.title,
        )
    if lines:
        needed = terminal.measure(out, options=terminal.options.update(max_width=_WIDEST)).maximum
        terminal.width = max(terminal.width, needed)
    terminal.print(out)
