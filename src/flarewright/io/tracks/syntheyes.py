"""2D tracker paths of SynthEyes: `name frame u v`, with or without an outcome code, one line a frame.

u and v run from -1 to 1, from left to right and from top to bottom (SynthEyes manual, "Exporting", of Tracker 2-D Paths
with scale 1 and offset 0).
"""

from __future__ import annotations

import re

from ...errors import FileError
from ..files.door import shown
from .numbers import MOST_TRACKS, number, track_of
from .track import TrackFile

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LINE = re.compile(rf"^\s*(?P<name>\S.*?)\s+(?P<frame>-?\d+)\s+(?P<u>{_NUMBER})\s+(?P<v>{_NUMBER})(?:\s+\d+)?\s*$")
# trackers leave the picture, but not by more than this
_FARTHEST = 10.0


def is_syntheyes(text: str) -> bool:
    """Return whether the first line of a text is one of a tracker path."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    found = _LINE.match(first)
    # three numbers alone are columns of another program
    return found is not None and not re.fullmatch(_NUMBER, found["name"])


def read_syntheyes(text: str, file: str) -> TrackFile:
    """Read the tracker paths of a text.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Raises
    ------
    FileError
        A line is none of a tracker path, or its numbers are not between -1 and 1 or near.
    """
    name = shown(file)
    tracks: dict[str, tuple[list[float], list[tuple[float, float]]]] = {}
    for k, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        where = f"{name} line {k}"
        found = _LINE.match(line)
        if found is None:
            raise FileError(f"{where} is no 'name frame u v' of SynthEyes' Tracker 2-D Paths; export it again")
        u, v = number(found["u"], where, "u"), number(found["v"], where, "v")
        if max(abs(u), abs(v)) > _FARTHEST:
            raise FileError(f"{where}: u and v lie between -1 and 1, not {u:g} {v:g}; export with scale 1 and offset 0")
        frames, places = tracks.setdefault(found["name"][:80], ([], []))
        frames.append(number(found["frame"], where, "a frame"))
        places.append((0.5 + 0.5 * u, 0.5 + 0.5 * v))
        if len(tracks) > MOST_TRACKS:
            raise FileError(f"{name} has more than {MOST_TRACKS} trackers; export those of the lights only")
    if not tracks:
        raise FileError(f"{name} has no tracker path; export Tracker 2-D Paths from SynthEyes")
    return TrackFile(
        tuple(track_of(name, key, *found, size_px=(1.0, 1.0)) for key, found in tracks.items()), "syntheyes"
    )
