"""OpenEXR files: layers as parts, the project in the metadata.

`write_exr` and `read_exr` are for our own files; `foreign_exr` reads pictures that other programs wrote.

Every program opens the first part: the first layer (the beauty) with plain channels R, G, B. Each further layer is a
separate part, named after the layer, with channels `layer.R`, `layer.G`, `layer.B`; compositing programs list it
under its name whether they read parts or channel names. A file with one layer is an ordinary single-part file. Pixels
are linear and scene-referred; `chromaticities` states the primaries.

A file of half floats stores values times a power of two (`half.half_scale`), recorded in each part's attribute
`flarewright.scale`. A layer with values above half's range has 32-bit channels, rounded to half's precision and
compressed by PXR24. PXR24 keeps 16 bits of each value, which suffices here; such a layer is about a quarter larger than
one of half floats (with ZIP about twice as large). The read functions here divide by the scale.

Parts of single ghosts cover only their data window, which keeps files of small ghosts small. Wide open, most ghosts
fill the picture and 351 of them make large files; `--brightest` limits them. Nuke, Fusion, Natron and OpenImageIO place
such a part correctly; Blender (up to 5 at least) puts it into the picture's corner. For Blender, `full_windows=True`
writes every layer at the size of the picture.

The layers of a Cryptomatte (`cryptomatte`) are parts as well, with 32-bit channels R, G, B and A, never scaled. Their
attributes are in their own parts and in the first one, the only one whose attributes some programs read.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import frexp, inf
from os import PathLike, fspath
from pathlib import Path
from threading import Lock
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...colorimetry import PRIMARIES
from ...errors import FileError, FlarewrightError, OutputError, raised_as
from ...model.layer import Layer, part_inside
from ...model.matte import GhostMatte
from ...model.project.camera import Colorspace
from ...typing import Pixels
from ..files.atomic_write import write_atomically
from ..files.door import outside, printable, sentences_for, shown
from ..files.silence_libraries import silenced
from .cryptomatte import matte_attributes, matte_layers, matte_names
from .file_space import FileSpace
from .half import HALF_MAX, half_scale, rounded_to_half

# the built-in spaces by their names of the ASWF Color Interop Forum
_INTEROP_ID: Mapping[Colorspace, str] = {"rec709": "lin_rec709_scene", "acescg": "lin_ap1_scene"}
CHROMATICITIES: Mapping[Colorspace, tuple[float, ...]] = {space: PRIMARIES[name] for space, name in _INTEROP_ID.items()}

_PREFIX = "flarewright."
_SCALE = f"{_PREFIX}scale"
CHANNELS = "RGB"
# beginnings of the names of layers of single ghosts; those of a shot have no dots
_SINGLE = ("ghost.", "ghost_")

# rows that are rounded to half floats together
_BAND = 64
# with less space left on the disk than this, bytes, a written file is read again
_SPARE = 1_000_000
# the library prints errors to stdout; redirecting stdout affects all threads
_REDIRECT_LOCK = Lock()


@dataclass(frozen=True)
class ExrContents:
    """Contents of a file, from `read_exr`.

    Attributes
    ----------
    layers : tuple of Layer
        In the order of the file; pixels as float32 within each part's data window, scale removed.
    size_px : tuple of int
        Width and height of the display window.
    pixel_type : {"half", "float"}
        Of the first part; "float" in a file of half floats when its values exceed half's range.
    metadata : dict of str to str
        As passed to `write_exr`.
    header : dict of str to object
        All attributes of the first part.
    scale : float
        Factor of the first part's values in the file.
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
    colorspace: Colorspace | FileSpace = "rec709",
    full_windows: bool = False,
    attributes: Mapping[str, Any] | None = None,
    one_part: bool = False,
    compression: Literal["zip", "dwaa"] = "zip",
    matte: GhostMatte | None = None,
) -> tuple[str, ...]:
    """Write layers into one EXR file, atomically.

    Parameters
    ----------
    path : path
    layers : sequence of Layer
        The first one becomes the part that every program opens.
    size_px : tuple of int
        Width and height of the whole picture.
    pixel_type : {"half", "float"}
        half: 16 bits per value; layers with values above half's range use 32 bits with half's precision; variances
        always use 32 bits.
    scale : float, optional
        Power of two that multiplies all values (variances: its square): `exr_scale(project)`. None: 1024 for half
        floats, which suits lights of intensity 1 and keeps brighter ones without loss; 1 for floats.
    metadata : mapping of str to str, optional
        Stored in the first part's header, each name prefixed by "flarewright.".
    pixel_aspect : float
        Width of a pixel over its height.
    colorspace : {"rec709", "acescg"} or FileSpace
        Primaries of the pixels; the function converts nothing. Those of a `FileSpace` are stated where they are known,
        its name in any case.
    full_windows : bool
        Write single ghosts at the size of the picture as well (for Blender).
    attributes : mapping of str to object, optional
        Further attributes of the first part's header, such as OpenEXR's standard ones (`exr_attributes`).
    one_part : bool
        Write one part with the channels of all layers, for programs that read no parts. Implies `full_windows`; if one
        layer needs 32 bits, its channels have them.
    compression : {"zip", "dwaa"}
        zip is lossless. dwaa, for half floats, is lossy (cosine transform, level 45): smaller files, errors that
        pictures do not show. Layers with 32 bits keep their lossless compression, and with `one_part` all do.
    matte : GhostMatte, optional
        Written as a Cryptomatte, in further parts of 32-bit floats.

    Returns
    -------
    tuple of str
        Remarks for the user: the scale, when it is not 1.

    Raises
    ------
    OutputError
        When the file cannot be written, or its name does not end in .exr.
    FlarewrightError
        When there is no layer, two of the same name, or the scale is no power of two.
    """
    if scale is None:
        scale = half_scale() if pixel_type == "half" else 1.0
    _check(path, layers, scale, pixel_type, compression, metadata or {})
    parts: list[Any] = []
    full_windows = full_windows or one_part
    for k, layer in enumerate(layers):
        # all passes cover the picture; only single ghosts have a smaller window
        whole = k == 0 or full_windows or not layer.name.startswith(_SINGLE)
        pixels, window = _over_picture(layer, size_px) if whole else (layer.pixels, layer.window)
        header = _header(layer, window, size_px, pixel_aspect, colorspace)
        if k == 0:
            # a project can name files whose names are not UTF-8
            header |= {f"{_PREFIX}{name}": printable(text) for name, text in (metadata or {}).items()}
            header |= attributes or {}
            header |= matte_attributes(matte.names) if matte is not None else {}
        parts.append(
            _part(
                layer.name, pixels, header, scale, half=pixel_type == "half", first=k == 0, lossy=compression == "dwaa"
            )
        )
    if matte is not None:
        parts += _matte_parts(matte, size_px, pixel_aspect)
    if one_part:
        parts = [_joined(parts)]
    write_atomically(Path(path), lambda temporary: _write_parts(parts, temporary, path))
    if scale == 1.0:
        return ()
    return (f"the EXR holds irradiances times {scale:.9g}, its attribute {_SCALE}; --float writes them as they are",)


def _check(
    path: str | PathLike[str],
    layers: Sequence[Layer],
    scale: float,
    pixel_type: str,
    compression: str,
    metadata: Mapping[str, str],
) -> None:
    """Raise an error for arguments of `write_exr` that contradict each other."""
    if Path(path).suffix.lower() != ".exr":
        raise OutputError(f"the output {fspath(path)!r} must be named *.exr")
    if printable(str(path)) != str(path):
        raise OutputError(f"cannot write {shown(path)}: its name is not UTF-8; choose another name")
    names = [layer.name for layer in layers]
    if not names or len(set(names)) != len(names):
        raise FlarewrightError(f"an EXR file needs at least one layer and no name twice, not {names}")
    if compression == "dwaa" and pixel_type != "half":
        raise FlarewrightError("compression dwaa keeps 16 bits of a value: give pixel_type half, or compression zip")
    if not _is_scale(scale):
        raise FlarewrightError(f"scale {scale!r} is no power of two from 2^-63 to 2^63; give exr_scale(project)")
    if "scale" in metadata:
        raise FlarewrightError("metadata 'scale' would replace the file's own; choose another name")


def _part(
    name: str, pixels: Pixels, header: dict[str, Any], scale: float, *, half: bool, first: bool, lossy: bool
) -> Any:
    """Return the part of a layer; the header gets its scale and compression."""
    import OpenEXR

    # a variance is an irradiance squared, too small for half floats
    by, half = (scale * scale, False) if name.endswith(".variance") else (scale, half)
    values = _stored(pixels, by, half)
    large = half and values.dtype == np.float32
    header = header | {_SCALE: by} | ({"compression": OpenEXR.PXR24_COMPRESSION} if large else {})
    if lossy and values.dtype == np.float16:
        # of larger values it would keep 16 bits, which overflow
        header["compression"] = OpenEXR.DWAA_COMPRESSION
    # one array of three channels instead of separate planes halves the memory: "RGB" becomes R, G, B, any other name
    # becomes NAME.R, NAME.G, NAME.B
    return OpenEXR.Part(header, {"RGB" if first else name: values}, name)


def _matte_parts(matte: GhostMatte, size_px: tuple[int, int], pixel_aspect: float) -> list[Any]:
    """Return the parts of a Cryptomatte."""
    import OpenEXR

    header = {
        "type": OpenEXR.scanlineimage,
        # lossless: a changed bit is another object
        "compression": OpenEXR.ZIP_COMPRESSION,
        "displayWindow": ((0, 0), (size_px[0] - 1, size_px[1] - 1)),
        "dataWindow": ((0, 0), (size_px[0] - 1, size_px[1] - 1)),
        "pixelAspectRatio": float(pixel_aspect),
        _SCALE: 1.0,
        **matte_attributes(matte.names),
    }
    return [OpenEXR.Part(dict(header), {name: pixels}, name) for name, pixels in matte_layers(matte)]


def _joined(parts: list[Any]) -> Any:
    """Return one part with the channels of all and the first one's header; lossless unless no layer needs 32 bits."""
    import OpenEXR

    channels = {name: channel for part in parts for name, channel in part.channels.items()}
    small = all(part.header["compression"] == OpenEXR.DWAA_COMPRESSION for part in parts)
    header = parts[0].header | {"compression": OpenEXR.DWAA_COMPRESSION if small else OpenEXR.ZIP_COMPRESSION}
    for part in parts[1:]:
        if (scale := part.header[_SCALE]) != header[_SCALE]:
            header[f"{_SCALE}.{part.name()}"] = scale
    return OpenEXR.Part(header, channels, parts[0].name())


def _write_parts(parts: list[Any], temporary: Path, path: str | PathLike[str]) -> None:
    """Write a temporary file for a path; raises OSError with the library's reason, or MemoryError."""
    import OpenEXR

    # the library compresses on one thread by default; its oldest releases have no setting for it
    if hasattr(OpenEXR, "set_global_thread_count"):
        OpenEXR.set_global_thread_count(max(OpenEXR.global_thread_count(), os.cpu_count() or 1))
    try:
        OpenEXR.File(parts).write(str(temporary))
    except RuntimeError as error:
        # The library raises RuntimeError; with a valid header the only cause is that the file cannot be written. The
        # message has the temporary name, then the reason.
        message = str(error).rstrip(".")
        if "compression routine" in message:
            # a compressor fails only where it cannot allocate its buffer
            raise MemoryError from error
        reason = message.partition(f'"{temporary}". ')[2]
        raise OSError(reason or message.replace(str(temporary), str(path))) from error
    if shutil.disk_usage(temporary.parent).free < _SPARE:
        # the library ignores errors of the last bytes, which it writes when it closes a file
        try:
            open_parts(temporary, "an EXR file")
        except FileError:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from None


def read_exr(path: str | PathLike[str]) -> ExrContents:
    """Read a file that `write_exr` wrote.

    Raises
    ------
    OutputError
        When it is not a readable EXR file.
    """
    with raised_as(OutputError), sentences_for(path, "an EXR file"):
        return _contents(open_parts(path, "an EXR file"))


def _contents(file: Any) -> ExrContents:
    """Return the layers of a file with R, G and B in each part, without those of Cryptomattes."""
    mattes = matte_names(file.parts[0].header)
    # a Cryptomatte's identifiers are no light
    light = [part for k, part in enumerate(file.parts) if k == 0 or not _of_matte(part.name(), mattes)]
    scales = [scale_of(part) for part in light]
    layers = []
    for k, (part, scale) in enumerate(zip(light, scales, strict=True)):
        groups = [("", part.name() or "beauty")] if k == 0 else [(f"{part.name()}.", part.name())]
        if len(file.parts) == 1:
            # a file that `one_part` wrote
            below = dict.fromkeys(name.rpartition(".")[0] for name in part.channels if "." in name)
            # files of others hold more, such as depth.Z
            whole = [n for n in below if all(f"{n}.{channel}" in part.channels for channel in CHANNELS)]
            groups += [(f"{n}.", n) for n in whole if not _of_matte(n, mattes)]
        x, y = (int(value) for value in part.header["dataWindow"][0])
        about = _prefixed(part.header, f"{_PREFIX}layer.")
        for prefix, name in groups:
            planes = [part.channels[f"{prefix}{channel}"].pixels for channel in CHANNELS]
            by = part.header.get(f"{_SCALE}.{name}", scale)
            pixels = _unscaled(np.stack(planes, axis=-1).astype(np.float32, copy=False), by)
            layers.append(
                Layer(name, pixels, (x, y, pixels.shape[1], pixels.shape[0]), about if k or not prefix else {})
            )
    header = dict(file.parts[0].header)
    low, high = header["displayWindow"]
    ours = {
        k: v for k, v in header.items() if not f"{k}.".startswith(f"{_SCALE}.") and not k.startswith(f"{_PREFIX}layer.")
    }
    metadata = {k: str(v) for k, v in _prefixed(ours, _PREFIX).items()}
    kind: Literal["half", "float"] = "half" if file.parts[0].channels["R"].pixels.dtype == np.float16 else "float"
    size = (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1)
    return ExrContents(tuple(layers), size, kind, metadata, header, scales[0])


def exr_note(path: str | PathLike[str], name: str) -> str | None:
    """Return one text of the metadata that `write_exr` stored; None if the file has none of this name.

    Only the header is read.

    Raises
    ------
    FileError
        When it is not an EXR file.
    """
    import OpenEXR

    with outside(path, "an EXR file", remedy="give an EXR file"):
        str(path).encode()
        with _REDIRECT_LOCK, silenced():
            parts = OpenEXR.File(str(path), header_only=True).parts
        found = parts[0].header.get(f"{_PREFIX}{name}") if parts else None
    return found if isinstance(found, str) else None


def _of_matte(layer: str, mattes: Sequence[str]) -> bool:
    """Return whether a layer belongs to one of the Cryptomattes."""
    return any(layer.startswith(name) and layer.removeprefix(name).isdecimal() for name in mattes)


def open_parts(path: str | PathLike[str], what: str, pixel_bytes: int = 8) -> Any:
    """Open a file with all its parts; raises FileError also for damaged parts, which the library silently skips."""
    import OpenEXR

    with outside(path, what, pixel_bytes=pixel_bytes, remedy="give an EXR file"):
        # the library's message about such a name is none
        str(path).encode()
        with _REDIRECT_LOCK, silenced():
            file = OpenEXR.File(str(path), separate_channels=True)
            whole = len(OpenEXR.File(str(path), header_only=True).parts)
        if len(file.parts) < max(whole, 1):
            raise ValueError("its pixels are damaged or cut short")
    return file


def exr_size(path: str | PathLike[str]) -> tuple[int, int]:
    """Return the width and height of the first part's pixels without reading them.

    Raises
    ------
    OutputError
        When it is not a readable EXR file.
    """
    import OpenEXR

    with raised_as(OutputError), outside(path, "an EXR file"):
        low, high = OpenEXR.File(str(path), header_only=True).header()["dataWindow"]
    return int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1


def scale_in_exr(path: str | PathLike[str]) -> float:
    """Return the factor of the values in a file without reading its pixels; 1 in files of other programs.

    Raises
    ------
    OutputError
        When it is not a readable EXR file.
    """
    import OpenEXR

    with raised_as(OutputError), outside(path, "an EXR file", remedy="give an EXR file"):
        return scale_of(OpenEXR.File(str(path), header_only=True).parts[0])


def _prefixed(header: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    return {name.removeprefix(prefix): value for name, value in header.items() if name.startswith(prefix)}


def _over_picture(layer: Layer, size_px: tuple[int, int]) -> tuple[Pixels, tuple[int, int, int, int]]:
    """Return a layer's pixels at the size of the picture, 0 outside its window."""
    width, height = size_px
    picture = (0, 0, width, height)
    if layer.window == picture:
        return layer.pixels, picture
    x, y, *_ = layer.window
    pixels = np.zeros((height, width, 3), np.float32)
    left, top, right, bottom = part_inside(layer.window, size_px)
    if left < right and top < bottom:
        pixels[top:bottom, left:right] = layer.pixels[top - y : bottom - y, left - x : right - x]
    return pixels, picture


def _stored(pixels: Pixels, scale: float, half: bool) -> NDArray[Any]:
    """Return the pixels as stored: scaled, as half floats if they are in range."""
    factor = np.float32(scale)
    if not half:
        return np.ascontiguousarray(pixels if scale == 1.0 else pixels * factor)
    stored: NDArray[Any] = np.empty(pixels.shape, np.float16)
    # in bands of rows: a few copies of a whole picture cost more time to clear than to fill
    for top in range(0, len(pixels), _BAND):
        rounded = rounded_to_half(pixels[top : top + _BAND] * factor)
        if stored.dtype == np.float16 and np.any(np.abs(rounded) > HALF_MAX):
            beyond = np.empty(pixels.shape, np.float32)
            beyond[:top] = stored[:top]
            stored = beyond
        stored[top : top + _BAND] = rounded
    return stored


def _unscaled(pixels: Pixels, scale: float) -> Pixels:
    return pixels if scale == 1.0 else pixels / np.float32(scale)


def _is_scale(scale: float) -> bool:
    """Return whether multiplication by the scale and by its square is exact."""
    return 2.0**-63 <= scale <= 2.0**63 and frexp(scale)[0] == 0.5


def scale_of(part: Any) -> float:
    """Return the scale of a part's values, 1 in files of other programs; raises ValueError when it is invalid."""
    try:
        scale = float(part.header.get(_SCALE, 1.0))
    except (TypeError, ValueError):
        scale = 0.0
    if not 0.0 < scale < inf:
        raise ValueError(f"its attribute {_SCALE} is no number above 0")
    return scale


def _header(
    layer: Layer,
    window: tuple[int, int, int, int],
    size_px: tuple[int, int],
    pixel_aspect: float,
    colorspace: Colorspace | FileSpace,
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
        **_stated(colorspace),
        **about,
    }


def _stated(colorspace: Colorspace | FileSpace) -> dict[str, Any]:
    """Return the attributes of a colour space."""
    if not isinstance(colorspace, FileSpace):
        return {"chromaticities": CHROMATICITIES[colorspace], "colorInteropID": _INTEROP_ID[colorspace]}
    named = {f"{_PREFIX}colorspace": printable(colorspace.name)}
    if colorspace.config:
        named[f"{_PREFIX}ocio"] = printable(colorspace.config)
    if colorspace.known is None:
        return named
    return {**named, "chromaticities": PRIMARIES[colorspace.known], "colorInteropID": colorspace.known}
