"""Exceptions for input that cannot be used, and helpers that raise them.

Every message is one sentence that says what is wrong, where, and how to fix it.
The command line prints it and exits with code 2; a library user catches `FlarewrightError`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

# input of the user in quotation marks; an apostrophe follows a letter
_LONG_QUOTE = re.compile(r"""(?<!\w)(['"])(?:(?!\1).){121,}\1(?!\w)""", re.DOTALL)
# longer than a file name
_LONG_WORD = re.compile(r"[^\s/\\]{256,}")


def _readable(message: str) -> str:
    """Return a message with quoted input and words longer than a file name cut in the middle to 120 characters."""

    def cut(found: re.Match[str]) -> str:
        text = found[0]
        return f"{text[:100]} ... {text[-15:]}"

    return _LONG_WORD.sub(cut, _LONG_QUOTE.sub(cut, message))


class FlarewrightError(Exception):
    """Invalid input from the user; the message says what, where, and the remedy.

    Parameters
    ----------
    message : str
        One sentence for the user.
    problems : tuple of str, optional
        All findings, each with its row, when there are several.
    """

    def __init__(self, message: str, problems: tuple[str, ...] = ()) -> None:
        super().__init__(_readable(message))
        self.problems = tuple(map(_readable, problems))


class FileError(FlarewrightError, ValueError):
    """A file that cannot be opened, exceeds the limit on memory, or that a library cannot read."""


class LensError(FlarewrightError):
    """A lens file that cannot be read or does not describe a camera lens."""


class GlassError(FlarewrightError):
    """A glass that is in no catalogue, or a wavelength outside the glass's range."""


class ProjectError(FlarewrightError):
    """A project file or a combination of options that cannot be rendered."""


class RecordError(ProjectError, ValueError):
    """A record made with impossible values; `problems` lists every field.

    It is a ValueError, so that pydantic reports it as an error of the record around it.
    """


class OutputError(FlarewrightError):
    """A file that could not be written; no partial file remains."""


@contextmanager
def naming(file: str | PathLike[str]) -> Iterator[None]:
    """Prepend the file name to the message of any `FlarewrightError` raised inside the block.

    Parameters
    ----------
    file : path
        The file being read. Messages that already contain its name stay as they are.
    """
    try:
        yield
    except FlarewrightError as error:
        if Path(file).name in str(error):
            raise
        raise type(error)(f"{file}: {error}", error.problems) from None


@contextmanager
def raised_as(kind: type[FlarewrightError]) -> Iterator[None]:
    """Raise a ValueError of the block, such as a `FileError`, as an error of another class with the same message."""
    try:
        yield
    except ValueError as error:
        raise kind(str(error)) from error


def optional(
    module: str, extra: str, what: str, *, kind: type[FlarewrightError] = FlarewrightError, hint: str = ""
) -> Any:
    """Import a module of an optional package.

    Parameters
    ----------
    module : str
        Such as "astral.sun".
    extra : str
        The extra of Flarewright that installs the package.
    what : str
        The feature that needs it; the message starts with it.
    kind : type of FlarewrightError
        Class of the exception.
    hint : str
        Text at the end of the message.

    Returns
    -------
    module

    Raises
    ------
    FlarewrightError
        The package is not installed; of class `kind`.
    """
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise kind(
            f"{what} needs the package {package}; install it with: pip install 'flarewright[{extra}]'{hint}"
        ) from None
