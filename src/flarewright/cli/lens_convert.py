"""`flarewright lens convert`: any lens file that can be read, as Flarewright's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import OutputError
from .common import APERTURES_HELP, aperture_reading, check_free, check_place, tell

EPILOG = (
    "Examples:\n\nflarewright lens convert old/tessar.lens tessar.toml\n\nflarewright lens convert double-gauss.zmx "
    "own.toml"
)


def convert(
    source: Annotated[str, typer.Argument(metavar="IN", help="A lens file of any known kind, or a shipped name.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The lens file to write, *.toml.")],
    apertures: Annotated[str | None, typer.Option(metavar="KIND", help=APERTURES_HELP)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there already.")] = False,
) -> None:
    """Write a lens as a Flarewright lens file: repaired, complete, estimates marked."""
    check_place(target, ".toml")
    if target.exists() and Path(source).exists() and target.samefile(source):
        raise OutputError(f"{target} is the file to convert; give another name for the output")
    check_free(target, force)
    reading = aperture_reading(apertures)
    from ..io.lens_writer import write_lens
    from ..render.prepare import load_lens

    remarks: list[str] = []
    lens = load_lens(source, remarks=remarks, apertures=reading)
    write_lens(lens, target)
    tell([*remarks, f"wrote {target}"])
