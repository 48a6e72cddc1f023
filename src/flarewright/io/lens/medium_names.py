"""Media as other programs write them: a name with its maker, an index and Abbe number, or both."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import GlassError
from ...model import Medium
from . import media
from .glass_catalogue import MAKERS
from .lens_fields import ROW_NUMBERS

_DIGITS = re.compile(r"(\d{3,7})\.(\d{3,7})|(\d{3})(\d{3})")
_PAIR = re.compile(r"(\d+(?:\.\d+)?):(\d+(?:\.\d+)?)")
_AIR = ("", "AIR", "VACUUM")
# every optical glass has a larger index
LEAST_GLASS = 1.3


def named_medium(
    text: str, place: str, problems: list[str], findings: list[tuple[int, media.Finding]], number: int
) -> Medium | None:
    """Return the medium of a name; None for air, and after an error, which is appended.

    Parameters
    ----------
    text : str
        `N-BK7`, `NBK7_SCHOTT`, `517.642`, `517642` and `517000.642000` (n_d 1.517, V_d 64.2), or `1.5168:64.17`.
    place : str
        "surface 3", for messages.
    problems : list of str
    findings : list of (int, Finding)
    number : int
        Of the surface, for the findings.
    """
    word = text.strip().strip("'\"")
    if word.upper() in _AIR:
        return None
    if pair := _PAIR.fullmatch(word):
        return numbered_medium(None, float(pair[1]), float(pair[2]), place, problems, findings, number)
    if digits := _DIGITS.fullmatch(word):
        index, abbe = digits[1] or digits[3], digits[2] or digits[4]
        # the code holds the decimals of n_d, which the densest glasses have above 2
        n_d, v_d = float(f"1.{index}"), float(f"{abbe[:2]}.{abbe[2:]}")
        n_d += 1.0 if 1.0 < n_d < LEAST_GLASS else 0.0
        return numbered_medium(None, n_d, v_d, place, problems, findings, number)
    name, _, maker = word.rpartition("_")
    full = f"{maker} {name}" if name and maker.upper() in MAKERS else word
    return numbered_medium(full, None, None, place, problems, findings, number)


def numbered_medium(
    glass: str | None,
    n_d: float | None,
    v_d: float | None,
    place: str,
    problems: list[str],
    findings: list[tuple[int, media.Finding]],
    number: int,
) -> Medium | None:
    """Return the medium of a name and numbers; None for an index of 1, and after an error, which is appended.

    Parameters
    ----------
    glass : str or None
    n_d, v_d : float or None
        None: not given. An Abbe number of 0 is unknown.
    place, problems, findings, number
        As in `named_medium`.
    """
    if glass is None and n_d == 1.0:
        return None
    v_d = None if v_d == 0.0 else v_d
    for key, value in (("n_d", n_d), ("v_d", v_d)):
        if value is not None and (refusal := ROW_NUMBERS[key].refuse(value)):
            problems.append(f"{place}: {key} {refusal}")
            return None
    try:
        medium, finding = media.attach(glass, n_d, v_d)
    except GlassError as error:
        problems.append(f"{place}: {error}")
        return None
    findings.append((number, finding))
    return medium


def tabulated_medium(
    wavelengths_nm: Sequence[float],
    indices: Sequence[float],
    place: str,
    problems: list[str],
    findings: list[tuple[int, media.Finding]],
    number: int,
) -> Medium | None:
    """Return the medium of a table of indices, by those at the d, F and C lines; None after an error.

    Parameters
    ----------
    wavelengths_nm, indices : sequence of float
        At least two, as many indices as wavelengths.
    place, problems, findings, number
        As in `named_medium`.
    """
    n_d, n_f, n_c = (_index(wavelengths_nm, indices, line_nm) for line_nm in (587.5618, 486.1327, 656.2725))
    v_d = (n_d - 1.0) / (n_f - n_c) if n_f > n_c else None
    return numbered_medium(None, n_d, v_d, place, problems, findings, number)


def _index(wavelengths_nm: Sequence[float], indices: Sequence[float], line_nm: float) -> float:
    """Return an index between tabulated ones, linear in 1 / wavelength^2 as in Cauchy's formula."""
    pairs = sorted(zip((1.0 / nm**2 for nm in wavelengths_nm), indices, strict=True))
    at = 1.0 / line_nm**2
    k = min(max(sum(x < at for x, _ in pairs), 1), len(pairs) - 1)
    (x0, y0), (x1, y1) = pairs[k - 1], pairs[k]
    return y0 + (y1 - y0) * (at - x0) / (x1 - x0) if x1 != x0 else y0
