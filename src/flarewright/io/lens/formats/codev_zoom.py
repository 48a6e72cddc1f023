"""The zoom positions of a CODE V sequence file.

`ZOO n` states their number. `ZOO THI S5 1.0 2.0 3.0` gives a value for each, `ZOO THI S5` alone says that it can vary,
and `THI S5 Z2 2.0` gives the value of one. The surfaces hold the first position. Gaps (THI; S0 is the object's
distance), the opening (FNO or EPD), the rim of the stop (CIR) and the fields (XAN F2 and others) are read.

Source: sequence files that the program exported, as programs that convert them describe them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ....model.lens.raw_lens import Configuration
from ....sentences import shorten
from ..configuration_table import MOST, NOWHERE, Commands, Place, Stated, settings
from ..foreign_file import number_of
from .codev_words import IDLE, VIGNETTING

_IDLE = IDLE | {"TIT", "TITLE", "UID", *VIGNETTING}
_PLACE = re.compile(r"([SFW])(O|I|\d{1,4})")
_POSITION = re.compile(r"[Zz](\d{1,4})")


@dataclass
class Zoom:
    """What a file states about its zoom positions.

    Attributes
    ----------
    count : int or None
    table : dict
        Words by row and position.
    solved : dict of int to str
        Surfaces whose gap another command sets, and that command.
    unread : list of str
        Why positions cannot be read.
    """

    count: int | None = None
    table: dict[Place, dict[int, str]] = field(default_factory=dict)
    solved: dict[int, str] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)


def zoom_row(words: list[str], surfaces: int, zoom: Zoom) -> None:
    """Read the words after ZOO: the number of positions, or a row of the table.

    Parameters
    ----------
    words : list of str
    surfaces : int
        Number of surfaces so far, with object and image.
    zoom : Zoom
        Changed.
    """
    if not words:
        return
    if (count := number_of(words[0])) is not None:
        if count.is_integer() and 0 < count <= MOST:
            zoom.count = int(count)
        else:
            zoom.unread.append(f"ZOO {words[0][:20]} is no number of positions")
        return
    key = words[0].upper()
    if key in _IDLE or "EDG" in (word.upper() for word in words[1:]):
        return
    place, values = NOWHERE, words[1:]
    if values and number_of(values[0]) is None:
        found = _place(values[0], surfaces)
        if found is None:
            zoom.unread.append(f"{shorten(' '.join(['ZOO', *words[:2]]))} names no surface or field of the file")
            return
        place, values = found, values[1:]
    row = zoom.table.setdefault((key, place), {})
    row.update(enumerate(values, 1))


def zoom_cell(words: list[str], surfaces: int, zoom: Zoom) -> bool:
    """Read a command for one zoom position, such as `THI S5 Z2 2.0`; False for any other command.

    Parameters
    ----------
    words : list of str
    surfaces : int
        Number of surfaces so far, with object and image.
    zoom : Zoom
        Changed.
    """
    at = next((k for k, word in enumerate(words[1:3], 1) if _POSITION.fullmatch(word)), None)
    key = words[0].upper()
    if at is None or key == "TITLE":
        return False
    if key in _IDLE:
        return True
    place = NOWHERE if at == 1 else _place(words[1], surfaces)
    if place is None or len(words) <= at + 1:
        zoom.unread.append(f"{shorten(' '.join(words))} is not understood")
    else:
        zoom.table.setdefault((key, place), {})[int(words[at][1:])] = words[at + 1]
    return True


def solved_gap(words: list[str], surfaces: int, zoom: Zoom) -> bool:
    """Note a pickup or a solve of a gap, whose result for the first position the surfaces hold; False for any other."""
    upper = [word.upper() for word in words]
    if not (upper[0] == "PIK" and "THI" in upper) and not (upper[0] == "THI" and "OAL" in upper):
        return False
    named = [place for word in upper[1:] if word[0] == "S" and (place := _place(word, surfaces)) is not None]
    zoom.solved[named[0] if named else surfaces - 1] = "PIK" if upper[0] == "PIK" else "OAL"
    return True


def _place(word: str, surfaces: int) -> int | None:
    """Return the number of a surface, field or wavelength; None for another word or a surface that does not exist."""
    found = _PLACE.fullmatch(word.upper())
    if found is None or (found[1] != "S" and not found[2].isdecimal()):
        return None
    number = {"O": 0, "I": surfaces - 1}[found[2]] if found[2] in "OI" else int(found[2])
    return number if found[1] != "S" or number < surfaces else None


def positions(zoom: Zoom, stated: Stated, fields: tuple[str, str], remarks: list[str]) -> tuple[Configuration, ...]:
    """Return the settings of a file; none for a file with one.

    Parameters
    ----------
    zoom : Zoom
    stated : Stated
        The first position.
    fields : tuple of str
        The commands of its fields along x and y.
    remarks : list of str
        Remarks are appended to it.

    Returns
    -------
    tuple of Configuration
        In the file's order.
    """
    most = max((number for row in zoom.table.values() for number in row), default=1)
    count = zoom.count or most
    if count < 2:
        return ()
    unread = list(zoom.unread)
    if most > count:
        unread.append(f"ZOO {count} states fewer positions than a row has values")
    for surface, command in sorted(zoom.solved.items()):
        if not zoom.table.get(("THI", surface)):
            unread.append(f"{command} sets the gap behind surface {surface}: write its values as ZOO THI S{surface}")
    if unread:
        remarks.append(f"the zoom positions (ZOO) are left out: {unread[0]}")
        return ()
    opening = "EPD" if stated.active.f_number is None else "FNO"
    commands = Commands("THI", opening, "CIR", fields, frozenset({"CIR"}))
    whole: list[int] = []
    for number in range(1, count + 1):
        short = [key for key, row in zoom.table.items() if row and number not in row]
        if number > 1 and short:
            key, place = short[0]
            at = "" if place == NOWHERE else f" {place}"
            remarks.append(f"configuration {number} is left out: ZOO {key[:20]}{at} has no value for it")
        else:
            whole.append(number)
    return settings(zoom.table, whole, commands, stated, remarks)
