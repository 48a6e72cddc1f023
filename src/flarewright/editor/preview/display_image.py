"""Convert linear light to a picture for the screen: exposure, look, JPEG."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from ...render.image.display import view
from ...typing import Pixels
from ..session.view_settings import View

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
MIDDLE_GREY = 0.18
# false colours: upper limits in stops around middle grey, and the colour of each range
FALSE_COLOURS: tuple[tuple[float, tuple[int, int, int]], ...] = (
    (-8.0, (8, 8, 10)),
    (-6.0, (58, 28, 92)),
    (-4.0, (36, 56, 150)),
    (-2.0, (30, 120, 160)),
    (-0.5, (40, 130, 80)),
    (0.5, (128, 128, 128)),
    (1.5, (150, 160, 60)),
    (2.5, (215, 180, 60)),
    (3.5, (225, 120, 50)),
    (99.0, (214, 50, 48)),
)


def pixels_of(light: Pixels, exposure_stops: float, look: View, plate: Pixels | None = None) -> NDArray[np.uint8]:
    """Return sRGB pixels of a linear picture.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3)
        Linear Rec.709.
    exposure_stops : float
    look : View
    plate : ndarray, shape (H, W, 3), optional
        Linear background with its own brightness, added before the look is applied.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8
    """
    if plate is not None:
        light = light * np.float32(2.0**exposure_stops) + plate * np.float32(2.0**look.plate_stops)
        exposure_stops = 0.0
    if look.look == "false-colour":
        return _false_colour(light * np.float32(2.0**exposure_stops))
    return view(light, exposure_stops, look.look)


def _false_colour(light: Pixels) -> NDArray[np.uint8]:
    stops = np.log2(np.maximum(light @ LUMINANCE, 1e-12) / MIDDLE_GREY)
    limits = np.array([limit for limit, _ in FALSE_COLOURS[:-1]])
    colours = np.array([colour for _, colour in FALSE_COLOURS], dtype=np.uint8)
    return np.asarray(colours[np.searchsorted(limits, stops)])


def jpeg(pixels: NDArray[np.uint8], quality: int = 82) -> bytes:
    """Encode sRGB pixels as JPEG; without chroma subsampling from quality 90."""
    from PIL import Image

    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, format="JPEG", quality=quality, subsampling=0 if quality >= 90 else 2)
    return buffer.getvalue()


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Encode pixels, with or without an alpha channel, as PNG."""
    from PIL import Image

    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, format="PNG", compress_level=1)
    return buffer.getvalue()
