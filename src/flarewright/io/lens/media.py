"""Assign a dispersion to each medium of a prescription, and report its origin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ...errors import GlassError
from ...model import Lens, Medium, Surface
from . import glass_catalogue
from .glass_catalogue import CatalogueGlass

_OWN_INDEX_TOLERANCE = 0.003
_OWN_ABBE_TOLERANCE = 0.03


@dataclass(frozen=True)
class Finding:
    """Origin of a medium's dispersion.

    Attributes
    ----------
    kind : {"named", "nearest", "reported"}
        named: the catalogue glass itself; nearest: a substitute, `text` is its name; reported: `text` is a remark.
    text : str
    """

    kind: Literal["named", "nearest", "reported"]
    text: str = ""


def attach(glass: str | None, n_d: float | None, v_d: float | None) -> tuple[Medium, Finding]:
    """Return a medium with dispersion for what a prescription states.

    Parameters
    ----------
    glass : str or None
        Catalogue name.
    n_d, v_d : float or None
        Index at 587.56 nm and Abbe number; stated values take precedence over the catalogue.

    Returns
    -------
    medium : Medium
    finding : Finding

    Raises
    ------
    GlassError
        When the name is unknown and n_d is missing, or both are missing.
    """
    if glass is None:
        if n_d is None:
            raise GlassError("v_d alone is no glass: add n_d or the glass's name")
        return _by_numbers(None, n_d, v_d)
    try:
        known = glass_catalogue.by_name(glass, n_d, suggest=n_d is None)
    except GlassError as error:
        if n_d is None:
            raise
        medium, finding = _by_numbers(glass, n_d, v_d)
        unknown = str(error).partition(": give")[0]
        return medium, Finding("reported", f"{unknown}; {_source(finding)}")

    return attach_known(glass, known, n_d, v_d)


def contradicts(known: CatalogueGlass, n_d: float, v_d: float | None, tolerance: float) -> bool:
    """Return whether stated numbers are those of another glass; `tolerance` is that of n_d."""
    abbe_off = v_d is not None and abs(v_d / known.v_d - 1.0) > _OWN_ABBE_TOLERANCE
    return abs(n_d - known.n_d) > tolerance or abbe_off


def attach_known(
    glass: str, known: CatalogueGlass, n_d: float | None, v_d: float | None, tolerance: float = _OWN_INDEX_TOLERANCE
) -> tuple[Medium, Finding]:
    """Return the medium of a catalogue glass, or that of stated numbers that contradict it.

    Parameters
    ----------
    glass : str
        The name as stated.
    known : CatalogueGlass
    n_d, v_d : float or None
        As stated.
    tolerance : float
        Largest difference of n_d at which the name is right.

    Returns
    -------
    medium : Medium
    finding : Finding
    """
    # stated numbers that contradict the catalogue: the name belongs to another glass, so the numbers take precedence
    if n_d is not None and contradicts(known, n_d, v_d, tolerance):
        stated = f"n_d = {n_d:g}" + (f", V_d = {v_d:g}" if v_d is not None else "")
        listed = f"{known.full_name} has {known.n_d:.5f}, {known.v_d:.2f}"
        off = f"{glass} is stated with {stated}, but {listed}; the stated numbers take precedence"
        if v_d is None:
            medium = Medium(glass=glass, n_d=n_d, v_d=None, dispersion=known.dispersion)
            return medium, Finding("reported", off)
        medium, finding = _by_numbers(glass, n_d, v_d)
        return medium, Finding("reported", f"{off}; {_source(finding)}")
    medium = Medium(
        glass=glass,
        n_d=known.n_d if n_d is None else n_d,
        v_d=known.v_d if v_d is None else v_d,
        dispersion=known.dispersion,
    )
    if glass_catalogue.same_name(glass, known.name):
        return medium, Finding("named")
    return medium, Finding("reported", f"{glass} is replaced by its successor {known.full_name}")


def complete_medium(lens: Lens) -> tuple[Lens, tuple[str, ...]]:
    """Assign a dispersion to every medium of a lens that has none.

    Returns
    -------
    lens : Lens
        The same lens when no dispersion was missing.
    remarks : tuple of str

    Raises
    ------
    GlassError
        When a glass is unknown and has no index.
    """
    rows = list(lens.rows)
    findings: list[tuple[int, Finding]] = []
    for k, row in enumerate(rows):
        if isinstance(row, Surface) and row.medium is not None and row.medium.dispersion is None:
            medium, finding = attach(row.medium.glass, row.medium.n_d, row.medium.v_d)
            rows[k] = row.replace(medium=medium)
            findings.append((k, finding))
    if not findings:
        return lens, ()
    return lens.replace(rows=tuple(rows)), remarks(findings)


def remarks(findings: list[tuple[int, Finding]], place: str = "row") -> tuple[str, ...]:
    """Summarize the findings of all rows in a few sentences.

    Parameters
    ----------
    findings : list of (int, Finding)
        Row or line, and its finding.
    place : str
        Meaning of the numbers: "row", or "line" of a file.

    Returns
    -------
    tuple of str
        One sentence on all substitutes, and one per other finding.
    """
    same: dict[str, list[str]] = {}
    for number, finding in findings:
        if finding.kind == "reported":
            same.setdefault(finding.text, []).append(str(number))
    sentences = tuple(f"{place}{'s' * (len(at) > 1)} {', '.join(at)}: {text}" for text, at in same.items())
    nearest = [f"{place} {number} {finding.text}" for number, finding in findings if finding.kind == "nearest"]
    if not nearest:
        return sentences
    return (*sentences, f"dispersion of the nearest catalogue glass: {', '.join(nearest)}")


def _by_numbers(glass: str | None, n_d: float, v_d: float | None) -> tuple[Medium, Finding]:
    near, distance = glass_catalogue.nearest(n_d, v_d)
    if v_d is None:
        medium = Medium(glass=glass, n_d=n_d, v_d=None, dispersion=near.dispersion)
        guess = f"no V_d is given for n_d = {n_d:g}; using the dispersion of {near.full_name}"
        return medium, Finding("reported", guess)
    if distance <= 1.0:
        return Medium(glass=glass, n_d=n_d, v_d=v_d, dispersion=near.dispersion), Finding("nearest", near.full_name)
    cauchy = glass_catalogue.cauchy_from_abbe(n_d, v_d)
    return Medium(glass=glass, n_d=n_d, v_d=v_d, dispersion=cauchy), Finding(
        "reported", f"no catalogue glass is near n_d = {n_d:g}, V_d = {v_d:g}; using Cauchy's formula"
    )


def _source(finding: Finding) -> str:
    return f"using the dispersion of {finding.text} (nearest n_d, V_d)" if finding.kind == "nearest" else finding.text
