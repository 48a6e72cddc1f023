"""From a colour to a smooth spectrum."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .cie1931 import D65_POWER, FIRST_NM, STEP_NM, cie_1931
from .color import xyz_to_rgb_matrix

Floats = NDArray[np.float64]

# the brightest channel of the curve that is fitted: its own scale does not matter, and half leaves room either way
_BRIGHTEST = 0.5
# steps from grey to the colour, and Newton steps in each
_STEPS, _NEWTON = 24, 12
# a curve is as good as wanted when no channel errs by more than this part of the brightest
CLOSE = 1e-6

__all__ = ["CLOSE", "smooth_curve", "uplift"]


def smooth_curve(coefficients: tuple[float, float, float], wavelength_nm: Floats) -> Floats:
    """Evaluate the family of curves that stand for colours.

    Parameters
    ----------
    coefficients : tuple of float
        c0, c1, c2.
    wavelength_nm : ndarray

    Returns
    -------
    ndarray
        1/2 + x / (2 sqrt(1 + x^2)) with x = c0 u^2 + c1 u + c2 and u = (wavelength - 580) / 200; between 0 and 1.

    Notes
    -----
    W. Jakob and J. Hanika, "A Low-Dimensional Function Space for Efficient Spectral Upsampling", Computer Graphics
    Forum 38 (2), 2019, equation 4.
    """
    u = (np.asarray(wavelength_nm, dtype=np.float64) - 580.0) / 200.0
    c0, c1, c2 = coefficients
    x = (c0 * u + c1) * u + c2
    curve: Floats = 0.5 + 0.5 * x / np.sqrt(1.0 + x * x)
    return curve


@lru_cache(maxsize=1024)
def uplift(rgb: tuple[float, float, float]) -> tuple[float, float, float]:
    """Fit the smooth curve that, lit by D65, has a colour.

    Parameters
    ----------
    rgb : tuple of float
        Linear Rec.709, none below 0, one above; only their ratios count.

    Returns
    -------
    tuple of float
        For `smooth_curve`.

    Notes
    -----
    Newton's method on the three coefficients, by way of paler colours. White is a flat curve. The round trip to Rec.709
    errs by less than 3e-4 of the brightest channel, the primaries included: by what the table of D65 differs from the
    rounded white of Rec.709 (tests/optics/test_uplift.py).
    """
    target = _BRIGHTEST * np.asarray(rgb, dtype=np.float64) / max(rgb)
    grey = np.full(3, _BRIGHTEST)
    u, response = _response()
    c = np.zeros(3)
    for part in np.linspace(0.0, 1.0, _STEPS + 1)[1:]:
        # quicker at first: the last steps to a saturated colour are the hard ones
        aim = grey + (1.0 - (1.0 - part) ** 2) * (target - grey)
        for _ in range(_NEWTON):
            c, error = _newton_step(c, aim, u, response)
            if error < CLOSE * _BRIGHTEST:
                break
    return float(c[0]), float(c[1]), float(c[2])


def _newton_step(c: Floats, aim: Floats, u: Floats, response: Floats) -> tuple[Floats, float]:
    """Return better coefficients, and the largest error of a channel before the step; halved until it helps."""

    def missed(at: Floats) -> Floats:
        x = (at[0] * u + at[1]) * u + at[2]
        return np.asarray((0.5 + 0.5 * x / np.sqrt(1.0 + x * x)) @ response - aim)

    found = missed(c)
    x = (c[0] * u + c[1]) * u + c[2]
    slope = 0.5 / (1.0 + x * x) ** 1.5
    jacobian = (slope[:, None] * np.stack([u * u, u, np.ones_like(u)], axis=1)).T @ response
    # a little damping: at the edge of the family the curve is a step, and its coefficients run away
    square = jacobian @ jacobian.T
    step = np.linalg.solve(square + 1e-9 * np.trace(square) * np.eye(3), jacobian @ found)
    size = 1.0
    while size > 1e-3 and np.linalg.norm(missed(c - size * step)) > np.linalg.norm(found):
        size *= 0.5
    if size <= 1e-3:
        return c, 0.0
    return c - size * step, float(np.abs(found).max())


@lru_cache
def _response() -> tuple[Floats, Floats]:
    """U of every wavelength (L,), and what a flat curve's light there adds to linear Rec.709 (L, 3), sum (1, 1, 1)."""
    table_nm = FIRST_NM + STEP_NM * np.arange(len(D65_POWER), dtype=np.float64)
    wave = np.arange(FIRST_NM, table_nm[-1] + 1.0)
    lit = np.interp(wave, table_nm, D65_POWER)[:, None] * cie_1931(wave)
    rgb = lit @ xyz_to_rgb_matrix("rec709").T
    return (wave - 580.0) / 200.0, rgb / rgb.sum(axis=0)
