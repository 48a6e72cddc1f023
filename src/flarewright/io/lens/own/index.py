"""The records of all lenses of the library in one file, with the size and time of each lens file.

The lens files hold the records as well, so the index is a cache: a missing, damaged or old one is made again.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from ....errors import FileError
from ...files.atomic_write import write_text_atomically
from ...files.text_file import read_json
from .folder import library_folder
from .record import LensRecord, as_json, from_json

_VERSION = 1
_LARGEST = 500_000_000


class Entry(NamedTuple):
    """A lens in the index: its record, and the size in bytes and time of change in ns of its file."""

    size: int
    changed_ns: int
    record: LensRecord


class Index(NamedTuple):
    """What the index holds; `damaged` is a sentence if there is a file that cannot be used, else empty."""

    entries: dict[str, Entry]
    damaged: str = ""


def index_path() -> Path:
    """Return the path of the index."""
    return library_folder() / "index.json"


def read_index() -> Index:
    """Read the index; entries that are no records are left out."""
    path = index_path()
    if not path.exists():
        return Index({})
    try:
        data = read_json(path, "the index of the lens library", largest=_LARGEST)
    except FileError as error:
        return Index({}, f"{str(error).partition(':')[0]}; the index of the lens library is made again")
    lenses = data.get("lenses") if isinstance(data, dict) else None
    if not isinstance(lenses, dict):
        return Index({}, f"{path} is no index of the lens library; it is made again")
    if data.get("version") != _VERSION:
        return Index({})
    found = {name: entry for name, value in lenses.items() if (entry := _entry(name, value)) is not None}
    broken = len(lenses) - len(found)
    return Index(found, f"{path} has {broken} entries that are no records; they are made again" if broken else "")


def _entry(name: str, value: object) -> Entry | None:
    if not isinstance(value, list) or len(value) != 3:
        return None
    size, changed_ns, record = value[0], value[1], from_json(value[2])
    if type(size) is not int or type(changed_ns) is not int or record is None or record.name != name:
        return None
    return Entry(size, changed_ns, record)


def write_index(entries: dict[str, Entry]) -> None:
    """Write the index, atomically.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    lenses = {name: [entry.size, entry.changed_ns, as_json(entry.record)] for name, entry in sorted(entries.items())}
    text = json.dumps({"version": _VERSION, "lenses": lenses})
    write_text_atomically(index_path(), text, newline="\n")
