"""The lines of a `.zmx` file, grouped by surface; `reader` reads the result."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ....sentences import count, shorten
from ..foreign_file import number_of
from ..glass_catalogue import MAKERS
from .keywords import TEXTS, USED_OF_SURFACE

# the surface types have up to 250 parameters
_MOST_PARAMETERS = 500
_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")


@dataclass
class Block:
    """The lines of one surface: words by keyword; PARM and XDAT by their number."""

    number: int
    words: dict[str, list[str]] = field(default_factory=dict)
    parameters: dict[int, float] = field(default_factory=dict)
    extra: dict[int, float] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """Type of the surface in capitals."""
        return (self.words.get("TYPE") or ["STANDARD"])[0].upper()


@dataclass(frozen=True)
class Operand:
    """One cell of the table of configurations: `THIC 5 2 1.5` is 1.5 behind surface 5 in configuration 2."""

    key: str
    place: int
    configuration: int
    value: str


@dataclass
class Text:
    """The lines of the file, grouped."""

    head: dict[str, list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    wavelengths_um: dict[int, float] = field(default_factory=dict)
    operands: list[Operand] = field(default_factory=list)
    commas: int = 0

    @property
    def makers(self) -> tuple[str, ...]:
        """Makers whose catalogues the file names, in its order; others (MISC, INFRARED) are left out."""
        words = self.head.get("GCAT", [])
        return tuple(dict.fromkeys(maker for word in words for maker in MAKERS if maker in word.upper()))


def grouped(text: str) -> Text:
    """Group the lines of a file; decimal commas and wrong numbers become remarks, broken PARM or XDAT problems."""
    found, misnumbered = Text(), ""
    for line in text.splitlines():
        words = line.split()
        if not words:
            continue
        key = words[0].upper()
        if key not in TEXTS:
            words = _with_points(words, found)
        if key == "SURF":
            number = len(found.blocks)
            if words[1:2] != [str(number)] and not misnumbered:
                given = f"numbered {shorten(' '.join(words[1:]))}" if words[1:] else "not numbered"
                misnumbered = f"surface {number} is {given} in the file"
            found.blocks.append(Block(number))
        elif not line[0].isspace():
            # the header, or lines after the last surface
            if key == "NOTE":
                found.notes.append(" ".join(words[2:]))
            if key == "WAVM" and len(words) > 2 and words[1].isdecimal():
                found.wavelengths_um[int(words[1])] = number_of(words[2]) or 0.0
            elif key in ("WAVL", "WAVN"):
                found.wavelengths_um |= {k: number_of(word) or 0.0 for k, word in enumerate(words[1:], 1)}
            # the rows of the table of configurations follow its size
            if "MNUM" in found.head and (operand := _operand(key, words)) is not None:
                found.operands.append(operand)
            found.head.setdefault(key, line.split(maxsplit=1)[1:] if key == "NAME" else words[1:])
        elif found.blocks:
            _of_surface(found.blocks[-1], key, words[1:], found)
    if misnumbered:
        found.remarks.append(f"{misnumbered}; surfaces are counted in their order, from 0")
    if found.commas:
        found.remarks.append(f"{count(found.commas, 'number')} with a decimal comma, read as a decimal point")
    return found


def _operand(key: str, words: list[str]) -> Operand | None:
    if len(words) < 4 or key == "TOL" or not (words[1].isdecimal() and words[2].isdecimal()):
        return None
    return Operand(key, int(words[1]), int(words[2]), words[3])


def _with_points(words: list[str], found: Text) -> list[str]:
    """Replace decimal commas, which a program writes on a computer of such a language."""
    changed = [word.replace(",", ".") if _COMMA.fullmatch(word) else word for word in words]
    found.commas += sum(a != b for a, b in zip(words, changed, strict=True))
    return changed


def _of_surface(block: Block, key: str, words: list[str], found: Text) -> None:
    where = f"surface {block.number}"
    if key not in ("PARM", "XDAT"):
        if key in block.words and key in USED_OF_SURFACE and block.words[key] != words:
            found.remarks.append(f"{where}: {key} is given twice; the first one is used")
        block.words.setdefault(key, words)
        return
    try:
        number, value = int(words[0]), number_of(words[1])
    except (ValueError, IndexError):
        number, value = 0, None
    if value is None or not 0 <= number <= _MOST_PARAMETERS:
        found.problems.append(f"{where}: {shorten(' '.join([key, *words]))} is not understood")
        return
    (block.parameters if key == "PARM" else block.extra)[number] = value
