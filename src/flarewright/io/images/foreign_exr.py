"""Pictures in OpenEXR files of other programs: a plane, a grey picture or a layer, within the display window."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np

from ...errors import FileError
from ...typing import Floats, Pixels
from ..files.door import sentences_for, shown
from .exr import CHANNELS, open_parts, scale_of


def read_exr_plane(path: str | PathLike[str], choices: Sequence[Sequence[str]], what: str = "an EXR file") -> Floats:
    """Read one plane of any EXR file within its display window.

    Parameters
    ----------
    path : path
    choices : sequence of sequence of str
        Sets of channels to average; the first set that the file has is used. The name of a single channel is ignored.
    what : str
        Expected kind of file, for messages.

    Returns
    -------
    ndarray, shape (H, W)
        0 outside the data window.

    Raises
    ------
    FileError
        When it is not a readable EXR file, or has none of these channels.
    """
    with sentences_for(path, what, "give an EXR file"):
        return _plane(*_part_with(open_parts(path, what), choices))


def read_exr_grey(path: str | PathLike[str], choices: Sequence[Sequence[str]]) -> tuple[Floats, Floats | None]:
    """Read a grey picture and its alpha, opening the file once.

    Parameters
    ----------
    path, choices
        As of `read_exr_plane`.

    Returns
    -------
    grey, alpha : ndarray, shape (H, W)
        As of `read_exr_plane`; no alpha without a channel A.

    Raises
    ------
    FileError
        As `read_exr_plane`.
    """
    with sentences_for(path, "an image", "give an EXR file"):
        file = open_parts(path, "an image", 16)
        grey = _plane(*_part_with(file, choices))
        part = next((part for part in file.parts if "A" in part.channels), None)
        return grey, None if part is None else _plane(part, ("A",))


def read_exr_layer(
    path: str | PathLike[str], layer: str | None, what: str = "an EXR file"
) -> tuple[Pixels, dict[str, Any]]:
    """Read the colours of a layer of any EXR file within its display window.

    Parameters
    ----------
    path : path
    layer : str or None
        A part's name, or the beginning of the names of its channels: "diffuse" for diffuse.R, diffuse.G, diffuse.B.
        None: plain channels R, G and B, or a single channel, or Y (grey).
    what : str
        Expected kind of file, for messages.

    Returns
    -------
    pixels : ndarray, shape (H, W, 3), float32
        0 outside the data window; values may be infinite or NaN.
    header : dict
        Attributes of the layer's part, over those of the first part.

    Raises
    ------
    FileError
        When it is not a readable EXR file, or has no such layer.
    """
    with sentences_for(path, what, "give an EXR file"):
        file = open_parts(path, what)
        part, names = _layer(file, layer, path)
        values = [np.asarray(part.channels[name].pixels, dtype=np.float64) / scale_of(part) for name in names]
        planes = [_over_display(part, plane) for plane in values]
        colours = np.stack(planes if len(planes) == 3 else [planes[0]] * 3, axis=-1)
        with np.errstate(over="ignore"):
            pixels = colours.astype(np.float32)
        return pixels, {**file.parts[0].header, **part.header}


def _layer(file: Any, layer: str | None, path: str | PathLike[str]) -> tuple[Any, Sequence[str]]:
    """Return the part and the channels of a layer; of the plain colours if none is named."""
    if layer is None:
        return _part_with(file, (("R", "G", "B"), ("Y",)))
    for prefix in (f"{layer}.", ""):
        for part in file.parts:
            names = [f"{prefix}{channel}" for channel in CHANNELS]
            if (prefix or part.name() == layer) and all(name in part.channels for name in names):
                return part, names
    channels = {name.rpartition(".")[0] for part in file.parts for name in part.channels if name.endswith(".R")}
    known = sorted(channels | {part.name() for part in file.parts if "R" in part.channels and part.name()})
    raise FileError(
        f"{shown(path)} has no layer {layer!r} with R, G and B: its layers are {', '.join(known[:12]) or 'unnamed'}; "
        "choose one, or omit the name"
    )


def _plane(part: Any, names: Sequence[str]) -> Floats:
    """Return the mean of channels within the display window."""
    mean = np.mean([np.asarray(part.channels[name].pixels, float) for name in names], axis=0)
    return _over_display(part, mean / scale_of(part))


def _part_with(file: Any, choices: Sequence[Sequence[str]]) -> tuple[Any, Sequence[str]]:
    """Return the part and the channels of the first set that a file has; a single channel can have any name."""
    known = [name for part in file.parts for name in part.channels]
    wanted = [*choices, known] if len(known) == 1 else choices
    found = [(part, names) for names in wanted for part in file.parts if all(name in part.channels for name in names)]
    if not found:
        wanted_names = " or ".join("".join(names) for names in choices)
        raise ValueError(f"it has no channel {wanted_names}; its channels are {', '.join(known[:8]) or 'none'}")
    return found[0]


def _over_display(part: Any, pixels: Floats) -> Floats:
    """Return a plane of the data window at the size of the display window, 0 outside."""
    low, high = part.header["displayWindow"]
    left, top = (int(a) - int(b) for a, b in zip(part.header["dataWindow"][0], low, strict=True))
    width, height = (int(b) - int(a) + 1 for a, b in zip(low, high, strict=True))
    plane = np.zeros((height, width))
    inside = pixels[max(-top, 0) : max(height - top, 0), max(-left, 0) : max(width - left, 0)]
    top, left = max(top, 0), max(left, 0)
    plane[top : top + inside.shape[0], left : left + inside.shape[1]] = inside
    return plane
