"""`flarewright lenses`: the shipped lenses."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from ..common import console, print_json

EPILOG = "Show one with: flarewright lens show heliar-tronnier --plot heliar.svg"


def lenses(as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False) -> None:
    """List the shipped lenses with focal length, f-number, field and source."""
    from ...io.lens.library import lens_path, library_names
    from ...io.lens.toml_lens import read_lens_toml
    from ...optics.rays.pack import preset_names
    from ...render.scene.resolve import first_order

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
    if as_json:
        print_json({"lenses": found})
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
    console().print(out)
