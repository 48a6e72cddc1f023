"""`flarewright project check`: check whether a project file can be rendered."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import naming
from ..common import errors_as_json, print_json, print_remarks
from ..shared_options import Json

if TYPE_CHECKING:
    from ...model import Project
    from ...render.scene.resolve import ResolvedProject


def check(file: Annotated[Path, typer.Argument(metavar="FILE", help="A project file.")], as_json: Json = False) -> None:
    """Check a project and its lens, and list all errors; exit code 2 if it cannot be rendered."""
    from ...io.project.project_file import read_project
    from ...measure.replay.measured_project import is_measured
    from ...render.image.ocio_space import check_file_space
    from ...render.render import refuse_matte_of_reference
    from ...workflow.project_files import open_project_files

    with errors_as_json(file, as_json), naming(file):
        project = read_project(file)
        remarks = check_file_space(project)
        refuse_matte_of_reference(project)
        found = _measured(project) if is_measured(project) else _of_lens(open_project_files(file, project))
    found["remarks"] += remarks
    if as_json:
        print_json({"file": str(file), "usable": True, **found})
        return
    print_remarks(found["remarks"])
    lights = f"{len(project.lights)} light{'s' if len(project.lights) > 1 else ''}"
    size = "x".join(str(side) for side in project.camera.size_px)
    opened = "" if found["f_number"] is None else f" at f/{found['f_number']:g}"
    mode = "measured" if is_measured(project) else project.quality.mode
    print(f"{file}: usable, {found['lens']}{opened}, {lights}, {size} pixels, {mode}")


def _measured(project: Project) -> dict[str, Any]:
    """Check a project of a measured flare; return the same facts as for one with a lens."""
    from ...measure.replay.measured_project import check_measured, efl_mm, flare_of, opening_of

    check_measured(project)
    flare = flare_of(project)
    return {
        "lens": flare.name, "efl_mm": efl_mm(project, flare.model), "f_number": opening_of(project, flare.model),
        "remarks": list(flare.model.remarks),
    }  # fmt: skip


def _of_lens(settled: ResolvedProject) -> dict[str, Any]:
    return {
        "lens": settled.lens.name, "efl_mm": settled.order.efl, "f_number": settled.order.f_number,
        "remarks": list(settled.remarks),
    }  # fmt: skip
