"""Give each medium of a prescription its dispersion, and say where it came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flarewright.errors import GlassError
from flarewright.model import Lens, Medium, Surface

from . import glass_catalogue

_OWN_INDEX_TOLERANCE = 0.003
_OWN_ABBE_TOLERANCE = 0.03


@dataclass(frozen=True)
class Finding:
    """How a medium got its dispersion.

    Attributes
    ----------
    kind : {"named", "nearest", "told"}
        named: the catalogue's own glass, nothing to say; nearest: `text` is the stand-in's name;
        told: `text` is a remark.
    text : str
    """

    kind: Literal["named", "nearest", "told"]
    text: str = ""


def attach(glass: str | None, n_d: float | None, v_d: float | None) -> tuple[Medium, Finding]:
    """Make a medium with dispersion from what a prescription states.

    Parameters
    ----------
    glass : str or None
        Catalogue name.
    n_d, v_d : float or None
        Index at 587.56 nm and Abbe number; what is stated wins over the catalogue.

    Returns
    -------
    medium : Medium
    finding : Finding

    Raises
    ------
    GlassError
        The name is unknown and no n_d is given, or neither name nor n_d is given.
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
        return medium, Finding("told", f"{unknown}; {_source(finding)}")

    # A name whose numbers are not those of the row belongs to another glass: the row's numbers win.
    index_off = n_d is not None and abs(n_d - known.n_d) > _OWN_INDEX_TOLERANCE
    abbe_off = v_d is not None and abs(v_d / known.v_d - 1.0) > _OWN_ABBE_TOLERANCE
    if n_d is not None and (index_off or abbe_off):
        stated = f"n_d = {n_d:g}" + (f", V_d = {v_d:g}" if v_d is not None else "")
        listed = f"{known.full_name} has {known.n_d:.5f}, {known.v_d:.2f}"
        off = f"{glass} is stated with {stated}, but {listed}; the stated numbers hold"
        if v_d is None:
            medium = Medium(glass=glass, n_d=n_d, v_d=None, dispersion=known.dispersion)
            return medium, Finding("told", off)
        medium, finding = _by_numbers(glass, n_d, v_d)
        return medium, Finding("told", f"{off}, {_source(finding)}")
    medium = Medium(
        glass=glass,
        n_d=known.n_d if n_d is None else n_d,
        v_d=known.v_d if v_d is None else v_d,
        dispersion=known.dispersion,
    )
    if glass_catalogue.same_name(glass, known.name):
        return medium, Finding("named")
    return medium, Finding("told", f"{glass} is taken as {known.full_name}, its successor")


def complete(lens: Lens) -> tuple[Lens, tuple[str, ...]]:
    """Attach dispersion to every medium of a lens that has none yet.

    Parameters
    ----------
    lens : Lens

    Returns
    -------
    lens : Lens
        The same lens when nothing was missing.
    remarks : tuple of str

    Raises
    ------
    GlassError
        A glass cannot be resolved.
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
    """Gather the findings of all rows into few sentences.

    Parameters
    ----------
    findings : list of (int, Finding)
        Where, and what was found there.
    place : str
        What the numbers count: "row", or "line" of a file.

    Returns
    -------
    tuple of str
        All stand-ins in one sentence, one more for each thing to tell.
    """
    same: dict[str, list[str]] = {}
    for number, finding in findings:
        if finding.kind == "told":
            same.setdefault(finding.text, []).append(str(number))
    told = tuple(f"{place}{'s' * (len(at) > 1)} {', '.join(at)}: {text}" for text, at in same.items())
    nearest = [f"{place} {number} {finding.text}" for number, finding in findings if finding.kind == "nearest"]
    if not nearest:
        return told
    return (*told, f"dispersion of the nearest catalogue glass: {', '.join(nearest)}")


def _by_numbers(glass: str | None, n_d: float, v_d: float | None) -> tuple[Medium, Finding]:
    near, distance = glass_catalogue.nearest(n_d, v_d)
    if v_d is None:
        medium = Medium(glass=glass, n_d=n_d, v_d=None, dispersion=near.dispersion)
        guess = f"no V_d is given for n_d = {n_d:g}: its dispersion is guessed as that of {near.full_name}"
        return medium, Finding("told", guess)
    if distance <= 1.0:
        return Medium(glass=glass, n_d=n_d, v_d=v_d, dispersion=near.dispersion), Finding("nearest", near.full_name)
    cauchy = glass_catalogue.cauchy_from_abbe(n_d, v_d)
    return Medium(glass=glass, n_d=n_d, v_d=v_d, dispersion=cauchy), Finding(
        "told", f"no catalogue glass is near n_d = {n_d:g}, V_d = {v_d:g}: dispersion by Cauchy's formula"
    )


def _source(finding: Finding) -> str:
    return f"dispersion of the nearest, {finding.text}" if finding.kind == "nearest" else finding.text
