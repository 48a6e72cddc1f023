"""Keys of a lens file for surface shapes and moved parts: aspheres, toroids, decentre, tilt, figure, elements, zoom."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...model import Element, Figure, Position, Surface
from ...model.lens.figure import LARGEST_NM, MOST_NOLL
from ...model.lens.prescription import MOST_TERMS
from ...sentences import INVALID, did_you_mean, shorten, validation_sentences
from .lens_fields import CURVATURE, NumberField

ELEMENT_KEYS = ("rows", "decentre", "tilt_deg")
FIGURE_KEYS = ("zernike_nm", "zernike_waves", "image", "peak_valley_nm")

CONIC_X = NumberField("conic constant in the x-z plane; default: `conic`", -1e6, 1e6, unit="")
TERM = NumberField("a term of A4 r^4 + A6 r^6 + ...", -1e3, 1e3, unit="")
OFFSET = NumberField("decentre", -100.0, 100.0)
TILT = NumberField("tilt", -45.0, 45.0, unit="degrees")
HEIGHT_NM = NumberField("height", -LARGEST_NM, LARGEST_NM, unit="nm")

GAP = NumberField("gap", 0.0, 10000.0)
POSITION_NUMBERS = {
    "focal_length": NumberField("focal length at this position, as the source states it", 0.0, 1e9, low_open=True),
    "focus_distance": NumberField("plane in focus at this position, for focus positions", 0.0, 1e9, low_open=True),
    "f_number": NumberField("f-number at this position, where it differs", 0.3, 256.0, low_open=True, unit=""),
    "field_deg": NumberField("half field of view at this position", 0.0, 90.0, True, True, unit="degrees"),
}

WAVE_NM = 632.8
"""Wavelength of figure errors in waves: the red helium-neon line, as for test plates."""


def read_shape(entry: dict[str, Any], where: str, folder: Path | None, problems: list[str]) -> dict[str, Any]:
    """Check the shape keys of a row.

    Parameters
    ----------
    entry : dict
        The parsed row; the caller reads `radius_x` and `curvature_x`.
    where : str
        "row 3", for messages.
    folder : path or None
        Base folder of relative image paths.
    problems : list of str
        Errors are appended.

    Returns
    -------
    dict
        Fields for `model.Surface`.
    """
    values: dict[str, Any] = {}
    if "conic_x" in entry and (number := CONIC_X.read(entry["conic_x"], f"{where}: conic_x", problems)) is not None:
        values["conic_x"] = number
    if "torus" in entry and type(entry["torus"]) is bool:
        values["torus"] = entry["torus"]
    elif "torus" in entry:
        problems.append(f"{where}: torus is {shorten(entry['torus'])}, true or false was expected")
    for key, first, second in (("asphere", "A4", "A6"), ("odd_asphere", "A3", "A5")):
        if key not in entry:
            continue
        terms = _numbers(entry[key], f"{where}: {key}", TERM, problems)
        if terms is not None and not 1 <= len(terms) <= MOST_TERMS:
            problems.append(
                f"{where}: {key} has {len(terms)} terms: give 1 to {MOST_TERMS}, {first} first, {second} next, ..."
            )
        elif terms is not None:
            values[key] = terms
    values |= _moved(entry, where, problems)
    if "figure" in entry:
        values["figure"] = _figure(entry["figure"], f"{where}: figure", folder, problems)
    return values


def read_elements(table: object, problems: list[str]) -> tuple[Element, ...]:
    """Check and return the `[[elements]]` of a lens file; `Lens` checks conditions between them."""
    found = []
    for where, entry in _tables(table, "element", "rows = [FIRST, LAST]", problems):
        before = len(problems)
        unknown_keys(entry, ELEMENT_KEYS, f"{where}: ", problems)
        rows = entry.get("rows")
        if not (isinstance(rows, list) and len(rows) == 2 and all(type(row) is int for row in rows)):
            problems.append(f"{where}: rows is {_stated(rows)}: give its first and last row, rows = [0, 2] for example")
        moved = _moved(entry, where, problems)
        if len(problems) == before:
            found.append(Element(rows=rows, **moved))
    return tuple(found)


def read_positions(table: object, problems: list[str]) -> tuple[Position, ...]:
    """Check and return the `[[positions]]` of a lens file; `Lens` checks conditions between them."""
    found = []
    for where, entry in _tables(table, "position", "name and gaps", problems):
        before = len(problems)
        unknown_keys(entry, ("name", "gaps", *POSITION_NUMBERS), f"{where}: ", problems)
        name, gaps = entry.get("name"), entry.get("gaps")
        if not isinstance(name, str) or not name.strip():
            problems.append(f'{where}: name is {_stated(name)}: give a name, such as name = "wide"')
        if not isinstance(gaps, dict) or not gaps or not all(key.isdecimal() for key in gaps):
            problems.append(f"{where}: gaps is {_stated(gaps)}: give the thickness behind rows, gaps = {{ 5 = 8.78 }}")
            gaps = {}
        fields: dict[str, Any] = {
            key: field.read(entry[key], f"{where}: {key}", problems)
            for key, field in POSITION_NUMBERS.items()
            if key in entry
        }
        read = [(int(row), GAP.read(gap, f"{where}: gap behind row {row}", problems)) for row, gap in gaps.items()]
        if len(problems) == before:
            found.append(Position(name=str(name), gaps=tuple((row, gap or 0.0) for row, gap in read), **fields))
    return tuple(found)


def _tables(table: object, one: str, holds: str, problems: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the tables of an array of tables, each with its name for messages."""
    if not isinstance(table, list):
        problems.append(f"{one}s is {shorten(table)}: write [[{one}s]] with {holds} below it")
        return
    for number, entry in enumerate(table):
        if isinstance(entry, dict):
            yield f"{one} {number}", entry
        else:
            problems.append(f"{one} {number} is {shorten(entry)}: a table with {holds} was expected")


def _moved(entry: dict[str, Any], where: str, problems: list[str]) -> dict[str, tuple[float, ...]]:
    """Check and return the decentre and tilt of a row or an element."""
    found = {}
    for key, field in (("decentre", OFFSET), ("tilt_deg", TILT)):
        if key in entry and (pair := _pair(entry[key], f"{where}: {key}", field, problems)) is not None:
            found[key] = pair
    return found


def positions_schema() -> dict[str, Any]:
    """Return the JSON Schema of `positions`."""
    return {
        "type": "array",
        "description": "settings of the zoom or the focus: moving gaps",
        "items": {
            "type": "object",
            "additionalProperties": False,
            "required": ["name", "gaps"],
            "properties": {
                "name": {"type": "string", "minLength": 1, "description": "name of the setting"},
                "gaps": {
                    "type": "object",
                    "minProperties": 1,
                    "propertyNames": {"pattern": "^[0-9]+$"},
                    "additionalProperties": GAP.schema(),
                    "description": "thickness behind each moving row; every position has the same rows",
                },
                **{key: field.schema() for key, field in POSITION_NUMBERS.items()},
            },
        },
    }


def _figure(value: object, where: str, folder: Path | None, problems: list[str]) -> Figure | None:
    if not isinstance(value, dict):
        problems.append(f"{where} is {shorten(value)}: a table like {{ zernike_nm = {{ 5 = 30 }} }} was expected")
        return None
    before = len(problems)
    unknown_keys(value, FIGURE_KEYS, f"{where}: ", problems)
    fields: dict[str, Any] = {}
    if "zernike_nm" in value and "zernike_waves" in value:
        problems.append(f"{where}: zernike_nm and zernike_waves are both given: keep one")
    for key, unit_nm in (("zernike_nm", 1.0), ("zernike_waves", WAVE_NM)):
        if key in value:
            fields["zernike_nm"] = _zernike(value[key], f"{where}.{key}", unit_nm, problems)
    if "image" in value:
        if not isinstance(value["image"], str) or not value["image"].strip():
            problems.append(f"{where}: image is {shorten(value['image'])}, the path of a grey picture was expected")
        else:
            fields["image"] = str(((folder or Path()) / value["image"]).absolute())
    if "peak_valley_nm" in value:
        fields["peak_valley_nm"] = HEIGHT_NM.read(value["peak_valley_nm"], f"{where}: peak_valley_nm", problems)
    if not value:
        problems.append(f"{where} is empty: give zernike_nm, or image and peak_valley_nm")
    if len(problems) > before:
        return None
    try:
        return Figure(**fields)
    except INVALID as error:
        problems += [f"{where}: {sentence}" for sentence in validation_sentences(error)]
        return None


def _zernike(value: object, where: str, unit_nm: float, problems: list[str]) -> tuple[tuple[int, float], ...]:
    if not isinstance(value, dict):
        problems.append(f"{where} is {shorten(value)}: a table {{ NOLL_INDEX = amplitude }} was expected, {{ 5 = 30 }}")
        return ()
    terms = []
    for key, amplitude in value.items():
        if not (key.isdecimal() and 2 <= int(key) <= MOST_NOLL):
            problems.append(f"{where}: {shorten(key)} is no term: Noll's index runs from 2 (tilt) to {MOST_NOLL}")
            continue
        number = HEIGHT_NM.read(amplitude, f"{where}: term {key}", problems)
        if number is not None and abs(number * unit_nm) > LARGEST_NM:
            problems.append(f"{where}: term {key} is {number:g}: a figure error is at most {LARGEST_NM / 1e3:g} um")
        elif number is not None:
            terms.append((int(key), number * unit_nm))
    return tuple(terms)


def shape_parts(row: Surface, number: Any, quoted: Any, radius: Any) -> list[str]:
    """Return the shape keys of a row as `key = value`.

    Parameters
    ----------
    row : Surface
    number, quoted : callable
        Format a number, a text.
    radius : callable
        Format a curvature as a radius.
    """
    parts = []
    if row.curvature_x is not None:
        parts.append(radius(row.curvature_x, "_x"))
    if row.conic_x is not None:
        parts.append(f"conic_x = {number(row.conic_x)}")
    if row.torus:
        parts.append("torus = true")
    for key in ("asphere", "odd_asphere", "decentre", "tilt_deg"):
        values = getattr(row, key)
        if values:
            parts.append(f"{key} = [{', '.join(map(number, values))}]")
    if row.figure is not None:
        inner = []
        if row.figure.zernike_nm:
            terms = ", ".join(f"{index} = {number(value)}" for index, value in row.figure.zernike_nm)
            inner.append(f"zernike_nm = {{ {terms} }}")
        if row.figure.image is not None:
            inner.append(f"image = {quoted(row.figure.image)}")
            inner.append(f"peak_valley_nm = {number(row.figure.peak_valley_nm)}")
        # a figure without terms is an ideal surface
        if inner:
            parts.append(f"figure = {{ {', '.join(inner)} }}")
    return parts


def shape_schema() -> dict[str, Any]:
    """Return the JSON Schema of a row's shape keys except `radius_x`."""
    pair = {"type": "array", "minItems": 2, "maxItems": 2}
    terms = {"type": "array", "minItems": 1, "maxItems": MOST_TERMS, "items": TERM.schema()}
    return {
        "curvature_x": CURVATURE.schema(),
        "conic_x": CONIC_X.schema(),
        "torus": {"type": "boolean", "description": "the profile along y rotates at the radius across; else biconic"},
        "asphere": {**terms, "description": "A4, A6, ... of the sag's even terms, 1/mm^3, 1/mm^5, ..."},
        "odd_asphere": {**terms, "description": "A3, A5, ... of the sag's odd terms, 1/mm^2, 1/mm^4, ..."},
        "decentre": {**pair, "items": OFFSET.schema(), "description": "x and y offset of the vertex from the axis, mm"},
        "tilt_deg": {**pair, "items": TILT.schema(), "description": "rotation about x, then about y, at the vertex"},
        "figure": {
            "type": "object",
            "additionalProperties": False,
            "minProperties": 1,
            "description": "departure from the ideal form",
            "properties": {
                "zernike_nm": _zernike_schema("rms in nm of each term by Noll's index"),
                "zernike_waves": _zernike_schema(f"the same in waves of {WAVE_NM} nm"),
                "image": {"type": "string", "minLength": 1, "description": "grey picture of the heights"},
                "peak_valley_nm": {**HEIGHT_NM.schema(), "description": "height from black to white, nm"},
            },
            "dependentRequired": {"image": ["peak_valley_nm"], "peak_valley_nm": ["image"]},
        },
    }


def _zernike_schema(about: str) -> dict[str, Any]:
    return {
        "type": "object",
        "propertyNames": {"pattern": "^(0*[2-9]|0*1[0-9]|0*2[0-8])$"},
        "additionalProperties": {"type": "number"},
        "description": about,
    }


def elements_schema() -> dict[str, Any]:
    """Return the JSON Schema of `elements`."""
    shapes = shape_schema()
    return {
        "type": "array",
        "description": "groups of rows that are decentred or tilted",
        "items": {
            "type": "object",
            "additionalProperties": False,
            "required": ["rows"],
            "properties": {
                "rows": {
                    "type": "array",
                    "minItems": 2,
                    "maxItems": 2,
                    "items": {"type": "integer", "minimum": 0},
                    "description": "first and last row, without the stop between",
                },
                "decentre": shapes["decentre"],
                "tilt_deg": {**shapes["tilt_deg"], "description": "rotation about x, then y, at the first vertex"},
            },
        },
    }


def _stated(value: object) -> str:
    return "missing" if value is None else shorten(value)


def _pair(value: object, where: str, field: NumberField, problems: list[str]) -> tuple[float, ...] | None:
    numbers = _numbers(value, where, field, problems)
    if numbers is not None and len(numbers) != 2:
        problems.append(f"{where} has {len(numbers)} numbers: give two, [x, y]")
        return None
    return numbers


def _numbers(value: object, where: str, field: NumberField, problems: list[str]) -> tuple[float, ...] | None:
    if not isinstance(value, list):
        problems.append(f"{where} is {shorten(value)}, a list of numbers was expected")
        return None
    found = [field.read(item, f"{where}[{k}]", problems) for k, item in enumerate(value)]
    return None if None in found else tuple(item for item in found if item is not None)


def unknown_keys(table: dict[str, Any], known: tuple[str, ...], where: str, problems: list[str]) -> None:
    """Append an error for each unknown key of a table; `where` begins its sentence."""
    problems += [
        f"{where}{shorten(key)} is not a known key{did_you_mean(key, known)}" for key in table if key not in known
    ]
