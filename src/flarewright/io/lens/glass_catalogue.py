"""The glass catalogue: dispersion formulas of six makers, found by name or by nearest (n_d, V_d).

`tools/bake_glass.py` compiles the data from the refractiveindex.info database (CC0 1.0); they load on first use.
"""

from __future__ import annotations

import difflib
import gzip
import json
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ...errors import GlassError
from ...model import Dispersion
from ...typing import Floats

N_D_TOLERANCE = 0.002
"""A catalogue glass can replace a stated (n_d, V_d) when its n_d is this close ..."""

V_D_TOLERANCE = 0.02
"""... and its V_d differs by at most this fraction."""

F_D_C_UM = (0.4861327, 0.5875618, 0.6562725)
"""The lines of hydrogen and helium at which makers state indices, micrometres."""

MAKERS = ("SCHOTT", "OHARA", "HOYA", "HIKARI", "CDGM", "SUMITA")

# minerals that prescriptions name directly
_ALIASES = {
    "CAF2": "LITHOTECCAF2",
    "FLUORITE": "LITHOTECCAF2",
    "SILICA": "LITHOSILQ",
    "FUSEDSILICA": "LITHOSILQ",
    "SIO2": "LITHOSILQ",
}


@dataclass(frozen=True)
class CatalogueGlass:
    """One glass of the catalogue.

    Attributes
    ----------
    maker, name : str
        In the maker's spelling, "SCHOTT" and "N-BK7".
    n_d : float
        Index at 587.56 nm, from the formula.
    v_d : float
        Abbe number, from the formula.
    dispersion : Dispersion
    """

    maker: str
    name: str
    n_d: float
    v_d: float
    dispersion: Dispersion

    @property
    def full_name(self) -> str:
        """Maker and name, "SCHOTT N-BK7"."""
        return f"{self.maker} {self.name}"


@dataclass(frozen=True)
class _Catalogue:
    rows: list[list[Any]]
    n_d: Floats
    v_d: Floats
    by_key: dict[str, tuple[int, ...]]


def by_name(name: str, n_d: float | None = None, *, suggest: bool = True) -> CatalogueGlass:
    """Find a glass by its catalogue name.

    Case, spaces, hyphens and underscores do not matter; a maker's name can precede the glass name. For an old Schott
    name that is not in the catalogue, return its successor ("LAKN7" finds "N-LAK7"), so compare the result's `name`.

    Parameters
    ----------
    name : str
        "N-BK7", "n bk7" or "SCHOTT N-BK7".
    n_d : float, optional
        Where several makers use the name, select the glass with the nearest index; without it Schott takes precedence.
    suggest : bool
        Search near names for the message; takes longer than the rest of the function.

    Raises
    ------
    GlassError
        When no glass has that name; the message suggests near ones.
    """
    catalogue = _catalogue()
    key, maker = _split_maker(name)
    for candidate in _spellings(key):
        found = [k for k in catalogue.by_key.get(candidate, ()) if maker in (None, catalogue.rows[k][0])]
        if found:
            if n_d is not None:
                found.sort(key=lambda k: abs(float(catalogue.n_d[k]) - n_d))
            return _glass(found[0])
    raise GlassError(_unknown(name, key, maker, suggest))


def nearest(n_d: float, v_d: float | None = None) -> tuple[CatalogueGlass, float]:
    """Find the catalogue glass nearest to an index and an Abbe number.

    Parameters
    ----------
    n_d : float
        Index at 587.56 nm.
    v_d : float or None
        Abbe number; None selects the median one of all glasses of that index.

    Returns
    -------
    glass : CatalogueGlass
    distance : float
        max(|dn| / 0.002, |dV| / (0.02 V)): up to 1 the glass is a fair substitute.
    """
    catalogue = _catalogue()
    by_index = np.abs(catalogue.n_d - n_d) / N_D_TOLERANCE
    if v_d is None and np.any(by_index <= 1.0):
        # the nearest index alone can give an exotic glass; the median V_d has the smallest error
        v_d = float(np.median(catalogue.v_d[by_index <= 1.0]))
    by_abbe = np.zeros_like(by_index) if v_d is None else np.abs(catalogue.v_d / v_d - 1.0) / V_D_TOLERANCE
    distance = np.maximum(by_index, by_abbe)
    best = int(np.argmin(distance))
    return _glass(best), float(distance[best])


def cauchy_from_abbe(n_d: float, v_d: float) -> Dispersion:
    """Make a two-term Cauchy formula that has the given n_d and V_d.

    Parameters
    ----------
    n_d : float
        Index at 587.56 nm.
    v_d : float
        Abbe number, above 0.

    Returns
    -------
    Dispersion
        n = A + B / L^2 with B = 0.52345 (n_d - 1) / V_d and A = n_d - B / 0.34523, L in micrometres.

    Notes
    -----
    The constants are L_d^2 = 0.34523 and 1 / (L_F^-2 - L_C^-2) = 0.52345 as printed (0.52366 exactly). Use it only
    when no catalogue glass fits: the index of real glass rises more towards the blue.
    """
    b = 0.52345 * (n_d - 1.0) / v_d
    return Dispersion(glass="Cauchy", formula="cauchy", coefficients=(n_d - b / 0.34523, b), range_nm=(360.0, 1100.0))


def all_names() -> tuple[str, ...]:
    """Return "MAKER NAME" of every glass."""
    return tuple(f"{row[0]} {row[1]}" for row in _catalogue().rows)


def glasses_of(maker: str) -> tuple[CatalogueGlass, ...]:
    """Return all glasses of one maker, in the catalogue's order; empty for an unknown maker.

    Parameters
    ----------
    maker : str
        One of `MAKERS`, in capitals.
    """
    return tuple(_glass(k) for k, row in enumerate(_catalogue().rows) if row[0] == maker)


def same_name(a: str, b: str) -> bool:
    """Return whether two spellings mean the same catalogue name, with or without a maker."""
    return _split_maker(a)[0] == _split_maker(b)[0]


@cache
def _catalogue() -> _Catalogue:
    packed = (files("flarewright.io") / "data" / "glasses.json.gz").read_bytes()
    rows: list[list[Any]] = json.loads(gzip.decompress(packed))["glasses"]
    by_key: dict[str, tuple[int, ...]] = {}
    for k, row in enumerate(rows):
        key = _key(row[1])
        by_key[key] = (*by_key.get(key, ()), k)

    # where makers share a name, the order of MAKERS decides
    for key, found in by_key.items():
        by_key[key] = tuple(sorted(found, key=lambda k: MAKERS.index(rows[k][0])))
    n_d = np.array([row[2] for row in rows])
    v_d = np.array([row[3] for row in rows])
    return _Catalogue(rows, n_d, v_d, by_key)


@cache
def _glass(k: int) -> CatalogueGlass:
    maker, name, n_d, v_d, formula, low_nm, high_nm, coefficients = _catalogue().rows[k]
    dispersion = Dispersion(
        glass=f"{maker} {name}", formula=formula, coefficients=tuple(coefficients), range_nm=(low_nm, high_nm)
    )
    return CatalogueGlass(maker, name, n_d, v_d, dispersion)


def _key(name: str) -> str:
    return re.sub(r"[\s\-_:]+", "", name).upper()


def _split_maker(name: str) -> tuple[str, str | None]:
    key = _key(name)
    for maker in MAKERS:
        if key.startswith(maker) and len(key) > len(maker):
            return key[len(maker) :], maker
    return key, None


def _spellings(key: str) -> list[str]:
    """Return the keys to try: the exact one, then the current names of an old glass."""
    tried = [key]
    if key in _ALIASES:
        tried.append(_ALIASES[key])
    tried.append("N" + key)
    if old := re.fullmatch(r"([A-Z]+)N(\d+[A-Z]?)", key):
        tried += [f"N{old[1]}{old[2]}", f"{old[1]}{old[2]}"]

    # Hikari's J- and E- series and Ohara's S- series reuse the classical names
    tried += ["J" + key, "E" + key, "S" + key]
    return tried


def _unknown(name: str, key: str, maker: str | None, suggest: bool) -> str:
    catalogue = _catalogue()
    spelled = {k: catalogue.rows[rows[0]] for k, rows in catalogue.by_key.items()}
    near = difflib.get_close_matches(key, spelled, n=3, cutoff=0.6) if suggest else []
    hint = "; near names: " + ", ".join(f"{spelled[k][0]} {spelled[k][1]}" for k in near) if near else ""
    whose = f"{maker}'s catalogue" if maker else "the catalogue"
    return f"glass {name!r} is not in {whose}: give n_d and v_d instead{hint}"
