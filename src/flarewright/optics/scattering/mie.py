"""Mie scattering by a sphere."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from ...typing import Floats


def mie(x: Floats, index: complex, cosine: Floats) -> tuple[Floats, Floats, Floats]:
    """Compute the scattering of spheres.

    Parameters
    ----------
    x : ndarray, shape (N,)
        Circumference over wavelength, above 0.
    index : complex
        Relative to the surrounding medium; a positive imaginary part absorbs.
    cosine : ndarray, shape (A,)
        Of the angle between incident and scattered light.

    Returns
    -------
    extinction, scattering : ndarray, shape (N,)
        Efficiencies: cross sections over that of the sphere.
    intensity : ndarray, shape (N, A)
        (|S1|^2 + |S2|^2) / 2; divided by k^2 it is the scattered power per solid angle and irradiance.

    Notes
    -----
    C. F. Bohren and D. R. Huffman, Absorption and Scattering of Light by Small Particles (1983), equations 4.61, 4.62,
    4.74 and 4.88: the logarithmic derivative D by downward recurrence, the Riccati-Bessel functions upward. Wiscombe's
    number of terms, x + 4.05 x^(1/3) + 2. `tests/optics/scattering/test_brdf.py` checks the example of their appendix
    A, Rayleigh's limit and the optical theorem.
    """
    x = np.asarray(x, dtype=np.float64)
    mu = np.asarray(cosine, dtype=np.float64)
    terms = np.ceil(x + 4.05 * np.cbrt(x) + 2.0)
    most = ceil(terms.max())
    D = _logarithmic_derivative(index * x, most)
    psi0, psi1 = np.cos(x), np.sin(x)
    chi0, chi1 = -np.sin(x), np.cos(x)
    S1, S2 = np.zeros((2, len(x), len(mu)), dtype=np.complex128)
    before, angular = np.zeros(len(mu)), np.ones(len(mu))
    extinction, scattering = np.zeros(len(x)), np.zeros(len(x))
    todo = np.arange(len(x))
    for n in range(1, most + 1):
        # skip spheres whose series has ended: their functions would overflow
        keep = terms[todo] >= n
        if not keep.all():
            todo, psi0, psi1, chi0, chi1 = todo[keep], psi0[keep], psi1[keep], chi0[keep], chi1[keep]
        xs = x[todo]
        psi = (2.0 * n - 1.0) * psi1 / xs - psi0
        chi = (2.0 * n - 1.0) * chi1 / xs - chi0
        xi, xi1 = psi - 1j * chi, psi1 - 1j * chi1
        by_m, times_m = D[n, todo] / index + n / xs, D[n, todo] * index + n / xs
        a = (by_m * psi - psi1) / (by_m * xi - xi1)
        b = (times_m * psi - psi1) / (times_m * xi - xi1)
        extinction[todo] += (2 * n + 1) * (a + b).real
        scattering[todo] += (2 * n + 1) * (np.abs(a) ** 2 + np.abs(b) ** 2)
        tau = n * mu * angular - (n + 1) * before
        weight = (2 * n + 1) / (n * (n + 1))
        S1[todo] += weight * (a[:, None] * angular + b[:, None] * tau)
        S2[todo] += weight * (a[:, None] * tau + b[:, None] * angular)
        before, angular = angular, ((2 * n + 1) * mu * angular - (n + 1) * before) / n
        psi0, psi1, chi0, chi1 = psi1, psi, chi1, chi
    intensity = 0.5 * (np.abs(S1) ** 2 + np.abs(S2) ** 2)
    return 2.0 * extinction / x**2, 2.0 * scattering / x**2, intensity


def _logarithmic_derivative(z: NDArray[np.complexfloating], most: int) -> NDArray[np.complexfloating]:
    """Return D_n(z) = d ln psi_n / dz for n = 0 to `most`, shape (most + 1, N)."""
    last = max(most, ceil(np.abs(z).max())) + 16
    D: NDArray[np.complexfloating] = np.zeros(len(z), dtype=np.complex128)
    found = np.empty((most + 1, len(z)), dtype=np.complex128)
    for n in range(last, 0, -1):
        D = n / z - 1.0 / (D + n / z)
        if n - 1 <= most:
            found[n - 1] = D
    return found
