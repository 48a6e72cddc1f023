"""Transfer functions: from the codes of a picture or a film, 0 to 1, to linear light."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

import numpy as np

from ...model.project.backplate import Transfer
from ...typing import Pixels
from .picture import decode_srgb

TRANSFERS: tuple[Transfer, ...] = get_args(Transfer)

HDR_WHITE_CD_M2 = 203.0
"""Luminance of white paper in pictures of high dynamic range (ITU-R BT.2408); it becomes 1."""
_HLG_WHITE = 0.75


def decoded(coded: Pixels, transfer: Transfer) -> Pixels:
    """Return linear values of codes.

    Parameters
    ----------
    coded : ndarray
        1 is white; codes above it, which video has, stay brighter. Codes below 0 count as 0.
    transfer : {"srgb", "linear", "rec709", "gamma22", "gamma28", "pq", "hlg"}

    Returns
    -------
    ndarray, float32
        1 is the white of a display; of pq and hlg, white paper, whose highlights are brighter.

    Notes
    -----
    srgb: IEC 61966-2-1. rec709: inverse of the camera's curve of ITU-R BT.709, which BT.601 and BT.2020 share. pq:
    SMPTE ST 2084, in units of 203 cd/m2. hlg: inverse of the camera's curve of ITU-R BT.2100, in units of its code
    0.75. `tests/io/images/test_transfer.py` compares them with colour-science.

    Examples
    --------
    >>> decoded(np.array([0.0, 0.5, 1.0], np.float32), "rec709").round(4).tolist()
    [0.0, 0.25959998369216919, 1.0]
    """
    codes = np.maximum(np.asarray(coded, np.float32), np.float32(0.0))
    return _CURVES[transfer](codes).astype(np.float32, copy=False)


def white_of(transfer: Transfer) -> float:
    """Return the value at which codes of a transfer function clip.

    Examples
    --------
    >>> white_of("srgb"), round(white_of("pq"), 2)
    (1.0, 49.26)
    """
    return float(decoded(np.ones(1, np.float32), transfer)[0])


def encoded_rec709(light: Pixels) -> Pixels:
    """Return the codes of linear light from 0 to 1, by the camera's curve of ITU-R BT.709; the inverse of `decoded`."""
    return np.where(light < 0.018, 4.5 * light, 1.099 * np.maximum(light, 0.018) ** 0.45 - 0.099)


def _rec709(codes: Pixels) -> Pixels:
    return np.where(codes < 0.081, codes / 4.5, ((codes + 0.099) / 1.099) ** (1.0 / 0.45))


def _pq(codes: Pixels) -> Pixels:
    m1, m2 = 2610.0 / 16384.0, 2523.0 / 32.0
    c1, c2, c3 = 3424.0 / 4096.0, 2413.0 / 128.0, 2392.0 / 128.0
    root = np.minimum(codes.astype(np.float64), 1.0) ** (1.0 / m2)
    light = 10000.0 * (np.maximum(root - c1, 0.0) / (c2 - c3 * root)) ** (1.0 / m1)
    return (light / HDR_WHITE_CD_M2).astype(np.float32)


def _hlg(codes: Pixels) -> Pixels:
    found: Pixels = (_hlg_scene(codes.astype(np.float64)) / _hlg_scene(np.float64(_HLG_WHITE))).astype(np.float32)
    return found


def _hlg_scene(codes: np.ndarray | np.float64) -> np.ndarray:
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    return np.where(codes <= 0.5, codes**2 / 3.0, (np.exp((codes - c) / a) + b) / 12.0)


_CURVES: dict[Transfer, Callable[[Pixels], Pixels]] = {
    "srgb": decode_srgb,
    "linear": lambda codes: codes,
    "rec709": _rec709,
    "gamma22": lambda codes: codes**2.2,
    "gamma28": lambda codes: codes**2.8,
    "pq": _pq,
    "hlg": _hlg,
}
