"""The folder of a merged run: one EXR file per constellation, and the index `merged.json`.

The EXR of a frame has two parts, `radiance` (channels R, G, B) and `radiance.variance`, both 32-bit floats; an infinite
variance marks a pixel that was clipped in every exposure.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError, FlarewrightError, OutputError
from ...model.layer import Layer
from ...model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from ...sentences import count, summary
from ..files.atomic_write import write_text_atomically
from ..files.text_file import read_json
from ..files.type_slips import record_of
from ..images.exr import read_exr, write_exr

INDEX = "merged.json"
# bytes; a frame takes about a kilobyte
_LARGEST_INDEX = 64_000_000
_RADIANCE, _VARIANCE = "radiance", "radiance.variance"


def read_note(note: Path) -> dict[str, Any]:
    """Return what a merge has noted beside a frame; empty when it cannot be read."""
    try:
        data = read_json(note, "the note of a frame")
    except FileError:
        return {}
    return data if isinstance(data, dict) else {}


def remove_index(folder: Path) -> None:
    """Delete the index of a run before its frames change: it would describe other pixels until it is written again.

    Raises
    ------
    OutputError
        When it cannot be deleted.
    """
    try:
        (folder / INDEX).unlink(missing_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"cannot delete {folder / INDEX} ({reason}): check the permissions") from None


def write_frame(folder: Path, frame: MergedFrame) -> None:
    """Write the pixels of a frame to the file in its `info`, as photographed: the light's drift is not removed.

    Parameters
    ----------
    folder : Path
        The run's folder.
    frame : MergedFrame

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    height, width = frame.radiance.shape[:2]
    window = (0, 0, width, height)
    about: dict[str, str | float] = {"constellation_deg": frame.info.constellation_deg}
    gain = np.float32(frame.info.gain)
    layers = [
        Layer(_RADIANCE, frame.radiance * gain, window, about),
        Layer(_VARIANCE, frame.variance * gain**2, window),
    ]
    write_exr(folder / frame.info.file, layers, (width, height), pixel_type="float", metadata={})


def read_frame(folder: Path, info: FrameInfo) -> MergedFrame:
    """Read one frame and remove the light's drift (`FrameInfo.gain`).

    Parameters
    ----------
    folder : Path
        The run's folder.
    info : FrameInfo
        One of `MergedRun.frames`.

    Raises
    ------
    FlarewrightError
        When the file is missing, damaged or not a merged frame, or pixels have no variance above 0.
    """
    path = folder / info.file
    remedy = "merge again with flarewright measure merge"
    if not path.is_file():
        raise FlarewrightError(f"{path} does not exist, but {INDEX} lists it: {remedy}")
    try:
        layers = {layer.name: layer.pixels for layer in read_exr(path).layers}
    except OutputError:
        raise FlarewrightError(f"{path} cannot be read as a merged frame: remove it and {remedy}") from None
    if not {_RADIANCE, _VARIANCE} <= layers.keys() or layers[_RADIANCE].shape != layers[_VARIANCE].shape:
        raise FlarewrightError(
            f"{path} has no radiance with a variance, so it is no merged frame: remove it and {remedy}"
        )
    # such a pixel would have an infinite weight
    if (exact := int((layers[_VARIANCE] <= 0.0).any(axis=2).sum())) > 0:
        raise FlarewrightError(
            f"{path} has a variance of 0 or less in {count(exact, 'pixel')}, and every measured value has noise: "
            f"remove it and {remedy}"
        )
    gain = np.float32(info.gain)
    return MergedFrame(info, layers[_RADIANCE] / gain, layers[_VARIANCE] / gain**2)


def write_run(folder: Path, run: MergedRun) -> None:
    """Write the index of a run.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    text = run.model_dump_json(indent=1) + "\n"

    write_text_atomically(folder / INDEX, text)


def read_run(folder: Path) -> MergedRun:
    """Read the index of a run; its frames are read one at a time by `read_frame`.

    Parameters
    ----------
    folder : Path
        Written by `flarewright measure merge`.

    Raises
    ------
    FlarewrightError
        When the index is missing or damaged.
    """
    path = folder / INDEX
    if not path.is_file():
        raise FlarewrightError(f"{path} does not exist: give a folder written by flarewright measure merge")
    try:
        data = read_json(path, "the index of a merged run", _LARGEST_INDEX)
    except FileError as error:
        raise FlarewrightError(f"{error}; merge again with flarewright measure merge") from None
    run, problems = record_of(MergedRun.model_validate, data)
    if run is None:
        raise FlarewrightError(summary(str(path), problems))
    return run
