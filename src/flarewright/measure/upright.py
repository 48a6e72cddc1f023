"""Merged frames turned upright: the tilt and the wandering of the horizon taken out of the pixels themselves."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, radians, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError
from ..io.merged import read_frame, write_frame
from ..model.capture import FrameInfo, MergedFrame, MergedRun

UPRIGHT = "upright"


def make_upright(folder: Path, run: MergedRun, tell: Callable[[float, str], None]) -> MergedRun:
    """Write every frame of a run turned about the axis, so that its light goes exactly as the captures say.

    Parameters
    ----------
    folder : Path
        Of the run.
    run : MergedRun
        Its frames are written as they were photographed.
    tell : callable
        Gets the finished part and words.

    Returns
    -------
    MergedRun
        With the new files; the old ones stay.

    Raises
    ------
    OutputError
        A frame cannot be written.

    Notes
    -----
    Bilinear, so a pixel's variance falls while neighbours share noise. The search and the fit need no such frames: they
    know each frame's own tilt.
    """
    try:
        (folder / UPRIGHT).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder / UPRIGHT}: {(error.strerror or '').lower()}") from None
    infos = []
    for k, info in enumerate(run.frames):
        frame = turned(read_frame(folder, info))
        here: FrameInfo = frame.info.replace(file=f"{UPRIGHT}/{Path(info.file).name}")
        write_frame(folder, MergedFrame(here, frame.radiance, frame.variance))
        infos.append(here)
        tell((k + 1) / len(run.frames), f"upright {k + 1} of {len(run.frames)}")
    told = "frames were turned upright (--upright): neighbouring pixels share some of their noise"
    out: MergedRun = run.replace(frames=tuple(infos), remarks=(*run.remarks, told))
    return out


def turned(frame: MergedFrame) -> MergedFrame:
    """Turn a frame about its axis by its horizon's tilt.

    Parameters
    ----------
    frame : MergedFrame

    Returns
    -------
    MergedFrame
        Its roll is what the captures say; what comes from beyond the border has infinite variance.
    """
    info = frame.info
    tilt = radians(info.horizon_deg)
    c, s = cos(tilt), sin(tilt)
    height, width = frame.radiance.shape[:2]
    x, y = np.arange(width) + 0.5 - info.axis_px[0], np.arange(height)[:, None] + 0.5 - info.axis_px[1]
    # rows count downwards: the tilt is counterclockwise in the upright picture
    u, v = info.axis_px[0] + c * x + s * y - 0.5, info.axis_px[1] - s * x + c * y - 0.5
    inside = (u >= 0.0) & (u <= width - 1) & (v >= 0.0) & (v <= height - 1)
    left = np.clip(np.floor(u), 0, width - 2).astype(np.intp)
    top = np.clip(np.floor(v), 0, height - 2).astype(np.intp)
    a, b = (np.clip(u - left, 0.0, 1.0))[..., None], (np.clip(v - top, 0.0, 1.0))[..., None]
    light, noise = np.zeros((height, width, 3)), np.zeros((height, width, 3))
    for down, right, weight in ((0, 0, (1 - a) * (1 - b)), (0, 1, a * (1 - b)), (1, 0, (1 - a) * b), (1, 1, a * b)):
        light += weight * frame.radiance[top + down, left + right]
        noise += _times(weight**2, frame.variance[top + down, left + right])
    noise[~inside] = np.inf
    light[~inside] = 0.0
    dx, dy = info.light_px[0] - info.axis_px[0], info.light_px[1] - info.axis_px[1]
    place = info.axis_px[0] + c * dx - s * dy, info.axis_px[1] + s * dx + c * dy
    here: FrameInfo = info.replace(roll_deg=info.nominal_roll_deg, light_px=place)
    return MergedFrame(here, light.astype(np.float32), noise.astype(np.float32))


def _times(weight: NDArray[np.float64], variance: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return a variance's share; a clipped neighbour that does not count spoils nothing."""
    with np.errstate(invalid="ignore"):
        return np.where(weight > 0.0, weight * variance, 0.0)
