"""Options that mean the same in many commands."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from ..errors import OutputError

KnownLens = Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens (flarewright lenses) or a lens file.")]
FNumber = Annotated[float | None, typer.Option(help="f-number (default: wide open).")]
Zoom = Annotated[str | None, typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Number of threads (default: all cores).")]
Force = Annotated[bool, typer.Option("--force", help="Replace an existing file.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def output_name(text: str) -> str:
    """Return the value of `-o`; raise OutputError for an empty one, or for one that can be no name of a file.

    A path of no characters is the present folder, which `-o "$UNSET"` would fill.
    """
    if not text:
        raise OutputError("the name of the output is empty; give a file or a folder")
    if "\0" in text:
        raise OutputError("the name of the output has a null byte, which no file's name can have; give another name")
    return text


def output_path(text: str) -> Path:
    """Return the value of `-o` as a path; errors as of `output_name`."""
    return Path(output_name(text))


output_option = partial(typer.Option, "-o", "--output", parser=output_path)
"""The option of a command's output; add `metavar` and `help`."""
