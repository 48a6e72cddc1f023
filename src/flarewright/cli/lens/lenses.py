"""`flarewright lenses`: the shipped lenses, and those of the user's library."""

from __future__ import annotations

from typing import Any

from ..common import console, focal_text, print_json, print_remarks
from ..shared_options import Json

EPILOG = "Show one with: flarewright lens show heliar-tronnier --plot heliar.svg"


def lenses(as_json: Json = False) -> None:
    """List the shipped lenses, then those of your library, with focal length, f-number, field and source."""
    from ...io.lens.library import lens_path, library_names
    from ...io.lens.own.record import as_json as record_json
    from ...io.lens.toml_lens import read_lens_toml
    from ...optics.lens.paraxial import first_order
    from ...optics.rays.pack import preset_names
    from ...workflow.own_library.own_lenses import own_library

    found: list[dict[str, Any]] = []
    for name in library_names():
        lens = read_lens_toml(lens_path(name)).lens
        order = first_order(lens)
        found.append(
            {
                "name": name,
                "title": lens.name,
                "efl_mm": order.efl,
                "f_number": lens.f_number,
                "field_deg": lens.field_deg,
                "surfaces": len(lens.rows) - 1,
                "coating_presets": sorted(preset_names(lens)),
                "source": lens.source,
            }
        )
    library = own_library()
    print_remarks(library.remarks)
    if as_json:
        print_json({"lenses": found, "own_lenses": [record_json(record) for record in library.records]})
        return
    from rich.table import Table

    out = Table(caption="Field: half angle in degrees.")
    out.add_column("name", no_wrap=True)
    for column in ("efl mm", "f/", "field", "surfaces"):
        out.add_column(column, justify="right", no_wrap=True)
    out.add_column("source")
    for lens_row in found:
        field = "-" if lens_row["field_deg"] is None else f"{lens_row['field_deg']:g}"
        out.add_row(
            lens_row["name"],
            f"{lens_row['efl_mm']:.1f}",
            f"{lens_row['f_number']:g}",
            field,
            str(lens_row["surfaces"]),
            lens_row["source"],
        )
    if library.records:
        out.add_section()
    for record in library.records:
        out.add_row(
            record.name,
            focal_text(record),
            f"{record.f_number:.3g}",
            "-" if record.field_deg is None else f"{record.field_deg:.1f}",
            str(record.surfaces),
            record.patent or record.title,
        )
    console().print(out)
