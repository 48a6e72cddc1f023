"""A table of records of lenses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..common import console, focal_text

if TYPE_CHECKING:
    from ...io.lens.own.record import LensRecord


_TITLE_WIDTH = 32


def print_records(records: Sequence[LensRecord], shipped: frozenset[str] = frozenset()) -> None:
    """Print records as a table.

    Parameters
    ----------
    records : sequence of LensRecord
    shipped : frozenset of str
        Names of those that ship with the program.
    """
    from rich.table import Table

    out = Table(caption="Field: half angle in degrees." + ("  * shipped with Flarewright." if shipped else ""))
    out.add_column("name", no_wrap=True)
    for column in ("efl mm", "f/", "field", "surfaces"):
        out.add_column(column, justify="right", no_wrap=True)
    out.add_column("maker", no_wrap=True)
    out.add_column("patent", no_wrap=True)
    out.add_column("title", overflow="ellipsis", no_wrap=True, max_width=_TITLE_WIDTH)
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
    console().print(out)
