"""Which files are films."""

from __future__ import annotations

import os
from pathlib import Path

FILM_SUFFIXES = (
    ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".mxf", ".mpg", ".mpeg", ".ts", ".mts", ".m2ts", ".wmv", ".ogv",
)  # fmt: skip
"""Films that are read, if their codec is known."""


def is_film(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a film, by its suffix.

    Examples
    --------
    >>> is_film("drive.MP4"), is_film("drive.####.exr")
    (True, False)
    """
    return Path(path).suffix.lower() in FILM_SUFFIXES
