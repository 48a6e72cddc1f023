"""Reader of `.lens` text tables, a format that several flare tools share.

The header comment holds title, patent and f-number; then follow `name:`, `focal_length:` and, after `surfaces:`, one
row per line: radius (0 or inf is flat, `stop` is the stop), thickness, n_d and V_d of the medium behind (1 and 0 for
air), aperture, number of coating layers. The reader does not judge the table; `optics.lens_import.patent_repair` does.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

from ....errors import LensError
from ....model import Medium
from ....model.lens.raw_lens import RawLens, RawRow
from ....sentences import did_you_mean, shorten, summary
from ...files.text_file import read_text
from .. import media
from ..foreign_file import MOST_SURFACES, lens_errors
from ..lens_fields import ROW_NUMBERS

_COLUMNS = ("radius", "thickness", "index", "Abbe number", "aperture", "coating layers")
_COUNTED = re.compile(r"(\d+)\s+surfaces?")
_F_NUMBER = re.compile(r"\bf/\s*(\d+(?:\.\d+)?)")
_WIDEST = 2000.0
_TIGHTEST = 1e-3


def read_dotlens(path: str | Path) -> RawLens:
    """Read a `.lens` file without repairs; each glass gets its dispersion.

    Raises
    ------
    LensError
        When the file cannot be read or its table is broken; `problems` lists every error with its line.
    """
    with lens_errors():
        text = read_text(path, "a .lens file")
    reading = _Reading()
    in_table = False
    for number, line in enumerate(text.split("\n"), start=1):
        content, _, comment = line.partition("#")
        content = content.strip()
        if not content:
            _read_comment(comment.strip(), reading, in_table)
        elif content.rstrip() == "surfaces:":
            if in_table:
                reading.remarks.append(f'line {number}: a second "surfaces:"; its rows are added to the first table')
            in_table = True
        elif in_table:
            _read_row(content, number, reading)
        else:
            _read_key(content, number, reading)
    if not in_table:
        reading.problems.append('there is no line "surfaces:" with a table behind it: is it a .lens file?')
    elif not reading.rows and not reading.problems:
        reading.problems.append('the table behind "surfaces:" is empty')
    if len(reading.rows) > MOST_SURFACES:
        reading.problems.append(f"the table has {len(reading.rows)} rows, a lens has at most {MOST_SURFACES}")
    if reading.problems:
        raise LensError(summary(str(path), reading.problems), tuple(reading.problems))
    return _finish(Path(path), reading)


@dataclass
class _Reading:
    """State of the parser."""

    name: str = ""
    title: str = ""
    patent: str = ""
    f_number: float | None = None
    focal_length: float | None = None
    surfaces: int | None = None
    rows: list[RawRow] = field(default_factory=list)
    findings: list[tuple[int, media.Finding]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    keys: set[str] = field(default_factory=set)


def _read_comment(comment: str, reading: _Reading, in_table: bool) -> None:
    if not comment or in_table:
        return
    if not reading.title:
        reading.title = comment
    elif comment.lower().startswith("patent:"):
        reading.patent = comment.partition(":")[2].strip()
    elif counted := _COUNTED.search(comment):
        reading.surfaces = int(counted[1])
        if (stated := _F_NUMBER.search(comment)) and 0.3 < float(stated[1]) <= 256.0:
            reading.f_number = float(stated[1])


def _read_key(content: str, number: int, reading: _Reading) -> None:
    key, colon, value = (part.strip() for part in content.partition(":"))
    if key in reading.keys:
        reading.remarks.append(f"line {number}: {key} is given twice; the last one is used")
    reading.keys.add(key)
    if key == "name" and colon:
        reading.name = value
    elif key == "focal_length" and colon:
        length = _float(value)
        if length is None or math.isnan(length):
            reading.problems.append(f"line {number}: focal_length is {shorten(value)}, a number in mm was expected")
        else:
            reading.focal_length = length if math.isfinite(length) and length != 0.0 else None
    else:
        near = did_you_mean(key, ("name", "focal_length", "surfaces"))
        reading.remarks.append(f"line {number}: {shorten(content)} is not understood and left out{near}")


def _read_row(content: str, number: int, reading: _Reading) -> None:
    words = content.split()
    stop = words[0].lower() == "stop"
    if not 5 <= len(words) <= 6:
        columns = ", ".join(_COLUMNS)
        reading.problems.append(f"line {number}: {len(words)} columns, 6 were expected ({columns})")
        return
    values: list[float] = []
    for column, word in zip(_COLUMNS, ["0" if stop else words[0], *words[1:]], strict=False):
        value = _float(word)
        if value is None or math.isnan(value) or (math.isinf(value) and column != "radius"):
            reading.problems.append(f"line {number}: {column} is {shorten(word)}, a number was expected")
            return
        values.append(value)
    radius, thickness, n_d, v_d, aperture, layers = (*values, 0.0)[:6]
    if refusal := ROW_NUMBERS["thickness"].refuse(thickness):
        reading.problems.append(f"line {number}: thickness {refusal}")
    if not 1.0 <= n_d < 4.5:
        reading.problems.append(f"line {number}: index is {n_d:g}: a glass lies between 1 and 4.5")
    if not 0.0 <= aperture <= _WIDEST:
        reading.problems.append(f"line {number}: aperture is {aperture:g}: it must lie between 0 and {_WIDEST:g} mm")
    if 0.0 < abs(radius) < _TIGHTEST:
        reading.problems.append(f"line {number}: radius is {radius:g}: less than a micrometre is no lens surface")
    if reading.problems:
        return
    if stop and n_d not in (1.0, reading.rows[-1].n_d if reading.rows else 1.0):
        reading.remarks.append(f"line {number}: the stop states an index of {n_d:g}, but it refracts nothing; left out")
    if layers < 0.0 or not layers.is_integer():
        reading.remarks.append(f"line {number}: {layers:g} coating layers, read as {max(int(layers), 0)}")
    reading.rows.append(
        RawRow(
            line=number,
            stop=stop,
            curvature=0.0 if radius == 0.0 or math.isinf(radius) else 1.0 / radius,
            thickness=thickness,
            n_d=n_d,
            v_d=v_d,
            medium=None if n_d == 1.0 or stop else _medium(n_d, v_d, number, reading),
            aperture=aperture,
            coating_layers=max(int(layers), 0),
        )
    )


def _medium(n_d: float, v_d: float, number: int, reading: _Reading) -> Medium:
    unknown = v_d == 0.0
    if not unknown and (refusal := ROW_NUMBERS["v_d"].refuse(v_d)):
        reading.remarks.append(f"line {number}: Abbe number {refusal}; treated as unknown")
        unknown = True
    medium, finding = media.attach(None, n_d, None if unknown else v_d)
    reading.findings.append((number, finding))
    return medium


def _finish(path: Path, reading: _Reading) -> RawLens:
    return RawLens(
        file=path.name,
        name=reading.name,
        title=reading.title,
        patent=reading.patent,
        f_number=reading.f_number,
        focal_length=reading.focal_length,
        stated_surfaces=reading.surfaces,
        rows=tuple(reading.rows),
        remarks=(*reading.remarks, *media.remarks(reading.findings, "line")),
    )


def _float(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None
