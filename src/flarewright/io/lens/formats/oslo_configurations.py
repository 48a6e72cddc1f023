"""The configurations of an OSLO lens file.

Behind the lens, `CFG` begins a table up to `END`: `TH 5 2 12.0` is the gap behind surface 5 in configuration 2, a
command of the whole lens has no surface (`EBR 2 4.0`). The surfaces are configuration 1. Gaps (TH), the opening (EBR or
FNO), the rim of the stop (AP) and the field (ANG or GIH) are read.

Source: the program maker's note "Managing different editing modules" (a command of this table has the configuration as
one argument more), and the order of the arguments in the reader of Optiland (surface, configuration, value).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from ....model.lens.raw_lens import Configuration
from ....sentences import shorten
from ..configuration_table import MOST, NOWHERE, Commands, Place, Stated, settings
from ..foreign_file import number_of

_OF_LENS = frozenset({"EBR", "FNO", "ANG", "GIH", "OBH", "NAO", "NAP", "UNI", "AST"})
# weights, comments, whether the optimization uses a configuration
_IDLE = re.compile(r"CFWT|CFAC|CFNM|DES|NOT|WW\d*|VX|TCE|CSLV")


@dataclass
class Table:
    """Words by row and configuration, and why the table cannot be read."""

    cells: dict[Place, dict[int, str]] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)


def cell(words: list[str], last: int, table: Table) -> None:
    """Read one command of the table.

    Parameters
    ----------
    words : list of str
    last : int
        Number of the image surface.
    table : Table
        Changed.
    """
    key, values = words[0].upper(), [word for word in words[1:] if word.upper() not in ("CHK", "UNC")]
    if _IDLE.fullmatch(key):
        return
    numbers = [number_of(word) for word in values]
    of_lens = key in _OF_LENS or key.startswith("WV")
    place, configuration = [*([float(NOWHERE)] if of_lens else []), *numbers, None, None][:2]
    wanted = 2 if place == NOWHERE else 3
    if (
        place is None or configuration is None or not (place.is_integer() and configuration.is_integer())
        or len(values) < wanted or not 1 <= configuration <= MOST or not (place == NOWHERE or 0 <= place <= last)
    ):  # fmt: skip
        table.unread.append(f"{shorten(' '.join(words))} is not understood")
        return
    table.cells.setdefault((key, int(place)), {})[int(configuration)] = values[wanted - 1]


def configurations(
    table: Table, stated: Stated, picked: Mapping[int, tuple[int, float]], remarks: list[str]
) -> tuple[Configuration, ...]:
    """Return the settings of a file; none for a file with one.

    Parameters
    ----------
    table : Table
    stated : Stated
        Configuration 1.
    picked : mapping of int to (int, float)
        Surfaces whose gap is that of an earlier one, with its sign; a gap that varies changes theirs.
    remarks : list of str
        Remarks are appended to it.

    Returns
    -------
    tuple of Configuration
        In the file's order.
    """
    if table.unread:
        remarks.append(f"the configurations (CFG) are left out: {table.unread[0]}")
        return ()
    cells = {row: dict(values) for row, values in table.cells.items()}
    for surface, (source, sign) in sorted(picked.items()):
        if ("TH", surface) in cells:
            remarks.append(
                f"the configurations (CFG) are left out: TH changes surface {surface}, whose gap is a pickup (PK TH)"
            )
            return ()
        if moved := cells.get(("TH", source)):
            cells["TH", surface] = {n: _signed(word, sign) for n, word in moved.items()}
    numbers = range(1, max((n for row in cells.values() for n in row), default=1) + 1)
    if len(numbers) < 2:
        return ()
    opening = "EBR" if stated.active.f_number is None else "FNO"
    if opening == "EBR":
        # half the diameter of the entrance pupil
        cells |= {row: {n: _signed(word, 2.0) for n, word in cells[row].items()} for row in cells if row[0] == "EBR"}
    angle = "ANG" if stated.active.image_height is None else "GIH"
    if (angle, NOWHERE) in cells:
        cells[angle, 1] = cells.pop((angle, NOWHERE))
    commands = Commands("TH", opening, "AP", ("", angle), frozenset({"AP"}))
    return settings(cells, numbers, commands, stated, remarks)


def _signed(word: str, factor: float) -> str:
    value = number_of(word)
    return word if value is None else repr(factor * value)
