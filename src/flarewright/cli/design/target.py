"""`flarewright design target`: a project whose targets are the ghosts of a photograph or of a measured flare."""

from __future__ import annotations

from math import hypot
from pathlib import Path
from typing import Annotated

import typer

from ...errors import ProjectError
from ...workflow.defaults import WIDTH_MM
from ..common import check_free, check_place, field_angles, print_json, print_remarks, write_text
from ..shared_options import Force, Json, output_option
from .checks import check_sensor_width
from .options import MostGhosts

EPILOG = (
    "Examples:\n\nflarewright design target flare.exr --light 10,5 --focal 50 -o shot.toml\n\n"
    "flarewright design target run/model.json --light 8,0 --light 15,0 -o shot.toml\n\n"
    "Then: flarewright design solve shot.toml -o found"
)


def target(
    source: Annotated[
        Path, typer.Argument(metavar="PICTURE|MODEL.json", help="A photograph, or a ghost model of measure fit.")
    ],
    output: Annotated[Path, output_option(metavar="PROJECT.toml", help="The project.")],
    light: Annotated[
        list[str],
        typer.Option(metavar="X,Y", help="Field angles in degrees, right and up; may be repeated for a model."),
    ],
    sensor_width: Annotated[
        float | None, typer.Option(help="Width of the sensor in the picture, mm (default: that of a model, else 36).")
    ] = None,
    focal: Annotated[
        float | None, typer.Option(metavar="MM", help="Focal length of a photograph; a model contains it.")
    ] = None,
    most: MostGhosts = 12,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a project whose targets are the ghosts in a picture; check it before `design solve`."""
    check_place(output, ".toml")
    check_free(output, force)
    check_sensor_width(sensor_width)
    if focal is not None and not 0.5 <= focal <= 10000.0:
        raise ProjectError(f"--focal {focal:g} is no focal length; give millimetres above 0.5")
    angles = [field_angles(text) for text in light]
    if not all(hypot(*one) > 0.0 for one in angles):
        raise ProjectError("a light on the axis puts every ghost at its middle; give the light's true angles")
    from ...io.project.project_text import project_text
    from ...workflow.searches.flare_targets import project_of_model, project_of_picture

    if source.suffix.lower() == ".json":
        project = project_of_model(source, angles, sensor_width, most)
    elif len(angles) > 1:
        raise ProjectError("a photograph shows one light; give --light once")
    else:
        project = project_of_picture(source, angles[0], sensor_width or WIDTH_MM, focal, most)
    write_text(output, project_text(project, folder=output.parent))
    assert project.design is not None
    ghost_targets = project.design.ghost_targets
    print_remarks([f"wrote {output}"])
    if as_json:
        print_json({"project": str(output), "ghosts": [
            {"light": one.light or 0, "place_mm": one.place_mm, "radius_mm": one.radius_mm, "color": one.color}
            for one in ghost_targets
        ]})  # fmt: skip
        return
    print(f"{len(ghost_targets)} ghosts; remove false ones from {output}, and continue with flarewright design solve")
