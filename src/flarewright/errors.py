"""What Flarewright says when a person's input cannot be used.

Every message is one sentence that tells what is wrong, where, and what to do about it.
The command line prints it and ends with exit code 2; a library user catches `FlarewrightError`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any


class FlarewrightError(Exception):
    """A mistake in what a person gave; the message says what, where, and the remedy.

    Parameters
    ----------
    message : str
        One sentence for a person.
    problems : tuple of str, optional
        Every single finding, each with its row, when there are several.
    """

    def __init__(self, message: str, problems: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.problems = problems


class LensError(FlarewrightError):
    """A lens file that cannot be read or is no camera lens."""


class GlassError(FlarewrightError):
    """A glass that no catalogue knows, or a wavelength it is not known for."""


class ProjectError(FlarewrightError):
    """A project file or a combination of options that cannot be rendered."""


class OutputError(FlarewrightError):
    """A file that could not be written; nothing was left half-written."""


@contextmanager
def naming(file: str | PathLike[str]) -> Iterator[None]:
    """Let whatever is refused within name the file that it comes from.

    Parameters
    ----------
    file : path
        Begins the message of an error that does not name it already.
    """
    try:
        yield
    except FlarewrightError as error:
        if Path(file).name in str(error):
            raise
        raise type(error)(f"{file}: {error}", error.problems) from None


def optional(
    module: str, extra: str, what: str, *, kind: type[FlarewrightError] = FlarewrightError, hint: str = ""
) -> Any:
    """Import a module of a package that is not installed with Flarewright itself.

    Parameters
    ----------
    module : str
        Like "astral.sun".
    extra : str
        Which installs the package.
    what : str
        Needs it; begins the message.
    kind : type of FlarewrightError
    hint : str
        Ends the message.

    Returns
    -------
    module

    Raises
    ------
    FlarewrightError
        Of the given kind, when the package is not there.
    """
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise kind(
            f"{what} needs the package {package}; install it with: pip install 'flarewright[{extra}]'{hint}"
        ) from None
