"""Convert linear light to a picture for the screen: exposure, look, background, JPEG."""

from __future__ import annotations

from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import FileError, FlarewrightError, ProjectError
from ...io.files.door import outside, shown
from ...io.images.exr import read_exr_colour
from ...io.images.picture import decode_srgb
from ...render.image.aces_view import aces_available
from ...render.image.display import view
from ...typing import Pixels
from ..session.view_settings import View

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
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
    stops = np.log2(np.maximum(light @ _LUMINANCE, 1e-12) / MIDDLE_GREY)
    limits = np.array([limit for limit, _ in FALSE_COLOURS[:-1]])
    colours = np.array([colour for _, colour in FALSE_COLOURS], dtype=np.uint8)
    return np.asarray(colours[np.searchsorted(limits, stops)])


@lru_cache(maxsize=4)
def read_plate(path: str, changed_ns: int, size_px: tuple[int, int]) -> Pixels:
    """Read a background picture, cropped and scaled to fill a size.

    Parameters
    ----------
    path : str
        EXR, PNG or JPEG.
    changed_ns : int
        Modification time of the file; a key of the cache.
    size_px : tuple of int

    Returns
    -------
    ndarray, shape (H, W, 3)
        Linear.

    Raises
    ------
    ProjectError
        When the file is no picture.
    """
    del changed_ns
    linear = _read_exr(Path(path)) if path.lower().endswith(".exr") else _read_image(Path(path))
    width, height = size_px
    high, wide = linear.shape[:2]
    zoom = max(width / wide, height / high)
    left, top = (wide - width / zoom) / 2.0, (high - height / zoom) / 2.0
    box = (max(left, 0.0), max(top, 0.0), min(wide - left, wide), min(high - top, high))
    # average over the covered area, to avoid aliasing of fine detail
    return np.stack([_scaled(linear[..., channel], size_px, box) for channel in range(3)], axis=-1)


def _scaled(plane: Pixels, size_px: tuple[int, int], box: tuple[float, float, float, float]) -> Pixels:
    from PIL import Image

    scaled = Image.fromarray(np.ascontiguousarray(plane)).resize(size_px, Image.Resampling.BILINEAR, box=box)
    return np.asarray(scaled, dtype=np.float32)


def plate_for(look: View, size_px: tuple[int, int]) -> Pixels | None:
    """Return the background of a view; None where there is none."""
    if look.plate is None:
        return None
    try:
        changed = Path(look.plate).stat().st_mtime_ns
    except OSError:
        raise ProjectError(f"the background {look.plate} is gone; choose another") from None
    return read_plate(look.plate, changed, size_px)


def _read_image(path: Path) -> Pixels:
    from PIL import Image, ImageOps

    remedy = "give an EXR, PNG or JPEG file"
    try:
        with outside(path, "a picture", pixel_bytes=16, remedy=remedy) as file, Image.open(file) as image:
            # Pillow's modes of 16-bit grey would become white if converted to 8 bits
            if image.mode.startswith("I"):
                grey = np.asarray(image, dtype=np.float32) / 65535.0
                return decode_srgb(np.repeat(grey[..., None], 3, axis=2))
            # apply the camera's orientation tag
            upright = ImageOps.exif_transpose(image)
            if not upright.has_transparency_data:
                return decode_srgb(np.asarray(upright.convert("RGB"), dtype=np.float32) / 255.0)
            # transparent pixels have no light, whatever colour they store
            pixels = np.asarray(upright.convert("RGBA"), dtype=np.float32) / 255.0
            return np.asarray(decode_srgb(pixels[..., :3]) * pixels[..., 3:])
    except FileError as error:
        raise ProjectError(str(error).replace(shown(path), path.name)) from None


def _read_exr(path: Path) -> Pixels:
    try:
        return read_exr_colour(path, "a background")
    except FileError as error:
        raise ProjectError(str(error).replace(shown(path), path.name)) from None


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


__all__ = ["FlarewrightError", "aces_available", "jpeg", "pixels_of", "plate_for", "png"]
