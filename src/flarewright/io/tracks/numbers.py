"""Numbers of track files, with sentences for what is none, and the limits on their count."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np

from ...errors import FileError
from ...typing import Floats
from .track import Origin, Track

LARGEST_BYTES = 64_000_000
"""Largest size of a track file, bytes: whole Nuke scripts hold tracks."""
MOST_FRAMES = 10_000
"""Largest number of frames of a track, that of the keys of a light."""
MOST_TRACKS = 1000
"""Largest number of tracks of a file."""
# frames have numbers of at most seven digits in file names; places of lights lie within some pictures
_LARGEST_FRAME, _LARGEST_PLACE = 1e7, 1e7


def number(text: str, where: str, what: str) -> float:
    """Return a number of a track file.

    Parameters
    ----------
    text : str
    where : str
        Place in the file, "track.txt line 3", the start of the message.
    what : str
        "x", "a frame", for the message.

    Raises
    ------
    FileError
        The text is no finite number.
    """
    try:
        # `float` also accepts 1_000
        value = float(text) if "_" not in text else float("nan")
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise FileError(f"{where}: {text.strip()[:60]!r} is no number for {what}; correct it or export the track again")
    return value


def whole(text: str, where: str, what: str) -> int:
    """Return a whole number of 0 or more; parameters and errors as `number`."""
    value = number(text, where, what)
    if value != int(value) or not 0 <= value <= _LARGEST_FRAME:
        raise FileError(f"{where}: {text.strip()[:60]!r} is no whole number for {what}; is it the right format?")
    return int(value)


def track_of(
    file: str,
    name: str,
    frames: Sequence[float],
    places: Sequence[tuple[float, float]],
    *,
    origin: Origin = "top-left",
    size_px: tuple[float, float] | None = None,
    intensity: Floats | None = None,
    rgb: Floats | None = None,
) -> Track:
    """Return a track with its frames in order, checked.

    Parameters
    ----------
    file : str
        For messages.
    name, frames, places, origin, size_px, intensity, rgb
        As of `Track`; the frames in any order.

    Raises
    ------
    FileError
        There is no frame, a frame appears twice, or there are more than `MOST_FRAMES`.
    """
    label = f"{file}: track {name!r}"
    if not len(frames):
        raise FileError(f"{label} has no frames; export it again")
    if len(frames) > MOST_FRAMES:
        raise FileError(f"{label} has {len(frames)} frames, more than {MOST_FRAMES}; export a shorter range")
    times, points = np.array(frames, dtype=np.float64), np.array(places, dtype=np.float64).reshape(-1, 2)
    if np.abs(times).max() > _LARGEST_FRAME:
        far = times[np.abs(times).argmax()]
        raise FileError(f"{label} has a frame {far:g}, beyond the numbers of frames; correct it")
    if np.abs(points / (1.0 if size_px is None else np.array(size_px))).max() > _LARGEST_PLACE:
        raise FileError(f"{label} has a place {np.abs(points).max():g} px away, which no picture has; correct it")
    order = np.argsort(times, kind="stable")
    times = times[order]
    same = np.flatnonzero(np.diff(times) <= 0.0)
    if len(same):
        raise FileError(f"{label} has frame {times[same[0]]:g} twice; keep one of them")
    return Track(
        name, times, points[order], origin, size_px,
        None if intensity is None else intensity[order], None if rgb is None else rgb[order],
    )  # fmt: skip
