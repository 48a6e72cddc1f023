"""Surfaces of simple tables: checked numbers become rows of a `RawSequence`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ....errors import LensError
from ....model.lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER
from ....model.lens.raw_lens import RawSequence, SequenceRow
from ....sentences import summary
from ...files.door import shown
from .. import media
from ..foreign_file import MOST_SURFACES, sequence_row
from ..medium_names import numbered_medium

_TIGHTEST = 1e-3


class TableRow(NamedTuple):
    """One row as a table states it.

    Attributes
    ----------
    number : int
        Line of the file or place in the list, for messages.
    radius : float
        mm; 0 and infinity are flat.
    thickness : float
        mm.
    stop : bool
    glass : str or None
    n_d, v_d : float or None
        None: not given.
    semi_diameter : float or None
        mm; None and 0 are unknown.
    conic : float
    asphere : tuple of float
    """

    number: int
    radius: float
    thickness: float
    stop: bool = False
    glass: str | None = None
    n_d: float | None = None
    v_d: float | None = None
    semi_diameter: float | None = None
    conic: float = 0.0
    asphere: tuple[float, ...] = ()


@dataclass
class TableHead:
    """What a table states beside its rows; `place` is what a row's number counts, "line" or "row"."""

    place: str
    name: str = ""
    notes: str = ""
    f_number: float | None = None
    field_deg: float | None = None
    focal_length: float | None = None
    remarks: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def sequence_of(path: str, head: TableHead, rows: Sequence[TableRow]) -> RawSequence:
    """Return the sequence of a table.

    Parameters
    ----------
    path : str
        Of the file, for messages.
    head : TableHead
        Problems found so far are reported with those of the rows.
    rows : sequence of TableRow
        Front to back.

    Raises
    ------
    LensError
        `problems` lists every error with its row.
    """
    problems = head.problems
    findings: list[tuple[int, media.Finding]] = []
    made = [_row(row, head, findings) for row in rows[:MOST_SURFACES]]
    stops = [row for row in rows if row.stop]
    if len(rows) > MOST_SURFACES:
        problems.append(f"the table has {len(rows)} rows, a lens has at most {MOST_SURFACES}")
    elif not rows and not problems:
        problems.append("the table has no rows")
    elif len(stops) != 1 and not problems:
        which = ", ".join(str(row.number) for row in stops)
        found = f"{head.place}s {which} are stops" if stops else "no row is the stop"
        problems.append(f"{found}; a lens has exactly one")
    for key, value, low, high in (
        ("f-number", head.f_number, LEAST_F_NUMBER, LARGEST_F_NUMBER), ("half field", head.field_deg, 0.0, 90.0),
    ):  # fmt: skip
        if value is not None and not low < value <= high:
            problems.append(f"the {key} is {value:g}: it must lie between {low:g} and {high:g}")
    if problems:
        raise LensError(summary(path, problems), tuple(problems))
    file = shown(path.replace("\\", "/").rpartition("/")[2])
    return RawSequence(
        file=file, name=head.name or file.rpartition(".")[0] or file, notes=head.notes,
        rows=tuple(row for row in made if row is not None), f_number=head.f_number, field_deg=head.field_deg,
        stop_semi_diameter=stops[0].semi_diameter or None, stated_focal_length=head.focal_length,
        remarks=(*head.remarks, *media.remarks(findings, head.place)),
    )  # fmt: skip


def _row(row: TableRow, head: TableHead, findings: list[tuple[int, media.Finding]]) -> SequenceRow | None:
    where, problems = f"{head.place} {row.number}", head.problems
    before = len(problems)
    if any(
        math.isnan(value) for value in (row.radius, row.thickness, row.semi_diameter or 0.0, row.conic, *row.asphere)
    ):
        problems.append(f"{where}: nan is no number")
    elif 0.0 < abs(row.radius) < _TIGHTEST:
        problems.append(f"{where}: the radius is {row.radius:g}: less than a micrometre is no lens surface")
    medium = None
    if row.glass is not None or row.n_d is not None:
        medium = numbered_medium(row.glass, row.n_d, row.v_d, where, problems, findings, row.number)
    elif row.v_d:
        problems.append(f"{where}: an Abbe number alone is no glass: add n_d or the glass's name")
    flat = row.radius == 0.0 or math.isinf(row.radius)
    return sequence_row(
        where, problems, before, number=row.number, stop=row.stop, curvature=0.0 if flat else 1.0 / row.radius,
        conic=row.conic, asphere=row.asphere, thickness=row.thickness, medium=medium,
        semi_diameter=row.semi_diameter or None,
    )  # fmt: skip
