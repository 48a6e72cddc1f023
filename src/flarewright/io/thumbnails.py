"""Small pictures of the library's lenses and looks that ship, so that nobody waits for them (tools/thumbnails.py)."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

from ..errors import ProjectError

SIZE_PX = (480, 270)

__all__ = ["SIZE_PX", "thumbnail", "thumbnail_path"]


def thumbnail(kind: str, name: str) -> bytes:
    """Return the picture of a lens or a look of the library.

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
        When the library has none of that name.
    """
    path = thumbnail_path(kind, name)
    # names come from the web too: only what lies in the folder is read
    if path.name not in _known():
        raise ProjectError(f"{name!r} is no {kind} of the library")
    return path.read_bytes()


def thumbnail_path(kind: str, name: str) -> Path:
    """Return where the picture of a lens or a look lies."""
    return _folder() / f"{kind}-{name}.jpg"


@cache
def _known() -> frozenset[str]:
    return frozenset(entry.name for entry in _folder().iterdir())


@cache
def _folder() -> Path:
    return Path(str(files("flarewright") / "thumbnails"))
