"""From linear light to the eight bits of a screen.

Everything before this file keeps negative and very large values. Here, at the very end, colours outside Rec.709's
triangle are brought in along the line to white, and what is brighter than white rolls off; `view_text` says so. One
function serves the PNG, the editor, the library's thumbnails, reports and movies (`kernels.screen.shown_color`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..model.camera import Colorspace
from ..model.layer import Layer

Transform = Literal["filmic", "srgb", "aces"]

# ACEScg (AP1, ACES white) to Rec.709 (D65), Bradford adaptation: from the primaries of S-2014-004 and BT.709-6,
# recomputed in tests/render/test_display.py.
ACESCG_TO_REC709: NDArray[np.float64] = np.array(
    [
        [1.70505099, -0.62179212, -0.08325887],
        [-0.13025642, 1.14080474, -0.01054832],
        [-0.02400336, -0.12896898, 1.15297233],
    ]
)

# Auto exposure puts this percentile of the lit pixels of what shall be seen at this linear display value,
_PERCENTILE = 99.5
_TARGET = 0.9
# unless more of the whole picture than this would burn out, which spikes and scattered light do together with the core
# of a star,
_BURNT_OUT = 1.5
# or a veil over all of it, its median, would come out brighter than this.
_BRIGHTEST_VEIL = 0.03
_DARKEST = 1e-30

# The sRGB curve is steepest at black, 12.92 * 255 codes per unit: no cell of [0, 1] holds more than two codes.
_CELLS = 4096


def view(
    rgb_linear: NDArray[np.float32],
    exposure_stops: float | None = None,
    transform: Transform = "filmic",
    colorspace: Colorspace = "rec709",
) -> NDArray[np.uint8]:
    """Return a picture for a screen.

    Parameters
    ----------
    rgb_linear : ndarray, shape (height, width, 3)
        Linear, scene-referred.
    exposure_stops : float or None
        The light is multiplied by 2 to this power; None takes `auto_exposure`.
    transform : {"filmic", "srgb", "aces"}
        filmic: bright light rolls off towards white; srgb: the exact sRGB curve, clipped at white. Colours outside
        Rec.709 keep their dominant wavelength in both (`kernels.screen.shown_color`). aces: ACES 2 by opencolorio.
    colorspace : {"rec709", "acescg"}
        Of `rgb_linear`.

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        sRGB-encoded.

    Raises
    ------
    FlarewrightError
        For a transform that is not known, or one that needs what is not installed.
    """
    from ..kernels.screen import encode

    if transform not in get_args(Transform):
        raise FlarewrightError(f"the view {transform!r} is unknown; choose {', '.join(get_args(Transform))}")
    if exposure_stops is None:
        exposure_stops = auto_exposure(rgb_linear, colorspace)
    light: NDArray[np.floating] = np.asarray(rgb_linear, np.float32)
    if colorspace == "acescg":
        light = light @ ACESCG_TO_REC709.T
    gain = np.float32(min(2.0**exposure_stops, float(np.finfo(np.float32).max)))
    if transform == "aces":
        from .aces_view import aces_pixels

        with np.errstate(over="ignore"):
            return aces_pixels(np.asarray(light * gain, np.float32))
    out = np.empty(light.shape, dtype=np.uint8)
    encode(np.ascontiguousarray(light, np.float32), gain, transform == "filmic", *_tables(), out)
    return out


def view_sum(
    ghosts: NDArray[np.float32],
    rest: NDArray[np.float32],
    exposure_stops: float,
    *,
    ghost_gain: Sequence[float] = (1.0, 1.0, 1.0),
    rest_gain: Sequence[float] = (1.0, 1.0, 1.0),
    corner: tuple[int, int] = (0, 0),
    transform: str = "filmic",
) -> NDArray[np.uint8]:
    """Return `view` of a sum, without the sum: for pictures that are only looked at.

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
    transform : {"filmic", "srgb"}
        As in `view`.

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        sRGB-encoded; as `view(ghosts * ghost_gain + rest * rest_gain, exposure_stops, transform)`.
    """
    # compiled code is loaded where it is called
    from ..kernels.screen import encode_sum

    exposure = 2.0**exposure_stops
    gains = (np.array(gain, dtype=np.float64) * exposure for gain in (ghost_gain, rest_gain))
    first, second = (np.minimum(gain, np.finfo(np.float32).max).astype(np.float32) for gain in gains)
    out = np.empty(ghosts.shape, dtype=np.uint8)
    encode_sum(ghosts, first, rest, second, corner, transform == "filmic", *_tables(), out)
    return out


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
    curve = {"srgb": "sRGB clipped at white", "aces": "ACES by opencolorio"}.get(
        transform, "filmic roll-off to white, sRGB"
    )
    source = "ACEScg converted to Rec.709" if colorspace == "acescg" else "Rec.709"
    gamut = "" if transform == "aces" else ", colours outside Rec.709 moved towards white"
    return f"exposure {exposure_stops:+.2f} stops{how}, {source}, {curve}{gamut}"


def auto_exposure(
    rgb_linear: NDArray[np.float32], colorspace: Colorspace = "rec709", *, ghosts: NDArray[np.float32] | None = None
) -> float:
    """Return the exposure in stops that shows faint light without burning out much of the picture.

    Parameters
    ----------
    rgb_linear : ndarray, shape (height, width, 3)
        The whole picture.
    colorspace : {"rec709", "acescg"}
    ghosts : ndarray, shape (..., 3), optional
        What shall be seen, if not all: the spikes of a star are as bright as a thousand ghosts.

    Returns
    -------
    float
        Puts the 99.5th percentile of the ghosts' lit pixels at a linear 0.9 (largest channel), or the 97.5th of the
        whole picture at 1 or its median at 0.03 where these are darker: what scatters is not burnt out, and large even
        light does not turn black into grey. Rounded to a hundredth of a stop; 0 for a black picture.
    """
    whole = _brightest(rgb_linear, colorspace)
    shown = whole if ghosts is None else _brightest(ghosts, colorspace)
    lit = shown[shown > _DARKEST]
    if lit.size == 0:
        lit = whole[whole > _DARKEST]
    if lit.size == 0:
        return 0.0
    burnt_out, veil = np.percentile(whole, [100.0 - _BURNT_OUT, 50.0])
    limits = (_TARGET / float(np.percentile(lit, _PERCENTILE)), 1.0, burnt_out), (np.inf, _BRIGHTEST_VEIL, veil)
    gain = min(min(most, value / light) if light > _DARKEST else most for most, value, light in limits)
    return round(float(np.log2(gain)), 2)


def layers_exposure(layers: Sequence[Layer], colorspace: Colorspace = "rec709") -> float:
    """Return `auto_exposure` of a render: its first layer, the beauty, and its ghosts where they have a layer."""
    ghosts = next((layer.pixels for layer in layers if layer.name == "ghosts"), None)
    return auto_exposure(layers[0].pixels, colorspace, ghosts=ghosts)


def _brightest(rgb_linear: NDArray[np.float32], colorspace: Colorspace) -> NDArray[np.float64]:
    """Return the largest channel of each pixel in Rec.709."""
    light = np.asarray(rgb_linear, np.float64)
    if colorspace == "acescg":
        light = light @ ACESCG_TO_REC709.T
    return np.asarray(light.max(axis=-1))


def srgb_oetf(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sRGB encoding of linear values in [0, 1] (IEC 61966-2-1)."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(np.maximum(light, 0.0031308), 1 / 2.4) - 0.055)
