"""Read text and TOML files; every failure raises one sentence for the user."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path
from typing import Any

from ...errors import FileError
from .door import outside, sentences_for, shown
from .file_kind import foreign_hint
from .toml_errors import toml_sentence

LARGEST = 4_000_000
"""Largest size of a text file, bytes; a larger file is of another kind."""

# parts of a dotted key; our files have up to five
_DEEPEST = 64
_STRINGS = re.compile(r""""(?:[^"\\]|\\.)*"|'[^']*'""")
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){{{_DEEPEST}}}")


def digest_of(path: str | Path) -> str | None:
    """Return the SHA-256 of a file's bytes as hexadecimal digits; None if there is no file to read."""
    try:
        digest = hashlib.sha256()
        with outside(path, "a file") as file:
            while part := file.read(1_000_000):
                digest.update(part)
        return digest.hexdigest()
    except FileError:
        return None


def read_bytes(path: str | Path, what: str, largest: int = LARGEST) -> bytes:
    """Read a small file.

    Parameters
    ----------
    path : str or Path
    what : str
        Expected kind of file, "a lens file", for the message.
    largest : int
        Bytes.

    Raises
    ------
    FileError
        The file is missing, a folder, not readable, too large or empty; the message is one sentence.
    """
    with outside(path, what, largest=largest) as file:
        data = file.read()
    if not data.strip():
        raise FileError(f"{shown(path)} is empty: {what} was expected")
    return data


def read_text(path: str | Path, what: str, largest: int = LARGEST, *, foreign: bool = False) -> str:
    """Read a small UTF-8 text file.

    Parameters
    ----------
    path : str or Path
    what, largest
        As in `read_bytes`.
    foreign : bool
        Whether a lens of another program is accepted.

    Returns
    -------
    str
        Lines end with a line feed alone; a byte order mark is dropped.

    Raises
    ------
    FileError
        The file cannot be read (as in `read_bytes`), is not UTF-8 or is a lens of another program; the message is one
        sentence.
    """
    data = read_bytes(path, what, largest)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        # a picture, say; UTF-16 has zeros too, but begins with its mark
        if b"\0" in data and not data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
            raise FileError(f"{shown(path)} is no text in UTF-8 but other data: {what} was expected") from None
        raise FileError(f"{shown(path)} is not UTF-8 text (line {line}): save it as UTF-8") from None
    if not foreign and (hint := foreign_hint(text)):
        raise FileError(f"{shown(path)} {hint}")
    return text.replace("\r\n", "\n")


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path : str or Path
    what : str
        Expected kind of file, "a lens file", for the message.

    Raises
    ------
    FileError
        The file cannot be read (as in `read_text`) or is not TOML; the message is one sentence with the line.
    """
    return parsed_toml(read_text(path, what), path, what)


def parsed_toml(text: str, path: str | Path, what: str) -> dict[str, Any]:
    """Parse TOML of a file; `path` and `what` are for messages, which are those of `read_toml`."""
    name = shown(path)
    for number, line in enumerate(text.split("\n"), 1):
        # a table inside a table inside ...: the parser's memory grows with the square of the depth
        if line.count(".") > _DEEPEST and _DEEP_KEY.search(_STRINGS.sub("s", line)):
            raise FileError(f"{name} line {number} has a key of more than {_DEEPEST} parts: it is not {what}")
    with sentences_for(path, what):
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise FileError(f"{name} {toml_sentence(text, error)}") from None
        except ValueError:
            # Python refuses to convert whole numbers of thousands of digits
            line_no = next((k for k, line in enumerate(text.split("\n"), 1) if re.search(r"[\d_]{4301}", line)), 1)
            raise FileError(f"{name} has a number of thousands of digits in line {line_no}: shorten it") from None
        except RecursionError:
            raise FileError(f"{name} is not {what}: its tables are nested too deeply") from None


def read_json(path: str | Path, what: str, largest: int = LARGEST, *, foreign: bool = False) -> Any:
    """Read a JSON file.

    Parameters
    ----------
    path : str or Path
    what, largest, foreign
        As in `read_text`.

    Returns
    -------
    object
        Parsed contents of any type.

    Raises
    ------
    FileError
        The file cannot be read (as in `read_text`) or is not JSON; the message is one sentence.
    """
    text = read_text(path, what, largest, foreign=foreign)
    with sentences_for(path, what):
        try:
            return json.loads(text)
        except json.JSONDecodeError as error:
            raise FileError(
                f"{shown(path)} is not valid JSON (line {error.lineno}): {lower_first(error.msg)}; is it {what}?"
            ) from None


def check_version(data: dict[str, Any], newest: int, file: str) -> None:
    """Raise an error for a file of a newer program version.

    Parameters
    ----------
    data : dict
        Parsed contents; a missing `schema_version` counts as 1.
    newest : int
        The newest version that this program reads.
    file : str
        Start of the message: "the project file shot.toml".

    Raises
    ------
    FileError
        When the file is newer.
    """
    version = data.get("schema_version", 1)
    if isinstance(version, int) and version > newest:
        raise FileError(f"{file} has schema_version {version}, newer than this program's {newest}: update Flarewright")


def lower_first(text: str) -> str:
    """Return the text with a lower-case first letter, for use inside a sentence."""
    return text[:1].lower() + text[1:]
