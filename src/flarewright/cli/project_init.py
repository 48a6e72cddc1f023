"""`flarewright project init`: a project file to begin with."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .common import check_free, check_place, field_angles, tell, write_text

if TYPE_CHECKING:
    from ..model import Light, Project

EPILOG = (
    "Example:\n\nflarewright project init heliar-tronnier -o shot.toml\n\n"
    "flarewright render --project shot.toml -o shot.exr"
)


def init(
    lens: Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens, a lens file, or a measured flare.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The project file, *.toml; left out: stdout.")
    ] = None,
    light: Annotated[str, typer.Option(metavar="X,Y", help="The first light, degrees right and up.")] = "10,5",
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there already.")] = False,
) -> None:
    """Write a project file with every setting, its default and a few words about it."""
    angles = field_angles(light)
    if output is not None:
        check_place(output, ".toml")
        check_free(output, force)
    from ..io.ghost_model_file import names_ghost_model
    from ..io.project_file import project_text
    from ..model import Light

    remarks: list[str] = []
    here = Light(field_deg=angles)
    project = _measured(lens, here) if names_ghost_model(lens) else _of_lens(lens, here, remarks)
    text = project_text(project, folder=output.parent if output else None, comments=True)
    if output is None:
        print(text, end="")
        return
    write_text(output, text)
    tell([*remarks, f"wrote {output}"])


def _of_lens(lens: str, light: Light, remarks: list[str]) -> Project:
    from ..io.library import lens_path, shipped
    from ..model import Project
    from ..render.prepare import load_lens

    loaded = load_lens(lens, remarks=remarks)
    found = lens_path(lens)
    # A shipped lens keeps its name; a file is named as the project's folder sees it.
    ships = found.stem in shipped() and not Path(lens).exists()
    return Project(lens=found.stem if ships else os.fspath(found), lights=(light,), iris=loaded.iris)


def _measured(path: str, light: Light) -> Project:
    """Show the whole frame of the captures."""
    from ..measure.rendering import check_measured, flare_of
    from ..model import Camera, Project

    project = Project(lens=path, lights=(light,))
    shown: Project = project.replace(camera=Camera(size_px=flare_of(project).model.size_px))
    check_measured(shown)
    return shown
