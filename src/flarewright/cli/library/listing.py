"""`flarewright library list`: the user's lenses."""

from __future__ import annotations

from ..common import one_bar, print_json, print_remarks
from ..shared_options import Json
from .tables import print_records

EPILOG = "Search them with: flarewright library search zeiss --focal 35-85"


def listing(as_json: Json = False) -> None:
    """List the lenses of your library with focal length, f-number, field, maker and patent."""
    from ...io.lens.own.folder import library_folder
    from ...io.lens.own.record import as_json as record_json
    from ...workflow.own_library.own_lenses import own_library

    with one_bar("library") as bar:
        library = own_library(bar)
    print_remarks(library.remarks)
    if as_json:
        lenses = [record_json(record) for record in library.records]
        print_json({"folder": str(library_folder()), "lenses": lenses, "remarks": library.remarks})
    elif library.records:
        print_records(library.records)
    else:
        print_remarks(["your library is empty; fill it with flarewright library add FOLDER"])
