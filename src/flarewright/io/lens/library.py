"""The lens library, and the search of lens files by name or path."""

from __future__ import annotations

import difflib
from functools import cache
from importlib.resources import files
from pathlib import Path

from flarewright.errors import LensError

from ..files.door import expanded
from ..files.file_kind import LENS_SUFFIXES


@cache
def library_names() -> tuple[str, ...]:
    """Return the names of the library's lenses in alphabetical order."""
    folder = _folder()
    if not folder.is_dir():
        return ()
    return tuple(sorted(entry.stem for entry in folder.iterdir() if entry.suffix == ".toml"))


def lens_path(name_or_path: str | Path) -> Path:
    """Return the path of a lens file, given by a name of the library or by its path.

    Parameters
    ----------
    name_or_path : str or Path
        "heliar-tronnier" (case, spaces and underscores do not matter) or "my/lens.toml".

    Returns
    -------
    Path

    Raises
    ------
    LensError
        When it is neither in the library nor a file; the message suggests near names.
    """
    text = str(name_or_path)
    by_key = {_key(name): name for name in library_names()}
    if (name := by_key.get(_key(text))) and not (isinstance(name_or_path, Path) and name_or_path.exists()):
        return _folder() / f"{name}.toml"
    path = expanded(text)
    if path.exists():
        return path
    if path.is_symlink():
        raise LensError(f"{text} is a broken link: give the path of the file itself")
    if path.suffix.lower() in LENS_SUFFIXES or path.parent != Path():
        raise LensError(
            f"{text} does not exist: check the path, or choose a shipped lens (flarewright lenses lists them)"
        )
    near = near_names(text)
    hint = f": did you mean {' or '.join(near)}?" if near else ""
    raise LensError(f"{text!r} is neither a shipped lens nor a file{hint or ': flarewright lenses lists the names'}")


def near_names(text: str) -> tuple[str, ...]:
    """Return up to three names of the library that resemble a text, the nearest first."""
    by_key = {_key(name): name for name in library_names()}
    return tuple(by_key[key] for key in difflib.get_close_matches(_key(text), by_key, n=3, cutoff=0.5))


def in_library(path: Path) -> bool:
    """Return whether a file belongs to the library."""
    return path.parent == _folder()


@cache
def _folder() -> Path:
    return Path(str(files("flarewright") / "lenses"))


def _key(name: str) -> str:
    return "-".join(name.lower().replace("_", " ").replace("-", " ").split())
