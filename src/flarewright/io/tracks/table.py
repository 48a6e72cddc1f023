"""Tracks in tables of comma-separated values.

One line a frame: `frame,x,y`, `frame,x,y,intensity` or `frame,x,y,intensity,r,g,b`. A first line with these names may
give another order, and a column `name` for several tracks. Commas, semicolons or tabs separate the cells; empty lines
and lines that start with # are skipped. x and y are pixels from the top left corner.
"""

from __future__ import annotations

import csv

import numpy as np

from ...errors import FileError
from ..files.door import shown
from .numbers import MOST_TRACKS, number, track_of
from .track import Origin, TrackFile

_ALIASES = {
    "red": "r", "green": "g", "blue": "b", "track": "name", "light": "name", "frames": "frame", "x_px": "x",
    "y_px": "y",
}  # fmt: skip
_COLUMNS = ("frame", "x", "y", "intensity", "r", "g", "b")
_FORMS = "frame,x,y or frame,x,y,intensity or frame,x,y,intensity,r,g,b"


def is_table(text: str) -> bool:
    """Return whether a text is a table: its first line has a separator, and a number or the name of a column."""
    lines = _lines(text)
    if not lines:
        return False
    cells = [cell.strip().lower() for cell in lines[0][1].split(_separator(lines[0][1]))]
    return len(cells) >= 3 and (cells[0].lstrip("-").replace(".", "", 1).isdigit() or "frame" in map(_column, cells))


def read_table(text: str, file: str, origin: Origin = "top-left") -> TrackFile:
    """Read a table of one track or several.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.
    origin : {"top-left", "bottom-left"}
        Corner from which x and y count.

    Raises
    ------
    FileError
        A line has other cells than the table's columns, or a cell is no number.
    """
    name = shown(file)
    lines = _lines(text)
    if not lines:
        raise FileError(f"{name} has no lines of numbers; write {_FORMS}")
    separator = _separator(lines[0][1])
    columns, remarks = _header([cell.strip() for cell in lines[0][1].split(separator)], name)
    body = lines[1:] if remarks is not None else lines
    tracks: dict[str, list[dict[str, float]]] = {}
    for number_of, line in body:
        where = f"{name} line {number_of}"
        try:
            cells = next(csv.reader([line], delimiter=separator))
        except csv.Error:
            raise FileError(f"{where} is no line of a table; write {','.join(columns)}") from None
        if len(cells) != len(columns):
            raise FileError(f"{where} has {len(cells)} cells and not {len(columns)}; write {','.join(columns)}")
        row = dict(zip(columns, cells, strict=True))
        key = row.pop("name", "").strip()[:80] or "track"
        values = {column: number(cell, where, column) for column, cell in row.items() if column in _COLUMNS}
        _check(values, where)
        tracks.setdefault(key, []).append(values)
        if len(tracks) > MOST_TRACKS:
            raise FileError(f"{name} has more than {MOST_TRACKS} tracks; split it")
    if not tracks:
        raise FileError(f"{name} has names of columns but no lines of numbers; write one line for each frame")
    found = []
    for key, rows in tracks.items():
        colours = np.array([[row[c] for c in "rgb"] for row in rows]) if "r" in columns else None
        levels = np.array([row["intensity"] for row in rows]) if "intensity" in columns else None
        places = [(row["x"], row["y"]) for row in rows]
        frames = [row["frame"] for row in rows]
        found.append(track_of(name, key, frames, places, origin=origin, intensity=levels, rgb=colours))
    return TrackFile(tuple(found), "csv", remarks=tuple(remarks or ()))


def _lines(text: str) -> list[tuple[int, str]]:
    """Return the lines with contents and their numbers."""
    numbered = ((k, line) for k, line in enumerate(text.splitlines(), 1))
    return [(k, line) for k, line in numbered if line.strip() and not line.lstrip().startswith("#")]


def _separator(line: str) -> str:
    return max(",;\t", key=line.count)


def _column(cell: str) -> str:
    word = cell.strip().strip('"').lower()
    return _ALIASES.get(word, word)


def _header(cells: list[str], file: str) -> tuple[tuple[str, ...], list[str] | None]:
    """Return the columns, and remarks if the first line names them; None if it has numbers already."""
    named = tuple(_column(cell) for cell in cells)
    if "frame" not in named:
        if len(cells) not in (3, 4, 7):
            raise FileError(f"{file} has {len(cells)} cells a line; write {_FORMS}, or name the columns in line 1")
        return _COLUMNS[: len(cells)], None
    twice = [column for column in named if named.count(column) > 1]
    if twice:
        raise FileError(f"{file} names the column {twice[0]!r} twice; keep one")
    missing = [column for column in ("x", "y") if column not in named]
    if missing:
        raise FileError(f"{file} has no column {missing[0]!r}; write {_FORMS}")
    if 0 < sum(column in named for column in "rgb") < 3:
        raise FileError(f"{file} has some of the columns r, g and b; give all three or none")
    unused = [column for column in named if column not in (*_COLUMNS, "name")]
    return named, [f"{file}: columns {', '.join(unused)[:200]} have no effect"] if unused else []


def _check(values: dict[str, float], where: str) -> None:
    """Raise an error for an intensity or a colour that no light has."""
    if not 0.0 <= values.get("intensity", 0.0) <= 1e20:
        raise FileError(f"{where}: an intensity lies between 0 and 1e20, not {values['intensity']:g}")
    colour = [values[c] for c in "rgb" if c in values]
    if colour and not (min(colour) >= 0.0 < max(colour) <= 1e9):
        raise FileError(f"{where}: a colour has three numbers from 0 to 1e9, not all 0; a dark light has intensity 0")
