"""`flarewright library show`: what is known of a lens of the library."""

from __future__ import annotations

from typing import Annotated

import typer

from ..common import focal_text, print_json, print_remarks
from ..shared_options import Json

EPILOG = "Its rows and pupils: flarewright lens show NAME"


def show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A lens of your library.")], as_json: Json = False
) -> None:
    """Show where a lens of your library came from, what its reader repaired, and where its file is."""
    from ...io.lens.own.record import as_json as record_json
    from ...workflow.own_library.own_lenses import find_own, own_library

    own_name, path = find_own(name)
    library = own_library()
    record = next((one for one in library.records if one.name == own_name), None)
    print_remarks(remark for remark in library.remarks if own_name in remark)
    if record is None:
        raise typer.Exit(2)
    if as_json:
        print_json({**record_json(record), "path": str(path)})
        return
    zoom = focal_text(record)
    field = "" if record.field_deg is None else f", half field {record.field_deg:.1f} degrees"
    print(f"{record.name}: {record.title}")
    print(f"  {zoom} mm, f/{record.f_number:.3g}{field}, {record.surfaces} surfaces")
    for key, value in (
        ("maker", record.maker), ("patent", record.patent), ("source", record.source), ("notes", record.notes),
        ("made of", record.file), ("sha256", record.digest), ("file", str(path)),
    ):  # fmt: skip
        if value:
            print(f"  {key}: {value}")
    for remark in record.remarks:
        print(f"  - {remark}")
