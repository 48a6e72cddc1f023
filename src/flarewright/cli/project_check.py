"""`flarewright project check`: whether a project file can be rendered."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import FlarewrightError, naming
from .common import print_json, refused_as_json, tell

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..render.prepare import Settled


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A project file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Check a project and its lens, and tell every mistake at once; exit code 2 when it cannot be rendered."""
    with refused_as_json(file, as_json), naming(file):
        settled = _settled(file)
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


def _settled(file: Path) -> Settled:
    """Read a project and everything that its render reads; all that is wrong with it is one error."""
    from ..io.mask_image import read_mask
    from ..io.project_file import ProjectFileError, read_project
    from ..io.sentences import summary
    from ..optics.pack import resolve_coatings
    from ..render.art import resolve_art
    from ..render.holdout import read_plates
    from ..render.prepare import settle
    from ..render.scatter import check_scatter
    from ..render.starburst_pass import read_soil

    settled = settle(read_project(file))
    project, mask = settled.project, settled.iris.mask
    stages: list[Callable[[], object]] = [
        lambda: resolve_coatings(settled.lens, settled.coating),
        lambda: resolve_art(settled),
        lambda: check_scatter(settled),
        lambda: None if mask is None else read_mask(mask),
        lambda: read_soil(project.dirt),
        *(partial(read_plates, project, light) for light in project.lights),
    ]
    errors: dict[str, FlarewrightError] = {}
    for stage in stages:
        try:
            stage()
        except FlarewrightError as error:
            errors.setdefault(str(error), error)
    if len(errors) == 1:
        raise next(iter(errors.values()))
    if errors:
        raise ProjectFileError(summary(str(file), list(errors)), tuple(errors))
    return settled
