"""Text forms of light spectra, after `--spectrum` and in `spectrum =`.

| text | meaning |
|---|---|
| `d65` | CIE daylight, white in Rec.709 |
| `equal-energy` | the same power at every wavelength |
| `black-body:3200` | Planck's law at 3200 K |
| `lines:589.0,589.6` | spectral lines of equal power, nm |
| `lines:589.0*0.5,589.6*1` | spectral lines with their relative powers |
| `rgb:1,0.5,0.1` | a smooth spectrum of that colour, linear Rec.709; only ratios count |
| `lamp.csv` | a table: wavelength in nm and relative power in each line |
"""

from __future__ import annotations

import difflib
from pathlib import Path

from ...errors import ProjectError, raised_as
from ...model.project.light import D65, BlackBody, EqualEnergy, Lines, Rgb, Spectrum, Tabulated
from ...sentences import INVALID
from ..files.text_file import read_text

_KNOWN = "d65, equal-energy, black-body:KELVIN, lines:NM,NM*POWER,..., rgb:R,G,B or a .csv file"


def parse_spectrum(text: str, *, folder: Path | None = None) -> Spectrum:
    """Return the spectrum of a text.

    Parameters
    ----------
    text : str
        One of the forms in this module's table.
    folder : path, optional
        Base folder of a relative CSV path; None: the working folder.

    Raises
    ------
    ProjectError
        When the text has none of the forms, a number is out of range, or the CSV file cannot be read.
    """
    word, _, rest = text.strip().partition(":")
    word = word.strip().lower()
    if word.endswith((".csv", ".txt", ".tsv")) or text.strip().lower().endswith((".csv", ".txt", ".tsv")):
        return _read_table((folder or Path()) / text.strip())
    if word == "d65" and not rest:
        return D65()
    if word == "equal-energy" and not rest:
        return EqualEnergy()
    try:
        if word == "black-body":
            return BlackBody(temperature_k=_number(rest.strip().removesuffix("K").removesuffix("k"), text))
        if word == "lines":
            return Lines(lines=tuple(_line(part, text) for part in rest.split(",")))
        if word == "rgb":
            return Rgb.model_validate({"rgb": [_number(part, text) for part in rest.split(",")]})
    except INVALID as error:
        reason = {
            "black-body": "a black body has between 500 and 100000 K",
            "lines": "spectral lines lie between 360 and 830 nm and have powers of 0 or more",
            "rgb": "a colour is three numbers of 0 or more, not all 0; write it like rgb:1,0.5,0.1",
        }[word]
        raise ProjectError(f"the spectrum {text!r} is out of range: {reason}") from error
    near = difflib.get_close_matches(word, ["d65", "equal-energy", "black-body", "lines", "rgb"], 1)
    hint = f"did you mean {near[0]!r}? Known forms are " if near else "use "
    raise ProjectError(f"the spectrum {text!r} is unknown; {hint}{_KNOWN}")


def spectrum_text(spectrum: Spectrum) -> str | None:
    """Return the text form of a spectrum, or None for a table, which has none."""
    match spectrum:
        case D65() | EqualEnergy():
            return spectrum.kind
        case BlackBody():
            return f"black-body:{spectrum.temperature_k:.12g}"
        case Lines():
            return "lines:" + ",".join(f"{nm:.12g}*{power:.12g}" for nm, power in spectrum.lines)
        case Rgb():
            return "rgb:" + ",".join(f"{value:.12g}" for value in spectrum.rgb)
    return None


def _read_table(path: Path) -> Tabulated:
    """Read two columns, wavelength in nm and relative power; empty lines, # and one header line are skipped."""
    with raised_as(ProjectError):
        lines = read_text(path, "a spectrum table").splitlines()
    pairs: list[tuple[float, float]] = []
    headline_seen = False
    for number, line in enumerate(lines, 1):
        cells = line.replace(",", " ").replace(";", " ").split()
        if not cells or cells[0].startswith("#"):
            continue
        try:
            if len(cells) != 2:
                raise ValueError
            pairs.append((float(cells[0]), float(cells[1])))
        except ValueError:
            if not pairs and not headline_seen:
                headline_seen = True
                continue
            raise ProjectError(
                f"{path} line {number}: {line.strip()!r} is no wavelength in nm and power: write two numbers a line"
            ) from None
    try:
        return Tabulated(wavelength_nm=tuple(nm for nm, _ in pairs), power=tuple(power for _, power in pairs))
    except INVALID as error:
        raise ProjectError(
            f"the spectrum file {path} needs at least two lines with rising wavelengths in nm and powers of 0 or more"
        ) from error


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ProjectError(
            f"the spectrum {whole!r} holds {text.strip()!r} where a number belongs; known forms are {_KNOWN}"
        ) from None


def _line(part: str, whole: str) -> tuple[float, float]:
    nm, star, power = part.partition("*")
    return _number(nm, whole), _number(power, whole) if star else 1.0
