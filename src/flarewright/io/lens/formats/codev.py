"""Reader of CODE V sequence files (`.seq`).

Commands are separated by line ends or semicolons; `&` continues a line, `!` begins a comment. The reader uses TITLE,
DIM, RDM, the aperture (EPD, FNO), the fields (XAN, YAN, XIM, YIM, XRI, YRI), REF and WL, PRV tables of indices, and of
each surface (SO, S, SI) curvature or radius, thickness and glass, STO, CIR, CON, ASP with K and A to J; `codev_zoom`
reads the zoom positions (ZOO). Other commands that change a surface are errors; remarks name the others. A file without
RDM does not state whether its first column holds radii or curvatures, so the caller has to.

Source: the sequence files that lens vendors publish, and the command names of the CODE V reference.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from ....model import Medium
from ....model.lens.raw_lens import Configuration, RawSequence, SequenceRow
from ....sentences import shorten
from ...files.door import shown
from .. import media
from ..configuration_table import Stated
from ..foreign_file import INFINITE, MOST_SURFACES, decoded, largest_field, lens_data, number_of, sequence_row, whole
from ..lens_fields import CURVATURE
from ..medium_names import named_medium, tabulated_medium
from .codev_words import FIELDS, IDLE, IN_ITS_LINE, SHIFTS, UNSUPPORTED, VIGNETTING
from .codev_zoom import Zoom, positions, solved_gap, zoom_cell, zoom_row

FirstColumn = Literal["radii", "curvatures"]

_MM = {"M": 1.0, "MM": 1.0, "C": 10.0, "CM": 10.0, "I": 25.4, "IN": 25.4}
# A to H are terms of r^4 to r^18, J is that of r^20
_TERMS = {letter: k for k, letter in enumerate("ABCDEFGHJ")}
_NOT_ROUND = ("REX", "REY", "ELX", "ELY", "ADX", "ADY", "ARO", "POX", "POY")
_WORDS = re.compile(r"'[^']*'|\"[^\"]*\"|[^\s;]+")


@dataclass
class _Surface:
    """Words of one surface."""

    number: int
    words: list[str]
    stop: bool = False
    conic: float = 0.0
    terms: dict[int, float] = field(default_factory=dict)
    rim: float | None = None


@dataclass
class _Reading:
    """State of the reader."""

    head: dict[str, list[str]] = field(default_factory=dict)
    surfaces: list[_Surface] = field(default_factory=list)
    radii: bool | None = None
    private: dict[str, list[float]] = field(default_factory=dict)
    private_nm: list[float] = field(default_factory=list)
    in_private: bool = False
    zoom: Zoom = field(default_factory=Zoom)
    problems: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    unknown: dict[str, list[str]] = field(default_factory=dict)
    findings: list[tuple[int, media.Finding]] = field(default_factory=list)


def read_seq(path: str | Path, first_column: FirstColumn | None = None) -> RawSequence:
    """Read a sequence file; each glass gets its dispersion.

    Parameters
    ----------
    path : str or Path
    first_column : {"radii", "curvatures"}, optional
        What the first number of a surface is if the file does not state it.

    Raises
    ------
    LensError
        When the file cannot be read or is not supported; `problems` gives each surface by its number, the object is 0.
    """
    reading = _Reading()
    with lens_data(path, "a .seq file") as data:
        for words in _commands(decoded(data)):
            _command(words, reading)
        raw = _sequence(Path(path), reading, first_column)
    return whole(path, raw, reading.problems)


def _commands(text: str) -> list[list[str]]:
    """Return the words of each command."""
    lines: list[str] = []
    continued = False
    for line in text.splitlines():
        # an exclamation mark inside quotes is text
        content = re.sub(r"('[^']*'|\"[^\"]*\")|!.*", lambda found: found[1] or "", line).rstrip()
        part = content.removesuffix("&")
        if continued:
            lines[-1] += " " + part.strip()
        else:
            lines.append(part.strip())
        continued = content.endswith("&")
    parts = [part for line in lines for part in re.findall(r"(?:'[^']*'|\"[^\"]*\"|[^;'\"]|['\"])+", line)]
    return [words for part in parts if (words := _WORDS.findall(part))]


def _command(words: list[str], reading: _Reading) -> None:
    key = words[0].upper()
    if reading.in_private:
        _private(key, words, reading)
    elif key == "PRV":
        reading.in_private = True
    elif key == "ZOO":
        zoom_row(words[1:], len(reading.surfaces), reading.zoom)
    elif zoom_cell(words, len(reading.surfaces), reading.zoom) or solved_gap(
        words, len(reading.surfaces), reading.zoom
    ):
        # what varies between zoom positions, and gaps whose result the lines S hold
        return
    elif key in ("SO", "S", "SI") or re.fullmatch(r"S\d+", key):
        reading.surfaces.append(_Surface(len(reading.surfaces), words[1:]))
    elif key == "RDM":
        reading.radii = not (len(words) > 1 and words[1].upper().startswith("N"))
    elif key in ("TIT", "TITLE", "DIM", "EPD", "FNO", "NA", "NAO", "WL", "REF", *FIELDS, *VIGNETTING):
        reading.head.setdefault("TITLE" if key == "TIT" else key, words[1:])
    elif key == "STO" or (reading.surfaces and key not in IDLE):
        _of_surface(key, words[1:], reading)
    elif key not in IDLE:
        reading.unknown.setdefault(key, [])


def _private(key: str, words: list[str], reading: _Reading) -> None:
    """Read one line of a table of indices: the wavelengths, or a glass with its indices."""
    if key == "END":
        reading.in_private = False
        return
    values = [number_of(word) for word in words[1:]]
    numbers = [value for value in values if value is not None]
    if key == "PWL":
        reading.private_nm = numbers
    elif len(numbers) == len(values) == len(reading.private_nm) > 1:
        reading.private[key.strip("'\"")] = numbers


def _of_surface(key: str, words: list[str], reading: _Reading) -> None:
    """Apply a command to the last surface, or to the one that it names."""
    surface = reading.surfaces[-1] if reading.surfaces else None
    if words and (named := re.fullmatch(r"[Ss](\d+)", words[0])):
        number, words = int(named[1]), words[1:]
        surface = reading.surfaces[number] if number < len(reading.surfaces) else None
    if surface is None:
        reading.problems.append(f"{shorten(' '.join([key, *words]))} names a surface that does not exist")
        return
    where = f"surface {surface.number}"
    if key == "STO":
        surface.stop = True
    elif key in ("CON", "ASP"):
        pass
    elif key == "K" or key in _TERMS:
        value = number_of(words[0]) if words else None
        if value is None:
            reading.problems.append(f"{where}: {key} is {shorten(' '.join(words))}, a number was expected")
        elif key == "K":
            surface.conic = value
        else:
            surface.terms[_TERMS[key]] = value
    elif key == "CIR":
        _rim(surface, words, reading)
    elif key in IN_ITS_LINE:
        reading.problems.append(f"{where}: {key} changes it; give radius, thickness and glass in its line S instead")
    elif key in UNSUPPORTED:
        if key not in SHIFTS or any(number_of(word) for word in words):
            reading.problems.append(f"{where}: {key} tilts, shifts or shapes it in a way that is not supported")
    else:
        reading.unknown.setdefault(key, []).append(str(surface.number))


def _rim(surface: _Surface, words: list[str], reading: _Reading) -> None:
    """Read the clear aperture; EDG is the mechanical edge, OBS and HOL stop the middle."""
    kinds = {word.upper() for word in words}
    if kinds & {"OBS", "HOL"}:
        reading.remarks.append(f"surface {surface.number}: annular apertures are treated as open in the middle")
        return
    value = number_of(words[-1]) if words else None
    if value is None or value < 0.0:
        reading.problems.append(f"surface {surface.number}: CIR is {shorten(' '.join(words))}, a length was expected")
    elif value > 0.0 and (surface.rim is None or "EDG" not in kinds):
        surface.rim = value


def _sequence(path: Path, reading: _Reading, first_column: FirstColumn | None) -> RawSequence | None:
    surfaces, problems = reading.surfaces, reading.problems
    if len(surfaces) < 4 and not any(map(_is_mirror, surfaces)):
        problems.append("the surfaces of object, lens and image (SO, S, SI) are missing: is it a CODE V .seq file?")
    elif len(surfaces) > MOST_SURFACES:
        problems.append(f"it has {len(surfaces)} surfaces, a lens has at most {MOST_SURFACES}")
    radii = first_column == "radii" if reading.radii is None else reading.radii
    if reading.radii is None and first_column is None:
        problems.append(
            "the file has no RDM, so the first number of a surface can be its radius or its curvature: add the line "
            "RDM Y or RDM N, or convert it with flarewright lens convert --first-column radii or curvatures"
        )
    unit = (reading.head.get("DIM") or ["M"])[0].upper()
    if unit not in _MM:
        problems.append(f"DIM {unit[:20]} is unknown; known are M (mm), C (cm) and I (inches)")
    if problems:
        return None
    mm = _MM[unit]
    if mm != 1.0:
        reading.remarks.append(f"lengths are in {'cm' if mm == 10.0 else 'inches'}; converted to mm")
    if not any(surface.stop for surface in surfaces):
        # CODE V's default
        surfaces[1].stop = True
        reading.remarks.append("the file has no STO; the stop is surface 1, as in CODE V")
    rows = [_row(surface, mm, radii, reading) for surface in surfaces[1:-1]]
    distance = _object_distance(surfaces[0], mm, reading)
    _remark(reading)
    if problems:
        return None
    kept = tuple(row for row in rows if row is not None)
    stop = next((row for row in kept if row.stop), None)
    stated = None if stop is None else stop.surface.semi_diameter
    opening, field_of_view = _opening(reading, mm), _field(reading, mm)
    one = Configuration(number=1, stop_semi_diameter=stated, focus_distance=distance, **opening, **field_of_view)
    several = _positions(one, None if stop is None else stop.number, mm, reading)
    title = (reading.head.get("TITLE") or [""])[0].strip("'\"").strip()
    return RawSequence(
        file=shown(path.name), name=" ".join(title.split()) or shown(path.stem), rows=kept,
        stop_semi_diameter=stated, focus_distance=distance, **opening, **field_of_view,
        configurations=several, remarks=(*reading.remarks, *media.remarks(reading.findings, "surface")),
    )  # fmt: skip


def _positions(one: Configuration, stop: int | None, mm: float, reading: _Reading) -> tuple[Configuration, ...]:
    axes = _field_axes(reading)
    x, y = ([number_of(word) or 0.0 for word in reading.head.get(axis, [])] for axis in axes)
    longest = max(len(x), len(y))
    points = ([*x, *[0.0] * (longest - len(x))], [*y, *[0.0] * (longest - len(y))])
    return positions(reading.zoom, Stated(one, stop, mm, points), axes, reading.remarks)


def _row(surface: _Surface, mm: float, radii: bool, reading: _Reading) -> SequenceRow | None:
    where, problems = f"surface {surface.number}", reading.problems
    before = len(problems)
    first, thickness = [*(number_of(word) for word in surface.words[:2]), None, None][:2]
    if first is None or thickness is None:
        problems.append(f"{where}: {shorten(' '.join(surface.words[:2]))} is no {_kind(radii)} and thickness")
        return None
    if abs(thickness * mm) >= INFINITE:
        problems.append(f"{where}: the gap to the next surface is infinite, so they form no lens: give its length")
    medium = None
    rest = surface.words[2:]
    if _is_mirror(surface):
        problems.append(f"{where} is a mirror: reflecting surfaces are not supported")
    elif rest:
        medium = _medium(rest[0], surface.number, reading)
    curvature = first / mm if not radii else 1.0 / (first * mm) if first else 0.0
    CURVATURE.read(curvature, f"{where}: the curvature", problems)
    most = max((k for k, value in surface.terms.items() if value), default=-1)
    return sequence_row(
        where, problems, before, number=surface.number, stop=surface.stop, curvature=curvature, conic=surface.conic,
        thickness=thickness * mm, medium=medium, semi_diameter=None if surface.rim is None else surface.rim * mm,
        asphere=tuple(surface.terms.get(k, 0.0) / mm ** (2 * k + 3) for k in range(most + 1)),
    )  # fmt: skip


def _is_mirror(surface: _Surface) -> bool:
    return any(word.upper() in ("REFL", "REFR:REFL", "TIR") for word in surface.words[2:])


def _kind(radii: bool) -> str:
    return "radius" if radii else "curvature"


def _medium(word: str, number: int, reading: _Reading) -> Medium | None:
    """Return the medium of a glass, of a PRV table by its indices at the d, F and C lines."""
    indices = reading.private.get(word.strip("'\"").upper())
    if indices is None:
        return named_medium(word, f"surface {number}", reading.problems, reading.findings, number)
    return tabulated_medium(
        reading.private_nm, indices, f"surface {number}", reading.problems, reading.findings, number
    )  # fmt: skip


def _object_distance(surface: _Surface, mm: float, reading: _Reading) -> float | None:
    value = number_of(surface.words[1]) if len(surface.words) > 1 else None
    if len(surface.words) > 2 and surface.words[2].upper() not in ("AIR", "REFR"):
        reading.problems.append(
            "surface 0: the lens stands in a medium: Flarewright traces light that comes through air"
        )
    return None if value is None or not 0.0 < value * mm < INFINITE else value * mm


def _opening(reading: _Reading, mm: float) -> dict[str, float | None]:
    for key, name, unit in (("FNO", "f_number", 1.0), ("EPD", "entrance_pupil_diameter", mm)):
        words = reading.head.get(key)
        value = number_of(words[0]) if words else None
        if value is not None and value > 0.0:
            return {name: value * unit}
    return {}


def _field_axes(reading: _Reading) -> tuple[str, str]:
    """Return the commands of the field points along x and y: of angles or of image heights."""
    columns = {key: [number_of(word) for word in reading.head.get(key, [])] for key in FIELDS}
    for axes in (("XAN", "YAN"), ("XIM", "YIM"), ("XRI", "YRI")):
        largest = largest_field(*(columns[axis] for axis in axes))
        if largest > 0.0 and (axes[0] != "XAN" or largest < 90.0):
            return axes
    return "XAN", "YAN"


def _field(reading: _Reading, mm: float) -> dict[str, float | None]:
    """Return the largest field as an angle or an image height."""
    axes = _field_axes(reading)
    x, y = ([number_of(word) for word in reading.head.get(axis, [])] for axis in axes)
    largest = largest_field(x, y)
    if axes[0] == "XAN":
        return {"field_deg": largest} if 0.0 < largest < 90.0 else {}
    return {"image_height": largest * mm}


def _remark(reading: _Reading) -> None:
    """Append remarks on what the file states and the lens does not hold."""
    if any(number_of(word) for key in VIGNETTING for word in reading.head.get(key, [])):
        reading.remarks.append("vignetting factors (VUX to VLY) are left out; the rims vignette")
    for key in ("NA", "NAO"):
        if key in reading.head:
            reading.remarks.append(f"the numerical aperture ({key}) is left out")
    places = [n for key in _NOT_ROUND for n in reading.unknown.pop(key, [])]
    if places:
        reading.remarks.append(f"surface {', '.join(places)}: apertures that are not round are left out")
    for key, at in reading.unknown.items():
        where = f"surface{'s'[: len(at) > 1]} {', '.join(at)}: " if at else ""
        reading.remarks.append(f"{where}command {shorten(key)} is left out")
