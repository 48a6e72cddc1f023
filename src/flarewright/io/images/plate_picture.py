"""Read a plate: a photograph or a rendered picture of a scene, with linear values and what its file states."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from fractions import Fraction
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError, optional
from ...model.project.backplate import Transfer
from ...model.project.camera import Colorspace
from ...typing import Pixels
from ..files.door import outside, refuse_claim, shown
from .exr import CHROMATICITIES
from .foreign_exr import read_exr_layer
from .half import HALF_MAX
from .picture import SCREEN
from .tiff_numbers import refuse_inks
from .transfer import decoded, white_of

_TIFF = (".tif", ".tiff")
PLATE_SUFFIXES = (".exr", *_TIFF, *SCREEN)
"""Kinds of files that a plate can be."""

# largest difference of chromaticity coordinates of the same primaries; files round them differently
_SAME_PRIMARIES = 2e-3


@dataclass(frozen=True)
class PlatePicture:
    """A plate, read.

    Attributes
    ----------
    pixels : ndarray, shape (H, W, 3), float32
        Linear values, row 0 at the top.
    white : float or None
        Value at which the file clips; None for floating-point numbers, which do not clip.
    transfer : str
        How its codes were read (`transfer.decoded`).
    colorspace : {"rec709", "acescg"} or None
        Primaries that the file states; None if it states none, or others.
    pixel_aspect : float
    fps : Fraction or None
    header : dict or None
        Attributes of an EXR file that stay with the picture: timeCode and the camera's.
    remarks : tuple of str
    window : tuple of slice
        Rows and columns for which the file has values; the others are black.
    """

    pixels: Pixels
    white: float | None
    transfer: Transfer
    colorspace: Colorspace | None = None
    pixel_aspect: float = 1.0
    fps: Fraction | None = None
    header: dict[str, Any] | None = None
    remarks: tuple[str, ...] = ()
    window: tuple[slice, slice] = (slice(None), slice(None))

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.pixels.shape[1], self.pixels.shape[0]


# attributes of OpenEXR's standard list that describe the photograph, not the file
_KEPT = (
    "timeCode", "keyCode", "owner", "capDate", "utcOffset", "isoSpeed", "expTime", "reelName",
    "cameraMake", "cameraModel", "cameraSerialNumber", "imageCounter",
)  # fmt: skip


def read_plate(
    path: str | os.PathLike[str], *, layer: str | None = None, transfer: Transfer | None = None
) -> PlatePicture:
    """Read a plate.

    Parameters
    ----------
    path : path
        EXR (half, float or integer; any layer; within its display window), or TIFF, PNG, JPEG, WebP with 8 bits; TIFF
        also with 16 bits or floating-point numbers (extra `photo`).
    layer : str, optional
        Layer of an EXR file; None: its plain colours.
    transfer : str, optional
        What codes mean (`transfer.decoded`). None: srgb for whole numbers, linear for floating-point numbers.

    Raises
    ------
    FileError
        The file is missing, damaged, too large, of another kind, or has no such layer.

    Examples
    --------
    >>> plate = read_plate("drive.1001.exr", layer="beauty")                    # doctest: +SKIP
    >>> plate.size_px                                                           # doctest: +SKIP
    (1920, 1080)
    """
    place = Path(path)
    suffix = place.suffix.lower()
    if suffix == ".exr":
        return _exr(place, layer, transfer)
    if layer is not None:
        raise FileError(f"{shown(place)} has no layers, so there is no {layer!r}: omit the layer, or give an EXR file")
    if suffix in _TIFF:
        return _tiff(place, transfer)
    if suffix in SCREEN:
        return _screen(place, transfer)
    raise FileError(f"{shown(place)} is no plate: give EXR, TIFF, PNG, JPEG or WebP; develop a RAW file first")


def _exr(path: Path, layer: str | None, transfer: Transfer | None) -> PlatePicture:
    pixels, header = read_exr_layer(path, layer, "a plate")
    pixels, damaged = _finite(pixels)
    kept = {name: header[name] for name in _KEPT if name in header}
    space, remarks = _primaries(header)
    kind: Transfer = transfer or "linear"
    if kind != "linear":
        pixels = decoded(np.clip(pixels, 0.0, 1.0), kind)
    return PlatePicture(
        pixels,
        None if kind == "linear" else white_of(kind),
        kind,
        space,
        float(header.get("pixelAspectRatio", 1.0)),
        _rate(header.get("framesPerSecond")),
        kept,
        (*damaged, *remarks),
        _window(header),
    )


def _window(header: dict[str, Any]) -> tuple[slice, slice]:
    """Return the rows and columns of the data window within the display window; all if they do not meet."""
    (low, high), data = header["displayWindow"], header["dataWindow"]
    columns, rows = (
        slice(max(int(data[0][k]) - int(low[k]), 0), min(int(data[1][k]), int(high[k])) - int(low[k]) + 1)
        for k in range(2)
    )
    if rows.stop <= rows.start or columns.stop <= columns.start:
        return slice(None), slice(None)
    return rows, columns


def _finite(pixels: Pixels) -> tuple[Pixels, tuple[str, ...]]:
    """Return pixels whose infinite values are the largest half float, and those that are no numbers 0; and a remark.

    A sun or a lamp brighter than half floats reach is written as infinite; black would remove it from the plate.
    """
    finite = np.isfinite(pixels)
    if finite.all():
        return pixels, ()
    count = int((~finite).any(axis=2).sum())
    words = f"{count} pixels of the plate are infinite or no number: they count as {HALF_MAX:g}, or 0"
    return np.nan_to_num(pixels, nan=0.0, posinf=HALF_MAX, neginf=0.0), (words,)


def _primaries(header: dict[str, Any]) -> tuple[Colorspace | None, tuple[str, ...]]:
    """Return the colour space that the attribute chromaticities states."""
    stated = header.get("chromaticities")
    if stated is None:
        return None, ()
    given = np.asarray(stated, dtype=np.float64).ravel()
    for space, known in CHROMATICITIES.items():
        if given.shape == (8,) and np.abs(given - known).max() < _SAME_PRIMARIES:
            return space, ()
    return None, ("the plate states primaries that are neither Rec.709 nor ACEScg; they are read as Rec.709",)


def _rate(stated: Any) -> Fraction | None:
    """Return frames per second from OpenEXR's rational number."""
    if stated is None:
        return None
    try:
        rate = Fraction(stated)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return rate if 0 < rate <= 1000 else None


def _screen(path: Path, transfer: Transfer | None) -> PlatePicture:
    from PIL import Image, ImageOps

    with outside(path, "a plate", pixel_bytes=16, remedy="give PNG, JPEG or EXR") as file, Image.open(file) as image:
        if image.mode.startswith("I"):
            # 16-bit grey, which Pillow would convert to white
            grey = np.asarray(image, dtype=np.float32) / np.float32(65535.0)
            return _decoded(np.repeat(grey[..., None], 3, axis=2), transfer, ())
        deep = image.format == "PNG" and _depth(image) > 8
        # viewers apply the camera's orientation tag
        upright = ImageOps.exif_transpose(image)
        alpha = None
        if upright.has_transparency_data:
            upright = upright.convert("RGBA")
            alpha = np.asarray(upright.getchannel("A"), dtype=np.float32)[..., None] / np.float32(255.0)
        coded = np.asarray(upright.convert("RGB"), dtype=np.float32) / np.float32(255.0)
    remarks = ("the plate has 16 bits, of which a PNG's first 8 are read; give TIFF or EXR for all",) if deep else ()
    found = _decoded(coded, transfer, remarks)
    # transparent pixels have no light, whatever colour they store
    return found if alpha is None else replace(found, pixels=found.pixels * alpha)


def _depth(image: Any) -> int:
    """Return the bits a channel of an open PNG; Pillow converts 16 bits of colours to 8 without a word."""
    mode = image.tile[0].args if image.tile else ""
    mode = mode[0] if isinstance(mode, tuple) else mode
    return 16 if "16" in str(mode) else 8


def _tiff(path: Path, transfer: Transfer | None) -> PlatePicture:
    tifffile = optional("tifffile", "photo", f"reading {shown(path)}")
    with outside(path, "a plate", remedy="save it as EXR or 16-bit TIFF") as stream, tifffile.TiffFile(stream) as file:
        page = file.pages[0]
        shape, size = tuple(page.shape), np.dtype(page.dtype).itemsize
        # the values, and linear pixels
        refuse_claim(path, " x ".join(map(str, shape)), prod(shape) * (size + 8))
        values = np.asarray(page.asarray())
        refuse_inks(path, page)
        if values.ndim == 3 and values.shape[0] in (3, 4) and values.shape[2] not in (3, 4):
            values = np.moveaxis(values, 0, 2)
        if values.ndim == 2:
            values = np.repeat(values[..., None], 3, axis=2)
        if values.ndim != 3 or values.shape[2] not in (3, 4) or values.dtype.kind not in "uf":
            raise ValueError(f"it holds {values.dtype} {values.shape}, no picture")
    values = values[..., :3]
    if values.dtype.kind == "u":
        return _decoded((values / np.float32(np.iinfo(values.dtype).max)).astype(np.float32), transfer, ())
    with np.errstate(over="ignore"):
        pixels, damaged = _finite(values.astype(np.float32))
    if transfer not in (None, "linear"):
        return _decoded(np.clip(pixels, 0.0, 1.0), transfer, damaged)
    return PlatePicture(pixels, None, "linear", remarks=damaged)


def _decoded(coded: Pixels, transfer: Transfer | None, remarks: tuple[str, ...]) -> PlatePicture:
    """Return a plate of codes from 0 to 1."""
    kind: Transfer = transfer or "srgb"
    if transfer is None:
        remarks = (*remarks, "the plate has display codes, decoded from sRGB; --plate-transfer linear reads them as is")
    return PlatePicture(decoded(coded, kind), white_of(kind), kind, "rec709", remarks=remarks)
