"""`flarewright lens convert`: write any readable lens file in Flarewright's format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...errors import OutputError
from ..common import (
    APERTURES_HELP,
    FIRST_COLUMN_HELP,
    aperture_reading,
    check_free,
    check_place,
    first_column_reading,
    print_remarks,
)

EPILOG = (
    "Examples:\n\nflarewright lens convert old/tessar.lens tessar.toml\n\nflarewright lens convert double-gauss.zmx "
    "own.toml"
)


def convert(
    source: Annotated[str, typer.Argument(metavar="IN", help="A lens file of any known kind, or a shipped name.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The lens file to write, *.toml.")],
    apertures: Annotated[str | None, typer.Option(metavar="KIND", help=APERTURES_HELP)] = None,
    first_column: Annotated[str | None, typer.Option(metavar="KIND", help=FIRST_COLUMN_HELP)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> None:
    """Convert a lens to a Flarewright lens file: repaired, completed, with estimates marked."""
    check_place(target, ".toml")
    if target.exists() and Path(source).exists() and target.samefile(source):
        raise OutputError(f"{target} is the file to convert; give another name for the output")
    check_free(target, force)
    reading, column = aperture_reading(apertures), first_column_reading(first_column)
    from ...io.lens.lens_writer import write_lens
    from ...render.scene.resolve import open_lens

    opened = open_lens(source, apertures=reading, first_column=column)
    write_lens(opened.lens, target)
    print_remarks([*opened.remarks, f"wrote {target}"])
