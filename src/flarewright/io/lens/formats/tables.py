"""Readers of plain tables of surfaces: CSV, and the lens files of pbrt (`.dat`).

A CSV table has a header with `radius` (mm; `flat`, empty, 0 or inf is a plane, `stop` is the stop) or `curvature`
(1/mm, the same words), `thickness`, and `n_d`, `v_d`, `glass`, `semi_diameter` (or `diameter`), `conic`, and `A4` to
`A20` that are known. Lines that begin with `#` are comments, except a header whose first column has that name;
`# name = ...`, `# f_number = ...`, `# field_deg = ...` and `# focal_length = ...` state what the table cannot. Columns
are separated by commas, semicolons or tabs; with the latter two a decimal comma is a point.

A line of pbrt's table has the radius in mm (0 is the stop), the thickness, the index of the medium behind (0 and 1 are
air) and the diameter of the aperture. Source: the documentation of the "realistic" camera in "Physically Based
Rendering", section 6.4, and its lens files.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from pathlib import Path

from ....model.lens.prescription import MOST_TERMS
from ....model.lens.raw_lens import RawSequence
from ....sentences import did_you_mean, shorten
from ...files.door import sentences_for
from ...files.text_file import read_bytes
from ..foreign_file import decoded, lens_errors, number_of
from .table_rows import TableHead, TableRow, sequence_of

_ALIASES = {
    "radius": ("radius", "r", "roc", "radiusmm"), "curvature": ("curvature", "c", "cv"),
    "thickness": ("thickness", "t", "d", "distance", "gap", "thicknessmm"),
    "n_d": ("nd", "n", "index", "refractiveindex"), "v_d": ("vd", "v", "abbe", "abbenumber", "abbenr"),
    "glass": ("glass", "material", "medium"), "semi_diameter": ("semidiameter", "sd", "semiaperture", "height"),
    "diameter": ("diameter", "aperture", "cleardiameter"), "conic": ("conic", "k", "cc"), "stop": ("stop", "type"),
    **{f"A{2 * k + 4}": (f"a{2 * k + 4}",) for k in range(MOST_TERMS)},
}  # fmt: skip
# a surface's own number, which its place already states
_NUMBERS = ("", "#", "no", "number", "row", "surface", "surf")
_STATED = re.compile(r"#\s*(name|notes|f_number|field_deg|focal_length)\s*[=:]\s*(.*)")
_STOP_WORDS = ("stop", "sto", "true", "yes", "aperture", "iris")
_FLAT_WORDS = ("", "flat", "plane", "plano", "inf", "infinity", "-inf")


def read_csv_table(path: str | Path) -> RawSequence:
    """Read a CSV table of surfaces.

    Raises
    ------
    LensError
        When the file cannot be read or is no table of a lens; `problems` lists every error with its line.
    """
    lines = _lines(path, "a CSV table of a lens")
    head = TableHead("line")
    table: list[tuple[int, list[str]]] = []
    content = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not _is_comment(line)]
    first = content[0][1] if content else ""
    delimiter = max(",;\t", key=first.count)
    with sentences_for(path, "a CSV table of a lens"):
        for number, line in content:
            table += [(number, [cell.strip() for cell in row]) for row in csv.reader([line], delimiter=delimiter)]
    for line in lines:
        if found := _STATED.fullmatch(line.strip()):
            _state(found[1], found[2].strip(), head)
    columns = _columns(table[0][1], head) if table else {}
    if "thickness" not in columns or not {"radius", "curvature"} & set(columns):
        head.problems.append("the first line must name the columns, at least radius and thickness: is it a lens table?")
    rows: list[TableRow] = []
    if not head.problems:
        for number, cells in table[1:]:
            given = {key: cells[k] for key, k in columns.items() if k < len(cells)}
            if not given.get("thickness") and number != table[-1][0]:
                head.problems.append(f"line {number}: its thickness is missing")
            rows += _csv_row(number, given, delimiter != ",", head)
    return sequence_of(str(path), head, rows)


def read_dat(path: str | Path) -> RawSequence:
    """Read a lens file of pbrt.

    Returns
    -------
    RawSequence
        The table has no Abbe numbers: dispersions are those of glasses with the same index, with a remark.

    Raises
    ------
    LensError
        When the file cannot be read or is no such table; `problems` lists every error with its line.
    """
    head = TableHead("line")
    rows: list[TableRow] = []
    for number, line in enumerate(_lines(path, "a lens table of pbrt"), 1):
        content, _, comment = line.partition("#")
        words = content.split()
        if not words:
            head.name = head.name or comment.strip()[:80]
            continue
        values = [number_of(word) for word in words]
        if len(values) != 4 or None in values:
            head.problems.append(
                f"line {number}: {shorten(content.strip())} is no row of four numbers (radius, thickness, index, "
                "aperture diameter): is it a lens file of pbrt?"
            )
            break
        radius, thickness, index, diameter = (value or 0.0 for value in values)
        rows.append(
            TableRow(
                number,
                radius,
                thickness,
                stop=radius == 0.0,
                n_d=None if index in (0.0, 1.0) else index,
                semi_diameter=diameter / 2.0,
            )
        )
    return sequence_of(str(path), head, rows)


def _lines(path: str | Path, what: str) -> list[str]:
    with lens_errors():
        return decoded(read_bytes(path, what)).splitlines()


def _is_comment(line: str) -> bool:
    """Whether a line is a comment; a header whose first column is named `#` is none."""
    first, *others = re.split(r"[,;\t]", line)
    named = first.strip() == "#" and any(_plain(name) in _ALIASES["thickness"] for name in others)
    return line.startswith("#") and not named


def _plain(name: str) -> str:
    """Return the name of a column without its unit, spaces and capitals."""
    return re.sub(r"\(.*\)|\[.*\]|[\s_\-]", "", name).lower()


def _state(key: str, value: str, head: TableHead) -> None:
    if key in ("name", "notes"):
        setattr(head, key, value)
        return
    number = number_of(value)
    if number is None or number <= 0.0:
        head.problems.append(f"{key} is {shorten(value)}, a number above 0 was expected")
    else:
        setattr(head, key, number)


def _columns(names: Iterable[str], head: TableHead) -> dict[str, int]:
    """Return the place of each known column; a remark names the others."""
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        plain = _plain(name)
        key = next((key for key, aliases in _ALIASES.items() if plain in aliases), None)
        if key in found:
            head.problems.append(f"the columns {name!r} and {key!r} are the same; keep one")
        elif key is not None:
            found[key] = place
        elif plain not in _NUMBERS:
            head.remarks.append(f"column {shorten(name)} is left out{did_you_mean(name, tuple(_ALIASES))}")
    for one, other in (("radius", "curvature"), ("semi_diameter", "diameter")):
        if one in found and other in found:
            head.problems.append(f"the table has both {one} and {other}; keep one")
    return found


def _csv_row(number: int, given: dict[str, str], comma: bool, head: TableHead) -> list[TableRow]:
    """Return the row of a line; none after an error, which is appended."""
    shape = given.get("radius", given.get("curvature", "")).lower()
    stop = shape == "stop" or given.get("stop", "").lower() in _STOP_WORDS
    values: dict[str, float] = {}
    for key, text in given.items():
        if key in ("glass", "stop") or not text:
            continue
        if key in ("radius", "curvature") and (text.lower() in _FLAT_WORDS or text.lower() == "stop"):
            continue
        value = number_of(text.replace(",", ".") if comma else text)
        if value is None:
            head.problems.append(f"line {number}: {key} is {shorten(text)}, a number was expected")
            return []
        values[key] = value
    curvature = values.get("curvature", 0.0)
    radius = values.get("radius", 1.0 / curvature if curvature else 0.0)
    terms = [values.get(f"A{2 * k + 4}", 0.0) for k in range(MOST_TERMS)]
    while terms and terms[-1] == 0.0:
        terms.pop()
    semi = values["diameter"] / 2.0 if "diameter" in values else values.get("semi_diameter")
    glass = given.get("glass", "")
    return [
        TableRow(
            number,
            radius,
            values.get("thickness", 0.0),
            stop=stop,
            n_d=values.get("n_d"),
            v_d=values.get("v_d"),
            glass=None if glass.lower() in ("", "air") else glass,
            semi_diameter=semi,
            conic=values.get("conic", 0.0),
            asphere=tuple(terms),
        )
    ]
