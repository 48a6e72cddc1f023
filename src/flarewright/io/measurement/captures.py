"""Lists of captures: captures.csv, or a folder of photographs with a rule for the angles; and camera.json.

```
file,constellation_deg,exposure_s,iso,f_number
IMG_0001.CR2,0,0.25,100,5.6
IMG_0002.CR2,0,1,100,5.6
IMG_0003.CR2,0.2,0.25,100,5.6
```

Further columns: roll_deg, focal_mm, light_x_px, light_y_px, kind (light, dark, flat). Empty cells and missing columns
are filled from the photograph's EXIF tags where possible. A rule such as `0+0.2` gives the angles in the order of the
lines: the next angle begins when an exposure repeats.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Container, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from ...errors import FlarewrightError
from ...model.measurement.capture import CameraNoise, Capture
from ...sentences import did_you_mean, summary, validation_sentences
from ..files.door import expanded, no_file, sentences_for
from ..files.text_file import read_json, read_text
from ..files.type_slips import record_of
from ..images.photo import PHOTO_SUFFIXES, photo_facts

_COLUMNS = tuple(Capture.model_fields)

# a constellation that lost one photograph is merged from the others if they are at least this many
_ENOUGH = 2

# relative tolerance of f-numbers and focal lengths: lists round the camera's values
_RELATIVE_TOLERANCE = 0.03


@dataclass(frozen=True)
class AngleRule:
    """The k-th constellation is at `start` + k * `step`, degrees."""

    start: float
    step: float


def parse_rule(text: str) -> AngleRule:
    """Return the angle rule of a text such as "0+0.2" or "30-0.5".

    Parameters
    ----------
    text : str
        Start and signed step, degrees.

    Raises
    ------
    FlarewrightError
        When the text has another form, or the step is 0.
    """
    number = r"(?:\d+\.?\d*|\.\d+)"
    found = re.fullmatch(rf"\s*([+-]?{number})\s*([+-]\s*{number})\s*", text)
    if found is None:
        raise FlarewrightError(f"the rule {text!r} for the angles is not START+STEP; write 0+0.2 for 0, 0.2, 0.4 ...")
    start, step = float(found[1]), float(found[2].replace(" ", ""))
    if step == 0.0:
        raise FlarewrightError(f"the rule {text!r} has a step of 0 degrees; give a step above or below 0")
    return AngleRule(start, step)


def read_captures(path: Path, rule: AngleRule | None = None) -> tuple[Capture, ...]:
    """Read the list of captures, as `read_capture_list` does, without its remarks."""
    return read_capture_list(path, rule)[0]


def read_capture_list(path: Path, rule: AngleRule | None = None) -> tuple[tuple[Capture, ...], tuple[str, ...]]:
    """Read the list of captures.

    Parameters
    ----------
    path : Path
        captures.csv, or a folder of photographs, which are read in the order of their names.
    rule : AngleRule, optional
        Angles of the captures; required for a folder.

    Returns
    -------
    captures : tuple of Capture
        In the order of the lines, or of roll and constellation; `file` is relative to the folder of the list.
    remarks : tuple of str
        A lost photograph: one that does not exist or is not listed, where its constellation has two others; lines that
        were not in the order of their angles.

    Raises
    ------
    FlarewrightError
        When the list cannot be read or has errors; `problems` then lists all of them.
    """
    folder = captures_folder(path)
    rows = _folder_rows(path, rule) if path.is_dir() else _csv_rows(path)
    problems: list[str] = []
    absent: dict[str, str] = {}
    filled = [_with_exif(row, folder, where, problems, absent) for where, row in rows]
    problems += _missing_exposure_sentence(
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
    remarks: list[str] = []
    if problems or _too_few_left(found, absent):
        problems = [*absent.values(), *problems]
    else:
        found = [one for one in found if one.file not in absent]
        problems = _list_errors(found, remarks)
    if problems:
        raise FlarewrightError(summary(str(path), problems), tuple(problems))
    if not _in_order(found):
        found.sort(key=_place)
        remarks.append("the lines are not in the order of their angles; sorted")
    remarks = [f"{sentence.partition(': check')[0]}; left out" for sentence in absent.values()] + remarks
    return tuple(found), tuple(remarks)


def captures_folder(path: Path) -> Path:
    """Return the base folder of the files of a capture list."""
    return path if path.is_dir() else path.parent


def read_camera(path: Path) -> CameraNoise:
    """Read camera.json.

    Raises
    ------
    FlarewrightError
        When the file cannot be read or has errors.
    """
    data = read_json(path, "a camera.json")
    if not isinstance(data, dict):
        raise FlarewrightError(f"{path} is no camera.json: a JSON object was expected")
    noise, problems = record_of(CameraNoise.model_validate, data)
    if noise is None:
        raise FlarewrightError(summary(str(path), problems))
    return noise


def _csv_rows(path: Path) -> list[tuple[str, dict[str, Any]]]:
    text = read_text(path, "a list of captures")
    with sentences_for(path, "a list of captures"):
        return _csv_cells(path, text)


def _csv_cells(path: Path, text: str) -> list[tuple[str, dict[str, Any]]]:
    """Return the filled cells of each line, with the line's number; csv.Error for a cell that never ends."""
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
        raise FlarewrightError(f"{path}: the first line has no column 'file'; begin with {','.join(_COLUMNS[:5])}")
    reader.fieldnames = names
    rows = []
    for row in reader:
        where = f"line {reader.line_num}"
        if None in row:
            raise FlarewrightError(f"{path}: {where} has more cells than the first line has columns; check its commas")
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
            f"{path} is a folder, which gives no angles; add --angles 0+0.2, or write a captures.csv"
        )
    return [(name, {"file": name}) for name in files]


def _with_exif(
    row: dict[str, Any], folder: Path, where: str, problems: list[str], absent: dict[str, str]
) -> dict[str, Any] | None:
    """Fill missing values from the photograph's EXIF tags; None after an error that ends the checks of this row.

    A photograph of the light that does not exist gets its error in `absent`, by its name.
    """
    file = expanded(folder / str(row.get("file", "")))
    if not row.get("file"):
        problems.append(f"{where}: file is missing")
        return None
    # in a folder, rows are named by their files, which the messages contain already
    place = "" if where == row["file"] else f"{where}: "
    if not file.is_file():
        sentence = f"{place}{file} {no_file(file)}: check the path and the spelling"
        if "exposure_s" in row and row.get("kind", "light") == "light":
            absent[str(row["file"])] = sentence
            return row
        problems.append(sentence)
        return None
    complete = {"exposure_s", "iso", "f_number"} <= row.keys()
    if complete and "focal_mm" in row:
        return row
    try:
        facts = photo_facts(file)
    except FlarewrightError as error:
        if complete:
            # merging reports damaged photographs
            return row
        problems.append(f"{place}{error}")
        return None
    return {**facts, **row}


def _missing_exposure_sentence(
    rows: Sequence[tuple[str, dict[str, Any]]], filled: Sequence[dict[str, Any] | None], remedy: str
) -> list[str]:
    """Return an error sentence on photographs whose exposure is missing in both the list and the EXIF tags."""
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
        return [f"{first} has no exposure_s; {remedy}"]
    return [f"{len(where)} of {len(rows)} photographs have no exposure_s, the first is {first}; {remedy}"]


_Setting = tuple[str, str]


def _setting(row: dict[str, Any]) -> _Setting:
    """Return exposure and ISO of a photograph, as the list writes them."""
    return str(row.get("exposure_s")), str(row.get("iso"))


def _bracket(settings: Sequence[_Setting]) -> list[_Setting]:
    """Return the exposures of one angle in their order, from those of all angles in turn, of which some may be lost."""
    if not settings:
        return []
    after = Counter(pair for pair in pairwise(settings) if pair[0] != pair[1])
    cycle = [settings[0]]
    rest = list(dict.fromkeys(settings))[1:]
    while rest:
        # the most common successor; the first one of several
        best = max(rest, key=lambda one: after[cycle[-1], one])
        cycle.append(best)
        rest.remove(best)
    # the first photograph may be lost: a rising or falling order begins where the cycle turns against it
    times = [_seconds(setting) for setting in cycle]
    steps = [b > a for a, b in pairwise([*times, times[0]])]
    for direction in (True, False):
        if len(cycle) > 2 and steps.count(not direction) == 1:
            start = (steps.index(not direction) + 1) % len(cycle)
            return [*cycle[start:], *cycle[:start]]
    return cycle


def _seconds(setting: _Setting) -> float:
    try:
        return float(setting[0])
    except ValueError:
        return 0.0


def _with_angles(rows: Sequence[dict[str, Any] | None], rule: AngleRule, path: Path) -> list[dict[str, Any] | None]:
    """Assign angles by the rule; the next one begins where the order of the exposures does, also if one is lost."""
    found: list[dict[str, Any] | None] = []
    lights = [row for row in rows if row is not None and row.get("kind", "light") == "light"]
    order = {setting: place for place, setting in enumerate(_bracket([_setting(row) for row in lights]))}
    last, step = -1, 0
    for row in rows:
        if row is None or row.get("kind", "light") != "light":
            found.append(row)
            continue
        if "constellation_deg" in row:
            raise FlarewrightError(
                f"{path} gives constellation_deg of {row['file']}, and so does the rule {rule.start:g}{rule.step:+g}: "
                "leave out --angles, or empty that column"
            )
        place = order[_setting(row)]
        step += place <= last
        last = place
        found.append({**row, "constellation_deg": round(rule.start + step * rule.step, 9)})
    return found


def _list_errors(captures: Sequence[Capture], remarks: list[str]) -> list[str]:
    """Return errors of the list as a whole: no light, a repeated file, missing exposures, several settings."""
    lights = [one for one in captures if one.kind == "light"]
    if not lights:
        return ["there is no capture of kind light; add photographs of the light"]
    names = [one.file for one in captures]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        return [f"{twice} is listed twice; remove one of the lines"]
    return _missing_exposures(lights, remarks) or _setting_errors(lights)


def _setting_errors(lights: Sequence[Capture]) -> list[str]:
    """Return an error on photographs at another aperture or zoom: these change the ghosts."""
    for name, words in (("f_number", "f/{:g}"), ("focal_mm", "{:g} mm")):
        known = [(one.file, getattr(one, name)) for one in lights if getattr(one, name) is not None]
        odd = next(
            ((file, value) for file, value in known if abs(value / known[0][1] - 1.0) > _RELATIVE_TOLERANCE), None
        )
        if odd is not None:
            return [
                f"{known[0][0]} was taken at {words.format(known[0][1])} and {odd[0]} at {words.format(odd[1])}, which "
                f"have different ghosts: merge them into separate runs, or correct {name}"
            ]
    return []


def _in_order(captures: Sequence[Capture]) -> bool:
    """Whether the constellations of each roll rise or fall throughout."""
    lights = [one for one in captures if one.kind == "light"]
    for roll in dict.fromkeys(one.roll_deg for one in lights):
        steps = np.diff([one.constellation_deg or 0.0 for one in lights if one.roll_deg == roll])
        if (steps > 0.0).any() and (steps < 0.0).any():
            return False
    return True


def _place(one: Capture) -> tuple[float, float]:
    return one.roll_deg, one.constellation_deg or 0.0


def _too_few_left(captures: Sequence[Capture], absent: Container[str]) -> bool:
    """Whether a constellation lacks two photographs, or has too few beside the one that it lacks."""
    lost = [_place(one) for one in captures if one.file in absent]
    left = Counter(_place(one) for one in captures if one.kind == "light" and one.file not in absent)
    return len(set(lost)) < len(lost) or any(left[place] < _ENOUGH for place in lost)


def _missing_exposures(lights: Sequence[Capture], remarks: list[str]) -> list[str]:
    """Return an error on a constellation with too few exposures; one that it can do without becomes a remark."""
    groups: dict[tuple[float, float], set[tuple[float, float]]] = {}
    for one in lights:
        groups.setdefault(_place(one), set()).add((one.exposure_s, one.iso))
    wanted = set().union(*groups.values())
    for (_, angle), have in groups.items():
        missing = sorted(wanted - have)
        if not missing:
            continue
        lacks = f"the constellation of {angle:g} deg lacks the exposure of {missing[0][0]:g} s that others have"
        if len(missing) > 1 or len(have) < _ENOUGH:
            return [f"{lacks}; add it, or remove the lines of that angle"]
        remarks.append(f"{lacks}; merged from the other {len(have)}")
    return []
