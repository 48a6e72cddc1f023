"""From light to a picture for the screen: exposure, look, background, JPEG."""

from __future__ import annotations

from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError, ProjectError
from ..io.exr import read_exr_colour
from ..render.aces_view import aces_available
from ..render.display import view
from .view import View

Floats = NDArray[np.float32]

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
MIDDLE_GREY = 0.18
# stops below and above middle grey, and the colour that stands for what is up to there
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


def pixels_of(light: Floats, exposure_stops: float, look: View, plate: Floats | None = None) -> NDArray[np.uint8]:
    """Return sRGB pixels of a linear picture.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3)
        Linear Rec.709.
    exposure_stops : float
    look : View
    plate : ndarray, shape (H, W, 3), optional
        Linear background of its own brightness, added in front of the look.

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


def _false_colour(light: Floats) -> NDArray[np.uint8]:
    stops = np.log2(np.maximum(light @ _LUMINANCE, 1e-12) / MIDDLE_GREY)
    limits = np.array([limit for limit, _ in FALSE_COLOURS[:-1]])
    colours = np.array([colour for _, colour in FALSE_COLOURS], dtype=np.uint8)
    return np.asarray(colours[np.searchsorted(limits, stops)])


@lru_cache(maxsize=4)
def read_plate(path: str, changed_ns: int, size_px: tuple[int, int]) -> Floats:
    """Read a background picture, cut and scaled to fill a size.

    Parameters
    ----------
    path : str
        EXR, PNG or JPEG.
    changed_ns : int
        When the file was changed: a new file is read anew.
    size_px : tuple of int

    Returns
    -------
    ndarray, shape (H, W, 3)
        Linear.

    Raises
    ------
    ProjectError
        The file is no picture.
    """
    del changed_ns
    linear = _read_exr(Path(path)) if path.lower().endswith(".exr") else _read_image(Path(path))
    width, height = size_px
    high, wide = linear.shape[:2]
    zoom = max(width / wide, height / high)
    left, top = (wide - width / zoom) / 2.0, (high - height / zoom) / 2.0
    box = (max(left, 0.0), max(top, 0.0), min(wide - left, wide), min(high - top, high))
    # every pixel is the mean of what it covers: fine detail of a large plate must not flicker into steps
    return np.stack([_scaled(linear[..., channel], size_px, box) for channel in range(3)], axis=-1)


def _scaled(plane: Floats, size_px: tuple[int, int], box: tuple[float, float, float, float]) -> Floats:
    from PIL import Image

    scaled = Image.fromarray(np.ascontiguousarray(plane)).resize(size_px, Image.Resampling.BILINEAR, box=box)
    return np.asarray(scaled, dtype=np.float32)


def plate_for(look: View, size_px: tuple[int, int]) -> Floats | None:
    """Return the background of a view; None where there is none."""
    if look.plate is None:
        return None
    try:
        changed = Path(look.plate).stat().st_mtime_ns
    except OSError:
        raise ProjectError(f"the background {look.plate} is gone; choose another") from None
    return read_plate(look.plate, changed, size_px)


def _read_image(path: Path) -> Floats:
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            # grey of 16 bits has modes of its own, which become white where they are taken for 8 bits
            if image.mode.startswith("I"):
                grey = np.asarray(image, dtype=np.float32) / 65535.0
                return _linear(np.repeat(grey[..., None], 3, axis=2))
            # as the camera was held
            upright = ImageOps.exif_transpose(image)
            if not upright.has_transparency_data:
                return _linear(np.asarray(upright.convert("RGB"), dtype=np.float32) / 255.0)
            # what is clear has no light, whatever colour is kept there
            pixels = np.asarray(upright.convert("RGBA"), dtype=np.float32) / 255.0
            return np.asarray(_linear(pixels[..., :3]) * pixels[..., 3:])
    except (OSError, UnidentifiedImageError, ValueError):
        raise ProjectError(f"{path.name} is no picture that can be read; give an EXR, PNG or JPEG file") from None


def _linear(coded: Floats) -> Floats:
    """Undo the curve of sRGB."""
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _read_exr(path: Path) -> Floats:
    try:
        return read_exr_colour(path)
    except (OSError, ValueError) as error:
        raise ProjectError(f"{path.name}: this cannot be read as a background ({error})") from None


def jpeg(pixels: NDArray[np.uint8], quality: int = 82) -> bytes:
    """Encode sRGB pixels as JPEG; from a quality of 90 on without colour subsampling."""
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
