"""Reader of Zemax' sequential lens files (`.zmx`).

A text of one keyword a line; those of a surface are indented behind its `SURF n`. What is read: NAME, NOTE, UNIT, the
opening (FNUM, ENPD, FLOA, OBNA), the fields (FTYP, XFLN, YFLN), and of each surface TYPE, CURV, CONI, PARM, XDAT, DISZ,
GLAS, DIAM, CLAP, FLAP, COAT and STOP. `optics.sequence` judges what this reader finds.

Source: the files themselves, as their makers and lens vendors publish them; the sag of each surface type is that of the
OpticStudio help ("Even Asphere", "Extended Asphere", "Biconic").
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from pydantic import ValidationError

from flarewright.errors import GlassError, LensError
from flarewright.model import Medium, Surface
from flarewright.model.lens import MOST_TERMS
from flarewright.model.raw_lens import RawSequence, SequenceRow

from . import media
from .sentences import shorten, summary, validation_sentences
from .text_file import read_bytes

_MM = {"MM": 1.0, "CM": 10.0, "IN": 25.4, "INCH": 25.4, "METER": 1000.0, "M": 1000.0}
_MOST_SURFACES = 500
# what stands in a GLAS line whose glass is known by its name alone
_NO_NUMBERS = ((0.0, 0.0), (1.5, 40.0))
_MOULDED = ("_MOLD", "_MOULD")
# the glasses of Zemax' MISC catalogue that lenses for photography use, and that no maker's catalogue has (n_d, V_d)
_MISC = {
    "PMMA": (1.491756, 57.44), "ACRYLIC": (1.491668, 55.31), "POLYCARB": (1.585470, 29.91),
    "POLYSTYR": (1.590481, 30.87), "F_SILICA": (1.458464, 67.82), "B270": (1.522900, 58.50),
}  # fmt: skip


@dataclass
class _Block:
    """The lines of one surface: keyword to its words; PARM and XDAT by their number."""

    number: int
    words: dict[str, list[str]] = field(default_factory=dict)
    parameters: dict[int, float] = field(default_factory=dict)
    extra: dict[int, float] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        return (self.words.get("TYPE") or ["STANDARD"])[0].upper()


@dataclass
class _Text:
    """The file, sorted by what its lines belong to."""

    head: dict[str, list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    blocks: list[_Block] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def read_zmx(path: str | Path) -> RawSequence:
    """Read a sequential Zemax file, each glass with its dispersion.

    Parameters
    ----------
    path : str or Path
        UTF-16 or UTF-8, with or without a byte order mark, or the Windows code page of old versions.

    Returns
    -------
    RawSequence

    Raises
    ------
    LensError
        The file cannot be read or holds what cannot be traced here; `problems` names each surface by the file's number.
    """
    try:
        text = decoded(read_bytes(path, "a .zmx file"))
    except ValueError as error:
        raise LensError(str(error), (str(error),)) from None
    found = _sorted(text)
    mode = found.head.get("MODE", ["SEQ"])[0].upper()
    if mode != "SEQ":
        found.problems.append(f"MODE {mode}: the file is not sequential, so it holds no prescription")
    elif len(found.blocks) < 4:
        found.problems.append("there are not the SURF blocks of object, lens and image in it: is it a .zmx file?")
    elif len(found.blocks) > _MOST_SURFACES:
        found.problems.append(f"it has {len(found.blocks)} surfaces, a lens has at most {_MOST_SURFACES}")
    if not found.problems:
        raw = _sequence(Path(path), found)
        if raw is not None and not found.problems:
            return raw
    raise LensError(summary(str(path), found.problems), tuple(found.problems))


def decoded(data: bytes) -> str:
    """Decode UTF-16 or UTF-8, whichever it is; what is neither, as the Windows code page that old versions wrote."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if b"\x00" in data[:64]:
        # no mark: Latin letters leave every other byte empty
        return data.decode("utf-16-le" if data[1:2] == b"\x00" else "utf-16-be", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _sorted(text: str) -> _Text:
    found = _Text()
    for line in text.splitlines():
        words = line.split()
        if not words:
            continue
        key = words[0].upper()
        if key == "SURF":
            found.blocks.append(_Block(len(found.blocks)))
        elif not line[0].isspace():
            # the head, or what follows the last surface
            if key == "NOTE":
                found.notes.append(" ".join(words[2:]))
            found.head.setdefault(key, line.split(maxsplit=1)[1:] if key == "NAME" else words[1:])
        elif found.blocks:
            _of_surface(found.blocks[-1], key, words[1:], found.problems)
    return found


def _of_surface(block: _Block, key: str, words: list[str], problems: list[str]) -> None:
    if key not in ("PARM", "XDAT"):
        block.words.setdefault(key, words)
        return
    try:
        (block.parameters if key == "PARM" else block.extra)[int(words[0])] = float(words[1])
    except (ValueError, IndexError):
        problems.append(f"surface {block.number}: {shorten(' '.join([key, *words]))} is not understood")


def _sequence(path: Path, found: _Text) -> RawSequence | None:
    unit = (found.head.get("UNIT") or ["MM"])[0].upper()
    if unit not in _MM:
        found.problems.append(f"UNIT {unit} is unknown; known are {', '.join(_MM)}")
        return None
    mm = _MM[unit]
    if mm != 1.0:
        found.remarks.append(f"lengths are in {unit}; converted to mm")
    findings: list[tuple[int, media.Finding]] = []
    for before, block in pairwise(found.blocks):
        # what has no glass of its own lies in that of the surface before
        if block.kind == "COORDBRK" and "GLAS" in before.words:
            block.words["GLAS"] = before.words["GLAS"]
    rows = [_row(block, mm, found, findings) for block in found.blocks[1:-1]]
    if found.problems:
        return None
    _tell(found)
    aperture = _opening(found, mm)
    field_deg, image_height = _field(found, mm)
    distance = _length(found.blocks[0], "DISZ", found.problems, infinite=math.inf) * mm
    stops = [row for row in rows if row is not None and row.stop]
    stated = stops[0].surface.semi_diameter if stops else None
    return RawSequence(
        file=path.name, name=" ".join(" ".join(found.head.get("NAME", [])).split()) or path.stem,
        notes=" ".join(note for note in found.notes if note), rows=tuple(row for row in rows if row is not None),
        stop_semi_diameter=stated, field_deg=field_deg, image_height=image_height, **aperture,
        focus_distance=None if not 0.0 < distance < 1e9 else distance,
        remarks=(*found.remarks, *media.remarks(findings, "surface")),
    )  # fmt: skip


def _row(
    block: _Block, mm: float, found: _Text, findings: list[tuple[int, media.Finding]]
) -> SequenceRow | None:  # fmt: skip
    """Make a surface of a block; what is wrong with it goes to the problems."""
    problems, where = found.problems, f"surface {block.number}"
    before = len(problems)
    glass = block.words.get("GLAS", [])
    if glass and glass[0].upper() == "MIRROR":
        problems.append(f"{where} is a mirror: reflecting surfaces are not supported")
        return None
    thickness = _length(block, "DISZ", problems, infinite=0.0) * mm
    values = _shape(block, mm, problems) | {"thickness": thickness, "semi_diameter": _rim(block, mm, problems)}
    if glass:
        values["medium"] = _medium(block.number, glass, problems, findings)
        if thickness < 0.0:
            problems.append(f"{where}: glass cannot be {thickness:g} mm thick")
    if len(problems) > before:
        return None
    try:
        return SequenceRow(
            number=block.number, surface=Surface(**values), stop="STOP" in block.words, automatic_rim=_automatic(block)
        )  # fmt: skip
    except ValidationError as error:
        problems += [f"{where}: {sentence}" for sentence in validation_sentences(error)]
        return None


def _shape(block: _Block, mm: float, problems: list[str]) -> dict[str, object]:
    where = f"surface {block.number}"
    curvature = _number(block, "CURV", problems) / mm
    conic = _number(block, "CONI", problems)
    if block.kind == "STANDARD":
        return {"curvature": curvature, "conic": conic}
    if block.kind == "COORDBRK":
        # the sixth only says which of turn and shift comes first
        if any(value for n, value in block.parameters.items() if n != 6):
            problems.append(
                f"{where} tilts or shifts what follows (COORDBRK), which is not read: set its numbers to 0, convert "
                "the file, and write them as [[elements]] of the new one"
            )
        return {}
    if block.kind == "BICONICX":
        radius, conic_x = block.parameters.get(1, 0.0) * mm, block.parameters.get(2, 0.0)
        return {
            "curvature": curvature, "conic": conic, "curvature_x": 1.0 / radius if radius else 0.0, "conic_x": conic_x
        }  # fmt: skip
    if block.kind == "EVENASPH":
        terms = {n: block.parameters.get(n, 0.0) for n in block.parameters if n > 0}
    elif block.kind == "XASPHERE":
        unit = block.extra.get(2, 1.0) or 1.0
        terms = {n: block.extra.get(n + 2, 0.0) / unit ** (2 * n) for n in range(1, int(block.extra.get(1, 0.0)) + 1)}
    else:
        problems.append(
            f"{where} is of type {block.kind}; read are STANDARD, EVENASPH, XASPHERE, BICONICX and an idle COORDBRK"
        )
        return {}
    return _asphere(where, curvature, conic, {n: value / mm ** (2 * n - 1) for n, value in terms.items()}, problems)


def _asphere(
    where: str, curvature: float, conic: float, terms: dict[int, float], problems: list[str]
) -> dict[str, object]:  # fmt: skip
    """Take the terms of r^2, r^4, ...; the first of them is a curvature of its own."""
    square = terms.pop(1, 0.0)
    if square and curvature == 0.0:
        # a r^2 is a paraboloid of curvature 2 a
        curvature, conic = 2.0 * square, -1.0
    elif square:
        problems.append(f"{where} has a term of r^2 beside its curvature, which is not supported")
    if any(value for n, value in terms.items() if n > MOST_TERMS + 1):
        problems.append(f"{where} has terms beyond r^{2 * MOST_TERMS + 2}, which are not supported")
    last = max((n for n, value in terms.items() if value), default=1)
    asphere = tuple(terms.get(n, 0.0) for n in range(2, last + 1))
    return {"curvature": curvature, "conic": conic, "asphere": asphere}


def _medium(
    number: int, words: list[str], problems: list[str], findings: list[tuple[int, media.Finding]]
) -> Medium | None:  # fmt: skip
    """Find a glass by its name; by its numbers where it has none, or one that no catalogue knows."""
    name = words[0]
    numbers = [_float(word) for word in words[3:5]]
    n_d, v_d = [*numbers, None, None][:2]
    if n_d is None or (n_d, v_d) in _NO_NUMBERS or n_d <= 1.0:
        n_d = v_d = None
    v_d = v_d if v_d and v_d > 0.0 else None
    nameless = name.startswith("___")
    plain = name
    for ending in _MOULDED:
        plain = plain.removesuffix(ending)
    tries: list[Callable[[], tuple[Medium, media.Finding]]] = []
    if not nameless:
        tries.append(lambda: media.attach(plain, None, None))
        if name.upper() in _MISC:
            tries.append(lambda: media.attach(None, *_MISC[name.upper()]))
    if n_d is not None:
        tries.append(lambda: media.attach(None if nameless else name, n_d, v_d))
    for each in tries:
        try:
            medium, finding = each()
        except GlassError:
            continue
        findings.append((number, finding))
        return medium
    problems.append(
        f"surface {number}: the glass {'has no index' if nameless else f'{name} is in no catalogue and has no index'} "
        "in the file: write its n_d and V_d into the GLAS line"
    )
    return None


def _rim(block: _Block, mm: float, problems: list[str]) -> float | None:
    """Return the clear semi-diameter: a stated aperture first, then the column of the table."""
    for key, place in (("CLAP", 1), ("FLAP", 1), ("DIAM", 0)):
        words = block.words.get(key, [])
        if len(words) > place:
            value = _float(words[place])
            if value is None or value < 0.0:
                problems.append(f"surface {block.number}: {key} is {shorten(' '.join(words))}, a length was expected")
            elif value > 0.0:
                return value * mm
    return None


def _automatic(block: _Block) -> bool:
    return not {"CLAP", "FLAP"} & set(block.words) and (block.words.get("DIAM") or ["", "1"])[1:2] == ["0"]


def _tell(found: _Text) -> None:
    """Say what the file holds that is left out."""
    lens = found.blocks[1:-1]
    coats = sorted({words[0] for block in lens if (words := block.words.get("COAT"))})
    if coats:
        found.remarks.append(
            f"coatings are named ({', '.join(coats)}) and not described; all surfaces are bare until one is chosen"
        )
    shaped = [str(b.number) for b in lens if {"SQAP", "ELAP", "UDAA", "UDAP", "SPID", "OBSC"} & set(b.words)]
    if shaped:
        found.remarks.append(f"surfaces {', '.join(shaped)}: apertures that are not round are taken as round")
    configurations = _float((found.head.get("MNUM") or ["1"])[0]) or 1.0
    if configurations > 1.0:
        found.remarks.append(f"the file holds {configurations:g} configurations; the one that it stands in was read")
    if _number(found.blocks[-1], "CURV", found.problems) != 0.0:
        found.remarks.append("the image surface is curved; the sensor is flat")


def _opening(found: _Text, mm: float) -> dict[str, float | None]:
    """Return what sets the opening: f_number or entrance_pupil_diameter, or neither."""
    for key, name, unit in (("FNUM", "f_number", 1.0), ("ENPD", "entrance_pupil_diameter", mm)):
        words = found.head.get(key, [])
        value = _float(words[0]) if words else None
        if value is not None and value > 0.0:
            return {name: value * unit}
    return {}


def _field(found: _Text, mm: float) -> tuple[float | None, float | None]:
    """Return the largest field as an angle or a height in the picture; of a near object neither."""
    kind = int(_float((found.head.get("FTYP") or ["0"])[0]) or 0)
    columns = []
    for axis in "XY":
        words = found.head.get(f"{axis}FLN") or found.head.get(f"{axis}FLD") or []
        columns.append([_float(word) or 0.0 for word in words])
    largest = max((math.hypot(x, y) for x, y in zip(*columns, strict=False)), default=0.0)
    if largest <= 0.0:
        return None, None
    if kind == 0:
        return (largest, None) if largest < 90.0 else (None, None)
    return None, largest * mm if kind in (2, 3) else None


def _number(block: _Block, key: str, problems: list[str]) -> float:
    words = block.words.get(key)
    if not words:
        return 0.0
    value = _float(words[0])
    if value is None:
        problems.append(f"surface {block.number}: {key} is {shorten(words[0])}, a number was expected")
        return 0.0
    return value


def _length(block: _Block, key: str, problems: list[str], infinite: float) -> float:
    words = block.words.get(key)
    return infinite if words and words[0].upper() == "INFINITY" else _number(block, key, problems)


def _float(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


__all__ = ["decoded", "read_zmx"]
