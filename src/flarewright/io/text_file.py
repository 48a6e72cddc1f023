"""Read a person's text file with every way to fail told in a sentence."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from .toml_mistake import toml_sentence

LARGEST = 4_000_000
"""Bytes; a text file beyond it is something else under a wrong name."""


def read_bytes(path: str | Path, what: str, largest: int = LARGEST) -> bytes:
    """Read a small file.

    Parameters
    ----------
    path : str or Path
    what : str
        What the file should be, "a lens file", for the message.
    largest : int
        Bytes.

    Returns
    -------
    bytes

    Raises
    ------
    ValueError
        The file is missing, a folder, not readable, too large or empty; the message is one sentence.
    """
    file = Path(path)
    try:
        if file.is_dir():
            raise ValueError(f"{file} is a folder, not {what}: give the path of a file")
        if file.is_symlink() and not file.exists():
            raise ValueError(f"{file} is a link that leads nowhere: give the path of the file itself")
        if not file.exists():
            raise ValueError(f"{file} does not exist: check the path and the spelling")
        if not file.is_file():
            raise ValueError(f"{file} is not a regular file: give the path of {what}")
        size = file.stat().st_size
        if size > largest:
            raise ValueError(f"{file} has {size / 1e6:.1f} MB, too large for {what}: is it the right file?")
        data = file.read_bytes()
    except OSError as error:
        raise ValueError(
            f"{file} cannot be read ({(error.strerror or str(error)).lower()}): check its permissions"
        ) from None
    if not data.strip():
        raise ValueError(f"{file} is empty: {what} was expected")
    return data


def read_text(path: str | Path, what: str, largest: int = LARGEST) -> str:
    """Read a small UTF-8 text file.

    Parameters
    ----------
    path : str or Path
    what, largest
        As in `read_bytes`.

    Returns
    -------
    str
        Lines end with a line feed alone; a byte order mark is dropped.

    Raises
    ------
    ValueError
        The file cannot be read (as in `read_bytes`) or is not UTF-8; the message is one sentence.
    """
    data = read_bytes(path, what, largest)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"{path} is not UTF-8 text (line {line}): save it as UTF-8") from None
    return text.replace("\r\n", "\n")


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path : str or Path
    what : str
        What the file should be, "a lens file", for the message.

    Returns
    -------
    dict

    Raises
    ------
    ValueError
        The file cannot be read (as in `read_text`) or is not TOML; the message is one sentence with the line.
    """
    text = read_text(path, what)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path} {toml_sentence(text, error)}") from None
    except ValueError:
        # a whole number of thousands of digits, which Python does not turn into one
        line = next((k for k, line in enumerate(text.split("\n"), 1) if re.search(r"[\d_]{4301}", line)), 1)
        raise ValueError(f"{path} has a number of thousands of digits in line {line}: shorten it") from None
    except RecursionError:
        raise ValueError(f"{path} is not {what}: its tables are nested too deeply") from None


def check_version(data: dict[str, Any], newest: int, file: str) -> None:
    """Refuse a file that a newer program has written.

    Parameters
    ----------
    data : dict
        As read; without `schema_version` it counts as the first.
    newest : int
        The newest version that can be read.
    file : str
        What the message begins with: "the project file shot.toml".

    Raises
    ------
    ValueError
        When it is newer.
    """
    version = data.get("schema_version", 1)
    if isinstance(version, int) and version > newest:
        raise ValueError(f"{file} has schema_version {version}, newer than this program's {newest}: update Flarewright")


def lower_first(text: str) -> str:
    """Return the text with a small first letter, to stand inside a sentence."""
    return text[:1].lower() + text[1:]
