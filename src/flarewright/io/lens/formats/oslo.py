"""Reader of OSLO's lens files (`.len`).

A file holds commands, one a line or several between semicolons; `//` begins a comment. `LEN NEW "name" scale n` begins
the lens of the surfaces 0 (the object) to n (the image), `NXT` the next surface, `END` ends them. The reader uses UNI
(millimetres a unit), the aperture (EBR, FNO), the field (ANG, GIH), WV, and of each surface AIR, GLA, RD, CV, TH, AP,
AST, CC, the terms AD to AG of r^4 to r^10, ASP ASR with AS1 of r^2, AS2 of r^4 and so on, GTO, and pickups (PK) of
glass, curvature and thickness; `oslo_configurations` reads what follows CFG. Other commands that change a surface are
errors; remarks name the rest.

Source: the listing of a lens file in the program's user guide, files that it saved, and its names of commands.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ....model import Medium
from ....model.lens.prescription import MOST_TERMS
from ....model.lens.raw_lens import Configuration, RawSequence, SequenceRow
from ....sentences import shorten
from ...files.door import shown
from .. import media
from ..configuration_table import Stated
from ..foreign_file import INFINITE, MOST_SURFACES, decoded, lens_data, number_of, sequence_row, whole
from ..lens_fields import CURVATURE
from ..medium_names import named_medium, numbered_medium, tabulated_medium
from .oslo_configurations import Table, cell, configurations

_WORD = re.compile(r'"(?:\\.|[^"\\])*"|[^\s"]+')
_PART = re.compile(r'"(?:\\.|[^"\\])*"|//.*|;|[^;"/]+|/|"')
# the d, F and C lines in micrometres, which a file without WV has
_LINES_UM = (0.58756, 0.48613, 0.65627)
_TERMS = {"AD": 2, "AE": 3, "AF": 4, "AG": 5}
_GENERAL_TERM = re.compile(r"AS(\d{1,3})")
_SPECTRUM = re.compile(r"W[VW]\d*|SNO\d+")
# their numbers, all 0, leave a surface as it is
_SHIFTS = frozenset({"DCX", "DCY", "DCZ", "TLA", "TLB", "TLC", "TOX", "TOY", "TOZ", "CVX", "RDX", "GSP"})
_UNSUPPORTED = frozenset({
    "PFL", "PFM", "GOR", "RFL", "RFH", "RCO", "BEN", "GC", "ZRX", "SPL", "GRA", "GRN", "DOE", "HOR", "HOE", "LAS",
    "FRN", "NSS",
})  # fmt: skip
_SOLVED = {"PY": "thickness", "PYC": "thickness", "EC": "thickness", "PU": "curvature", "PUC": "curvature"}
# drawing, notes, designer, thermal data, groups, deletions of what is not there, the switch of aperture checking
_IDLE = frozenset({
    "DES", "NOT", "DRW", "LDP", "CBK", "CALLBACK", "GPRT", "ELMDF1", "ELMDF2", "BDI", "BDD", "VX", "PF", "LMN", "LME",
    "LMO", "TCE", "TEM", "PRE", "APCK", "TELE", "DT", "ATD", "CXD", "APD", "GCD", "RCD", "BED", "PFD", "TDD", "CSD",
    "TSD", "WRSP", "AFO", "AIM", "IMS", "DLNR",
})  # fmt: skip
# what a file states once and a configuration again
_COMMON = ("stop_semi_diameter", "focus_distance", "f_number", "entrance_pupil_diameter", "field_deg", "image_height")
_PICKED = {"GLA": "glass", "CV": "curvature", "CVM": "curvature", "TH": "thickness", "THM": "thickness", "AP": "rim"}


@dataclass
class _Surface:
    """One surface as the file states it; `glass` is None for air."""

    number: int
    glass: tuple[str, ...] | None = None
    wavelengths_um: tuple[float, ...] = _LINES_UM
    curvature: float = 0.0
    thickness: float = 0.0
    rim: float | None = None
    conic: float = 0.0
    terms: dict[int, float] = field(default_factory=dict)
    general: dict[int, float] = field(default_factory=dict)
    kind: str = "ADO"
    stop: bool = False
    solved: set[str] = field(default_factory=set)


@dataclass
class _Reading:
    """State of the reader."""

    name: str = ""
    count: int | None = None
    head: dict[str, float] = field(default_factory=dict)
    surfaces: dict[int, _Surface] = field(default_factory=lambda: {0: _Surface(0)})
    at: int = 0
    wavelengths_um: tuple[float, ...] = _LINES_UM
    ended: bool = False
    in_table: bool = False
    table: Table = field(default_factory=Table)
    picked: dict[int, tuple[int, float]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    unknown: dict[str, list[str]] = field(default_factory=dict)
    findings: list[tuple[int, media.Finding]] = field(default_factory=list)

    @property
    def surface(self) -> _Surface:
        """The surface that commands change."""
        return self.surfaces[self.at]


def read_len(path: str | Path) -> RawSequence:
    """Read a lens file of OSLO; each glass gets its dispersion.

    Raises
    ------
    LensError
        When the file cannot be read or is not supported; `problems` gives each surface by its number, the object is 0.
    """
    reading = _Reading()
    with lens_data(path, "a .len file") as data:
        for words in _commands(decoded(data)):
            _command(words, reading)
        raw = _sequence(Path(path), reading)
    return whole(path, raw, reading.problems)


def _commands(text: str) -> Iterator[list[str]]:
    """Yield the words of each command."""
    for line in text.splitlines():
        command = ""
        for part in _PART.findall(line):
            if part == ";" or part.startswith("//"):
                if words := _WORD.findall(command):
                    yield words
                command = ""
            else:
                command += part
        if words := _WORD.findall(command):
            yield words


def _command(words: list[str], reading: _Reading) -> None:
    key, values = words[0].upper(), words[1:]
    if reading.ended:
        if key == "CFG" or (key == "END" and reading.in_table):
            reading.in_table = key == "CFG"
        elif reading.in_table:
            cell(words, max(reading.surfaces), reading.table)
    elif key == "LEN":
        reading.name = " ".join(values[1].strip('"').split()) if len(values) > 1 else ""
        counted = number_of(values[-1]) if values else None
        reading.count = int(counted) if counted is not None else None
    elif key == "NXT":
        _go_to(reading.at + 1, reading)
    elif key == "GTO":
        number = number_of(values[0]) if values else None
        _go_to(-1 if number is None else int(number), reading)
    elif key == "END":
        reading.ended = True
    elif key in ("UNI", "EBR", "FNO", "ANG", "GIH", "OBH", "NAO", "NAP", "PUK"):
        value = number_of(values[0]) if values else None
        if value is None:
            reading.problems.append(f"{key} is {shorten(' '.join(values))}, a number was expected")
        else:
            reading.head[key] = value
    elif key == "WV":
        found = tuple(value for word in values if (value := number_of(word)) is not None and value > 0.0)
        reading.wavelengths_um = found or _LINES_UM
    elif not _SPECTRUM.fullmatch(key) and key not in _IDLE:
        _of_surface(key, values, reading)


def _go_to(number: int, reading: _Reading) -> None:
    if not 0 <= number <= MOST_SURFACES:
        reading.problems.append(f"it goes to surface {number}, a lens has at most {MOST_SURFACES}")
        return
    reading.at = number
    reading.surfaces.setdefault(number, _Surface(number))


def _of_surface(key: str, values: list[str], reading: _Reading) -> None:
    """Apply a command to a surface."""
    surface = reading.surface
    where = f"surface {surface.number}"
    if key in ("AIR", "AIF"):
        surface.glass = None
    elif key in ("GLA", "GLF") and values:
        surface.glass, surface.wavelengths_um = tuple(values), reading.wavelengths_um
    elif key == "AST":
        for other in reading.surfaces.values():
            other.stop = other is surface
    elif key == "ASP":
        kind = values[0].upper() if values else ""
        surface.kind = {"0": "ADO", "1": "ASR", "2": "ASX"}.get(kind, kind)
    elif key == "PK":
        _pick_up(values, reading)
    elif key in _SOLVED:
        surface.solved.add(_SOLVED[key])
    elif key in _UNSUPPORTED:
        what = "is a mirror" if key in ("RFL", "RFH") else f"has {key}"
        reading.problems.append(f"{where} {what}, which is not supported")
    elif key in _SHIFTS:
        if any(number_of(word) for word in values):
            reading.problems.append(f"{where}: {key} tilts, shifts or shapes it in a way that is not supported")
    elif key in ("RD", "RDF", "CV", "CVF", "TH", "THF", "AP", "APF", "CC", *_TERMS) or _GENERAL_TERM.fullmatch(key):
        _number(key, values, reading)
    else:
        reading.unknown.setdefault(key, []).append(str(surface.number))


def _number(key: str, values: list[str], reading: _Reading) -> None:
    """Set one number of a surface."""
    surface = reading.surface
    words = values[1:] if key in ("AP", "APF") and values and values[0].upper() in ("CHK", "UNC") else values
    value = number_of(words[0]) if words else None
    if value is None:
        reading.problems.append(
            f"surface {surface.number}: {key} is {shorten(' '.join(values))}, a number was expected"
        )
    elif key in ("RD", "RDF"):
        surface.curvature = 1.0 / value if value else 0.0
        surface.solved.discard("curvature")
    elif key in ("CV", "CVF"):
        surface.curvature = value
        surface.solved.discard("curvature")
    elif key in ("TH", "THF"):
        surface.thickness = value
        reading.picked.pop(surface.number, None)
        surface.solved.discard("thickness")
    elif key in ("AP", "APF"):
        surface.rim = value
    elif key == "CC":
        surface.conic = value
    elif key in _TERMS:
        surface.terms[_TERMS[key]] = value
    elif found := _GENERAL_TERM.fullmatch(key):
        surface.general[int(found[1])] = value


def _pick_up(values: list[str], reading: _Reading) -> None:
    """Copy a value of an earlier surface: the number is its place, or with a minus sign how far before this one."""
    surface, kind = reading.surface, values[0].upper() if values else ""
    number = number_of(values[1]) if len(values) > 1 else None
    source = None
    if number is not None:
        source = reading.surfaces.get(int(number) if number >= 0 else surface.number + int(number))
    if kind not in _PICKED or source is None or source is surface or any(number_of(word) for word in values[2:]):
        reading.problems.append(
            f"surface {surface.number}: the pickup {shorten(' '.join(values))} is not supported: write the value"
        )
        return
    sign = -1.0 if kind.endswith("M") else 1.0
    what = _PICKED[kind]
    if what == "glass":
        surface.glass, surface.wavelengths_um = source.glass, source.wavelengths_um
    elif what == "curvature":
        surface.curvature = sign * source.curvature
    elif what == "thickness":
        surface.thickness = sign * source.thickness
        # a chain of pickups has the first one's gap
        first, turn = reading.picked.get(source.number, (source.number, 1.0))
        reading.picked[surface.number] = (first, sign * turn)
    else:
        surface.rim = source.rim


def _sequence(path: Path, reading: _Reading) -> RawSequence | None:
    problems, last = reading.problems, max(reading.surfaces)
    if reading.count is None or last < 3:
        problems.append("LEN NEW with the surfaces of object, lens and image is missing: is it an OSLO .len file?")
        return None
    if not reading.ended or reading.count != last:
        problems.append(
            f"it has surfaces up to {last}, and LEN states {reading.count}: the file is cut short or damaged"
        )
    mm = reading.head.get("UNI", 1.0)
    if not 1e-6 < mm < 1e6:
        problems.append(f"UNI is {mm:g}: the number of millimetres of a unit was expected, 1 or 25.4")
    if problems:
        return None
    if mm != 1.0:
        reading.remarks.append(f"lengths are in units of {mm:g} mm; converted to mm")
    surfaces = [reading.surfaces[k] for k in range(1, last)]
    if not any(surface.stop for surface in surfaces):
        # OSLO's default
        surfaces[0].stop = True
        reading.remarks.append("the file has no AST; the stop is surface 1, as in OSLO")
    if reading.surfaces[0].glass is not None:
        problems.append("surface 0: the lens stands in a medium: Flarewright traces light that comes through air")
    if "thickness" in surfaces[-1].solved:
        surfaces[-1].solved.discard("thickness")
        surfaces[-1].thickness = 0.0
        reading.remarks.append("the last gap is solved in the file; the sensor is placed at the paraxial focus")
    rows = [_row(surface, mm, reading) for surface in surfaces]
    _remark(reading)
    if problems:
        return None
    kept = tuple(row for row in rows if row is not None)
    distance = reading.surfaces[0].thickness * mm
    name = reading.name if reading.name.lower() != "no name" else ""
    stop = next((row for row in kept if row.stop), None)
    one = Configuration(
        number=1, stop_semi_diameter=None if stop is None else stop.surface.semi_diameter,
        focus_distance=distance if 0.0 < distance < INFINITE else None, **_opening(reading.head, mm),
        **_field(reading.head, mm),
    )  # fmt: skip
    height = (one.field_deg if one.image_height is None else one.image_height / mm) or 0.0
    stated = Stated(one, None if stop is None else stop.number, mm, ([0.0], [height]))
    several = configurations(reading.table, stated, reading.picked, reading.remarks)
    return RawSequence(
        file=shown(path.name), name=name or shown(path.stem), rows=kept, configurations=several,
        **{key: getattr(one, key) for key in _COMMON},
        remarks=(*reading.remarks, *media.remarks(reading.findings, "surface")),
    )  # fmt: skip


def _row(surface: _Surface, mm: float, reading: _Reading) -> SequenceRow | None:
    where, problems = f"surface {surface.number}", reading.problems
    before = len(problems)
    for what in sorted(surface.solved):
        problems.append(f"{where}: its {what} is solved, not stated: write its value into the file")
    if abs(surface.thickness * mm) >= INFINITE:
        problems.append(f"{where}: the gap to the next surface is infinite, so they form no lens: give its length")
    curvature, conic, terms = surface.curvature / mm, surface.conic, _even_terms(surface, mm, problems)
    if (square := terms.pop(1, 0.0)) and curvature == 0.0:
        # a r^2 is a paraboloid of curvature 2 a
        curvature, conic = 2.0 * square, -1.0
    elif square:
        problems.append(f"{where} has a term of r^2 beside its curvature, which is not supported")
    CURVATURE.read(curvature, f"{where}: the curvature", problems)
    medium = _medium(surface, reading)
    if surface.rim is not None and surface.rim < 0.0:
        problems.append(f"{where}: AP is {surface.rim:g}, a length was expected")
    most = max((n for n, value in terms.items() if value), default=1)
    return sequence_row(
        where, problems, before, number=surface.number, stop=surface.stop, curvature=curvature, conic=conic,
        thickness=surface.thickness * mm, medium=medium, semi_diameter=surface.rim * mm if surface.rim else None,
        asphere=tuple(terms.get(n, 0.0) for n in range(2, most + 1)),
    )  # fmt: skip


def _even_terms(surface: _Surface, mm: float, problems: list[str]) -> dict[int, float]:
    """Return the terms of r^(2 n) by n, in mm."""
    where = f"surface {surface.number}"
    terms = {n: value for n, value in surface.terms.items() if value}
    general = {n: value for n, value in surface.general.items() if value}
    if general and surface.kind != "ASR":
        problems.append(f"{where} is an asphere of the kind {surface.kind[:20]}, known are AD to AG, and ASR")
    elif general and terms:
        problems.append(f"{where} has both AD to AG and AS terms: keep one kind")
    elif general.pop(0, 0.0):
        problems.append(f"{where}: AS0 is a shift along the axis, which is not supported: change the gaps")
    terms |= general
    if any(n > MOST_TERMS + 1 for n in terms):
        problems.append(f"{where} has terms beyond r^{2 * MOST_TERMS + 2}, which are not supported")
    return {n: value / mm ** (2 * n - 1) for n, value in terms.items() if n <= MOST_TERMS + 1}


def _medium(surface: _Surface, reading: _Reading) -> Medium | None:
    """Return the medium of GLA: a name, `MOD NAME` with n_d and V_d or an index a wavelength, or indices alone."""
    words, where = surface.glass, f"surface {surface.number}"
    if words is None:
        return None
    numbers = list(words)
    if words[0].upper() in ("MOD", "FIX", "DIR") and len(words) > 1:
        numbers = list(words[2:])
    elif number_of(words[0]) is None:
        return named_medium(words[0], where, reading.problems, reading.findings, surface.number)
    values = [value for word in numbers if (value := number_of(word)) is not None]
    if not values or len(values) != len(numbers):
        reading.problems.append(f"{where}: the glass {shorten(' '.join(words))} has no indices: give a name or n_d")
        return None
    if len(values) == 2 and values[1] > 10.0:
        return numbered_medium(None, values[0], values[1], where, reading.problems, reading.findings, surface.number)
    if len(values) == 1 or len(values) != len(surface.wavelengths_um):
        if len(values) > 1:
            reading.remarks.append(
                f"{where}: the glass has {len(values)} indices for other wavelengths; the first is used"
            )
        return numbered_medium(None, values[0], None, where, reading.problems, reading.findings, surface.number)
    wavelengths_nm = [1000.0 * um for um in surface.wavelengths_um]
    return tabulated_medium(wavelengths_nm, values, where, reading.problems, reading.findings, surface.number)


def _opening(head: dict[str, float], mm: float) -> dict[str, float]:
    if (radius := head.get("EBR", 0.0)) > 0.0:
        return {"entrance_pupil_diameter": 2.0 * radius * mm}
    return {"f_number": head["FNO"]} if head.get("FNO", 0.0) > 0.0 else {}


def _field(head: dict[str, float], mm: float) -> dict[str, float]:
    """Return the field as an angle or an image height."""
    if 0.0 < (angle := abs(head.get("ANG", 0.0))) < 90.0:
        # OSLO writes a tiny angle for a field on the axis
        return {"field_deg": angle} if angle > 0.01 else {}
    height = abs(head.get("GIH", 0.0)) * mm
    return {"image_height": height} if height > 0.0 else {}


def _remark(reading: _Reading) -> None:
    """Append remarks on what the file states and the lens does not hold."""
    for key, what in (
        ("OBH", "the object's height"),
        ("NAO", "the numerical aperture"),
        ("NAP", "the numerical aperture"),
    ):
        if reading.head.get(key):
            reading.remarks.append(f"{what} ({key}) is left out")
    for key, at in reading.unknown.items():
        where = f"surface{'s'[: len(at) > 1]} {', '.join(at[:20])}"
        reading.remarks.append(f"{where}: command {shorten(key)} is left out")
