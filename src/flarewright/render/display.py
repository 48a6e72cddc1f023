"""From linear light to the eight bits of a screen.

Everything before this file keeps negative and very large values. Here, at the very end, negative colours (outside
Rec.709's triangle) are clamped to 0 and what is brighter than white is clipped to white; `view_text` says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..model.camera import Colorspace

Transform = Literal["srgb", "filmic"]

# ACEScg (AP1, ACES white) to Rec.709 (D65), Bradford adaptation: from the primaries of S-2014-004 and BT.709-6,
# recomputed in tests/render/test_display.py.
ACESCG_TO_REC709: NDArray[np.float64] = np.array(
    [
        [1.70505099, -0.62179212, -0.08325887],
        [-0.13025642, 1.14080474, -0.01054832],
        [-0.02400336, -0.12896898, 1.15297233],
    ]
)

_LUMINANCE_REC709 = np.array([0.2126, 0.7152, 0.0722])

# Auto exposure puts this percentile of the lit pixels at this linear display value,
_PERCENTILE = 99.0
_TARGET = 0.7
# unless a veil over the whole picture, its median, would come out brighter than this.
_BRIGHTEST_VEIL = 0.04
_DARKEST = 1e-30

# The sRGB curve is steepest at black, 12.92 * 255 codes per unit: no cell of [0, 1] holds more than two codes.
_CELLS = 4096

_GREY = 0.18
_CONTRAST = 1.2


def view(
    rgb_linear: NDArray[np.float32],
    exposure_stops: float | None = None,
    transform: Transform = "srgb",
    colorspace: Colorspace = "rec709",
) -> NDArray[np.uint8]:
    """Return a picture for a screen.

    Parameters
    ----------
    rgb_linear : ndarray, shape (height, width, 3)
        Linear, scene-referred.
    exposure_stops : float or None
        The light is multiplied by 2 to this power; None takes `auto_exposure`.
    transform : {"srgb", "filmic"}
        srgb: the exact sRGB curve, clipped at white; filmic: `filmic` first, which rolls off towards white.
    colorspace : {"rec709", "acescg"}
        Of `rgb_linear`.

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        sRGB-encoded.
    """
    if exposure_stops is None:
        exposure_stops = auto_exposure(rgb_linear, colorspace)
    light: NDArray[np.floating] = np.asarray(rgb_linear, np.float32)
    if colorspace == "acescg":
        light = light @ ACESCG_TO_REC709.T
    with np.errstate(over="ignore"):
        light = np.maximum(light * np.float32(2.0**exposure_stops), 0.0)
    if transform == "filmic":
        light = filmic(light.astype(np.float64))
    elif transform != "srgb":
        raise FlarewrightError(f"the view {transform!r} is unknown; known are srgb and filmic")
    return _encoded(np.minimum(light, 1.0))


def view_sum(
    ghosts: NDArray[np.float32],
    rest: NDArray[np.float32],
    exposure_stops: float,
    *,
    ghost_gain: Sequence[float] = (1.0, 1.0, 1.0),
    rest_gain: Sequence[float] = (1.0, 1.0, 1.0),
    corner: tuple[int, int] = (0, 0),
) -> NDArray[np.uint8]:
    """Return `view` of a sum by the sRGB curve, in a fraction of its time: for pictures that are only looked at.

    Parameters
    ----------
    ghosts : ndarray, shape (height, width, 3)
        Linear Rec.709.
    rest : ndarray, shape (height', width', 3)
        At least as large; all C-contiguous.
    exposure_stops : float
    ghost_gain, rest_gain : sequence of float
        Red, green and blue.
    corner : tuple of int
        Row and column of `rest` that lie on the first pixel.

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        sRGB-encoded; as `view(ghosts * ghost_gain + rest * rest_gain, exposure_stops)`.
    """
    # compiled code is loaded where it is called
    from ..kernels.screen import encode_sum

    exposure = 2.0**exposure_stops
    gains = (np.array(gain, dtype=np.float64) * exposure for gain in (ghost_gain, rest_gain))
    first, second = (np.minimum(gain, np.finfo(np.float32).max).astype(np.float32) for gain in gains)
    out = np.empty(ghosts.shape, dtype=np.uint8)
    encode_sum(ghosts, first, rest, second, corner, *_tables(), out)
    return out


def _encoded(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Round `srgb_oetf` of values in [0, 1] to 8 bits, by tables: a power per value would take longer than a draft."""
    codes, following = _tables()
    found = codes[(light * _CELLS).astype(np.uint16)]
    return found + (light >= following[found])


@lru_cache(maxsize=1)
def _tables() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the code at the lower end of each cell of [0, 1], and the least value of the code after each."""
    wanted = (np.arange(255) + 0.5) / 255.0
    low, high = np.zeros(255), np.ones(255)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = srgb_oetf(middle) < wanted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    following = np.append(high, np.inf).astype(np.float32)
    codes = np.searchsorted(following, np.arange(_CELLS + 1, dtype=np.float32) / _CELLS, side="right")
    return codes.astype(np.uint8), following


def view_text(exposure_stops: float, transform: Transform, colorspace: Colorspace, *, automatic: bool) -> str:
    """Return the sentence that states a view, for the file and the person."""
    how = " (automatic)" if automatic else ""
    curve = "sRGB" if transform == "srgb" else "filmic (Naka-Rushton, contrast 1.2) then sRGB"
    source = "ACEScg converted to Rec.709" if colorspace == "acescg" else "Rec.709"
    return f"exposure {exposure_stops:+.2f} stops{how}, {source}, {curve}, negative colours clamped to 0"


def auto_exposure(rgb_linear: NDArray[np.float32], colorspace: Colorspace = "rec709") -> float:
    """Return the exposure in stops that shows faint light without burning out most of it.

    Parameters
    ----------
    rgb_linear : ndarray, shape (height, width, 3)
        Best the ghosts alone: the direct image of a light is a million times brighter than they are.
    colorspace : {"rec709", "acescg"}

    Returns
    -------
    float
        Puts the 99th percentile of the luminance of all lit pixels at a linear 0.7, or the median of all pixels at
        0.04 where that is darker, so that large even ghosts do not turn black into grey. Rounded to a hundredth of a
        stop; 0 for a black picture.
    """
    light = np.asarray(rgb_linear, np.float64)
    weights = _LUMINANCE_REC709 if colorspace == "rec709" else _LUMINANCE_REC709 @ ACESCG_TO_REC709
    luminance = light @ weights
    lit = luminance[luminance > _DARKEST]
    if lit.size == 0:
        return 0.0
    gain = _TARGET / float(np.percentile(lit, _PERCENTILE))
    veil = float(np.median(luminance))
    if veil > _DARKEST:
        gain = min(gain, _BRIGHTEST_VEIL / veil)
    return round(float(np.log2(gain)), 2)


def filmic(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return light rolled off towards white like film: 0 stays 0, 0.18 stays 0.18, infinity becomes 1.

    Parameters
    ----------
    light : ndarray
        Linear, not negative.

    Returns
    -------
    ndarray of the same shape, in [0, 1)

    Notes
    -----
    The Naka-Rushton response x^c / (x^c + s), the photoreceptor curve of Reinhard and Devlin, "Dynamic Range Reduction
    Inspired by Photoreceptor Physiology", 2005, eq. 1, per channel with c = 1.2 and s so that middle grey stays.
    """
    semi_saturation = _GREY**_CONTRAST * (1.0 - _GREY) / _GREY
    # Written as 1 - s / (x^c + s), an infinite x gives 1 and not infinity over infinity.
    return np.asarray(1.0 - semi_saturation / (np.power(light, _CONTRAST) + semi_saturation))


def srgb_oetf(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sRGB encoding of linear values in [0, 1] (IEC 61966-2-1)."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(np.maximum(light, 0.0031308), 1 / 2.4) - 0.055)
