"""The table of configurations of a `.zmx` file: settings of a zoom, or of the focus.

`MNUM n a` states their number and the active one, which the SURF lines hold. Rows `KEY place configuration value`
follow. Gaps (THIC; place 0 is the object's distance), the aperture (APER), the stop's semi-diameter (SDIA) and the
fields (XFIE, YFIE) are read; `io.lens.configuration_table` makes settings of them and names the other rows.
Source: published files, and the OpticStudio help ("Multi-Configuration Operands").
"""

from __future__ import annotations

from ....model.lens.raw_lens import Configuration
from ..configuration_table import MOST, Commands, Place, Stated, settings
from ..foreign_file import number_of
from .keywords import IDLE_OPERANDS, RIM_OPERANDS
from .text import Operand, Text

_COMMANDS = Commands(gap="THIC", opening="APER", semi_diameter="SDIA", fields=("XFIE", "YFIE"), rims=RIM_OPERANDS)


def configurations(found: Text, active: Configuration, stop: int | None, mm: float) -> tuple[Configuration, ...]:
    """Return the settings of a file; none for a file with one.

    Parameters
    ----------
    found : Text
        Remarks are appended to it.
    active : Configuration
        What the file states outside the table; a setting without a separate row has the same value.
    stop : int or None
        Number of the stop's surface.
    mm : float
        Millimetres in the file's unit.

    Returns
    -------
    tuple of Configuration
        In the file's order.
    """
    words = found.head.get("MNUM") or ["1"]
    count = number_of(words[0]) or 1.0
    if count <= 1.0:
        return ()
    if count > MOST or not float(count).is_integer():
        found.remarks.append(f"the file states {words[0][:20]} configurations; only the active one is read")
        return ()
    current = int(number_of(words[1]) or 1) if len(words) > 1 else 1
    numbers = range(1, int(count) + 1)
    table = _cells(found.operands, len(numbers))
    stated = Stated(active, stop, mm, (_points("X", found), _points("Y", found)))
    return settings(table, numbers, _COMMANDS, stated, found.remarks, current)


def _cells(operands: list[Operand], count: int) -> dict[Place, dict[int, str]]:
    """Return the values by row of the table and configuration; a value that is given twice counts the first time."""
    table: dict[Place, dict[int, str]] = {}
    for operand in operands:
        if 1 <= operand.configuration <= count and operand.key not in IDLE_OPERANDS:
            row = table.setdefault((operand.key, operand.place), {})
            row.setdefault(operand.configuration, operand.value)
    return table


def _points(axis: str, found: Text) -> list[float]:
    words = found.head.get(f"{axis}FLN") or found.head.get(f"{axis}FLD") or []
    return [number_of(word) or 0.0 for word in words]
