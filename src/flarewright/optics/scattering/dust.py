"""Dust on surfaces: number of particles by cleanliness level, and their scatter."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ...typing import Floats
from .mie import mie

# index of spherical dust particles in common models (P. R. Spyak and W. L. Wolfe, Opt. Eng. 31, 1757, 1992)
DUST_INDEX = complex(1.53, 0.0005)
# smallest particle that the standard counts, micrometres
LEAST_UM = 1.0
# slope of log(number) over the squared logarithm of size
SLOPE = 0.926
# quadrature: sizes (circumference over wavelength) and angles (logarithm of v, each a mean of PER_ANGLE values)
SIZES, SMALLEST, LARGEST = 180, 3.0, 6000.0
ANGLES, FIRST_V, PER_ANGLE = 40, 2e-4, 6


def particles_above(diameter_um: Floats, level: float) -> Floats:
    """Return the number of particles at least as large as a diameter, up to a cleanliness level, on 1 mm^2.

    Notes
    -----
    IEST-STD-CC1246 (MIL-STD-1246): on 0.1 m^2, log10 N = 0.926 (log10(level)^2 - log10(d)^2).
    """
    return np.asarray(10.0 ** (SLOPE * (np.log10(level) ** 2 - np.log10(diameter_um) ** 2)) / 1e5, dtype=np.float64)


def dust_density(v: ArrayLike, wavelength_nm: float, level: float) -> Floats:
    """Return the light that dust on a surface in air scatters forward, as a fraction per area of v.

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
    Sum over sizes of number times Mie's scatter per solid angle, at the angle whose sine is v; angles near grazing use
    85 degrees. Particles are far apart, so their irradiances add. Division by the cosine converts to area of v. The
    density is constant below v = 2e-4 and above the last angle: the largest particles spread their light over
    wavelength / level, 1e-3.
    """
    nodes, spread = _mie_spread()
    edges = np.geomspace(LEAST_UM, level, SIZES + 1)
    # the difference excludes the single particle of the level's size
    number = -np.diff(particles_above(edges, level))
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
    return np.exp(np.interp(place, np.log(nodes), smooth))


@lru_cache(maxsize=1)
def _mie_spread() -> tuple[Floats, Floats]:
    """Return the logarithm of Mie's intensity over the cosine, by circumference and v, averaged over near angles."""
    edges = np.geomspace(FIRST_V, np.sin(np.radians(85.0)), ANGLES + 1)
    v = np.exp(np.linspace(np.log(edges[0]), np.log(edges[-1]), ANGLES * PER_ANGLE + 1))
    v = np.sqrt(v[1:] * v[:-1])
    cosine = np.sqrt(1.0 - v**2)
    sizes = np.geomspace(SMALLEST, LARGEST, SIZES)
    _, _, intensity = mie(sizes, DUST_INDEX, cosine)
    mean = (intensity / cosine).reshape(SIZES, ANGLES, PER_ANGLE).mean(axis=2)
    return np.sqrt(edges[1:] * edges[:-1]), np.log(mean)


def _smoothed(t: Floats, values: Floats) -> Floats:
    """Fit a non-rising polynomial of degree seven, because rings of spheres are not a property of real dust."""
    u = 2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0
    fit = np.polynomial.chebyshev.Chebyshev.fit(u, values, 7)
    return np.asarray(np.minimum.accumulate(fit(u)), dtype=np.float64)
