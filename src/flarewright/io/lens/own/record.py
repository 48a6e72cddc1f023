"""What is known of a lens of the library: found once, kept in the first line of its file and in the index.

The first line is a comment, so the file is a lens file like any other. It holds a digest of the lines below it: a
file that was edited by hand gets a new record.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields, replace
from hashlib import sha256
from typing import Any

_START = "# library: "
LONGEST_REMARKS = 20
"""Largest number of remarks that a record keeps."""


@dataclass(frozen=True)
class LensRecord:
    """A lens of the library.

    Attributes
    ----------
    name : str
        By which commands and projects find it.
    title, source, notes : str
        As in the lens file.
    maker, patent : str
        Found in the texts (`facts`); "" where unknown.
    efl_mm, f_number : float
        Focal length at infinity, of the first position of a zoom, and the f-number wide open.
    efl_range_mm : tuple of float
        Shortest and longest focal length of the positions.
    field_deg : float or None
        Half field of view; None: not stated.
    surfaces : int
    file : str
        The file that it was made of; "ARCHIVE.zip: PATH" for a part of an archive.
    digest : str
        SHA-256 of that file's bytes, hexadecimal.
    remarks : tuple of str
        What the reader noticed, assumed or repaired.
    """

    name: str
    title: str
    source: str = ""
    notes: str = ""
    maker: str = ""
    patent: str = ""
    efl_mm: float = 0.0
    efl_range_mm: tuple[float, float] = (0.0, 0.0)
    f_number: float = 0.0
    field_deg: float | None = None
    surfaces: int = 0
    file: str = ""
    digest: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The texts that a search compares, in small letters."""
        texts = (self.name, self.title, self.maker, self.patent, self.source, self.notes, self.file)
        plain_patent = "".join(letter for letter in self.patent if letter.isalnum())
        return " ".join((*texts, plain_patent, f"f/{self.f_number:g}", f"{self.efl_mm:.0f}mm")).lower()


def as_json(record: LensRecord) -> dict[str, Any]:
    """Return a record as an object of JSON."""
    return asdict(record)


def from_json(data: Any) -> LensRecord | None:
    """Return the record of an object of JSON; None if it is none, as after damage."""
    if not isinstance(data, dict) or not isinstance(data.get("name"), str):
        return None
    known = {one.name: data[one.name] for one in fields(LensRecord) if one.name in data}
    texts = ("title", "source", "notes", "maker", "patent", "file", "digest")
    numbers = ("efl_mm", "f_number", "surfaces")
    remarks, ends, field_deg = known.get("remarks", ()), known.get("efl_range_mm", (0.0, 0.0)), known.get("field_deg")
    usable = (
        all(isinstance(known.get(key, ""), str) for key in texts)
        and all(_is_number(known.get(key, 0)) for key in numbers)
        and isinstance(remarks, list | tuple) and all(isinstance(one, str) for one in remarks)
        and isinstance(ends, list | tuple) and len(ends) == 2 and all(map(_is_number, ends))
        and (field_deg is None or _is_number(field_deg)) and "title" in known
    )  # fmt: skip
    if not usable:
        return None
    return LensRecord(**(known | {"remarks": tuple(remarks), "efl_range_mm": tuple(ends)}))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def with_record(text: str, record: LensRecord) -> str:
    """Return the text of a lens file below a line with its record."""
    # TOML allows no DEL in a comment, and JSON does not escape it
    data = json.dumps({"of": _digest(text), **as_json(record)}).replace("\x7f", "\\u007f")
    return f"{_START}{data}\n{text}"


def record_in(text: str, name: str) -> tuple[LensRecord | None, bool]:
    """Read the record in a lens file.

    Parameters
    ----------
    text : str
        Of the whole file.
    name : str
        Of the lens: that of its file, which the user may have renamed.

    Returns
    -------
    record : LensRecord or None
        None if the file has none.
    current : bool
        Whether the lines below are those of which the record was made.
    """
    line, _, rest = text.partition("\n")
    if not line.startswith(_START):
        return None, False
    try:
        data = json.loads(line.removeprefix(_START))
    except (ValueError, RecursionError):
        return None, False
    record = from_json(data)
    if record is None:
        return None, False
    return replace(record, name=name), data.get("of") == _digest(rest)


def _digest(text: str) -> str:
    return sha256(text.encode("utf-8", "replace")).hexdigest()[:16]
