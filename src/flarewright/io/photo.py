"""Photographs in linear numbers, read in bands of rows: camera RAW, linear TIFF, EXR, NPY.

A RAW file's mosaic is not interpolated: two by two photosites make one pixel (red, the mean of two greens, blue), so
that the noise of a pixel stays its own. Red and blue then lie a quarter of a pixel off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError, OutputError

_RAW = (".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".rw2", ".orf", ".pef", ".srw", ".raw", ".crw", ".nrw", ".3fr")
_TIFF = (".tif", ".tiff")
PHOTO_SUFFIXES = (*_RAW, *_TIFF, ".exr", ".npy")

Band = NDArray[np.float32]

# EXIF tags of the Exif IFD: exposure time, f-number, ISO speed, focal length
_EXIF = {33434: "exposure_s", 33437: "f_number", 34855: "iso", 37386: "focal_mm"}
_EXIF_IFD = 0x8769


@dataclass(frozen=True)
class Photo:
    """An opened photograph.

    Attributes
    ----------
    path : Path
    size_px : tuple of int
        Width and height, of a RAW file that of its blocks of two by two.
    rows : callable
        rows(low, high) returns the numbers of these rows, shape (high - low, width, 3), float32; a pixel of which a
        part was clipped has at least `white_level`.
    black_level : tuple of float
        Of red, green and blue; 0 when the file does not tell.
    white_level : float or None
        The least number that is clipped; None when the file does not tell.
    samples : tuple of int
        How many readings were averaged into each number of red, green and blue.
    step : float
        By how much two numbers of the file differ at least; 0 for floating point.
    white_balance : tuple of float
        The camera's own multipliers, green 1.
    """

    path: Path
    size_px: tuple[int, int]
    rows: Callable[[int, int], Band]
    black_level: tuple[float, float, float] = (0.0, 0.0, 0.0)
    white_level: float | None = None
    samples: tuple[int, int, int] = (1, 1, 1)
    step: float = 1.0
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)


def open_photo(path: Path, white_level: float | None = None, block: int = 1) -> Photo:
    """Open a photograph.

    Parameters
    ----------
    path : Path
    white_level : float, optional
        Overrides the file's.
    block : int
        Average so many by so many pixels into one; rows and columns that are left over are dropped.

    Returns
    -------
    Photo

    Raises
    ------
    FlarewrightError
        When the file is missing, damaged, of another kind, or not linear.
    """
    if not path.is_file():
        raise FlarewrightError(f"{path} does not exist: check the path and the spelling")
    suffix = path.suffix.lower()
    if suffix in _RAW:
        photo = _open_raw(path, white_level)
    elif suffix in _TIFF:
        photo = _from_array(path, _tiff_pixels(path), white_level)
    elif suffix == ".npy":
        photo = _from_array(path, _npy_pixels(path), white_level)
    elif suffix == ".exr":
        photo = _from_array(path, _exr_pixels(path), white_level)
    else:
        raise FlarewrightError(
            f"{path} is no photograph in linear numbers; give camera RAW ({', '.join(_RAW[:5])} ...), linear TIFF, EXR "
            "or NPY"
        )
    return photo if block == 1 else _blocks(photo, block)


def photo_facts(path: Path) -> dict[str, float]:
    """Return what a photograph tells of its exposure_s, iso, f_number and focal_mm.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict of str to float
        What it tells; empty for formats without EXIF.

    Raises
    ------
    FlarewrightError
        When a RAW file is damaged.
    """
    suffix = path.suffix.lower()
    if suffix not in (*_RAW, *_TIFF):
        return {}
    from PIL import Image

    # most RAW formats are TIFF inside, and Pillow reads their EXIF without the picture
    try:
        with Image.open(path) as image:
            tags = image.getexif()
            table = {**tags, **tags.get_ifd(_EXIF_IFD)}
    except (OSError, ValueError, SyntaxError):
        table = {}
    facts = {name: _number(table[tag]) for tag, name in _EXIF.items() if tag in table}
    return {name: value for name, value in facts.items() if value > 0.0}


def _number(value: Any) -> float:
    """Return an EXIF value, of which there may be several, as one number; 0 when it is none."""
    try:
        return float(value[0] if isinstance(value, tuple) else value)
    except (TypeError, ValueError, ZeroDivisionError, IndexError):
        return 0.0


def _from_array(path: Path, pixels: NDArray[Any], white_level: float | None) -> Photo:
    if pixels.ndim == 2:
        pixels = np.broadcast_to(pixels[..., None], (*pixels.shape, 3))
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or 0 in pixels.shape or pixels.dtype.kind not in "uif":
        raise FlarewrightError(
            f"{path} holds {pixels.dtype} {pixels.shape}, no picture: rows, columns and RGB are needed"
        )
    if pixels.dtype == np.uint8:
        raise FlarewrightError(f"{path} has 8 bits a channel, which are not linear: develop it as linear 16-bit TIFF")
    if white_level is None and pixels.dtype.kind == "u":
        white_level = float(np.iinfo(pixels.dtype).max)

    def rows(low: int, high: int) -> Band:
        return np.ascontiguousarray(pixels[low:high, :, :3], dtype=np.float32)

    step = 0.0 if pixels.dtype.kind == "f" else 1.0
    return Photo(path, (pixels.shape[1], pixels.shape[0]), rows, white_level=white_level, step=step)


def _npy_pixels(path: Path) -> NDArray[Any]:
    try:
        pixels: NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError):
        raise FlarewrightError(f"{path} cannot be read as an NPY file: photograph or convert it again") from None
    return pixels


def _exr_pixels(path: Path) -> NDArray[Any]:
    from .exr import read_exr

    try:
        first = read_exr(path).layers[0]
    except (OutputError, KeyError, ValueError):
        raise FlarewrightError(f"{path} cannot be read as an EXR file with R, G and B: convert it again") from None
    return first.pixels


def _tiff_pixels(path: Path) -> NDArray[Any]:
    tifffile = _extra("tifffile", path)
    try:
        with tifffile.TiffFile(path) as file:
            page = file.pages[0]
            if page.is_memmappable:
                pixels: NDArray[Any] = tifffile.memmap(path, page=0, mode="r")
            else:
                pixels = page.asarray()
    except (OSError, ValueError, KeyError, IndexError, TypeError, tifffile.TiffFileError) as error:
        raise FlarewrightError(f"{path} cannot be read as a TIFF file ({_short(error)}): convert it again") from None
    return pixels


def _open_raw(path: Path, white_level: float | None) -> Photo:
    rawpy = _extra("rawpy", path)
    try:
        with rawpy.imread(str(path)) as raw:
            if raw.raw_pattern is None or raw.raw_pattern.shape != (2, 2) or raw.raw_image_visible.ndim != 2:
                raise FlarewrightError(
                    f"{path} has no mosaic of two by two colours: develop it as linear 16-bit TIFF and give that"
                )
            sites = raw.raw_image_visible.copy()
            colors = [raw.color_desc.decode("ascii", "replace")[k] for k in raw.raw_colors_visible[:2, :2].flat]
            black = [float(raw.black_level_per_channel[k]) for k in raw.raw_colors_visible[:2, :2].flat]
            white = float(raw.white_level) if white_level is None else white_level
            camera = [float(value) for value in raw.camera_whitebalance[:3]]
    except (rawpy.LibRawError, OSError, ValueError) as error:
        raise FlarewrightError(f"{path} cannot be read as a RAW file ({_short(error)}): copy it again") from None
    if sorted(colors) != ["B", "G", "G", "R"]:
        raise FlarewrightError(f"{path} has photosites {''.join(colors)}, not red, green and blue: develop it as TIFF")
    balance = tuple(value / camera[1] for value in camera) if min(camera) > 0.0 else (1.0, 1.0, 1.0)
    return _mosaic(path, sites, colors, black, white, (balance[0], balance[1], balance[2]))


def _mosaic(
    path: Path, sites: NDArray[Any], colors: list[str], black: list[float], white: float,
    balance: tuple[float, float, float],
) -> Photo:  # fmt: skip
    """Make one pixel of two by two photosites."""
    height, width = sites.shape[0] // 2, sites.shape[1] // 2
    at = {color: [divmod(k, 2) for k, name in enumerate(colors) if name == color] for color in "RGB"}
    levels = [float(np.mean([black[k] for k, name in enumerate(colors) if name == color])) for color in "RGB"]

    def rows(low: int, high: int) -> Band:
        band = np.empty((high - low, width, 3), np.float32)
        part = sites[2 * low : 2 * high, : 2 * width]
        for c, color in enumerate("RGB"):
            planes = [part[y::2, x::2].astype(np.float32) for y, x in at[color]]
            mean = np.mean(planes, axis=0)
            band[..., c] = np.where(np.max(planes, axis=0) >= white, np.maximum(mean, white), mean)
        return band

    black_level = (levels[0], levels[1], levels[2])
    return Photo(path, (width, height), rows, black_level, white, (1, 2, 1), white_balance=balance)


def _blocks(photo: Photo, block: int) -> Photo:
    """Average square blocks of pixels; a block with a clipped pixel counts as clipped."""
    width, height = photo.size_px[0] // block, photo.size_px[1] // block
    if width == 0 or height == 0:
        raise FlarewrightError(f"{photo.path} has no room for blocks of {block} pixels; choose smaller ones")
    white = photo.white_level

    def rows(low: int, high: int) -> Band:
        band = photo.rows(low * block, high * block)[:, : width * block]
        parts = band.reshape(high - low, block, width, block, 3)
        mean: Band = parts.mean(axis=(1, 3), dtype=np.float32)
        if white is not None:
            clipped = parts.max(axis=(1, 3)) >= white
            mean[clipped] = np.maximum(mean[clipped], np.float32(white))
        return mean

    red, green, blue = photo.samples
    samples = (red * block**2, green * block**2, blue * block**2)
    return replace(photo, size_px=(width, height), rows=rows, samples=samples)


def _extra(name: str, path: Path) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        raise FlarewrightError(f"{path} needs the package {name}: pip install 'flarewright[photo]'") from None


def _short(error: BaseException) -> str:
    text = error.args[0] if error.args else type(error).__name__
    text = text.decode("ascii", "replace") if isinstance(text, bytes) else str(text)
    return " ".join(text.split())[:120].rstrip(".")
