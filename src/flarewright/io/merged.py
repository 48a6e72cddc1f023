"""The folder of a merged run: one EXR file a constellation, and `merged.json`, its index.

A frame's EXR has two parts, `radiance` (channels R, G, B) and `radiance.variance`, both 32-bit floats; a variance of
infinity marks a pixel that was clipped in every exposure.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from ..errors import FlarewrightError, OutputError
from ..model.capture import FrameInfo, MergedFrame, MergedRun
from ..model.layer import Layer
from .atomic import write_atomically
from .exr import read_exr, write_exr
from .sentences import summary, validation_sentences

INDEX = "merged.json"
_RADIANCE, _VARIANCE = "radiance", "radiance.variance"


def write_frame(folder: Path, frame: MergedFrame) -> None:
    """Write the pixels of a frame into the file that its `info` names, as photographed: with the drift of the light.

    Parameters
    ----------
    folder : Path
        Of the run.
    frame : MergedFrame

    Raises
    ------
    OutputError
        The file cannot be written.
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
    """Read one frame, the drift of the light taken out (`FrameInfo.gain`).

    Parameters
    ----------
    folder : Path
        Of the run.
    info : FrameInfo
        One of `MergedRun.frames`.

    Returns
    -------
    MergedFrame

    Raises
    ------
    FlarewrightError
        When the file is missing, damaged or no merged frame.
    """
    path = folder / info.file
    again = "merge again with flarewright measure merge"
    if not path.is_file():
        raise FlarewrightError(f"{path} does not exist, though {INDEX} names it: {again}")
    try:
        layers = {layer.name: layer.pixels for layer in read_exr(path).layers}
    except (OutputError, KeyError, ValueError):
        raise FlarewrightError(f"{path} cannot be read as a merged frame: remove it and {again}") from None
    if not {_RADIANCE, _VARIANCE} <= layers.keys() or layers[_RADIANCE].shape != layers[_VARIANCE].shape:
        raise FlarewrightError(
            f"{path} has no radiance with a variance, so it is no merged frame: remove it and {again}"
        )
    gain = np.float32(info.gain)
    return MergedFrame(info, layers[_RADIANCE] / gain, layers[_VARIANCE] / gain**2)


def write_run(folder: Path, run: MergedRun) -> None:
    """Write the index of a run.

    Parameters
    ----------
    folder : Path
    run : MergedRun

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    text = run.model_dump_json(indent=1) + "\n"

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    write_atomically(folder / INDEX, write)


def read_run(folder: Path) -> MergedRun:
    """Read the index of a run; its frames are read one at a time by `read_frame`.

    Parameters
    ----------
    folder : Path
        That `flarewright measure merge` has written.

    Returns
    -------
    MergedRun

    Raises
    ------
    FlarewrightError
        When there is no index, or it is damaged.
    """
    path = folder / INDEX
    try:
        data = json.loads(path.read_text("utf-8"))
        return MergedRun.model_validate(data)
    except OSError as error:
        raise FlarewrightError(
            f"{path} cannot be read ({(error.strerror or str(error)).lower()}): "
            "give a folder that flarewright measure merge has written"
        ) from None
    except ValidationError as error:
        raise FlarewrightError(summary(str(path), validation_sentences(error, data))) from None
    except ValueError:
        raise FlarewrightError(f"{path} is damaged: merge again with flarewright measure merge") from None
