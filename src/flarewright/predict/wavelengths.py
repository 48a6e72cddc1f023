"""Few wavelengths that give a light's luminance exactly: Gauss quadrature over the eye's sensitivity."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..model.project.light import Lines, Spectrum
from ..optics.colour.cie1931 import cie_1931
from ..optics.colour.spectrum import luminance_shares
from ..typing import Floats


@lru_cache(maxsize=64)
def luminous_lines(spectrum: Spectrum, count: int) -> Lines:
    """Replace a spectrum by lines that give the same luminance through any factor smooth in wavelength.

    Returns
    -------
    Lines
        `count` lines, or the spectrum's own if it has no more. Luminance is right, colour is not.

    Raises
    ------
    FlarewrightError
        When the spectrum has no visible light.

    Notes
    -----
    The reflectances R_j(l) R_i(l) of a ghost are smooth but strongly nonlinear between a few even wavelengths: a
    quarter-wave film reflects least where the eye is most sensitive, so that linear interpolation between three
    wavelengths makes its flare brighter by two thirds, between seven by a fifth. Gauss nodes and weights for S(l) y(l)
    integrate polynomials up to degree 2 count - 1 exactly (Golub and Welsch 1969, from the measure's recurrence).
    """
    wave, share = luminance_shares(spectrum)
    lit = len(np.unique(wave[share > 0.0]))
    if isinstance(spectrum, Lines) and lit <= count:
        return spectrum
    # a spectrum with light at few wavelengths allows no more nodes than those
    nodes, weights = _gauss(wave, share, min(count, lit))
    # the luminance of a line is its power times y(l)
    power = weights / cie_1931(nodes)[:, 1]
    return Lines(lines=tuple((float(node), float(one)) for node, one in zip(nodes, power, strict=True)))


def _gauss(x: Floats, mass: Floats, count: int) -> tuple[Floats, Floats]:
    """Return Gauss nodes and weights for a sum over points; the masses sum to 1."""
    # Stieltjes: orthogonal polynomials on the points give the Jacobi matrix
    diagonal, off = np.zeros(count), np.zeros(count)
    before, now = np.zeros_like(x), np.ones_like(x)
    for k in range(count):
        diagonal[k] = (mass * x * now * now).sum()
        following = (x - diagonal[k]) * now - (off[k - 1] if k else 0.0) * before
        off[k] = np.sqrt((mass * following * following).sum())
        before, now = now, following / off[k] if off[k] > 0.0 else following
    jacobi = np.diag(diagonal) + np.diag(off[:-1], 1) + np.diag(off[:-1], -1)
    nodes, vectors = np.linalg.eigh(jacobi)
    return nodes, vectors[0] ** 2
