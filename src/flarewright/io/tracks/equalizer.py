"""2D tracks of 3DEqualizer 4: File, Export 2D Tracks.

The number of points; for each its name, its colour, the number of its frames, and a line `frame x y` for each. Pixels
count from the bottom left corner, frames from 1 whatever number the sequence starts with.
"""

from __future__ import annotations

from ...errors import FileError
from ..files.door import shown
from .numbers import MOST_FRAMES, MOST_TRACKS, number, track_of, whole
from .track import TrackFile


def is_equalizer(text: str) -> bool:
    """Return whether a text starts with a number of points, a name, a colour and a number of frames."""
    lines = [line.strip() for line in text.splitlines() if line.strip()][:5]
    return (
        len(lines) == 5
        and all(lines[k].isdecimal() for k in (0, 2, 3))
        and len(lines[4].split()) == 3
        and lines[4].split()[0].isdecimal()
    )


def read_equalizer(text: str, file: str) -> TrackFile:
    """Read the tracks of a text.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Raises
    ------
    FileError
        The file ends early, or a line is not what its place requires.
    """
    name = shown(file)
    lines = [(k, line.strip()) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    at = 0

    def taken(what: str) -> tuple[str, str]:
        nonlocal at
        if at >= len(lines):
            raise FileError(f"{name} ends where {what} belongs: it is cut short; export the tracks again")
        k, line = lines[at]
        at += 1
        return line, f"{name} line {k}"

    count = whole(*taken("the number of points"), "the number of points")
    if not 1 <= count <= MOST_TRACKS:
        raise FileError(f"{name} has {count} points; give 1 to {MOST_TRACKS}")
    tracks = []
    for _ in range(count):
        point, _where = taken("the name of a point")
        whole(*taken("the colour of a point"), "the colour of a point")
        frames_of, where = taken("a number of frames")
        length = whole(frames_of, where, "the number of frames")
        if length > MOST_FRAMES:
            raise FileError(f"{where}: {length} frames are more than {MOST_FRAMES}; export a shorter range")
        frames, places = [], []
        for _frame in range(length):
            line, where = taken(f"a frame of {point[:40]!r}")
            cells = line.split()
            if len(cells) != 3:
                raise FileError(f"{where}: {line[:60]!r} is no 'frame x y'; export the tracks again")
            frame, x, y = (number(cell, where, what) for cell, what in zip(cells, ("a frame", "x", "y"), strict=True))
            frames.append(frame)
            places.append((x, y))
        # a point that is tracked nowhere is exported with 0 frames
        if frames:
            tracks.append(track_of(name, point[:80], frames, places, origin="bottom-left"))
    if not tracks:
        raise FileError(f"{name} has {count} points, none with a frame; export points that are tracked")
    return TrackFile(tuple(tracks), "3de")
