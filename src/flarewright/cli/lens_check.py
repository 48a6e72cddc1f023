"""`flarewright lens check`: whether lens files can be used."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from ..errors import FlarewrightError, naming
from .common import APERTURES_HELP, aperture_reading, print_json, refusal

EPILOG = "Example:\n\nflarewright lens check my-lenses/*.lens"


def check(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Lens files or shipped names.")],
    apertures: Annotated[str | None, typer.Option(metavar="KIND", help=APERTURES_HELP)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Tell which lens files are usable and what had to be repaired; exit code 2 when any is refused."""
    from ..io.mask_image import read_mask
    from ..render.prepare import first_order, load_lens

    reading = aperture_reading(apertures)
    results: list[dict[str, Any]] = []
    for file in files:
        remarks: list[str] = []
        try:
            lens = load_lens(file, remarks=remarks, apertures=reading)
            order = first_order(lens)
            if lens.iris.mask is not None:
                with naming(file):
                    read_mask(lens.iris.mask)
        except FlarewrightError as error:
            results.append(refusal(file, error))
            continue
        results.append(
            {
                "file": file,
                "usable": True,
                "name": lens.name,
                "efl_mm": order.efl,
                "f_number": lens.f_number,
                "remarks": remarks,
            }
        )
    if as_json:
        print_json({"files": results})
    else:
        _print(results)
    refused = sum(not result["usable"] for result in results)
    if refused:
        what = results[0]["reason"] if len(results) == 1 else f"{refused} of {len(results)} lens files were refused"
        print(f"flarewright: error: {what}", file=sys.stderr)
        raise typer.Exit(2)


def _print(results: list[dict[str, Any]]) -> None:
    for result in results:
        if result["usable"]:
            print(
                f"{result['file']}: usable, {result['name']}, efl {result['efl_mm']:.2f} mm, f/{result['f_number']:g}"
            )
            findings = result["remarks"]
        else:
            print(f"{result['file']}: refused, {result['reason']}")
            findings = result["problems"] if len(result["problems"]) > 1 else []
        for finding in findings:
            print(f"  - {finding}")
