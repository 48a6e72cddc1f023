"""`flarewright project init`: write a new project file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...errors import ProjectError
from ..common import check_free, check_place, field_angles, print_remarks, write_text
from ..render.tracks import compile_places, pixel_place
from ..shared_options import Force, output_option

if TYPE_CHECKING:
    from ...model import Light, Project

EPILOG = (
    "Example:\n\nflarewright project init heliar-tronnier -o shot.toml\n\n"
    "flarewright render --project shot.toml -o shot.exr"
)


def init(
    lens: Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens, a lens file, or a measured flare.")],
    output: Annotated[Path | None, output_option(help="The project file, *.toml (default: stdout).")] = None,
    light: Annotated[
        str | None, typer.Option(metavar="X,Y", help="The first light, degrees right and up (default: 10,5).")
    ] = None,
    light_px: Annotated[
        str | None, typer.Option(metavar="X,Y", help="Instead: its pixel from the top left corner of the picture.")
    ] = None,
    force: Force = False,
) -> None:
    """Write a project file with every setting, its default and a comment."""
    if light is not None and light_px is not None:
        raise ProjectError("--light and --light-px both place the first light; keep one")
    angles = field_angles("10,5" if light is None else light) if light_px is None else (0.0, 0.0)
    place = None if light_px is None else pixel_place(light_px)
    if output is not None:
        check_place(output, ".toml")
        check_free(output, force)
    from ...io.files.file_kind import is_ghost_model_file
    from ...io.project.project_text import project_text
    from ...model import Light

    here = Light(field_deg=angles)
    project, remarks = (_measured(lens, here), ()) if is_ghost_model_file(lens) else _of_lens(lens, here)
    if place is not None:
        from ...workflow.light_places import lights_at_pixels

        compile_places(project)
        project = lights_at_pixels(project, {0: place})
    text = project_text(project, folder=output.parent if output else None, comments=True)
    if output is None:
        print(text, end="")
        return
    write_text(output, text)
    print_remarks([*remarks, f"wrote {output}"])


def _of_lens(lens: str, light: Light) -> tuple[Project, tuple[str, ...]]:
    """Return a project with a lens, and remarks on the lens."""
    from ...io.lens.library import library_name
    from ...model import Project
    from ...render.scene.resolve import open_lens

    opened = open_lens(lens)
    found = opened.path
    assert found is not None
    # A lens of a library keeps its name; a file gets a path relative to the project's folder.
    name = library_name(lens) or os.fspath(found)
    return Project(lens=name, lights=(light,), iris=opened.lens.iris), opened.remarks


def _measured(path: str, light: Light) -> Project:
    """Return a project with the whole frame of the captures."""
    from ...measure.replay.measured_project import check_measured, flare_of, with_sensor
    from ...model import Camera, Project

    project = Project(lens=path, lights=(light,))
    shown = with_sensor(project.replace(camera=Camera(size_px=flare_of(project).model.size_px)))
    check_measured(shown)
    return shown
