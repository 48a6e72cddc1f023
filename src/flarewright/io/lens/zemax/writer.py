"""Write a lens as a sequential Zemax file (`.zmx`) that `reader.read_zmx` reads back.

Surfaces are of the types STANDARD, EVENASPH, ODDASPHE, XOSPHERE and BICONICX, positions become configurations (THIC,
APER, YFIE). A glass is named where the catalogue has the row's index, else it is written by its n_d and V_d. Source: as
for `reader`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ....errors import GlassError, LensError
from ....model import Lens, Medium, Stop, Surface
from .. import glass_catalogue
from ..glass_catalogue import F_D_C_UM

_SAME_INDEX = 1e-6
_SAME_ABBE = 0.01
# aspheric terms from r^4 on: Zemax's even asphere has eight, from r^2 to r^16
_MOST_TERMS = 7
# y^4 to y^14 of a torus
_MOST_TORUS_TERMS = 6
# its odd asphere those of r to r^8; the extended one has as many as it states
_MOST_ODD_POWER = 8


class LensState(NamedTuple):
    """A lens at one of its positions, as its file needs it.

    Attributes
    ----------
    lens : Lens
        Without positions; all semi-diameters known.
    sensor_distance : float
        Last vertex to sensor, mm.
    stop_semi_diameter : float
        mm.
    """

    lens: Lens
    sensor_distance: float
    stop_semi_diameter: float


def zmx_text(name: str, states: Sequence[LensState]) -> tuple[str, tuple[str, ...]]:
    """Return the text of a Zemax file.

    Parameters
    ----------
    name : str
        Of the lens.
    states : sequence of LensState
        One for each configuration; the first is the active one.

    Returns
    -------
    text : str
    remarks : tuple of str
        Glasses that are written by numbers.

    Raises
    ------
    LensError
        A surface has a shape that none of the types holds.
    """
    first = states[0]
    lens = first.lens
    remarks: list[str] = []
    named = [
        _glass(row.medium, k, remarks) for k, row in enumerate(lens.rows) if isinstance(row, Surface) and row.medium
    ]
    makers = list(dict.fromkeys(glass.maker for glass in named if glass is not None))
    fields = _fields(lens)
    lines = [
        "VERS 140124 258 36214", "MODE SEQ", f"NAME {' '.join(name.split())}",
        *(f"NOTE 0 {' '.join(line.split())}" for line in (lens.source, *lens.notes.splitlines()) if line.strip()),
        "UNIT MM X W X CM MR CPMM", f"FNUM {lens.f_number!r} 0", *([f"GCAT {' '.join(makers)}"] if makers else []),
        f"FTYP 0 0 {len(fields)} {len(F_D_C_UM)} 0 0 0", f"XFLN {' '.join('0' for _ in fields)}",
        f"YFLN {' '.join(map(repr, fields))}",
        *(f"WAVM {k} {um!r} 1" for k, um in enumerate(F_D_C_UM, 1)), "PWAV 2",
        "SURF 0", "  TYPE STANDARD", "  CURV 0.0 0 0 0 0 \"\"",
        f"  DISZ {'INFINITY' if lens.focus_distance is None else repr(lens.focus_distance)}", '  DIAM 0 0 0 0 1 ""',
    ]  # fmt: skip
    glasses = iter(named)
    for k, row in enumerate(lens.rows):
        gap = row.thickness if k < len(lens.rows) - 1 else first.sensor_distance
        glass = next(glasses) if isinstance(row, Surface) and row.medium else None
        lines += _surface(k, row, gap, first.stop_semi_diameter, glass)
    lines += [
        f"SURF {len(lens.rows) + 1}",
        "  TYPE STANDARD",
        '  CURV 0.0 0 0 0 0 ""',
        "  DISZ 0",
        '  DIAM 0 0 0 0 1 ""',
    ]
    lines += _configurations(states)
    return "\n".join(lines) + "\n", tuple(remarks)


def _fields(lens: Lens) -> list[float]:
    if lens.field_deg is None:
        return [0.0]
    return [0.0, 0.7 * lens.field_deg, lens.field_deg]


def _glass(medium: Medium, row: int, by_numbers: list[str]) -> glass_catalogue.CatalogueGlass | None:
    """Return the catalogue glass with the medium's name and numbers; None if it has others."""
    if medium.glass is None:
        return None
    try:
        known = glass_catalogue.by_name(medium.glass, medium.n_d, suggest=False)
    except GlassError:
        known = None
    same = known is not None and abs(known.n_d - medium.n_d) <= _SAME_INDEX
    if known is not None and same and (medium.v_d is None or abs(known.v_d - medium.v_d) <= _SAME_ABBE):
        return known
    by_numbers.append(f"row {row} ({medium.glass})")
    return None


def _surface(
    k: int, row: Surface | Stop, gap: float, stop_semi: float, glass: glass_catalogue.CatalogueGlass | None
) -> list[str]:  # fmt: skip
    lines = [f"SURF {k + 1}"]
    if isinstance(row, Stop):
        return [
            *lines, "  STOP", "  TYPE STANDARD", '  CURV 0.0 0 0 0 0 ""', f"  DISZ {gap!r}",
            f'  DIAM {stop_semi!r} 0 0 0 1 ""',
        ]  # fmt: skip
    if row.toroidal and row.terms and not row.torus:
        raise LensError(f"row {k} has different curvatures in its meridians and aspheric terms, which .zmx cannot hold")
    if row.torus and len(row.asphere) > _MOST_TORUS_TERMS:
        raise LensError(f"row {k} is a torus with terms above y^14, which .zmx cannot hold; write a .toml file")
    odd = any(row.odd_asphere)
    if len(row.asphere) > _MOST_TERMS and not odd:
        raise LensError(f"row {k} has aspheric terms above r^16, which .zmx cannot hold; write a .toml or .json file")
    extended = odd and max(row.terms) > _MOST_ODD_POWER
    kind = "BICONICX" if row.toroidal else "EVENASPH" if any(row.asphere) else "STANDARD"
    if row.torus:
        kind = "TOROIDAL"
    if odd:
        kind = "XOSPHERE" if extended else "ODDASPHE"
    lines += [f"  TYPE {kind}", f'  CURV {row.curvature!r} 0 0 0 0 ""', f"  CONI {row.conic!r}"]
    if row.toroidal:
        across, conic = row.meridian_x
        lines += [f"  PARM 1 {1.0 / across if across else 0.0!r}"]
        # behind the radius a torus has its terms, of which that of y^2 is in the curvature
        lines += [
            f"  PARM {n} {number!r}" for n, number in enumerate((0.0, *row.asphere) if row.torus else (conic,), 2)
        ]
    elif extended:
        # the number of terms and the radius that r is divided by come first
        lines += [f"  XDAT 1 {max(row.terms)} 0 0", "  XDAT 2 1.0 0 0"]
        lines += [f"  XDAT {n + 2} {term!r} 0 0" for n, term in sorted(row.terms.items())]
    elif odd:
        lines += [f"  PARM {n} {term!r}" for n, term in sorted(row.terms.items())]
    elif any(row.asphere):
        lines += [f"  PARM {n} {term!r}" for n, term in enumerate((0.0, *row.asphere), 1)]
    lines.append(f"  DISZ {gap!r}")
    if row.medium is not None:
        n_d, v_d = row.medium.n_d, row.medium.v_d
        if glass is not None:
            lines.append(f"  GLAS {glass.name.replace(' ', '_')} 0 0 {glass.n_d!r} {glass.v_d!r} 0 0 0 0 0 0")
        else:
            lines.append(f"  GLAS ___BLANK 1 0 {n_d!r} {v_d or 0.0!r} 0 0 0 0 0 0")
    fixed = 0 if row.semi_diameter_estimated else 1
    lines.append(f'  DIAM {row.semi_diameter or 0.0!r} {fixed} 0 0 1 ""')
    return lines


def _configurations(states: Sequence[LensState]) -> list[str]:
    """Return the table of configurations; every position gives all gaps that move, and the image's distance."""
    lines = [f"MNUM {len(states)} 1"]
    if len(states) == 1:
        return lines
    rows = len(states[0].lens.rows)
    gaps = {0: ["1.0E+10" if s.lens.focus_distance is None else repr(s.lens.focus_distance) for s in states]}
    gaps |= {k + 1: [repr(s.lens.rows[k].thickness) for s in states] for k in range(rows - 1)}
    gaps[rows] = [repr(s.sensor_distance) for s in states]
    fields = [_fields(s.lens)[-1] for s in states]
    table = [("THIC", place, values) for place, values in gaps.items()]
    table += [("APER", 0, [repr(s.lens.f_number) for s in states])]
    if states[0].lens.field_deg is not None:
        table += [("YFIE", n + 1, [repr(part * field) for field in fields]) for n, part in ((1, 0.7), (2, 1.0))]
    for key, place, values in table:
        if len(set(values)) > 1:
            lines += [f"{key} {place:3d} {k:3d} {value} 0 0 0 1 1 1 0 0" for k, value in enumerate(values, 1)]
    return lines
