"""Refractive index over wavelength; the only module that evaluates dispersion formulas."""

from __future__ import annotations

import numpy as np

from ...colorimetry import VISIBLE_NM
from ...errors import GlassError
from ...model import Dispersion, Medium
from ...typing import Floats

D_LINE_NM = 587.56
# the lines of V_d = (n_d - 1) / (n_F - n_C)
F_LINE_NM, C_LINE_NM = 486.13, 656.27

# limits of extrapolation: a little beyond the maker's range, and visible light in any case
_STRETCH = 0.15


def refractive_index(medium: Medium | None, wavelength_nm: Floats | float) -> Floats:
    """Return the index of a medium.

    Parameters
    ----------
    medium : Medium or None
        None is air, index 1.
    wavelength_nm : array_like, any shape
        Vacuum wavelengths in nm.

    Returns
    -------
    ndarray, shape of `wavelength_nm`
        n(lambda) = n_d + f(lambda) - f(587.56 nm), so that the prescription's n_d is exact.

    Raises
    ------
    GlassError
        When the medium has no dispersion, or a wavelength is far outside the range of its formula.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    if medium is None:
        return np.ones_like(wavelength)
    if medium.dispersion is None:
        label = medium.glass or f"n_d = {medium.n_d:g}"
        raise GlassError(f"the glass {label} has no dispersion: load the lens with load_lens, which attaches one")
    change = dispersion_index(medium.dispersion, wavelength) - dispersion_index(
        medium.dispersion, np.float64(D_LINE_NM)
    )
    return np.asarray(medium.n_d + change, dtype=np.float64)


def dispersion_index(dispersion: Dispersion, wavelength_nm: Floats | np.float64) -> Floats:
    """Evaluate a dispersion formula.

    Parameters
    ----------
    dispersion : Dispersion
    wavelength_nm : ndarray, any shape
        Vacuum wavelengths in nm.

    Returns
    -------
    ndarray, shape of `wavelength_nm`

    Raises
    ------
    GlassError
        When a wavelength is far outside the range of the formula, or the formula gives no index above 1 there.

    Notes
    -----
    The forms are those of `model.Dispersion`; the result ignores any medium's n_d, for comparison with a catalogue.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    _check_range(dispersion, wavelength)
    c = dispersion.coefficients
    L = wavelength * 1e-3
    L2 = L * L
    with np.errstate(all="ignore"):
        if dispersion.formula == "cauchy":
            n = c[0] + c[1] / L2
        elif dispersion.formula == "sellmeier":
            n = np.sqrt(1.0 + c[0] + sum(B * L2 / (L2 - C) for B, C in zip(c[1::2], c[2::2], strict=True)))
        else:
            n = np.sqrt(c[0] + sum(a * L**p for a, p in zip(c[1::2], c[2::2], strict=True)))
    if not np.all(n > 1.0):
        raise GlassError(f"the formula of {dispersion.glass} gives no index above 1 at {_span(wavelength)} nm")
    return np.asarray(n, dtype=np.float64)


def _check_range(dispersion: Dispersion, wavelength_nm: Floats) -> None:
    low, high = dispersion.range_nm
    low = min(low * (1.0 - _STRETCH), VISIBLE_NM[0])
    high = max(high * (1.0 + _STRETCH), VISIBLE_NM[1])
    if wavelength_nm.size and not bool(np.all((wavelength_nm >= low) & (wavelength_nm <= high))):
        raise GlassError(
            f"{dispersion.glass} is known from {dispersion.range_nm[0]:g} to {dispersion.range_nm[1]:g} nm, "
            f"not at {_span(wavelength_nm)} nm: keep the wavelengths between {low:.0f} and {high:.0f} nm"
        )


def _span(wavelength_nm: Floats) -> str:
    low, high = float(np.min(wavelength_nm)), float(np.max(wavelength_nm))
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
