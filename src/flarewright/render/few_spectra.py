"""Few spectra that stand for many: each light is a sum of some lights' spectra, channel by channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# of a light's spectrum this part, wavelength by wavelength, may be made of others
SPECTRUM_TOLERANCE = 0.02
# how much more the sum of a spectrum counts than its wavelengths
SUM_WEIGHT = 1e3

__all__ = ["few_spectra"]


def few_spectra(colors: Floats, most: int) -> tuple[list[int], Floats, NDArray[np.bool_]]:
    """Choose lights whose spectra the others are sums of.

    Parameters
    ----------
    colors : ndarray, shape (L, M, 3)
        What each wavelength of each light brings to each channel.
    most : int
        So many are chosen at most.

    Returns
    -------
    chosen : list of int
    gains : ndarray, shape (L, K, 3)
        What each light has of each chosen one.
    fits : ndarray of bool, shape (L,)
        Whether a light's wavelengths differ by no more than `SPECTRUM_TOLERANCE` from that sum. Its channels' sums are
        kept in any case.

    Notes
    -----
    A pivoted choice: the brightest light first, then whichever is made worst.
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
    """Fit each of many spectra, shape (L, M), by a sum of few, shape (K, M), its own sum kept; shape (L, K)."""
    basis, wanted = (np.column_stack([one, SUM_WEIGHT * one.sum(axis=1)]) for one in (few, many))
    found: Floats = np.linalg.lstsq(basis.T, wanted.T, rcond=1e-9)[0].T
    return found
