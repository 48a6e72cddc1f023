"""Text forms of coatings, on the command line and in lens files.

| text | coating |
|---|---|
| `none` | bare glass |
| `quarter-wave:550` | one film, a quarter of 550 nm, index sqrt(n0 n2) but not below 1.38 |
| `quarter-wave:550:ideal` | the same with index sqrt(n0 n2) as it is |
| `quarter-wave:550:1.38` | the same with index 1.38 |
| `quarter-wave:550+10` | 10 nm too thick (`-10`: too thin); may follow an index too |
| `film:1.38:96.4` | one film of index 1.38, 96.4 nm thick |
| `stack:1.38:96.4,2.1:120` | several films, from the air to the glass |
| `modern-broadband` | a standard coating: `uncoated-1930s`, `single-1950s`, `early-multicoat`, `modern-broadband` |
| `modern-broadband*1.05` | the same with every film 5 % thicker: its spectrum moves to wavelengths 5 % longer |

What all surfaces of a lens carry (`--coating`, a project's `coating`, `flarewright.render(..., coating=...)`) may also
be `lens`, `preset:NAME` or a coating file.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from ...errors import ProjectError, raised_as
from ...model import (
    AsLens,
    Bare,
    Coating,
    CoatingChoice,
    Everywhere,
    Film,
    InTurn,
    PerRow,
    Preset,
    QuarterWave,
    Stack,
    Standard,
)
from ...model.lens.coating import STANDARD_NAMES
from ...model.project.project import CHOICES, everywhere
from ...sentences import INVALID, did_you_mean, shorten, validation_sentences
from ..files.text_file import read_toml
from ..files.type_slips import record_of

HELP = (
    "write none, quarter-wave:550, quarter-wave:550:ideal, film:1.38:96.4, stack:1.38:96.4,2.1:120 or one of "
    + ", ".join(STANDARD_NAMES)
)

UNCOATED = "-"
"""Entry for a row without a coating in a list of one coating per row, such as the stop."""

_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUARTER_WAVE = re.compile(
    rf"quarter-wave:(?P<center>{_NUMBER})"
    rf"(?P<early>[+-]{_NUMBER})?"
    rf"(?::(?P<index>ideal|real|{_NUMBER}))?"
    rf"(?P<late>[+-]{_NUMBER})?"
)
_COATING: TypeAdapter[Any] = TypeAdapter(Coating)


def parse_coating(text: str) -> Coating:
    """Return the coating of a text.

    Parameters
    ----------
    text : str
        See the table above; case and surrounding spaces do not matter.

    Returns
    -------
    Bare, QuarterWave, Film, Stack or Standard

    Raises
    ------
    ProjectError
        When the text has none of the forms, or a number is out of range.
    """
    return _parsed(text, HELP)


def _parsed(text: str, forms: str) -> Coating:
    """Return the coating of a text; `forms` are those that the message for other texts names."""
    plain = re.sub(r"\s+", "", text).lower()
    if plain in ("none", "bare"):
        return Bare()
    kind, _, rest = plain.partition(":")
    named, _, factor = plain.partition("*")
    try:
        for name in STANDARD_NAMES:
            if plain == name or (named == name and re.fullmatch(_NUMBER, factor)):
                return Standard(name=name, thickness=float(factor or 1.0))
        if kind == "quarter-wave" and (match := _QUARTER_WAVE.fullmatch(plain)):
            return _quarter_wave(match, text)
        if kind == "film":
            return _film(rest)
        if kind == "stack":
            return Stack(layers=tuple(_film(part) for part in rest.split(",")))
    except INVALID as error:
        raise ProjectError(f"coating {text!r}: {'; '.join(validation_sentences(error))}") from None
    except ValueError:
        pass
    raise ProjectError(f"coating {text!r} is not understood{did_you_mean(plain, STANDARD_NAMES)}: {forms}")


def parse_coating_choice(text: str, *, folder: Path | None = None) -> CoatingChoice:
    """Return the coating choice of a text.

    Parameters
    ----------
    text : str
        `lens`, `preset:NAME`, a coating file (`*.toml`), or a form of the table above, for every surface between glass
        and air.
    folder : path, optional
        Base folder of relative paths; None: the working folder.

    Raises
    ------
    FlarewrightError
        When the text has none of the forms.
    """
    word, _, rest = text.strip().partition(":")
    if text.strip() == "lens":
        return AsLens()
    if word == "preset":
        if not rest.strip():
            raise ProjectError(f"the coating {text!r} names no preset: write preset:NAME, a name from the lens file")
        return Preset(name=rest.strip())
    if text.strip().lower().endswith(".toml"):
        return read_coating_file((folder or Path()) / text.strip())
    return Everywhere(coating=_parsed(text, f"{HELP}; for the lens: lens, preset:NAME or a coating file *.toml"))


def coating_choice(coating: str | PathLike[str] | Coating | CoatingChoice | None) -> CoatingChoice:
    """Return the coating choice of a library caller's argument.

    Parameters
    ----------
    coating : str or path
        As in `parse_coating_choice`; relative paths start at the working folder.
    coating : Coating
        The same on every surface between glass and air.
    coating : CoatingChoice
        Returned unchanged.
    coating : None
        As in the lens file.

    Raises
    ------
    FlarewrightError
        When it is of another type, or a text with none of the forms.
    """
    if isinstance(coating, str | PathLike):
        return parse_coating_choice(fspath(coating))
    choice = AsLens() if coating is None else everywhere(coating)
    if isinstance(choice, CHOICES):
        return choice
    raise ProjectError(f"coating {shorten(coating)} is neither a text nor a coating: {HELP}")


def coating_from(value: object) -> Coating | None:
    """Return the coating of a parsed TOML value.

    Parameters
    ----------
    value : object
        A text (`UNCOATED` and the empty text give None) or a table with `kind` and the fields of the coating.

    Raises
    ------
    ProjectError
        When the value is of another type, or has invalid fields.
    """
    if isinstance(value, str):
        return None if value.strip() in ("", UNCOATED) else parse_coating(value)
    if isinstance(value, dict):
        read: Callable[[Any], Coating] = _COATING.validate_python
        coating, wrong = record_of(read, value)
        if coating is None:
            raise ProjectError(f"coating table: {'; '.join(wrong)}")
        return coating
    raise ProjectError(f"coating {shorten(value)} is neither a text nor a table: {HELP}")


def format_coating(coating: Coating) -> str:
    """Return the text form of a coating; `parse_coating` reverses it.

    Parameters
    ----------
    coating : Bare, QuarterWave, Film, Stack or Standard
    """
    if isinstance(coating, Bare):
        return "none"
    if isinstance(coating, Standard):
        return coating.name if coating.thickness == 1.0 else f"{coating.name}*{_number(coating.thickness)}"
    if isinstance(coating, Film):
        return f"film:{_number(coating.index)}:{_number(coating.thickness_nm)}"
    if isinstance(coating, Stack):
        return "stack:" + ",".join(f"{_number(film.index)}:{_number(film.thickness_nm)}" for film in coating.layers)
    index = coating.index if isinstance(coating.index, str) else _number(coating.index)
    suffix = "" if index == "real" else f":{index}"
    if coating.thickness_offset_nm:
        sign = "-" if coating.thickness_offset_nm < 0 else "+"
        suffix += sign + _number(abs(coating.thickness_offset_nm))
    return f"quarter-wave:{_number(coating.center_wavelength_nm)}{suffix}"


def read_coating_file(path: str | Path) -> CoatingChoice:
    """Read a coating file: TOML with `coating = "..."`, or `rows = [...]` with one per row, or `in_turn = [...]`.

    Returns
    -------
    Everywhere, PerRow or InTurn

    Raises
    ------
    ProjectError
        When the file cannot be read, has none or several of the keys, or has invalid entries; lists all of these.
    """
    with raised_as(ProjectError):
        table = read_toml(path, "a coating file")
    if set(table) == {"coating"}:
        return Everywhere(coating=coating_from(table["coating"]) or Bare())
    for key, place in (("rows", "row"), ("in_turn", "coating")):
        if set(table) == {key} and isinstance(table[key], list):
            found = _coatings(path, table[key], place)
            if key == "rows":
                return PerRow(coatings=tuple(found))
            if found:
                return InTurn(coatings=tuple(coating or Bare() for coating in found))
    more = set(table) - {"coating", "rows", "in_turn"}
    if len(table) > 1 and len(more) < len(table):
        key = shorten(min(more)) if more else "several of coating, rows and in_turn"
        raise ProjectError(f"{path} has {key} beside its coatings: a coating file has one key; remove the others")
    raise ProjectError(
        f'{path} is no coating file: it holds either one line coating = "quarter-wave:550" '
        f'or rows = ["quarter-wave:550", "{UNCOATED}", ...] with one entry for each row of the lens, '
        'or in_turn = ["quarter-wave:450", "quarter-wave:600"], repeated over its surfaces in air from the front'
    )


def _coatings(path: str | Path, entries: list[Any], place: str) -> list[Coating | None]:
    """Return the coatings of a list; raises ProjectError with all invalid entries."""
    coatings: list[Coating | None] = []
    problems: list[str] = []
    for k, entry in enumerate(entries):
        try:
            coatings.append(coating_from(entry))
        except ProjectError as error:
            problems.append(f"{place} {k}: {error}")
    if problems:
        raise ProjectError(f"{path}: " + "; ".join(problems))
    return coatings


def _quarter_wave(match: re.Match[str], text: str) -> QuarterWave:
    early, late, index = match["early"], match["late"], match["index"] or "real"
    if early and late:
        raise ProjectError(f"coating {text!r} has two thickness offsets: keep one")
    return QuarterWave(
        center_wavelength_nm=float(match["center"]),
        index=index if index in ("real", "ideal") else float(index),
        thickness_offset_nm=float(early or late or 0.0),
    )


def _film(text: str) -> Film:
    index, thickness_nm = (float(part) for part in text.split(":"))
    return Film(index=index, thickness_nm=thickness_nm)


def _number(value: float) -> str:
    return repr(float(value)).removesuffix(".0")
