"""Reader of RealFlare's lenses (`.json`).

An object with `lens_elements`, a list of surfaces with `radius` (mm; 0 is flat), `distance` to the next one,
`refractive_index` and `abbe_nr` of the medium behind, and `height`, half the clear diameter; `aperture_index` is the
stop's place in that list, from 0. `name`, `notes`, `patent_number`, `focal_length` and `fstop` describe the lens.

Source: the program's model files.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ....errors import LensError
from ....model.lens.raw_lens import RawSequence
from ....sentences import shorten
from ...files.text_file import read_json
from ..foreign_file import json_number, lens_errors
from .table_rows import TableHead, TableRow, sequence_of

# None: each element has it
_KEYS = {"radius": None, "distance": None, "refractive_index": 1.0, "abbe_nr": 0.0, "height": 0.0}
_TOP = ("name", "year", "patent_number", "notes", "focal_length", "fstop", "aperture_index", "lens_elements")


def read_realflare(path: str | Path) -> RawSequence:
    """Read a lens of RealFlare.

    Raises
    ------
    LensError
        When the file cannot be read or is no such lens; `problems` lists every error with its element, from 0.
    """
    with lens_errors():
        data = read_json(path, "a lens of RealFlare", foreign=True)
    elements = data.get("lens_elements") if isinstance(data, dict) else None
    if not isinstance(data, dict) or not isinstance(elements, list):
        raise LensError(f"{path} has no list lens_elements: is it a lens of RealFlare?")
    head = TableHead("element", name=_text(data, "name"), notes=_notes(data))
    head.f_number, head.focal_length = (_stated(data, key, head) for key in ("fstop", "focal_length"))
    unknown = [key for key in data if key not in _TOP]
    if unknown:
        head.remarks.append(f"keys left out: {', '.join(shorten(key) for key in unknown[:8])}")
    stop = data.get("aperture_index")
    if isinstance(stop, bool) or not isinstance(stop, int) or not 0 <= stop < max(len(elements), 1):
        found = "missing" if stop is None else shorten(stop)
        head.problems.append(f"aperture_index is {found}, the place of the stop in lens_elements was expected")
    rows = [row for k, entry in enumerate(elements) if (row := _row(k, entry, k == stop, head)) is not None]
    return sequence_of(str(path), head, rows)


def _row(k: int, entry: Any, stop: bool, head: TableHead) -> TableRow | None:
    if not isinstance(entry, dict):
        head.problems.append(f"element {k} is {shorten(entry)}, an object with radius and distance was expected")
        return None
    unknown = [key for key in entry if key not in _KEYS]
    if unknown:
        head.remarks.append(f"element {k}: keys left out: {', '.join(shorten(key) for key in unknown[:8])}")
    values: dict[str, float] = {}
    for key, default in _KEYS.items():
        value = json_number(entry.get(key, default))
        if value is None:
            found = shorten(entry[key]) if key in entry else "missing"
            head.problems.append(f"element {k}: {key} is {found}, a number was expected")
            return None
        values[key] = value
    index, abbe = values["refractive_index"], values["abbe_nr"]
    return TableRow(
        k, values["radius"], values["distance"], stop=stop, n_d=None if index in (0.0, 1.0) else index,
        v_d=abbe if index not in (0.0, 1.0) and abbe else None, semi_diameter=values["height"] or None,
    )  # fmt: skip


def _text(data: dict[str, Any], key: str) -> str:
    value = data.get(key, "")
    return " ".join(value.split()) if isinstance(value, str) else ""


def _notes(data: dict[str, Any]) -> str:
    patent = _text(data, "patent_number")
    return " ".join(part for part in (f"Patent {patent}." if patent else "", _text(data, "notes")) if part)


def _stated(data: dict[str, Any], key: str, head: TableHead) -> float | None:
    """Return a number above 0; 0 and a missing one are unknown."""
    value = json_number(data.get(key, 0))
    if value is None or value < 0.0:
        head.problems.append(f"{key} is {shorten(data[key])}, a number was expected")
        return None
    return value or None
