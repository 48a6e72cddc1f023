"""Lists of photographs: captures.csv, or a folder with a rule for the angles; and camera.json.

```
file,constellation_deg,exposure_s,iso,f_number
IMG_0001.CR2,0,0.25,100,5.6
IMG_0002.CR2,0,1,100,5.6
IMG_0003.CR2,0.2,0.25,100,5.6
```

Further columns: roll_deg, focal_mm, light_x_px, light_y_px, kind (light, dark, flat). What is not said, in an empty
cell or without a column, is read from the photograph itself (EXIF) where it has it. A rule such as `0+0.2` gives the
angles in the order of the lines: the next angle begins when an exposure comes a second time.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import FlarewrightError
from ..model.capture import CameraNoise, Capture
from .photo import PHOTO_SUFFIXES, photo_facts
from .sentences import did_you_mean, summary, validation_sentences
from .taken_for import record_of
from .text_file import read_text

_COLUMNS = tuple(Capture.model_fields)

# f-numbers and focal lengths that differ by less are one: a list rounds what the camera writes
_SAME = 0.03


@dataclass(frozen=True)
class AngleRule:
    """The k-th constellation is at `start` + k * `step`, degrees."""

    start: float
    step: float


def parse_rule(text: str) -> AngleRule:
    """Return the rule that a text like "0+0.2" or "30-0.5" means.

    Parameters
    ----------
    text : str
        Start and signed step, degrees.

    Returns
    -------
    AngleRule

    Raises
    ------
    FlarewrightError
        When it is no such text, or the step is 0.
    """
    number = r"(?:\d+\.?\d*|\.\d+)"
    found = re.fullmatch(rf"\s*([+-]?{number})\s*([+-]\s*{number})\s*", text)
    if found is None:
        raise FlarewrightError(
            f"the rule {text!r} for the angles is no start and step; write 0+0.2 for 0, 0.2, 0.4 ..."
        )
    start, step = float(found[1]), float(found[2].replace(" ", ""))
    if step == 0.0:
        raise FlarewrightError(f"the rule {text!r} has a step of 0 degrees; the camera has to turn")
    return AngleRule(start, step)


def read_captures(path: Path, rule: AngleRule | None = None) -> tuple[Capture, ...]:
    """Read the list of photographs.

    Parameters
    ----------
    path : Path
        captures.csv, or a folder of photographs, which are taken in the order of their names.
    rule : AngleRule, optional
        Gives the angles; needed for a folder.

    Returns
    -------
    tuple of Capture
        In the order of the lines; `file` from the folder of the list.

    Raises
    ------
    FlarewrightError
        When the list cannot be read or has mistakes; `problems` then lists all of them.
    """
    folder = captures_folder(path)
    rows = _folder_rows(path, rule) if path.is_dir() else _csv_rows(path)
    problems: list[str] = []
    filled = [_with_exif(row, folder, where, problems) for where, row in rows]
    problems += _untold(
        rows, filled, "list them in a captures.csv with file and exposure_s" if path.is_dir() else "give it in the list"
    )
    if not problems and rule is not None:
        filled = _with_angles(filled, rule, path)
    found = []
    for (where, _), row in zip(rows, filled, strict=True):
        if row is None or "exposure_s" not in row:
            continue
        try:
            found.append(Capture.model_validate(row))
        except ValidationError as error:
            problems += [f"{where}: {sentence}" for sentence in validation_sentences(error)]
    if not problems:
        problems = _mistakes(found)
    if problems:
        raise FlarewrightError(summary(str(path), problems), tuple(problems))
    return tuple(found)


def captures_folder(path: Path) -> Path:
    """Return where the files of a list of captures are looked for."""
    return path if path.is_dir() else path.parent


def read_camera(path: Path) -> CameraNoise:
    """Read camera.json.

    Parameters
    ----------
    path : Path

    Returns
    -------
    CameraNoise

    Raises
    ------
    FlarewrightError
        When it cannot be read or has mistakes.
    """
    try:
        data = json.loads(read_text(path, "a camera.json"))
    except json.JSONDecodeError as error:
        raise FlarewrightError(f"{path} is not JSON (line {error.lineno}): {error.msg.lower()}") from None
    except ValueError as error:
        raise FlarewrightError(str(error)) from None
    if not isinstance(data, dict):
        raise FlarewrightError(f"{path} is no camera.json: a JSON object was expected")
    noise, problems = record_of(CameraNoise.model_validate, data)
    if noise is None:
        raise FlarewrightError(summary(str(path), problems))
    return noise


def _csv_rows(path: Path) -> list[tuple[str, dict[str, Any]]]:
    try:
        text = read_text(path, "a list of captures")
    except ValueError as error:
        raise FlarewrightError(str(error)) from None
    separator = ";" if text.partition("\n")[0].count(";") > text.partition("\n")[0].count(",") else ","
    reader = csv.DictReader(text.splitlines(), delimiter=separator, skipinitialspace=True)
    names = [name.strip() for name in reader.fieldnames or ()]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise FlarewrightError(f"{path}: the column {name!r} is named twice; remove one of them")
        if name not in _COLUMNS:
            raise FlarewrightError(
                f"{path}: the column {name!r} is unknown{did_you_mean(name, _COLUMNS)}; known are {', '.join(_COLUMNS)}"
            )
    if "file" not in names:
        raise FlarewrightError(f"{path}: the first line names no column 'file'; begin with {','.join(_COLUMNS[:5])}")
    reader.fieldnames = names
    rows = []
    for row in reader:
        where = f"line {reader.line_num}"
        if None in row:
            raise FlarewrightError(f"{path}: {where} has more cells than the first line has names; check its commas")
        cells = {name: cell.strip() for name, cell in row.items() if cell is not None and cell.strip()}
        if cells:
            rows.append((where, dict(cells)))
    if not rows:
        raise FlarewrightError(f"{path}: there are no captures below the first line; add a line for each photograph")
    return rows


def _folder_rows(path: Path, rule: AngleRule | None) -> list[tuple[str, dict[str, Any]]]:
    files = sorted(file.name for file in path.iterdir() if file.suffix.lower() in PHOTO_SUFFIXES)
    if not files:
        raise FlarewrightError(
            f"{path} holds no photograph; give a folder of {', '.join(PHOTO_SUFFIXES[:6])} ... files"
        )
    if rule is None:
        raise FlarewrightError(
            f"{path} is a folder, which tells no angles; add --angles 0+0.2, or write a captures.csv"
        )
    return [(name, {"file": name}) for name in files]


def _with_exif(row: dict[str, Any], folder: Path, where: str, problems: list[str]) -> dict[str, Any] | None:
    """Fill in what the list leaves out and the photograph tells; None when there is no more to say of the row."""
    file = folder / str(row.get("file", ""))
    if not row.get("file"):
        problems.append(f"{where}: file is missing")
        return None
    # in a folder a row is called as its file, which what is told names already
    place = "" if where == row["file"] else f"{where}: "
    if not file.is_file():
        problems.append(f"{place}{file} does not exist: check the path and the spelling")
        return None
    told = {"exposure_s", "iso", "f_number"} <= row.keys()
    if told and "focal_mm" in row:
        return row
    try:
        facts = photo_facts(file)
    except FlarewrightError as error:
        if told:
            # merging tells of a damaged photograph
            return row
        problems.append(f"{place}{error}")
        return None
    return {**facts, **row}


def _untold(
    rows: Sequence[tuple[str, dict[str, Any]]], filled: Sequence[dict[str, Any] | None], remedy: str
) -> list[str]:
    """Say in one sentence of which photographs neither the list nor they themselves tell the exposure."""
    where = [
        (place, str(row["file"]))
        for (place, _), row in zip(rows, filled, strict=True)
        if row is not None and "exposure_s" not in row
    ]
    if not where:
        return []
    place, file = where[0]
    first = file if place == file else f"{file} in {place}"
    if len(where) == 1:
        return [f"{first} does not tell its exposure_s; {remedy}"]
    return [f"{len(where)} of {len(rows)} photographs do not tell their exposure_s, the first is {first}; {remedy}"]


def _with_angles(rows: Sequence[dict[str, Any] | None], rule: AngleRule, path: Path) -> list[dict[str, Any] | None]:
    """Give angles by the rule; the next one begins when an exposure comes a second time."""
    found: list[dict[str, Any] | None] = []
    seen, step = set[tuple[str, str]](), 0
    for row in rows:
        if row is None or row.get("kind", "light") != "light":
            found.append(row)
            continue
        if "constellation_deg" in row:
            raise FlarewrightError(
                f"{path} tells constellation_deg of {row['file']}, and so does the rule {rule.start:g}{rule.step:+g}: "
                "leave out --angles, or empty that column"
            )
        setting = (str(row.get("exposure_s")), str(row.get("iso")))
        if setting in seen:
            seen, step = set(), step + 1
        seen.add(setting)
        found.append({**row, "constellation_deg": round(rule.start + step * rule.step, 9)})
    return found


def _mistakes(captures: Sequence[Capture]) -> list[str]:
    """Look for what makes no run: no light, a file twice, angles that go back and forth, exposures that are missing."""
    lights = [one for one in captures if one.kind == "light"]
    if not lights:
        return ["there is no capture of kind light; add photographs of the light"]
    names = [one.file for one in captures]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        return [f"{twice} is listed twice; remove one of the lines"]
    return _disorder(lights) or _missing_exposures(lights) or _other_lens(lights)


def _other_lens(lights: Sequence[Capture]) -> list[str]:
    """Look for photographs at another aperture or zoom: their ghosts are others."""
    for name, words in (("f_number", "f/{:g}"), ("focal_mm", "{:g} mm")):
        known = [(one.file, getattr(one, name)) for one in lights if getattr(one, name) is not None]
        odd = next(((file, value) for file, value in known if abs(value / known[0][1] - 1.0) > _SAME), None)
        if odd is not None:
            return [
                f"{known[0][0]} was taken at {words.format(known[0][1])} and {odd[0]} at {words.format(odd[1])}, which "
                f"have other ghosts: merge them into runs of their own, or correct {name}"
            ]
    return []


def _disorder(lights: Sequence[Capture]) -> list[str]:
    for roll in dict.fromkeys(one.roll_deg for one in lights):
        angles = [one.constellation_deg or 0.0 for one in lights if one.roll_deg == roll]
        steps = [(a, b) for a, b in pairwise(angles) if a != b]
        back = next(((a, b) for a, b in steps if (b > a) != (steps[0][1] > steps[0][0])), None)
        if back is not None:
            return [
                f"the angles are out of order: {back[1]:g} deg follows {back[0]:g} deg; if the angles are right, sort "
                "the lines by them"
            ]
    return []


def _missing_exposures(lights: Sequence[Capture]) -> list[str]:
    groups: dict[tuple[float, float], set[tuple[float, float]]] = {}
    for one in lights:
        groups.setdefault((one.roll_deg, one.constellation_deg or 0.0), set()).add((one.exposure_s, one.iso))
    wanted = set().union(*groups.values())
    for (_, angle), have in groups.items():
        if have != wanted:
            missing = min(wanted - have)
            return [
                f"the constellation of {angle:g} deg lacks the exposure of {missing[0]:g} s that others have; add it, "
                "or remove the lines of that angle"
            ]
    return []
