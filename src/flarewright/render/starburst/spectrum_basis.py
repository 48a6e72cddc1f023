"""Represent the spectra of many lights as sums of a few of them, channel by channel."""

from __future__ import annotations

import numpy as np

from ...typing import Floats, Mask

# allowed difference between a spectrum and its sum, relative to the spectrum, summed over wavelengths
SPECTRUM_TOLERANCE = 0.02
# weight of a spectrum's total, relative to its single wavelengths, in the fit
SUM_WEIGHT = 1e3


def basis_spectra(colors: Floats, most: int) -> tuple[list[int], Floats, Mask]:
    """Choose lights whose spectra represent those of all lights.

    Parameters
    ----------
    colors : ndarray, shape (L, M, 3)
        Flux of each light at each wavelength in each channel.
    most : int
        Largest number of chosen lights.

    Returns
    -------
    chosen : list of int
    gains : ndarray, shape (L, K, 3)
        Coefficient of each chosen light in each light's sum.
    fits : ndarray of bool, shape (L,)
        Whether a light's wavelengths differ from its sum by at most `SPECTRUM_TOLERANCE`. The totals of its channels
        are preserved in any case.

    Notes
    -----
    Greedy choice: the brightest light first, then the light with the largest error.
    """
    size = np.abs(colors).sum(axis=(1, 2))
    unit = colors / np.where(size > 0.0, size, 1.0)[:, None, None]
    chosen = [int(np.argmax(size))]
    while True:
        gains = np.stack([_sums_of(unit[chosen, :, c], unit[:, :, c]) for c in range(3)], axis=2)
        off = np.abs(np.einsum("lkc,kmc->lmc", gains, unit[chosen]) - unit).sum(axis=(1, 2))
        worst = int(np.argmax(off))
        if off[worst] <= SPECTRUM_TOLERANCE or len(chosen) >= most:
            break
        chosen.append(worst)
    scale: Floats = size[:, None] / size[chosen]
    return chosen, gains * scale[:, :, None], off <= SPECTRUM_TOLERANCE


def _sums_of(few: Floats, many: Floats) -> Floats:
    """Fit spectra, shape (L, M), by sums of a few, shape (K, M), with preserved totals; shape (L, K)."""
    basis, wanted = (np.column_stack([one, SUM_WEIGHT * one.sum(axis=1)]) for one in (few, many))
    found: Floats = np.linalg.lstsq(basis.T, wanted.T, rcond=1e-9)[0].T
    return found
