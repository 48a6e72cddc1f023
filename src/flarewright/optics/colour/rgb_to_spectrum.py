"""Smooth spectra of colours: fit a three-parameter curve to a linear RGB colour."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...typing import Floats
from .cie1931 import D65_POWER, TABLE_NM, cmf_at_1_nm
from .rgb import xyz_to_rgb_matrix

# brightest channel of the fitted curve: the scale is arbitrary, and half leaves room on both sides
_BRIGHTEST = 0.5
# of Newton's method; 3,000 colours from grey to primaries need 9 at most
_NEWTON_STEPS = 24
# converged when no channel has an error above this fraction of the brightest
CLOSE = 1e-6


def smoothest_reflectance(coefficients: tuple[float, float, float], wavelength_nm: Floats) -> Floats:
    """Evaluate the curve family of smooth spectra.

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
    return 0.5 + 0.5 * x / np.sqrt(1.0 + x * x)


@lru_cache(maxsize=1024)
def uplift(rgb: tuple[float, float, float]) -> tuple[float, float, float]:
    """Fit the smooth curve whose product with D65 has a given colour.

    Parameters
    ----------
    rgb : tuple of float
        Linear Rec.709, none below 0, at least one above; only their ratios count.

    Returns
    -------
    tuple of float
        Coefficients for `smoothest_reflectance`.

    Notes
    -----
    Newton's method on the three coefficients, from grey. White is a flat curve. The round trip to Rec.709 has an error
    below 3e-4 of the brightest channel, primaries included. That is the difference between the D65 table and the white
    of Rec.709, which is rounded (tests/optics/colour/test_rgb_to_spectrum.py).
    """
    target = _BRIGHTEST * np.asarray(rgb, dtype=np.float64) / max(rgb)
    u, response = _response()
    c = np.zeros(3)
    for _ in range(_NEWTON_STEPS):
        c, error = _newton_step(c, target, u, response)
        if error < CLOSE * _BRIGHTEST:
            break
    return float(c[0]), float(c[1]), float(c[2])


def _newton_step(c: Floats, aim: Floats, u: Floats, response: Floats) -> tuple[Floats, float]:
    """Return better coefficients and the largest channel error before the step; the step is halved until it helps."""

    def residual(at: Floats) -> Floats:
        x = (at[0] * u + at[1]) * u + at[2]
        return np.asarray((0.5 + 0.5 * x / np.sqrt(1.0 + x * x)) @ response - aim)

    found = residual(c)
    x = (c[0] * u + c[1]) * u + c[2]
    slope = 0.5 / (1.0 + x * x) ** 1.5
    jacobian = (slope[:, None] * np.stack([u * u, u, np.ones_like(u)], axis=1)).T @ response
    # damping: at the edge of the family the curve becomes a step, and its coefficients diverge
    square = jacobian @ jacobian.T
    step = np.linalg.solve(square + 1e-9 * np.trace(square) * np.eye(3), jacobian @ found)
    size = 1.0
    while size > 1e-3 and np.linalg.norm(residual(c - size * step)) > np.linalg.norm(found):
        size *= 0.5
    if size <= 1e-3:
        return c, 0.0
    return c - size * step, float(np.abs(found).max())


@lru_cache
def _response() -> tuple[Floats, Floats]:
    """Return u of every wavelength (L,), and the linear Rec.709 of a flat curve's light there (L, 3), sum (1, 1, 1)."""
    wave, cmf = cmf_at_1_nm()
    lit = np.interp(wave, TABLE_NM, D65_POWER)[:, None] * cmf
    rgb = lit @ xyz_to_rgb_matrix("rec709").T
    return (wave - 580.0) / 200.0, rgb / rgb.sum(axis=0)
