"""Where the user's lenses are, and the names they get."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Container
from pathlib import Path

from ....errors import OutputError
from ...files.state_folder import state_folder

# Windows has devices of these names, whatever follows a point
_DEVICES = frozenset({"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))})

LONGEST_NAME = 60
"""Largest number of characters of a name, without the number of a repeated one."""


def library_folder() -> Path:
    """Return the folder of the user's library, whether it exists or not."""
    return state_folder() / "library"


def lenses_folder() -> Path:
    """Return the folder with one `.toml` file a lens."""
    return library_folder() / "lenses"


def thumbnail_file(name: str) -> Path:
    """Return the path of the thumbnail of one of the user's lenses, whether it exists or not."""
    return library_folder() / "thumbnails" / f"{name}.jpg"


def own_lenses() -> dict[str, Path]:
    """Return the file of each of the user's lenses by its name, in alphabetical order; empty if there is no library.

    A folder that cannot be read counts as empty: every lens of a command is searched here first.
    """
    folder = lenses_folder()
    try:
        names = sorted(name for name in os.listdir(folder) if name.endswith(".toml") and not name.startswith("."))
    except OSError:
        return {}
    return {name.removesuffix(".toml"): folder / name for name in names}


def writable_folder() -> Path:
    """Create the folders of the library if they are missing.

    Returns
    -------
    Path
        `library_folder`.

    Raises
    ------
    OutputError
        They cannot be created or written.
    """
    folder = library_folder()
    try:
        for name in ("lenses", "images", "thumbnails"):
            (folder / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_writable(folder, error.strerror or str(error)) from None
    if not os.access(folder / "lenses", os.W_OK):
        raise _not_writable(folder, "permission denied")
    return folder


def _not_writable(folder: Path, reason: str) -> OutputError:
    return OutputError(
        f"the lens library {folder} cannot be written ({reason.lower()}): check its permissions, or set "
        "FLAREWRIGHT_STATE to another folder"
    )


def key_of(name: str) -> str:
    """Return a name in the form in which names are compared: case, spaces and underscores do not matter."""
    return "-".join(name.lower().replace("_", " ").replace("-", " ").split())


def spoken(text: str) -> str:
    """Return a text as a name of small letters, digits, points within numbers, and hyphens; "lens" if none remain.

    Examples
    --------
    >>> spoken("Zeiss Planar_50mm F/1,4 (1964)")
    'zeiss-planar-50mm-f-1.4-1964'
    """
    plain = unicodedata.normalize("NFKD", text.casefold()).encode("ascii", "ignore").decode().lower()
    plain = re.sub(r"(?<=\d)[.,](?=\d)", "\0", plain)
    plain = re.sub(r"[^a-z0-9\0]+", "-", plain).replace("\0", ".")
    plain = plain.strip("-.")
    if len(plain) > LONGEST_NAME:
        # cut between words, unless a single word is too long
        plain = plain[:LONGEST_NAME].rpartition("-")[0] or plain[:LONGEST_NAME]
    plain = plain.strip("-.") or "lens"
    return f"lens-{plain}" if plain.partition(".")[0] in _DEVICES else plain


def unused_name(text: str, taken: Container[str]) -> str:
    """Return the name that a text gives; with a number from 2 on if it is taken.

    Parameters
    ----------
    text : str
        A title or the stem of a file's name.
    taken : container of str
        Keys (`key_of`) of the names in use.
    """
    base = spoken(text)
    name, number = base, 2
    while key_of(name) in taken:
        name, number = f"{base}-{number}", number + 1
    return name
