"""The colours of a film: from Y'CbCr codes to linear Rec.709."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...colorimetry import D65_WHITE, rgb_to_xyz
from ...colorimetry import PRIMARIES as KNOWN
from ...model.project.backplate import Transfer
from ...typing import Pixels
from ..images.transfer import decoded

WEIGHTS = {"bt709": (0.2126, 0.0722), "bt601": (0.299, 0.114), "bt2020": (0.2627, 0.0593), "smpte240m": (0.212, 0.087)}
"""Weights of red and blue in luma, of each matrix (ITU-R BT.709, BT.601 and BT.2020, SMPTE 240M)."""

PRIMARIES = {
    "bt709": KNOWN["lin_rec709_scene"],
    "smpte170m": (0.63, 0.34, 0.31, 0.595, 0.155, 0.07, *D65_WHITE),
    "bt470bg": (0.64, 0.33, 0.29, 0.60, 0.15, 0.06, *D65_WHITE),
    "bt2020": KNOWN["lin_rec2020_scene"],
    "p3": KNOWN["lin_p3d65_scene"],
}
"""Chromaticities x and y of red, green, blue and white (ITU-T H.273, table 2)."""


@dataclass(frozen=True)
class FilmCoding:
    """How the codes of a film mean colours.

    Attributes
    ----------
    matrix : str or None
        Key of `WEIGHTS`; None: the codes are red, green and blue.
    full_range : bool
        Codes from 0 to the largest one; otherwise 16 to 235, chroma 16 to 240, of 8 bits.
    transfer : str
        As of `io.images.transfer`.
    primaries : str
        Key of `PRIMARIES`.
    bits : int
        Of a code.
    """

    matrix: str | None
    full_range: bool
    transfer: Transfer
    primaries: str = "bt709"
    bits: int = 8


def linear_pixels(codes: np.ndarray, coding: FilmCoding, transfer: Transfer | None = None) -> Pixels:
    """Return linear Rec.709 of the codes of a frame.

    Parameters
    ----------
    codes : ndarray, shape (H, W, 3), uint16
        As of `signal_of`.
    coding : FilmCoding
    transfer : str, optional
        Overrides that of the coding.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Other primaries are converted, so colours outside Rec.709 have negative values.
    """
    linear = decoded(signal_of(codes, coding), transfer or coding.transfer)
    if coding.primaries == "bt709":
        return linear
    return linear @ to_rec709(coding.primaries).T


def signal_of(codes: np.ndarray, coding: FilmCoding) -> Pixels:
    """Return red, green and blue before the transfer function; 0 is black, 1 white.

    Parameters
    ----------
    codes : ndarray, shape (H, W, 3), uint16
        Red, green and blue with 65535 as white; or Y', Cb, Cr, whose codes of b bits are shifted by 16 - b; luma of the
        full range has 65535 as white.
    coding : FilmCoding

    Returns
    -------
    ndarray, shape (H, W, 3), float32

    Notes
    -----
    ITU-R BT.709-6, item 3.4 and 3.5: R' = Y' + 2 (1 - Kr) Cr, B' = Y' + 2 (1 - Kb) Cb, and Y' is their weighted sum.
    """
    values = codes.astype(np.float32)
    if coding.matrix is None:
        return values / np.float32(65535.0)
    if coding.full_range:
        luma = values[..., 0] / np.float32(65535.0)
        # the largest code, shifted
        chroma = (values[..., 1:] - np.float32(32768.0)) / np.float32(65536 - (1 << (16 - coding.bits)))
    else:
        luma = (values[..., 0] - np.float32(16 << 8)) / np.float32(219 << 8)
        chroma = (values[..., 1:] - np.float32(128 << 8)) / np.float32(224 << 8)
    kr, kb = WEIGHTS[coding.matrix]
    red = luma + np.float32(2.0 * (1.0 - kr)) * chroma[..., 1]
    blue = luma + np.float32(2.0 * (1.0 - kb)) * chroma[..., 0]
    green = (luma - np.float32(kr) * red - np.float32(kb) * blue) / np.float32(1.0 - kr - kb)
    return np.stack((red, green, blue), axis=-1)


@lru_cache
def to_rec709(primaries: str) -> Pixels:
    """Return the matrix from linear light of some primaries to Rec.709, shape (3, 3), float32."""
    to_xyz = rgb_to_xyz(PRIMARIES[primaries])
    return (np.linalg.inv(rgb_to_xyz(PRIMARIES["bt709"])) @ to_xyz).astype(np.float32)
