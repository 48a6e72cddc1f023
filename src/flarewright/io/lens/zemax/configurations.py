"""The table of configurations of a `.zmx` file: settings of a zoom, or of the focus.

`MNUM n a` states their number and the active one, which the SURF lines hold. Rows `KEY place configuration value`
follow. Gaps (THIC; place 0 is the object's distance), the aperture (APER), the stop's semi-diameter (SDIA) and the
fields (XFIE, YFIE) are read. Remarks name the other rows: those that only change rims, and those that make a
configuration another lens, which is left out. Source: published files, and the OpticStudio help
("Multi-Configuration Operands").
"""

from __future__ import annotations

import math

from flarewright.model.lens.raw_lens import Configuration

from ...files.sentences import shorten
from ..foreign_file import number_of
from .keywords import IDLE_OPERANDS, RIM_OPERANDS
from .text import Operand, Text

_READ = frozenset({"THIC", "APER", "XFIE", "YFIE"})
# more are no settings of a lens
_MOST = 100
_INFINITE = 1e9


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
    stated = number_of(words[0]) or 1.0
    if stated <= 1.0:
        return ()
    if stated > _MOST or not float(stated).is_integer():
        found.remarks.append(f"the file states {words[0][:20]} configurations; only the active one is read")
        return ()
    current = int(number_of(words[1]) or 1) if len(words) > 1 else 1
    numbers = range(1, int(stated) + 1)
    table = _cells(found.operands, len(numbers))
    other = _other_lenses(table, current, stop, found)
    settings = [
        _setting(number, _column(table, number), active, stop, mm, found) for number in numbers if number not in other
    ]
    return tuple(setting for setting in settings if setting is not None)


def _cells(operands: list[Operand], count: int) -> dict[tuple[str, int], dict[int, str]]:
    """Return the values by row of the table and configuration; a value that is given twice counts the first time."""
    table: dict[tuple[str, int], dict[int, str]] = {}
    for operand in operands:
        if 1 <= operand.configuration <= count and operand.key not in IDLE_OPERANDS:
            row = table.setdefault((operand.key, operand.place), {})
            row.setdefault(operand.configuration, operand.value)
    return table


def _column(table: dict[tuple[str, int], dict[int, str]], number: int) -> dict[tuple[str, int], str]:
    return {row: values[number] for row, values in table.items() if number in values}


def _other_lenses(
    table: dict[tuple[str, int], dict[int, str]], current: int, stop: int | None, found: Text
) -> set[int]:  # fmt: skip
    """Return the configurations that differ from the active one in more than positions have; append remarks."""
    other: dict[int, str] = {}
    rims: set[int] = set()
    for (key, place), values in table.items():
        if key in _READ or (key == "SDIA" and place == stop):
            continue
        differing = [number for number, value in values.items() if not _same(value, values.get(current))]
        if key in RIM_OPERANDS and differing:
            rims.add(place)
        else:
            other |= {number: f"{key[:20]} {place}" for number in differing if number not in other}
    if rims:
        places = ", ".join(map(str, sorted(rims)))
        found.remarks.append(
            f"surface{'s'[: len(rims) > 1]} {places}: the rim differs between the file's configurations; that of the "
            "active one is used"
        )
    for number, why in sorted(other.items()):
        found.remarks.append(
            f"configuration {number} differs in {why}, which no position of a lens can hold; it is left out"
        )
    return set(other)


def _same(one: str, other: str | None) -> bool:
    if other is None:
        return False
    a, b = number_of(one), number_of(other)
    return one.upper() == other.upper() if a is None or b is None else math.isclose(a, b, rel_tol=1e-9)


def _setting(
    number: int, column: dict[tuple[str, int], str], active: Configuration, stop: int | None, mm: float, found: Text
) -> Configuration | None:
    """Return one setting; None, with a remark, if one of its values is no number."""
    values: dict[tuple[str, int], float] = {}
    for (key, place), word in column.items():
        if key not in _READ and (key, place) != ("SDIA", stop):
            continue
        value = math.inf if word.upper() == "INFINITY" else number_of(word)
        if value is None or (not math.isfinite(value) and (key, place) != ("THIC", 0)):
            found.remarks.append(f"configuration {number}: {key} {place} is {shorten(word)}, no number; it is left out")
            return None
        values[key, place] = value
    changes: dict[str, object] = {
        "number": number,
        "gaps": tuple(
            (place, value * mm) for (key, place), value in sorted(values.items()) if key == "THIC" and place > 0
        ),
    }
    if (distance := values.get(("THIC", 0))) is not None:
        changes["focus_distance"] = distance * mm if 0.0 < distance * mm < _INFINITE else None
    if (semi := values.get(("SDIA", -1 if stop is None else stop))) is not None and semi > 0.0:
        changes["stop_semi_diameter"] = semi * mm
    if (aperture := values.get(("APER", 0), values.get(("APER", 1)))) is not None and aperture > 0.0:
        if active.f_number is not None:
            changes["f_number"] = aperture
        elif active.entrance_pupil_diameter is not None:
            changes["entrance_pupil_diameter"] = aperture * mm
    changes |= _field(values, active, mm, found)
    setting: Configuration = active.replace(**changes)
    return setting


def _field(
    values: dict[tuple[str, int], float], active: Configuration, mm: float, found: Text
) -> dict[str, float | None]:  # fmt: skip
    """Return the largest field of a setting, as an angle or an image height like that of the file."""
    if not any(key in ("XFIE", "YFIE") for key, _ in values):
        return {}
    columns: list[list[float]] = []
    for axis in "XY":
        words = found.head.get(f"{axis}FLN") or found.head.get(f"{axis}FLD") or []
        column = [number_of(word) or 0.0 for word in words]
        for (key, place), value in values.items():
            if key == f"{axis}FIE" and 1 <= place <= len(column):
                column[place - 1] = value
        columns.append(column)
    largest = max((math.hypot(x, y) for x, y in zip(*columns, strict=False)), default=0.0)
    if largest <= 0.0:
        return {}
    if active.image_height is not None:
        return {"image_height": largest * mm}
    return {"field_deg": largest} if active.field_deg is not None and largest < 90.0 else {}


__all__ = ["configurations"]
