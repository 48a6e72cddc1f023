"""`flarewright library search`: lenses by words and numbers."""

from __future__ import annotations

from typing import Annotated

import typer

from ..common import one_bar, print_json, print_remarks
from ..shared_options import Json
from .tables import print_records

EPILOG = (
    "Examples:\n\nflarewright library search zeiss --focal 35-85 --fstop -2\n\n"
    "flarewright library search --patent 2645156"
)


def search(
    words: Annotated[list[str] | None, typer.Argument(metavar="[WORD...]", help="Words that a lens has all.")] = None,
    focal: Annotated[
        str | None, typer.Option(metavar="MM|A-B", help="Focal length, within 4 % of one number, or a range.")
    ] = None,
    fstop: Annotated[str | None, typer.Option(metavar="F|A-B", help="f-number wide open: a number or a range.")] = None,
    field: Annotated[
        str | None, typer.Option(metavar="DEG|A-B", help="Half field of view in degrees: a number or a range.")
    ] = None,
    surfaces: Annotated[str | None, typer.Option(metavar="N|A-B", help="Number of surfaces, or a range.")] = None,
    maker: Annotated[str, typer.Option(metavar="NAME", help="Maker, or a part of the name.")] = "",
    patent: Annotated[str, typer.Option(metavar="NUMBER", help="Patent number, or a part of it.")] = "",
    own: Annotated[bool, typer.Option("--own", help="Search your library only, not the shipped lenses.")] = False,
    as_json: Json = False,
) -> None:
    """Search your library and the shipped lenses.

    Words are compared with name, title, maker, patent, source, notes and file.
    """
    from ...io.lens.own.record import as_json as record_json
    from ...io.lens.own.search import Query, matching, parse_range
    from ...workflow.own_library.own_lenses import own_library

    def limits(text: str | None, flag: str) -> tuple[float, float] | None:
        return None if text is None else parse_range(text, flag)

    query = Query(
        words=tuple(words or ()), maker=maker, patent=patent, focal_mm=limits(focal, "--focal"),
        f_number=limits(fstop, "--fstop"), field_deg=limits(field, "--field"), surfaces=limits(surfaces, "--surfaces"),
    )  # fmt: skip
    with one_bar("library") as bar:
        library = own_library(bar)
    mine = matching(library.records, query)
    shipped = []
    if not own:
        from ...workflow.own_library.lens_record import shipped_records

        shipped = matching(shipped_records(), query)
    names = frozenset(record.name for record in shipped)
    found = sorted([*mine, *shipped], key=lambda record: record.name)
    print_remarks(library.remarks)
    if as_json:
        print_json({"lenses": [{**record_json(record), "shipped": record.name in names} for record in found]})
    elif found:
        print_records(found, names)
    if not found:
        print_remarks(["no lens matches"])
