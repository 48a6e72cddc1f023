"""Precomputed thumbnails of the library's lenses and looks (`tools/thumbnails.py` makes them)."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

from ...errors import ProjectError

SIZE_PX = (480, 270)


def thumbnail(kind: str, name: str) -> bytes:
    """Return the thumbnail of a lens or a look of the library.

    Parameters
    ----------
    kind : {"lens", "look"}
    name : str

    Returns
    -------
    bytes
        JPEG, `SIZE_PX`.

    Raises
    ------
    ProjectError
        When the library has no such name.
    """
    path = thumbnail_path(kind, name)
    # names can come from web requests: read only files of this folder
    if path.name not in _known():
        raise ProjectError(f"{name!r} is no {kind} of the library")
    return path.read_bytes()


def thumbnail_path(kind: str, name: str) -> Path:
    """Return the path of the thumbnail of a lens or a look."""
    return _folder() / f"{kind}-{name}.jpg"


@cache
def _known() -> frozenset[str]:
    return frozenset(entry.name for entry in _folder().iterdir())


@cache
def _folder() -> Path:
    return Path(str(files("flarewright") / "thumbnails"))
