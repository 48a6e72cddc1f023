"""Photographs as linear pixel values, read in bands of rows: camera RAW, linear TIFF, EXR, NPY.

The mosaic of a RAW file is not interpolated: two by two photosites make one pixel (red, the mean of two greens, blue),
so that the noise of pixels is independent. Red and blue are then displaced by a quarter of a pixel.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, prod
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...errors import FileError, FlarewrightError, OutputError, optional
from ...model.measurement.capture import Matrix3
from ...typing import Pixels
from ..files.door import no_file, outside, refuse_claim
from ..files.silence_libraries import silenced
from .tiff_numbers import refuse_inks

_RAW = (".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".rw2", ".orf", ".pef", ".srw", ".raw", ".crw", ".nrw", ".3fr")
_TIFF = (".tif", ".tiff")
PHOTO_SUFFIXES = (*_RAW, *_TIFF, ".exr", ".npy")

# EXIF tags of the Exif IFD: exposure time, f-number, ISO speed, focal length
_EXIF = {33434: "exposure_s", 33437: "f_number", 34855: "iso", 37386: "focal_mm"}
_EXIF_IFD = 0x8769
# of a float picture: the squares of larger values leave the range of 32-bit floats, and their sums overflow
_LARGEST_VALUE = 1e12


@dataclass(frozen=True)
class Photo:
    """An open photograph.

    Attributes
    ----------
    path : Path
    size_px : tuple of int
        Width and height; for a RAW file, of its two-by-two blocks.
    rows : callable
        rows(low, high) returns the pixel values of these rows, shape (high - low, width, 3), float32; a pixel with a
        clipped part has at least `white_level`.
    black_level : tuple of float
        Of red, green and blue; 0 when the file does not state it.
    white_level : float or None
        The smallest clipped value; None when the file does not state it.
    samples : tuple of int
        Number of photosite readings averaged into each value of red, green and blue.
    step : float
        Quantization step of the file's values; 0 for floating point.
    white_balance : tuple of float or None
        The camera's multipliers, green 1; None when the file does not state them.
    to_rec709 : tuple of 3 tuples of 3 float, or None
        From values above black, before white balance, to linear Rec.709; None when the file does not state it.
    side : int
        Side of the square of file pixels, or photosites, that makes one pixel here.
    """

    path: Path
    size_px: tuple[int, int]
    rows: Callable[[int, int], Pixels]
    black_level: tuple[float, float, float] = (0.0, 0.0, 0.0)
    white_level: float | None = None
    samples: tuple[int, int, int] = (1, 1, 1)
    step: float = 1.0
    white_balance: tuple[float, float, float] | None = None
    to_rec709: Matrix3 | None = None
    side: int = 1


def open_photo(path: Path, white_level: float | None = None, block: int = 1) -> Photo:
    """Open a photograph.

    Parameters
    ----------
    path : Path
    white_level : float, optional
        Overrides the value in the file.
    block : int
        Average blocks of `block` x `block` pixels; incomplete blocks are dropped.

    Raises
    ------
    FlarewrightError
        When the file is missing, damaged, of an unknown format, or not linear.
    """
    if not path.is_file():
        raise FlarewrightError(f"{path} {no_file(path)}: check the path and the spelling")
    suffix = path.suffix.lower()
    if suffix in _RAW:
        photo = _open_raw(path, white_level)
    elif suffix in _TIFF:
        photo = _from_array(path, _tiff_picture(path), white_level)
    elif suffix == ".npy":
        photo = _from_array(path, _npy_picture(path), white_level)
    elif suffix == ".exr":
        photo = _from_array(path, _exr_picture(path), white_level)
    else:
        raise FlarewrightError(
            f"{path} is no photograph with linear values; give RAW ({', '.join(_RAW[:5])} ...), linear TIFF, EXR or NPY"
        )
    return photo if block == 1 else _blocks(photo, block)


def photo_facts(path: Path) -> dict[str, float]:
    """Return exposure_s, iso, f_number and focal_mm of a photograph from its EXIF tags.

    Returns
    -------
    dict of str to float
        The values that the file states; empty for formats without EXIF.

    Raises
    ------
    FlarewrightError
        When a RAW file is damaged.
    """
    suffix = path.suffix.lower()
    if suffix not in (*_RAW, *_TIFF):
        return {}
    from PIL import Image

    # most RAW formats are TIFF containers; Pillow reads their tags even when it cannot read the image
    tags: dict[int, Any] = {}
    exif = Image.Exif()
    # another container, which the RAW decoder may support; for a damaged file, its exception gives the error sentence
    with suppress(FileError), outside(path, "a photograph") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        exif.load_from_fp(file)
        tags = {**exif, **exif.get_ifd(_EXIF_IFD)}
    facts = {name: _number(tags[tag]) for tag, name in _EXIF.items() if tag in tags}
    if "exposure_s" not in facts and suffix in _RAW:
        with _raw(_extra("rawpy", path), path) as raw:
            other = getattr(raw, "other", None)
            names = {"exposure_s": "shutter", "iso": "iso_speed", "f_number": "aperture", "focal_mm": "focal_len"}
            facts = {name: _number(getattr(other, field, 0.0)) for name, field in names.items()}
    return {name: value for name, value in facts.items() if 0.0 < value < inf}


def _number(value: Any) -> float:
    """Return an EXIF value as one number, the first of several; 0 when it is not a number."""
    try:
        return float(value[0] if isinstance(value, tuple) else value)
    except (TypeError, ValueError, ZeroDivisionError, IndexError):
        return 0.0


@dataclass(frozen=True)
class _Picture:
    """An array in a file, read only when needed: a run has hundreds of files."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    load: Callable[[], NDArray[Any]]


def _from_array(path: Path, picture: _Picture, white_level: float | None) -> Photo:
    shape, dtype = picture.shape, picture.dtype
    if (
        len(shape) not in (2, 3)
        or (len(shape) == 3 and shape[2] not in (3, 4))
        or 0 in shape
        or dtype.kind not in "uif"
    ):
        raise FlarewrightError(f"{path} holds {dtype} {shape}, no picture: an array of rows, columns and RGB is needed")
    if dtype == np.uint8:
        raise FlarewrightError(f"{path} has 8 bits a channel, which are not linear: develop it as linear 16-bit TIFF")
    if white_level is None and dtype.kind == "u":
        white_level = float(np.iinfo(dtype).max)
    load = lru_cache(maxsize=1)(picture.load)

    def rows(low: int, high: int) -> Pixels:
        part = load()[low:high]
        if part.ndim == 2:
            part = np.broadcast_to(part[..., None], (*part.shape, 3))
        # a NaN is the largest of all
        largest = np.abs(part[..., :3]).max(initial=0.0) if dtype.kind == "f" else 0.0
        if not np.isfinite(largest):
            raise FlarewrightError(f"{path} has pixels that are infinite or NaN: convert it again")
        if largest > _LARGEST_VALUE:
            raise FlarewrightError(f"{path} has pixels above {_LARGEST_VALUE:g}, as no camera has: convert it again")
        return np.ascontiguousarray(part[..., :3], dtype=np.float32)

    return Photo(path, (shape[1], shape[0]), rows, white_level=white_level, step=0.0 if dtype.kind == "f" else 1.0)


def _npy_picture(path: Path) -> _Picture:
    def load() -> NDArray[Any]:
        with outside(path, "an NPY file", remedy="photograph or convert it again"):
            pixels: NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
            if not isinstance(pixels, np.ndarray):
                raise ValueError("it is an archive of arrays")
        return pixels

    pixels = load()
    return _Picture(pixels.shape, pixels.dtype, load)


def _exr_picture(path: Path) -> _Picture:
    from .exr import exr_size, read_exr

    problem = f"{path} cannot be read as an EXR file with R, G and B"

    def load() -> NDArray[Any]:
        try:
            return read_exr(path).layers[0].pixels
        except OutputError as error:
            raise FlarewrightError(f"{problem}: convert it again ({error})") from None

    try:
        width, height = exr_size(path)
    except OutputError as error:
        raise FlarewrightError(f"{problem}: convert it again ({error})") from None
    return _Picture((height, width, 3), np.dtype(np.float32), load)


def _tiff_picture(path: Path) -> _Picture:
    tifffile = _extra("tifffile", path)
    what, remedy = "a TIFF file", "convert it again"

    def load() -> NDArray[Any]:
        with outside(path, what, remedy=remedy):
            if mapped:
                pixels: NDArray[Any] = tifffile.memmap(path, page=0, mode="r")
            else:
                pixels = tifffile.imread(path, key=0)
        return pixels

    with outside(path, what, remedy=remedy) as stream, tifffile.TiffFile(stream) as file:
        page = file.pages[0]
        refuse_inks(path, page)
        mapped = bool(page.is_memmappable)
        shape, dtype = tuple(page.shape), np.dtype(page.dtype)
        if not mapped:
            refuse_claim(path, " x ".join(map(str, shape)), prod(shape) * dtype.itemsize)
        return _Picture(shape, dtype, load)


def _open_raw(path: Path, white_level: float | None) -> Photo:
    rawpy = _extra("rawpy", path)

    def load() -> NDArray[Any]:
        with _raw(rawpy, path) as raw:
            sites: NDArray[Any] = raw.raw_image_visible.copy()
        return sites

    with _raw(rawpy, path) as raw:
        pattern = raw.raw_pattern
        if pattern is None or pattern.shape != (2, 2):
            raise FlarewrightError(
                f"{path} has {_pattern_words(pattern)}, not one of two by two colours: develop it as linear "
                "16-bit TIFF and give that"
            )
        sizes = raw.sizes
        # the pattern starts at the sensor's corner; the visible area can begin at an odd row or column
        order = np.roll(pattern, (-(sizes.top_margin % 2), -(sizes.left_margin % 2)), axis=(0, 1)).ravel()
        colors = [raw.color_desc.decode("ascii", "replace")[k] for k in order]
        black = [float(raw.black_level_per_channel[k]) for k in order]
        white = float(raw.white_level) if white_level is None else white_level
        camera = [float(value) for value in raw.camera_whitebalance[:3]]
        to_rec709 = _to_rec709(raw)
        size = sizes.width // 2, sizes.height // 2
    if sorted(colors) != ["B", "G", "G", "R"]:
        raise FlarewrightError(f"{path} has photosites {''.join(colors)}, not red, green and blue: develop it as TIFF")
    balance = (camera[0] / camera[1], 1.0, camera[2] / camera[1]) if min(camera) > 0.0 else None
    levels = [float(np.mean([black[k] for k, name in enumerate(colors) if name == color])) for color in "RGB"]
    return Photo(
        path, size, _mosaic_rows(lru_cache(maxsize=1)(load), colors, size[0], white), (levels[0], levels[1], levels[2]),
        white, (1, 2, 1), white_balance=balance, to_rec709=to_rec709, side=2,
    )  # fmt: skip


def _pattern_words(pattern: NDArray[Any] | None) -> str:
    if pattern is None:
        return "no mosaic"
    return "an X-Trans mosaic" if pattern.shape == (6, 6) else f"a mosaic of {pattern.shape[0]} by {pattern.shape[1]}"


def _to_rec709(raw: Any) -> Matrix3 | None:
    """Return the decoder's matrix, which expects daylight-balanced values, for unbalanced values."""
    matrix = np.array(raw.color_matrix, dtype=np.float64)[:, :3]
    daylight = np.array(raw.daylight_whitebalance[:3], dtype=np.float64)
    if matrix.shape != (3, 3) or not (matrix.any() and np.isfinite(matrix).all() and (daylight > 0.0).all()):
        return None
    red, green, blue = (tuple(map(float, row)) for row in matrix * (daylight / daylight[1]))
    return cast(Matrix3, (red, green, blue))


@contextmanager
def _raw(rawpy: Any, path: Path) -> Iterator[Any]:
    with outside(path, "a RAW file", remedy="copy it again"), silenced(), rawpy.imread(str(path)) as raw:
        yield raw


def _mosaic_rows(
    load: Callable[[], NDArray[Any]], colors: list[str], width: int, white: float
) -> Callable[[int, int], Pixels]:
    """Average two by two photosites into one pixel."""
    at = {color: [divmod(k, 2) for k, name in enumerate(colors) if name == color] for color in "RGB"}

    def rows(low: int, high: int) -> Pixels:
        band = np.empty((high - low, width, 3), np.float32)
        part = load()[2 * low : 2 * high, : 2 * width]
        for c, color in enumerate("RGB"):
            planes = [part[y::2, x::2].astype(np.float32) for y, x in at[color]]
            mean = np.mean(planes, axis=0)
            band[..., c] = np.where(np.max(planes, axis=0) >= white, np.maximum(mean, white), mean)
        return band

    return rows


def _blocks(photo: Photo, block: int) -> Photo:
    """Average square blocks of pixels; a block with a clipped pixel is clipped."""
    width, height = photo.size_px[0] // block, photo.size_px[1] // block
    if width == 0 or height == 0:
        raise FlarewrightError(f"{photo.path} is smaller than one block of {block} pixels; choose smaller blocks")
    white = photo.white_level

    def rows(low: int, high: int) -> Pixels:
        band = photo.rows(low * block, high * block)[:, : width * block]
        parts = band.reshape(high - low, block, width, block, 3)
        mean: Pixels = parts.mean(axis=(1, 3), dtype=np.float32)
        if white is not None:
            clipped = parts.max(axis=(1, 3)) >= white
            mean[clipped] = np.maximum(mean[clipped], np.float32(white))
        return mean

    red, green, blue = photo.samples
    samples = (red * block**2, green * block**2, blue * block**2)
    return replace(photo, size_px=(width, height), rows=rows, samples=samples, side=photo.side * block)


def _extra(name: str, path: Path) -> Any:
    return optional(name, "photo", str(path))
