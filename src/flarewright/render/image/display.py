"""From linear light to the 8-bit sRGB of a screen.

All earlier steps keep negative and very large values. Here colours outside the Rec.709 triangle are moved along the
line to white, and values brighter than white are compressed; `view_text` reports it. The PNG, the editor, the library's
thumbnails, reports and movies all use this module (`kernels.raster.display_codes.shown_color`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...model.layer import Layer
from ...model.project.camera import Colorspace
from ...optics.colour.rgb import brightest_channel
from ...typing import Floats, Pixels

Transform = Literal["filmic", "srgb", "aces"]

# ACEScg (AP1, ACES white) to Rec.709 (D65), Bradford adaptation: from the primaries of S-2014-004 and BT.709-6,
# recomputed in tests/render/image/test_display.py.
ACESCG_TO_REC709: Floats = np.array(
    [
        [1.70505099, -0.62179212, -0.08325887],
        [-0.13025642, 1.14080474, -0.01054832],
        [-0.02400336, -0.12896898, 1.15297233],
    ]
)

# Auto exposure maps this percentile of the lit ghost pixels to this linear display value, ...
_PERCENTILE = 99.5
_TARGET = 0.9
# ... unless a larger percentage of the whole picture would clip, as around the core of a star, ...
_BURNT_OUT = 1.5
# ... or the median of the picture would exceed this value, as with a veil.
_BRIGHTEST_VEIL = 0.03
_DARKEST = 1e-30

# The sRGB curve is steepest at black, 12.92 * 255 codes per unit: a cell of [0, 1] contains at most two codes.
_CELLS = 4096


def view(
    rgb_linear: Pixels,
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
        The light is multiplied by 2 to this power; None: `auto_exposure`.
    transform : {"filmic", "srgb", "aces"}
        filmic: bright light rolls off towards white. srgb: the exact sRGB curve up to white. Both keep the
        dominant wavelength of colours outside Rec.709 (`kernels.raster.display_codes.shown_color`). aces: ACES 2
        through opencolorio.
    colorspace : {"rec709", "acescg"}
        Of `rgb_linear`.

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        sRGB-encoded.

    Raises
    ------
    FlarewrightError
        The transform is unknown, or needs a package that is not installed.
    """
    from ...kernels.raster.display_codes import encode

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


def srgb_codes(values: Pixels) -> NDArray[np.uint8]:
    """Return the sRGB codes of linear values, each clipped to 0 and 1 by itself; NaN is black.

    Parameters
    ----------
    values : ndarray, float32

    Returns
    -------
    ndarray of the same shape, uint8
        The nearest codes, as `view` finds them for colours that it does not change.
    """
    from ...kernels.raster.display_codes import encode_clipped

    out = np.empty(values.shape, np.uint8)
    encode_clipped(np.ascontiguousarray(values, np.float32).ravel(), *_tables(), out.ravel())
    return out


def view_sum(
    ghosts: Pixels,
    rest: Pixels,
    exposure_stops: float,
    *,
    ghost_gain: Sequence[float] = (1.0, 1.0, 1.0),
    rest_gain: Sequence[float] = (1.0, 1.0, 1.0),
    corner: tuple[int, int] = (0, 0),
    transform: str = "filmic",
) -> NDArray[np.uint8]:
    """Return `view` of a weighted sum of two pictures without computing the sum, for previews.

    Parameters
    ----------
    ghosts : ndarray, shape (height, width, 3)
        Linear Rec.709.
    rest : ndarray, shape (height', width', 3)
        At least as large as `ghosts`; both C-contiguous.
    exposure_stops : float
    ghost_gain, rest_gain : sequence of float
        Red, green and blue.
    corner : tuple of int
        Row and column of `rest` at the first pixel of `ghosts`.
    transform : {"filmic", "srgb"}
        As in `view`.

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        sRGB-encoded, equal to `view(ghosts * ghost_gain + rest * rest_gain, exposure_stops, transform)`.
    """
    # imported here because it loads compiled code
    from ...kernels.raster.display_codes import encode_sum

    exposure = 2.0**exposure_stops
    gains = (np.array(gain, dtype=np.float64) * exposure for gain in (ghost_gain, rest_gain))
    first, second = (np.minimum(gain, np.finfo(np.float32).max).astype(np.float32) for gain in gains)
    out = np.empty(ghosts.shape, dtype=np.uint8)
    encode_sum(ghosts, first, rest, second, corner, transform == "filmic", *_tables(), out)
    return out


@lru_cache(maxsize=1)
def _tables() -> tuple[NDArray[np.uint8], Pixels]:
    """Return the code at the lower end of each cell of [0, 1], and the lower limit of the code after each."""
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
    """Return a sentence about a view, for file metadata and the user."""
    how = " (automatic)" if automatic else ""
    curve = {"srgb": "sRGB clipped at white", "aces": "ACES by opencolorio"}.get(
        transform, "filmic roll-off to white, sRGB"
    )
    source = "ACEScg converted to Rec.709" if colorspace == "acescg" else "Rec.709"
    gamut = "" if transform == "aces" else ", colours outside Rec.709 moved towards white"
    return f"exposure {exposure_stops:+.2f} stops{how}, {source}, {curve}{gamut}"


def auto_exposure(rgb_linear: Pixels, colorspace: Colorspace = "rec709", *, ghosts: Pixels | None = None) -> float:
    """Return the exposure in stops that shows faint light without clipping much of the picture.

    Parameters
    ----------
    rgb_linear : ndarray, shape (height, width, 3)
        The whole picture.
    colorspace : {"rec709", "acescg"}
    ghosts : ndarray, shape (..., 3), optional
        The light to expose for, if not all: the spikes of a star are as bright as a thousand ghosts.

    Returns
    -------
    float
        The 99.5th percentile of the ghosts' lit pixels becomes 0.9, linear, in the largest channel. The exposure is
        lower where the 98.5th percentile of the whole picture would exceed 1 or its median 0.03, so that scattered
        light does not clip and a veil does not turn black into grey. Rounded to 0.01 stops; 0 for a black picture.
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
    """Return `auto_exposure` for a render: for its first layer, the beauty, and its ghosts if they have a layer."""
    ghosts = next((layer.pixels for layer in layers if layer.name == "ghosts"), None)
    return auto_exposure(layers[0].pixels, colorspace, ghosts=ghosts)


def _brightest(rgb_linear: Pixels, colorspace: Colorspace) -> Floats:
    """Return the largest channel of each pixel in Rec.709."""
    light: NDArray[np.floating] = rgb_linear
    if colorspace == "acescg":
        light = np.asarray(rgb_linear, np.float64) @ ACESCG_TO_REC709.T
    return np.asarray(brightest_channel(light), np.float64)


def srgb_oetf(light: Floats) -> Floats:
    """Return the sRGB encoding of linear values in [0, 1] (IEC 61966-2-1)."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(np.maximum(light, 0.0031308), 1 / 2.4) - 0.055)
