"""`flarewright design target`: a project whose targets are the ghosts of a photograph or of a measured flare."""

from __future__ import annotations

from math import atan, atan2, degrees, hypot, radians, tan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...errors import ProjectError
from ...workflow.defaults import WIDTH_MM
from ..common import check_free, check_place, field_angles, print_json, print_remarks, write_text
from .checks import check_sensor_width

if TYPE_CHECKING:
    from ...design.problem.photo_targets import PhotoGhost
    from ...measure.detection.single_image import Spot
    from ...model import Project

EPILOG = (
    "Examples:\n\nflarewright design target flare.exr --light 10,5 --focal 50 -o shot.toml\n\n"
    "flarewright design target run/model.json --light 8,0 --light 15,0 -o shot.toml\n\n"
    "Then: flarewright design solve shot.toml -o found"
)

# radius around the light's image without a search for ghosts, as a fraction of the picture's width
_GLOW = 0.06


def target(
    source: Annotated[
        Path, typer.Argument(metavar="PICTURE|MODEL.json", help="A photograph, or a ghost model of measure fit.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="PROJECT.toml", help="The project.")],
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
    most: Annotated[
        int, typer.Option(min=1, max=60, help="Largest number of ghosts, most visible first (default: 12).")
    ] = 12,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
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
    model = source.suffix.lower() == ".json"
    project = project_of_model(source, angles, sensor_width, most) if model else _of_picture(
        source, angles, sensor_width or WIDTH_MM, focal, most
    )  # fmt: skip
    from ...io.project.project_file import project_text

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


def project_of_model(source: Path, angles: list[tuple[float, float]], width: float | None, most: int) -> Project:
    """Return a project whose targets are a measured flare's ghosts for given lights and sensor width (mm).

    Without a width, it is the model's, else 36 mm.
    """
    from ...design.problem.photo_targets import seen_project
    from ...io.measurement.ghost_model_file import read_ghost_model
    from ...measure.detection.single_image import spots_of_model

    model = read_ghost_model(source)
    width = width or model.sensor_width_mm or WIDTH_MM
    pixel = width / model.size_px[0]
    lights = []
    for x, y in angles:
        constellation = degrees(atan(hypot(tan(radians(x)), tan(radians(y)))))
        lights.append(((x, y), _striking(spots_of_model(model, constellation), pixel, most)))
    sensor = (width, width * model.size_px[1] / model.size_px[0])
    return seen_project(lights, size_px=model.size_px, sensor_mm=sensor, focal_mm=model.focal_px * pixel)


def _of_picture(
    source: Path, angles: list[tuple[float, float]], width: float, focal: float | None, most: int
) -> Project:
    import numpy as np

    from ...design.problem.photo_targets import seen_project
    from ...io.images.picture import read_picture
    from ...measure.detection.single_image import spots_of_picture

    if len(angles) > 1:
        raise ProjectError("a photograph shows one light; give --light once")
    pixels = read_picture(source)
    high, wide = pixels.shape[:2]
    if min(high, wide) < 32:
        raise ProjectError(f"{source} is {wide} by {high} pixels, too small to find ghosts in")
    x, y = (tan(radians(angle)) for angle in angles[0])
    pixel, axis = width / wide, (0.5 * wide, 0.5 * high)
    hidden = None
    if focal is not None:
        place = axis[0] + focal * x / pixel, axis[1] - focal * y / pixel
        rows, columns = np.indices((high, wide)) + 0.5
        hidden = np.hypot(columns - place[0], rows - place[1]) < _GLOW * wide
    spots = spots_of_picture(pixels, axis, degrees(atan2(y, x)), most=60, hidden=hidden)
    sensor = (width, width * high / wide)
    ghosts = _striking(spots, pixel, most)
    return seen_project([(angles[0], ghosts)], size_px=(wide, high), sensor_mm=sensor, focal_mm=focal)


def _striking(spots: tuple[Spot, ...], pixel: float, most: int) -> list[PhotoGhost]:
    """Return the most visible ghosts in mm: those with the most light on their border."""
    from ...design.problem.photo_targets import PhotoGhost

    by_light = sorted(spots, key=lambda one: -sum(one.rgb) * one.radius_px)
    return [PhotoGhost(one.place_px * pixel, one.radius_px * pixel, one.rgb) for one in by_light[:most]]
