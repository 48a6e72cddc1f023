"""Media between surfaces and how their index varies with wavelength."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..base import Frozen


class Dispersion(Frozen):
    """A dispersion formula of a named catalogue glass.

    Attributes
    ----------
    glass : str
        Catalogue name, "SCHOTT N-BK7" for example, or "Cauchy" for the last resort.
    formula : {"sellmeier", "polynomial", "cauchy"}
        sellmeier: n^2 = 1 + c0 + sum B_i L^2 / (L^2 - C_i), coefficients (c0, B1, C1, B2, C2, ...), C_i in square
        micrometres;
        polynomial: n^2 = c0 + sum c_k L^{p_k}, coefficients (c0, c1, p1, c2, p2, ...);
        cauchy: n = A + B / L^2, coefficients (A, B). L is the wavelength in micrometres.
    coefficients : tuple of float
    range_nm : tuple of float
        Wavelengths for which the maker states the formula.
    """

    glass: str
    formula: Literal["sellmeier", "polynomial", "cauchy"]
    coefficients: tuple[float, ...]
    range_nm: tuple[float, float]


class Medium(Frozen):
    """What fills the gap behind a surface; air is the absence of a medium (None).

    The prescription's own `n_d` is the truth at 587.56 nm; `dispersion` gives the change away from it:
    n(lambda) = n_d + f(lambda) - f(587.56 nm).
    """

    glass: str | None = Field(None, description="catalogue name as the prescription gives it")
    n_d: float = Field(gt=1.0, lt=4.5, description="index at 587.56 nm")
    v_d: float | None = Field(None, gt=5.0, lt=150.0, description="Abbe number")
    dispersion: Dispersion | None = Field(None, description="filled in when the lens is loaded")
