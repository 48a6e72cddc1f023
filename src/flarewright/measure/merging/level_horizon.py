"""Rotate merged frames upright: remove tilt and jitter of the horizon from the pixels."""

from __future__ import annotations

import json
from math import cos, radians, sin
from pathlib import Path

import numpy as np

from ...io.files.atomic_write import make_folder, write_text_atomically
from ...io.files.text_file import digest_of
from ...io.measurement.merged import read_frame, read_note, remove_index, write_frame
from ...model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from ...typing import Floats, Pixels, Progress

UPRIGHT = "upright"


def make_upright(folder: Path, run: MergedRun, progress: Progress) -> MergedRun:
    """Write all frames of a run rotated about the axis, so that the light's direction is exactly the captures' roll.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    run : MergedRun
        With frames as photographed.
    progress : callable
        Called with the finished part (0 to 1) and a description.

    Returns
    -------
    MergedRun
        With the new files; the old ones are kept.

    Raises
    ------
    OutputError
        When a frame cannot be written.

    Notes
    -----
    Interpolation is bilinear, which lowers a pixel's variance and correlates neighbours. Search and fit do not need
    such frames: they use the tilt of each frame.
    """
    make_folder(folder / UPRIGHT)
    infos = []
    for k, info in enumerate(run.frames):
        here = _upright_info(info).replace(file=f"{UPRIGHT}/{Path(info.file).name}")
        _write_upright(folder, info, here)
        infos.append(here)
        progress((k + 1) / len(run.frames), f"upright {k + 1} of {len(run.frames)}")
    remark = "frames were turned upright (--upright): neighbouring pixels share some of their noise"
    return run.replace(frames=tuple(infos), remarks=(*run.remarks, remark))


def _write_upright(folder: Path, info: FrameInfo, here: FrameInfo) -> None:
    """Write a frame turned upright, unless it is there already: then later stages keep what they have made of it."""
    note, written = (folder / here.file).with_suffix(".json"), folder / here.file
    # what merging has noted of the frame: its digest, and the ratios of its exposures
    about = read_note((folder / info.file).with_suffix(".json"))
    made_of = [about.get("sha256"), info.model_dump(mode="json")]
    known = read_note(note)
    if about.get("sha256") and known.get("of") == made_of and known.get("sha256") == digest_of(written):
        return
    remove_index(folder)
    frame = _turned_upright(read_frame(folder, info))
    write_frame(folder, MergedFrame(here, frame.radiance, frame.variance))
    facts = {"of": made_of, "sha256": digest_of(written), "ratios": about.get("ratios", [])}
    write_text_atomically(note, json.dumps(facts) + "\n")


def _upright_info(info: FrameInfo) -> FrameInfo:
    """Return what is known of a frame after it is turned upright."""
    c, s = cos(radians(info.horizon_deg)), sin(radians(info.horizon_deg))
    dx, dy = info.light_px[0] - info.axis_px[0], info.light_px[1] - info.axis_px[1]
    place = info.axis_px[0] + c * dx - s * dy, info.axis_px[1] + s * dx + c * dy
    turned: FrameInfo = info.replace(roll_deg=info.nominal_roll_deg, light_px=place)
    return turned


def _turned_upright(frame: MergedFrame) -> MergedFrame:
    """Rotate a frame about its axis by the tilt of its horizon; beyond the border the variance is infinite."""
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
    return MergedFrame(_upright_info(info), light.astype(np.float32), noise.astype(np.float32))


def _times(weight: Floats, variance: Pixels) -> Floats:
    """Return weight times variance; 0 where the weight is 0, also for an infinite variance."""
    with np.errstate(invalid="ignore"):
        return np.where(weight > 0.0, weight * variance, 0.0)
