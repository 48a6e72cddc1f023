"""Lenses by name: those that ship with the program, and those of the user's library (`own`); lens files by path."""

from __future__ import annotations

import difflib
from functools import cache
from importlib.resources import files
from pathlib import Path

from ...errors import LensError
from ..files.door import expanded
from ..files.file_kind import LENS_SUFFIXES
from .own.folder import key_of, own_lenses


@cache
def library_names() -> tuple[str, ...]:
    """Return the names of the shipped lenses in alphabetical order."""
    folder = _folder()
    if not folder.is_dir():
        return ()
    return tuple(sorted(entry.stem for entry in folder.iterdir() if entry.suffix == ".toml"))


def lens_path(name_or_path: str | Path) -> Path:
    """Return the path of a lens file, given by a name or by its path.

    Parameters
    ----------
    name_or_path : str or Path
        "heliar-tronnier" (case, spaces and underscores do not matter) or "my/lens.toml". A shipped lens comes before
        a lens of the user's library, and that before a file.

    Raises
    ------
    LensError
        When it is neither a lens of a library nor a file; the message suggests near names.
    """
    text = str(name_or_path)
    if not (isinstance(name_or_path, Path) and name_or_path.exists()) and (found := _by_name(text)) is not None:
        return found
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


def _by_name(text: str) -> Path | None:
    """Return the file of a lens by its name; None if no library has it."""
    key = key_of(text)
    if (name := _shipped_keys().get(key)) is not None:
        return _folder() / f"{name}.toml"
    return next((path for name, path in own_lenses().items() if key_of(name) == key), None)


def library_name(text: str) -> str | None:
    """Return the name of the lens, shipped or of the user's library, that a text names.

    Parameters
    ----------
    text : str
        As for `lens_path`.

    Returns
    -------
    str or None
        None for the path of a file, and for a text that names no lens.
    """
    if Path(text).exists():
        return None
    path = _by_name(text)
    return None if path is None else path.stem


def near_names(text: str) -> tuple[str, ...]:
    """Return up to three names that resemble a text, of shipped lenses and the user's, the nearest first."""
    by_key = {key_of(name): name for name in own_lenses()} | _shipped_keys()
    return tuple(by_key[key] for key in difflib.get_close_matches(key_of(text), by_key, n=3, cutoff=0.5))


def in_library(path: Path) -> bool:
    """Return whether a file belongs to the shipped lenses."""
    return path.parent == _folder()


def is_own(name: str) -> bool:
    """Return whether a name is that of one of the user's lenses that no shipped lens hides."""
    return key_of(name) not in _shipped_keys() and name in own_lenses()


@cache
def _shipped_keys() -> dict[str, str]:
    return {key_of(name): name for name in library_names()}


@cache
def _folder() -> Path:
    return Path(str(files("flarewright") / "lenses"))
