"""A table of what differs between a file's configurations, to settings of a lens.

Rows are commands with a place, such as the gap behind surface 5, and have one value a configuration. Gaps (place 0 is
the object's distance), the opening, the stop's semi-diameter and the fields become a `Configuration`. Remarks name the
other rows: those that only change rims, and those that make a configuration another lens, which is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from ...model.lens.raw_lens import Configuration
from ...sentences import shorten
from .foreign_file import INFINITE, number_of

Place = tuple[str, int]
"""A command and the number of its surface or field; `NOWHERE` for one of the whole lens."""

NOWHERE = -1

MOST = 100
"""More configurations are no settings of a lens."""


class Commands(NamedTuple):
    """Names of the rows that a lens can hold.

    Attributes
    ----------
    gap, opening, semi_diameter : str
        `opening` is an f-number or the diameter of the entrance pupil, whichever the file gives.
    fields : tuple of str
        Those of x and y.
    rims : frozenset of str
        Rows that change rims.
    """

    gap: str
    opening: str
    semi_diameter: str
    fields: tuple[str, str]
    rims: frozenset[str]


class Stated(NamedTuple):
    """What the file states outside the table.

    Attributes
    ----------
    active : Configuration
        A setting without a separate row has the same value.
    stop : int or None
        Number of the stop's surface.
    mm : float
        Millimetres in the file's unit.
    fields : tuple of sequence of float
        The field points along x and y.
    """

    active: Configuration
    stop: int | None
    mm: float
    fields: tuple[Sequence[float], Sequence[float]]


def settings(
    table: Mapping[Place, Mapping[int, str]],
    numbers: Iterable[int],
    commands: Commands,
    stated: Stated,
    remarks: list[str],
    current: int = 1,
) -> tuple[Configuration, ...]:
    """Return the settings that a table describes.

    Parameters
    ----------
    table : mapping
        Words by row and configuration.
    numbers : iterable of int
        The configurations.
    commands : Commands
    stated : Stated
    remarks : list of str
        Remarks are appended to it.
    current : int
        The configuration that the surfaces hold.

    Returns
    -------
    tuple of Configuration
        In the order of `numbers`.
    """
    other = _other_lenses(table, current, commands, stated.stop, remarks)
    found = [_setting(n, _column(table, n), commands, stated, remarks) for n in numbers if n not in other]
    return tuple(setting for setting in found if setting is not None)


def _column(table: Mapping[Place, Mapping[int, str]], number: int) -> dict[Place, str]:
    return {row: values[number] for row, values in table.items() if number in values}


def _is_held(key: str, place: int, commands: Commands, stop: int | None) -> bool:
    held = (commands.gap, commands.opening, *commands.fields)
    return key in held or (key == commands.semi_diameter and place == stop)


def _other_lenses(
    table: Mapping[Place, Mapping[int, str]], current: int, commands: Commands, stop: int | None, remarks: list[str]
) -> set[int]:
    """Return the configurations that differ from the current one in more than positions have; append remarks."""
    other: dict[int, str] = {}
    rims: set[int] = set()
    for (key, place), values in table.items():
        if _is_held(key, place, commands, stop):
            continue
        differing = [number for number, value in values.items() if not _same(value, values.get(current))]
        if key in commands.rims and differing:
            rims.add(place)
        else:
            other |= {number: _label(key, place) for number in differing if number not in other}
    if rims:
        places = ", ".join(map(str, sorted(rims)))
        remarks.append(
            f"surface{'s'[: len(rims) > 1]} {places}: the rim differs between the file's configurations; that of the "
            "active one is used"
        )
    for number, why in sorted(other.items()):
        remarks.append(f"configuration {number} differs in {why}, which no position of a lens can hold; it is left out")
    return set(other)


def _label(key: str, place: int) -> str:
    return key[:20] if place == NOWHERE else f"{key[:20]} {place}"


def _same(one: str, other: str | None) -> bool:
    if other is None:
        return False
    a, b = number_of(one), number_of(other)
    return one.upper() == other.upper() if a is None or b is None else math.isclose(a, b, rel_tol=1e-9)


def _setting(
    number: int, column: Mapping[Place, str], commands: Commands, stated: Stated, remarks: list[str]
) -> Configuration | None:
    """Return one setting; None, with a remark, if one of its values is no number."""
    values: dict[Place, float] = {}
    for (key, place), word in column.items():
        if not _is_held(key, place, commands, stated.stop):
            continue
        value = math.inf if word.upper() == "INFINITY" else number_of(word)
        if value is None or (not math.isfinite(value) and (key, place) != (commands.gap, 0)):
            label = _label(key, place)
            remarks.append(f"configuration {number}: {label} is {shorten(word)}, no number; it is left out")
            return None
        values[key, place] = value
    active, mm = stated.active, stated.mm
    gaps = sorted((place, value * mm) for (key, place), value in values.items() if key == commands.gap and place > 0)
    changes: dict[str, object] = {"number": number, "gaps": tuple(gaps)}
    if (distance := values.get((commands.gap, 0))) is not None:
        changes["focus_distance"] = distance * mm if 0.0 < distance * mm < INFINITE else None
    semi = None if stated.stop is None else values.get((commands.semi_diameter, stated.stop))
    if semi is not None and semi > 0.0:
        changes["stop_semi_diameter"] = semi * mm
    aperture = next((value for (key, _), value in values.items() if key == commands.opening), None)
    if aperture is not None and aperture > 0.0:
        if active.f_number is not None:
            changes["f_number"] = aperture
        elif active.entrance_pupil_diameter is not None:
            changes["entrance_pupil_diameter"] = aperture * mm
    changes |= _field(values, commands, stated)
    return active.replace(**changes)


def _field(values: Mapping[Place, float], commands: Commands, stated: Stated) -> dict[str, float | None]:
    """Return the largest field of a setting, as an angle or an image height like that of the file."""
    if not any(key in commands.fields for key, _ in values):
        return {}
    columns: list[list[float]] = []
    for axis, points in zip(commands.fields, stated.fields, strict=True):
        column = list(points)
        for (key, place), value in values.items():
            if key == axis and 1 <= place <= len(column):
                column[place - 1] = value
        columns.append(column)
    largest = max((math.hypot(x, y) for x, y in zip(*columns, strict=False)), default=0.0)
    if largest <= 0.0:
        return {}
    if stated.active.image_height is not None:
        return {"image_height": largest * stated.mm}
    return {"field_deg": largest} if stated.active.field_deg is not None and largest < 90.0 else {}
