"""Dust on surfaces: how much lies there by cleanliness level, and what it scatters."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .mie import mie

Floats = NDArray[np.float64]

# specks are spheres of this index in the field's models (P. R. Spyak and W. L. Wolfe, Opt. Eng. 31, 1757, 1992)
DUST_INDEX = complex(1.53, 0.0005)
# the standard counts specks from 1 micrometre on
LEAST_UM = 1.0
# slope of the logarithm of numbers over the squared logarithm of sizes
SLOPE = 0.926
# sizes and angles of the sum: circumferences over wavelength and logarithms of v, each mean of some
SIZES, SMALLEST, LARGEST = 180, 3.0, 6000.0
ANGLES, FIRST_V, PER_ANGLE = 40, 2e-4, 6

__all__ = ["area_covered", "dust_density", "specks_above"]


def specks_above(diameter_um: ArrayLike, level: float) -> Floats:
    """Count specks at least as large as a diameter on 1 mm^2.

    Parameters
    ----------
    diameter_um : array_like
    level : float
        Cleanliness level.

    Returns
    -------
    ndarray
        0 above the level itself.

    Notes
    -----
    IEST-STD-CC1246 (MIL-STD-1246): on 0.1 m^2, log10 N = 0.926 (log10(level)^2 - log10(d)^2).
    """
    size = np.asarray(diameter_um, dtype=np.float64)
    number = 10.0 ** (SLOPE * (np.log10(level) ** 2 - np.log10(np.maximum(size, LEAST_UM)) ** 2)) / 1e5
    found: Floats = np.where(size > level, 0.0, number)
    return found


def area_covered(level: float) -> float:
    """Part of a surface's area that round specks of a cleanliness level cover."""
    edges = np.geomspace(LEAST_UM, level, 2001)
    middle = np.sqrt(edges[1:] * edges[:-1])
    return float((-np.diff(_counts(edges, level)) * 0.25e-6 * np.pi * middle**2).sum())


def _counts(edges_um: Floats, level: float) -> Floats:
    """Numbers above sizes, whose last difference does not hold the single speck of the level's own size."""
    return np.asarray(10.0 ** (SLOPE * (np.log10(level) ** 2 - np.log10(edges_um) ** 2)) / 1e5, dtype=np.float64)


def dust_density(v: ArrayLike, wavelength_nm: float, level: float) -> Floats:
    """Share of light that dust on a surface in air scatters forward, per area of v.

    Parameters
    ----------
    v : array_like
        Length of the difference of the direction components along the surface.
    wavelength_nm : float
    level : float
        Cleanliness level.

    Returns
    -------
    ndarray

    Notes
    -----
    The sum over sizes of their number times Mie's scatter, per solid angle, at the angle whose sine is v; that near
    grazing is taken at 85 degrees. Specks lie far apart, so their light adds; it is told per area of v, that is,
    divided by the cosine. Below v = 2e-4 and above the last angle the density stays what it is there: the largest
    specks spread their light over wavelength / level, 1e-3.
    """
    nodes, spread = _mie_spread()
    edges = np.geomspace(LEAST_UM, level, SIZES + 1)
    number = -np.diff(_counts(edges, level))
    middle = np.sqrt(edges[1:] * edges[:-1])
    x = np.pi * middle / (1e-3 * wavelength_nm)
    k2 = (2e6 * np.pi / wavelength_nm) ** 2
    at = np.log(np.clip(x, SMALLEST, LARGEST))
    sizes = np.log(np.geomspace(SMALLEST, LARGEST, SIZES))
    density = np.zeros(ANGLES)
    for m in range(ANGLES):
        density[m] = (number * np.exp(np.interp(at, sizes, spread[:, m]))).sum() / k2
    smooth = _smoothed(np.log(nodes), np.log(density))
    place = np.log(np.clip(np.asarray(v, dtype=np.float64), nodes[0], nodes[-1]))
    found: Floats = np.exp(np.interp(place, np.log(nodes), smooth))
    return found


@lru_cache(maxsize=1)
def _mie_spread() -> tuple[Floats, Floats]:
    """Logarithm of Mie's intensity over the cosine, by circumference and by v, each a mean of neighbouring angles."""
    edges = np.geomspace(FIRST_V, np.sin(np.radians(85.0)), ANGLES + 1)
    v = np.exp(np.linspace(np.log(edges[0]), np.log(edges[-1]), ANGLES * PER_ANGLE + 1))
    v = np.sqrt(v[1:] * v[:-1])
    cosine = np.sqrt(1.0 - v**2)
    sizes = np.geomspace(SMALLEST, LARGEST, SIZES)
    _, _, intensity = mie(sizes, DUST_INDEX, cosine)
    mean = (intensity / cosine).reshape(SIZES, ANGLES, PER_ANGLE).mean(axis=2)
    return np.sqrt(edges[1:] * edges[:-1]), np.log(mean)


def _smoothed(t: Floats, values: Floats) -> Floats:
    """Fit a polynomial of the seventh degree that never rises: what is left of spheres' rings is no feature of dust."""
    u = 2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0
    fit = np.polynomial.chebyshev.Chebyshev.fit(u, values, 7)
    return np.asarray(np.minimum.accumulate(fit(u)), dtype=np.float64)
