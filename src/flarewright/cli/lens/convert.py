"""`flarewright lens convert`: write any readable lens file in Flarewright's format or that of another program."""

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
from ..shared_options import Force

EPILOG = (
    "Examples:\n\nflarewright lens convert old/tessar.lens tessar.toml\n\nflarewright lens convert double-gauss.zmx "
    "own.toml\n\nflarewright lens convert canon-28-80 canon.zmx"
)


def convert(
    source: Annotated[str, typer.Argument(metavar="IN", help="A lens file of any known kind, or a shipped name.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The file to write: *.toml, .zmx, .csv, .lens, .json.")],
    apertures: Annotated[str | None, typer.Option(metavar="KIND", help=APERTURES_HELP)] = None,
    first_column: Annotated[str | None, typer.Option(metavar="KIND", help=FIRST_COLUMN_HELP)] = None,
    force: Force = False,
) -> None:
    """Convert a lens: repaired, completed, with estimates marked; other programs' formats by the suffix."""
    from ...io.files.file_kind import WRITTEN_LENS_SUFFIXES

    check_place(target, WRITTEN_LENS_SUFFIXES)
    if target.exists() and Path(source).exists() and target.samefile(source):
        raise OutputError(f"{target} is the file to convert; give another name for the output")
    check_free(target, force)
    reading, column = aperture_reading(apertures), first_column_reading(first_column)
    from ...render.scene.resolve import open_lens
    from ...workflow.lens_export import export_lens

    opened = open_lens(source, apertures=reading, first_column=column)
    left_out = export_lens(opened.lens, target)
    print_remarks([*opened.remarks, *left_out, f"wrote {target}"])
