"""`flarewright lens check`: whether lens files can be used."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import FlarewrightError, naming
from ..common import (
    APERTURES_HELP,
    FIRST_COLUMN_HELP,
    aperture_reading,
    error_data,
    first_column_reading,
    one_bar,
    print_json,
)
from ..shared_options import Json

if TYPE_CHECKING:
    from ...io.lens.formats.codev import FirstColumn
    from ...optics.lens_import.patent_repair import Apertures

EPILOG = "Example:\n\nflarewright lens check my-lenses/*.lens"


def check(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Lens files or shipped names.")],
    apertures: Annotated[str | None, typer.Option(metavar="KIND", help=APERTURES_HELP)] = None,
    first_column: Annotated[str | None, typer.Option(metavar="KIND", help=FIRST_COLUMN_HELP)] = None,
    as_json: Json = False,
) -> None:
    """Check lens files and list repairs; exit code 2 if any is rejected."""
    reading, column = aperture_reading(apertures), first_column_reading(first_column)
    results: list[dict[str, Any]] = []
    with one_bar("lenses") as bar:
        for done, file in enumerate(files):
            if bar is not None:
                bar(done / len(files), Path(file).name)
            results.append(_checked(file, reading, column))
    if as_json:
        print_json({"files": results})
    else:
        _print(results)
    refused = sum(not result["usable"] for result in results)
    if refused:
        what = results[0]["reason"] if len(results) == 1 else f"{refused} of {len(results)} lens files were rejected"
        print(f"flarewright: error: {what}", file=sys.stderr)
        raise typer.Exit(2)


def _checked(file: str, apertures: Apertures, first_column: FirstColumn | None) -> dict[str, Any]:
    """Return what `--json` lists of a file; one file's fault never ends the check of the others."""
    from ...io.files.door import sentences_for
    from ...io.images.mask_image import read_mask
    from ...optics.lens.paraxial import first_order
    from ...render.scene.resolve import open_lens

    try:
        with sentences_for(file, "a lens"):
            opened = open_lens(file, apertures=apertures, first_column=first_column)
            lens = opened.lens
            order = first_order(lens)
            if lens.iris.mask is not None:
                with naming(file):
                    read_mask(lens.iris.mask)
    except FlarewrightError as error:
        return error_data(file, error)
    return {
        "file": file,
        "usable": True,
        "name": lens.name,
        "efl_mm": order.efl,
        "f_number": lens.f_number,
        "remarks": opened.remarks,
    }


def _print(results: list[dict[str, Any]]) -> None:
    for result in results:
        if result["usable"]:
            print(
                f"{result['file']}: usable, {result['name']}, efl {result['efl_mm']:.2f} mm, f/{result['f_number']:g}"
            )
            findings = result["remarks"]
        else:
            print(f"{result['file']}: rejected, {result['reason']}")
            findings = result["problems"] if len(result["problems"]) > 1 else []
        for finding in findings:
            print(f"  - {finding}")
