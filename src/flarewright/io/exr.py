"""OpenEXR files: layers as parts, the project in the metadata.

The first part is what every program opens: the first layer (the beauty) with plain channels R, G, B. Each further
layer is a part of its own, named after the layer, with channels `layer.R`, `layer.G`, `layer.B`, so that compositing
programs list it under its name whether they go by parts or by channel names. A file with one layer is an ordinary
single-part file. Pixels are linear and scene-referred; `chromaticities` states the primaries.

In a file of half floats all values are multiplied by a power of two (`half.half_scale`), which each part's attribute
`flarewright.scale` records. A layer with values above half's range has 32-bit channels, rounded like half floats and
compressed by PXR24, which keeps 16 bits of each and so all that is there: about a quarter larger than a layer of half
floats, where ZIP makes it about twice as large. The functions here that read pixels divide by the attribute.

The parts of single ghosts cover their own data window only, which keeps files of small ghosts small. Wide open, where
most ghosts fill the picture, 351 of them make large files all the same; `--brightest` is for that. Nuke,
Fusion, Natron and OpenImageIO place such a part where it belongs; Blender (up to 5 at least) puts it into the picture's
corner, for which `full_windows=True` writes every layer at the size of the picture.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import frexp, inf
from os import PathLike
from pathlib import Path
from threading import Lock
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError, OutputError
from ..model.camera import Colorspace
from ..model.layer import Layer
from .atomic import write_atomically
from .half import HALF_MAX, half_scale, rounded_to_half
from .quiet import quiet

# (red x, y, green x, y, blue x, y, white x, y): ITU-R BT.709-6 table 3; ACEScg as S-2014-004, AP1 with the ACES white.
CHROMATICITIES: Mapping[Colorspace, tuple[float, ...]] = {
    "rec709": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "acescg": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
}

# Names of the ASWF Color Interop Forum for the same two spaces.
_INTEROP_ID: Mapping[Colorspace, str] = {"rec709": "lin_rec709_scene", "acescg": "lin_ap1_scene"}

_PREFIX = "flarewright."
_SCALE = f"{_PREFIX}scale"
_CHANNELS = "RGB"

# the library prints to stdout what is wrong with a file; who redirects that does it for all threads
_ONE_READS = Lock()


@dataclass(frozen=True)
class ExrContents:
    """What `read_exr` finds in a file.

    Attributes
    ----------
    layers : tuple of Layer
        In the order of the file, pixels as float32 within each part's data window, the file's scale undone.
    size_px : tuple of int
        Width and height of the display window.
    pixel_type : {"half", "float"}
        Of the first part; "float" in a file of half floats when its values are above their range.
    metadata : dict of str to str
        What `write_exr` was given.
    header : dict of str to object
        All attributes of the first part.
    scale : float
        By what the first part's values are multiplied in the file.
    """

    layers: tuple[Layer, ...]
    size_px: tuple[int, int]
    pixel_type: Literal["half", "float"]
    metadata: dict[str, str]
    header: dict[str, Any] = field(default_factory=dict)
    scale: float = 1.0


def write_exr(
    path: str | PathLike[str],
    layers: Sequence[Layer],
    size_px: tuple[int, int],
    *,
    pixel_type: Literal["half", "float"] = "half",
    scale: float | None = None,
    metadata: Mapping[str, str] | None = None,
    pixel_aspect: float = 1.0,
    colorspace: Colorspace = "rec709",
    full_windows: bool = False,
) -> tuple[str, ...]:
    """Write layers into one EXR file, under a temporary name first.

    Parameters
    ----------
    path : path
    layers : sequence of Layer
        The first one becomes the part that every program opens.
    size_px : tuple of int
        Width and height of the whole picture.
    pixel_type : {"half", "float"}
        half: 16 bits a value, and for layers with values above their range, 32 bits rounded like them; variances keep
        32 bits.
    scale : float, optional
        Power of two by which all values are multiplied, those of variances by its square: `exr_scale(project)`. None:
        1024 for half floats, which suits lights of intensity 1 and loses nothing bright of others; 1 for floats.
    metadata : mapping of str to str, optional
        Goes into the first part's header, each name prefixed by "flarewright.".
    pixel_aspect : float
        Width of a pixel over its height.
    colorspace : {"rec709", "acescg"}
        Primaries of the pixels; nothing is converted.
    full_windows : bool
        Write single ghosts at the size of the picture too (for Blender).

    Returns
    -------
    tuple of str
        Remarks for a person: by what the values are multiplied, when it is not 1.

    Raises
    ------
    OutputError
        When the file cannot be written.
    FlarewrightError
        When there is no layer, two of the same name, or the scale is no power of two.
    """
    import OpenEXR

    names = [layer.name for layer in layers]
    if not names or len(set(names)) != len(names):
        raise FlarewrightError(f"an EXR file needs at least one layer and no name twice, not {names}")
    if scale is None:
        scale = half_scale() if pixel_type == "half" else 1.0
    if not _is_scale(scale):
        raise FlarewrightError(f"scale {scale!r} is no power of two from 2^-63 to 2^63; give exr_scale(project)")
    if "scale" in (metadata or {}):
        raise FlarewrightError("metadata 'scale' would replace the file's own; choose another name")
    parts = []
    for k, layer in enumerate(layers):
        # Passes always cover the picture; only a single ghost has a window worth cropping to.
        whole = k == 0 or full_windows or not layer.name.startswith("ghost.")
        pixels, window = _over_picture(layer, size_px) if whole else (layer.pixels, layer.window)
        # a variance is an irradiance squared, far too small for half floats
        squared = layer.name.endswith(".variance")
        by, half = (scale * scale, False) if squared else (scale, pixel_type == "half")
        header = _header(layer, window, size_px, pixel_aspect, colorspace)
        if k == 0:
            header |= {f"{_PREFIX}{name}": text for name, text in (metadata or {}).items()}
        header[_SCALE] = by
        values = _stored(pixels, by, half)
        if half and values.dtype == np.float32:
            header["compression"] = OpenEXR.PXR24_COMPRESSION
        # from one array of three channels, "RGB" as R, G, B and any other name as NAME.R, NAME.G, NAME.B: planes of
        # their own would hold all layers in memory twice
        parts.append(OpenEXR.Part(header, {"RGB" if k == 0 else layer.name: values}, layer.name))

    # the library compresses on one thread unless it is told otherwise; its oldest releases cannot be told
    if hasattr(OpenEXR, "set_global_thread_count"):
        OpenEXR.set_global_thread_count(max(OpenEXR.global_thread_count(), os.cpu_count() or 1))

    def write(temporary: Path) -> None:
        try:
            OpenEXR.File(parts).write(str(temporary))
        except RuntimeError as error:
            # The library has no exception of its own; what it cannot do with a valid header is reach the file. It says
            # so of the temporary name, behind which it gives the reason.
            told = str(error).rstrip(".")
            reason = told.partition(f'"{temporary}". ')[2]
            raise OSError(reason or told.replace(str(temporary), str(path))) from error

    write_atomically(Path(path), write)
    if scale == 1.0:
        return ()
    return (f"the EXR holds irradiances times {scale:.9g}, its attribute {_SCALE}; --float writes them as they are",)


def read_exr(path: str | PathLike[str]) -> ExrContents:
    """Read back a file that `write_exr` wrote.

    Parameters
    ----------
    path : path

    Returns
    -------
    ExrContents

    Raises
    ------
    OutputError
        When it is no readable EXR file.
    """
    try:
        file = _opened(path)
        scales = [_scale(part) for part in file.parts]
    except OSError as error:
        raise OutputError(f"{path} cannot be read as an EXR file: {error}") from error
    layers = []
    for k, (part, scale) in enumerate(zip(file.parts, scales, strict=True)):
        prefix = "" if k == 0 else f"{part.name()}."
        planes = [part.channels[f"{prefix}{name}"].pixels for name in _CHANNELS]
        pixels = _unscaled(np.stack(planes, axis=-1).astype(np.float32, copy=False), scale)
        x, y = (int(value) for value in part.header["dataWindow"][0])
        about = _prefixed(part.header, f"{_PREFIX}layer.")
        name = part.name() or "beauty"
        layers.append(Layer(name, pixels, (x, y, pixels.shape[1], pixels.shape[0]), about))
    header = dict(file.parts[0].header)
    low, high = header["displayWindow"]
    ours = {k: v for k, v in header.items() if k != _SCALE and not k.startswith(f"{_PREFIX}layer.")}
    metadata = {k: str(v) for k, v in _prefixed(ours, _PREFIX).items()}
    kind: Literal["half", "float"] = "half" if file.parts[0].channels["R"].pixels.dtype == np.float16 else "float"
    size = (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1)
    return ExrContents(tuple(layers), size, kind, metadata, header, scales[0])


def _opened(path: str | PathLike[str]) -> Any:
    """Read a file with all its parts; raises OSError when one is damaged, which the library leaves out with a word."""
    import OpenEXR

    try:
        with _ONE_READS, quiet():
            file = OpenEXR.File(str(path), separate_channels=True)
            whole = len(OpenEXR.File(str(path), header_only=True).parts)
    except RuntimeError as error:
        raise OSError(str(error).rstrip(".")) from error
    if len(file.parts) < max(whole, 1):
        raise OSError("its pixels are damaged or cut short")
    return file


def read_exr_plane(path: str | PathLike[str], choices: Sequence[Sequence[str]]) -> NDArray[np.float64]:
    """Read one plane of any EXR file, over its display window.

    Parameters
    ----------
    path : path
    choices : sequence of sequence of str
        Channels whose mean is wanted; of several choices the first that the file has. A file of a single channel may
        call it what it likes.

    Returns
    -------
    ndarray, shape (H, W)
        0 outside the data window.

    Raises
    ------
    OSError
        When it is no readable EXR file.
    ValueError
        When it has no such channels.
    """
    part, names = _part_with(path, choices)
    mean = np.mean([np.asarray(part.channels[name].pixels, float) for name in names], axis=0)
    return _over_display(part, mean / _scale(part))


def read_exr_colour(path: str | PathLike[str]) -> NDArray[np.float32]:
    """Read the colours of any EXR file, over its display window.

    Parameters
    ----------
    path : path
        With channels R, G and B, or a single one, or Y, which is grey.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Black outside the data window, and where a value is no number or infinite.

    Raises
    ------
    OSError
        When it is no readable EXR file.
    ValueError
        When it has no such channels.
    """
    part, names = _part_with(path, (("R", "G", "B"), ("Y",)))
    values = [np.asarray(part.channels[name].pixels, dtype=np.float64) / _scale(part) for name in names]
    planes = [_over_display(part, plane) for plane in values]
    colours = np.stack(planes if len(planes) == 3 else [planes[0]] * 3, axis=-1).astype(np.float32)
    return np.where(np.isfinite(colours), colours, np.float32(0.0))


def _part_with(path: str | PathLike[str], choices: Sequence[Sequence[str]]) -> tuple[Any, Sequence[str]]:
    """Find the part and the names of the first choice that a file has; a single channel may have any name."""
    file = _opened(path)
    known = [name for part in file.parts for name in part.channels]
    wanted = [*choices, known] if len(known) == 1 else choices
    found = [(part, names) for names in wanted for part in file.parts if all(name in part.channels for name in names)]
    if not found:
        told = " or ".join("".join(names) for names in choices)
        raise ValueError(f"it has no channel {told}; its channels are {', '.join(known[:8]) or 'none'}")
    return found[0]


def _over_display(part: Any, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lay a plane of the data window on the display window, 0 outside."""
    low, high = part.header["displayWindow"]
    left, top = (int(a) - int(b) for a, b in zip(part.header["dataWindow"][0], low, strict=True))
    width, height = (int(b) - int(a) + 1 for a, b in zip(low, high, strict=True))
    plane = np.zeros((height, width))
    inside = pixels[max(-top, 0) : max(height - top, 0), max(-left, 0) : max(width - left, 0)]
    top, left = max(top, 0), max(left, 0)
    plane[top : top + inside.shape[0], left : left + inside.shape[1]] = inside
    return plane


def exr_size(path: str | PathLike[str]) -> tuple[int, int]:
    """Return the width and height of the first part's pixels without reading them.

    Parameters
    ----------
    path : path

    Returns
    -------
    tuple of int

    Raises
    ------
    OutputError
        When it is no readable EXR file.
    """
    import OpenEXR

    try:
        low, high = OpenEXR.File(str(path), header_only=True).header()["dataWindow"]
    except RuntimeError as error:
        raise OutputError(f"{path} cannot be read as an EXR file: {error}") from error
    return int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1


def _prefixed(header: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    return {name.removeprefix(prefix): value for name, value in header.items() if name.startswith(prefix)}


def _over_picture(layer: Layer, size_px: tuple[int, int]) -> tuple[NDArray[np.float32], tuple[int, int, int, int]]:
    """Return a layer's pixels at the size of the picture, black around its window."""
    width, height = size_px
    picture = (0, 0, width, height)
    if layer.window == picture:
        return layer.pixels, picture
    x, y, w, h = layer.window
    pixels = np.zeros((height, width, 3), np.float32)
    left, top, right, bottom = max(x, 0), max(y, 0), min(x + w, width), min(y + h, height)
    if left < right and top < bottom:
        pixels[top:bottom, left:right] = layer.pixels[top - y : bottom - y, left - x : right - x]
    return pixels, picture


def _stored(pixels: NDArray[np.float32], scale: float, half: bool) -> NDArray[Any]:
    """Return the pixels as the file holds them: times the scale, in 16 bits where these reach."""
    if scale != 1.0:
        pixels = pixels * np.float32(scale)
    if not half:
        return np.ascontiguousarray(pixels)
    rounded = rounded_to_half(pixels)
    return rounded if np.any(np.abs(rounded) > HALF_MAX) else rounded.astype(np.float16)


def _unscaled(pixels: NDArray[np.float32], scale: float) -> NDArray[np.float32]:
    return pixels if scale == 1.0 else pixels / np.float32(scale)


def _is_scale(scale: float) -> bool:
    """Whether multiplying by the scale and by its square rounds nothing."""
    return 2.0**-63 <= scale <= 2.0**63 and frexp(scale)[0] == 0.5


def _scale(part: Any) -> float:
    """Return by what the values of a part are multiplied, 1 in files of other programs; raises OSError."""
    try:
        scale = float(part.header.get(_SCALE, 1.0))
    except (TypeError, ValueError):
        scale = 0.0
    if not 0.0 < scale < inf:
        raise OSError(f"its attribute {_SCALE} is no number above 0")
    return scale


def _header(
    layer: Layer,
    window: tuple[int, int, int, int],
    size_px: tuple[int, int],
    pixel_aspect: float,
    colorspace: Colorspace,
) -> dict[str, Any]:
    import OpenEXR

    x, y, w, h = window
    about = {f"{_PREFIX}layer.{name}": value for name, value in layer.about.items()}
    return {
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "displayWindow": ((0, 0), (size_px[0] - 1, size_px[1] - 1)),
        "dataWindow": ((x, y), (x + w - 1, y + h - 1)),
        "pixelAspectRatio": float(pixel_aspect),
        "chromaticities": CHROMATICITIES[colorspace],
        "colorInteropID": _INTEROP_ID[colorspace],
        **about,
    }
