"""One picture of a merged run: the maximum of all frames, with light, axis and mirror lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...io.images.png import write_png
from ...io.measurement.merged import read_frame
from ...model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from ...render.image.display import auto_exposure, view, view_text
from ...typing import Floats, Pixels
from ..core.sampling import evenly_spaced

OVERVIEW = "merged.png"
# largest width, pixels, and largest number of frames
_WIDTH_PX, _FRAMES = 960, 24
_AXIS, _LIGHT, _GUESSED, _PATH = (90, 220, 255), (255, 90, 60), (160, 120, 255), (90, 220, 120)


def write_overview(folder: Path, run: MergedRun) -> None:
    """Write `overview_picture` as `merged.png`.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    run : MergedRun

    Raises
    ------
    FlarewrightError
        When a frame cannot be read or the picture cannot be written.
    """
    picture, stops = overview_picture(folder, run)
    seen = view_text(stops, "filmic", "rec709", automatic=True)
    about = {"Description": f"{seen}; red: light, blue: optical axis, green: mirror lines"}
    write_png(folder / OVERVIEW, picture, about)


def overview_picture(folder: Path, run: MergedRun) -> tuple[NDArray[np.uint8], float]:
    """Draw the maximum of all frames, with the axis, the light's positions and the mirror lines.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    run : MergedRun

    Returns
    -------
    picture : ndarray, shape (height, width, 3), uint8
        Reduced to a width of at most 960 pixels.
    stops : float
        Exposure of the picture.

    Raises
    ------
    FlarewrightError
        When a frame cannot be read or has another size.

    Notes
    -----
    Red rings: detected positions of the light; violet rings: predicted positions; blue cross: the optical axis, with
    arms of three standard errors but at least 6 pixels; green: the mirror lines of the first and the last frame with a
    detected light.
    """
    picture, block = _laid_over(folder, run)
    light = in_rec709(picture, run)
    stops = auto_exposure(light)
    shown = view(light, stops)
    seen = [frame for frame in run.frames if frame.light_found]
    axis = run.axis_px[0] / block, run.axis_px[1] / block
    for frame in (seen[0], seen[-1]) if seen else ():
        reach = np.linspace(-2.0, 2.0, 4 * max(shown.shape)) * max(shown.shape)
        _dots(shown, axis[0] + reach * frame.direction[0], axis[1] + reach * frame.direction[1], _PATH, part=0.5)
    for frame in run.frames:
        angle = np.linspace(0.0, 2.0 * np.pi, 60)
        x, y = frame.light_px[0] / block, frame.light_px[1] / block
        _dots(shown, x + 4.0 * np.cos(angle), y + 4.0 * np.sin(angle), _LIGHT if frame.light_found else _GUESSED)
    for k, unit in enumerate(((1.0, 0.0), (0.0, 1.0))):
        arm = np.linspace(-1.0, 1.0, 200) * max(6.0, 3.0 * run.axis_error_px[k] / block)
        _dots(shown, axis[0] + arm * unit[0], axis[1] + arm * unit[1], _AXIS)
    return shown, stops


def in_rec709(light: Floats, run: MergedRun) -> Pixels:
    """Convert light of a run's frames to linear Rec.709; without the camera's matrix its colours stay unchanged.

    Parameters
    ----------
    light : ndarray, shape (..., 3)
        In the captures' red, green and blue.
    run : MergedRun

    Returns
    -------
    ndarray, shape (..., 3), float32
        Linear Rec.709.
    """
    return np.asarray(light if run.to_rec709 is None else light @ np.array(run.to_rec709).T, np.float32)


def frame_of(folder: Path, run: MergedRun, info: FrameInfo) -> MergedFrame:
    """Read a frame of a run and check its size.

    Raises
    ------
    FlarewrightError
        When it cannot be read, or its size differs from the run's.
    """
    frame = read_frame(folder, info)
    height, width = frame.radiance.shape[:2]
    if (width, height) != run.size_px:
        raise FlarewrightError(
            f"{folder / info.file} has {width} x {height} pixels, and the run {run.size_px[0]} x {run.size_px[1]}: "
            "merge again with flarewright measure merge"
        )
    return frame


def _laid_over(folder: Path, run: MergedRun) -> tuple[Floats, int]:
    """Return the maximum over some frames at each pixel, reduced, and the side of the pixel block."""
    width, height = run.size_px
    block = -(-width // _WIDTH_PX)
    brightest = np.zeros((height // block, width // block, 3))
    for info in evenly_spaced(run.frames, _FRAMES):
        light = frame_of(folder, run, info).radiance
        part = light[: brightest.shape[0] * block, : brightest.shape[1] * block].astype(np.float64)
        parts = part.reshape(brightest.shape[0], block, brightest.shape[1], block, 3)
        brightest = np.maximum(brightest, parts.mean(axis=(1, 3)))
    return brightest, block


def _dots(picture: NDArray[np.uint8], x: Floats, y: Floats, color: tuple[int, int, int], part: float = 1.0) -> None:
    """Colour the pixels at (x, y) that lie in the picture."""
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    inside = (i >= 0) & (j >= 0) & (i < picture.shape[1]) & (j < picture.shape[0])
    i, j = i[inside], j[inside]
    picture[j, i] = ((1.0 - part) * picture[j, i] + part * np.array(color)).astype(np.uint8)
