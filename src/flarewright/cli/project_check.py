"""`flarewright project check`: whether a project file can be rendered."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import print_json, tell


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A project file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Check a project and its lens, and tell every mistake at once; exit code 2 when it cannot be rendered."""
    from ..io.project_file import read_project
    from ..optics.pack import resolve_coatings
    from ..render.art import resolve_art
    from ..render.holdout import read_plates
    from ..render.prepare import settle
    from ..render.scatter import check_scatter

    settled = settle(read_project(file))
    resolve_coatings(settled.lens, settled.coating)
    resolve_art(settled)
    check_scatter(settled)
    for light in settled.project.lights:
        read_plates(settled.project, light)
    if as_json:
        print_json(
            {
                "file": str(file),
                "usable": True,
                "lens": settled.lens.name,
                "efl_mm": settled.order.efl,
                "f_number": settled.order.f_number,
                "remarks": list(settled.remarks),
            }
        )
        return
    tell(settled.remarks)
    project, order = settled.project, settled.order
    lights = f"{len(project.lights)} light{'s' if len(project.lights) > 1 else ''}"
    size = "x".join(str(side) for side in project.camera.size_px)
    print(
        f"{file}: usable, {settled.lens.name} at f/{order.f_number:g}, {lights}, {size} pixels, {project.quality.mode}"
    )
