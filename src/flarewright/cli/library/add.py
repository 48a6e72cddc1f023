"""`flarewright library add`: add lens files to the user's library."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..common import (
    APERTURES_HELP,
    FIRST_COLUMN_HELP,
    aperture_reading,
    first_column_reading,
    one_bar,
    print_json,
    print_remarks,
)
from ..shared_options import Json

if TYPE_CHECKING:
    from ...workflow.own_library.addition import Addition

EPILOG = (
    "Examples:\n\nflarewright library add ~/lenses\n\nflarewright library add patents.zip\n\n"
    "flarewright library add tessar.zmx --name my-tessar"
)
# largest number of refused files that are listed one by one
_LISTED = 200


def add(
    places: Annotated[list[Path], typer.Argument(metavar="FOLDER|ZIP|FILE...", help="Where the lens files are.")],
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="Name of a single lens (default: that of its file).")
    ] = None,
    maker: Annotated[
        str | None, typer.Option(metavar="NAME", help="Maker of all lenses (default: found in their texts).")
    ] = None,
    apertures: Annotated[str | None, typer.Option(metavar="KIND", help=APERTURES_HELP)] = None,
    first_column: Annotated[str | None, typer.Option(metavar="KIND", help=FIRST_COLUMN_HELP)] = None,
    as_json: Json = False,
) -> None:
    """Add lens files of every known kind to your library; commands then find them by name.

    A file that the library has already is skipped, so an interrupted command resumes when it is repeated. Files that
    are no usable lens are listed with the reason. Exit code 2 if there was no usable lens at all.
    """
    from ...io.files.door import expanded
    from ...workflow.own_library.addition import add_lenses

    reading, column = aperture_reading(apertures), first_column_reading(first_column)
    with one_bar("library") as bar:
        found = add_lenses(
            [expanded(place) for place in places], name=name, maker=maker, apertures=reading, first_column=column,
            progress=bar,
        )  # fmt: skip
    if as_json:
        print_json(_data(found))
    else:
        _print(found)
    if not found.added and not found.known:
        if len(found.refused) == 1:
            why = found.refused[0].reason
        elif found.refused:
            why = "none of the files is a usable lens"
        else:
            why = "there are no lens files: check the folder"
        print(f"flarewright: error: {why}", file=sys.stderr)
        raise typer.Exit(2)


def _data(found: Addition) -> dict[str, Any]:
    """Return the JSON object of `--json`."""
    from ...io.lens.own.record import as_json

    return {
        "added": [as_json(record) for record in found.added],
        "known": [{"file": file, "name": there} for file, there in found.known],
        "refused": [{"file": one.file, "reason": one.reason} for one in found.refused],
        "other_files": found.others,
        "remarks": found.remarks,
    }


def _print(found: Addition) -> None:
    for record in found.added:
        print(f"{record.name}: {record.title}, {record.file}")
        for remark in record.remarks:
            print(f"  - {remark}")
    # the command's error names a single one
    alone = len(found.refused) == 1 and not found.added and not found.known
    for one in () if alone else found.refused[:_LISTED]:
        reason = one.reason if Path(one.file).name in one.reason else f"{one.file}: {one.reason}"
        print(f"flarewright: refused: {reason}", file=sys.stderr)
    if len(found.refused) > _LISTED:
        more = len(found.refused) - _LISTED
        print(f"flarewright: and {more} more refused files, which --json lists", file=sys.stderr)
    print_remarks([*found.remarks, _summary(found)])


def _summary(found: Addition) -> str:
    from ...sentences import count

    parts = [f"{count(len(found.added), 'lens', 'lenses')} added"]
    parts += [f"{len(found.known)} known already"] if found.known else []
    parts += [f"{len(found.refused)} refused"] if found.refused else []
    if found.others:
        kinds = ", ".join(f"{number} {suffix or 'without suffix'}" for suffix, number in list(found.others.items())[:8])
        parts.append(f"other files left out: {kinds}")
    return "; ".join(parts)
