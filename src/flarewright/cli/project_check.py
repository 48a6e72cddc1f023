"""`flarewright project check`: whether a project file can be rendered."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import FlarewrightError, naming
from .common import print_json, refused_as_json, tell

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..model import Project
    from ..render.prepare import Settled


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A project file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Check a project and its lens, and tell every mistake at once; exit code 2 when it cannot be rendered."""
    from ..io.project_file import read_project
    from ..measure.rendering import is_measured

    with refused_as_json(file, as_json), naming(file):
        project = read_project(file)
        found = _measured(project) if is_measured(project) else _of_lens(read_everything(file, project))
    if as_json:
        print_json({"file": str(file), "usable": True, **found})
        return
    tell(found["remarks"])
    lights = f"{len(project.lights)} light{'s' if len(project.lights) > 1 else ''}"
    size = "x".join(str(side) for side in project.camera.size_px)
    opened = "" if found["f_number"] is None else f" at f/{found['f_number']:g}"
    mode = "measured" if is_measured(project) else project.quality.mode
    print(f"{file}: usable, {found['lens']}{opened}, {lights}, {size} pixels, {mode}")


def _measured(project: Project) -> dict[str, Any]:
    """Check a project of a measured flare; tell of it what is told of one with a lens."""
    from ..measure.rendering import check_measured, efl_mm, flare_of, opening_of

    check_measured(project)
    flare = flare_of(project)
    return {
        "lens": flare.name, "efl_mm": efl_mm(project, flare.model), "f_number": opening_of(project, flare.model),
        "remarks": list(flare.model.remarks),
    }  # fmt: skip


def _of_lens(settled: Settled) -> dict[str, Any]:
    return {
        "lens": settled.lens.name, "efl_mm": settled.order.efl, "f_number": settled.order.f_number,
        "remarks": list(settled.remarks),
    }  # fmt: skip


def read_everything(file: Path, project: Project) -> Settled:
    """Read everything that a project's render reads.

    Parameters
    ----------
    file : path
        Where the project stands, for messages.
    project : Project
        With a lens.

    Returns
    -------
    Settled

    Raises
    ------
    FlarewrightError
        All that is wrong with it, as one error.
    """
    from ..io.mask_image import read_mask
    from ..io.project_file import ProjectFileError
    from ..io.sentences import summary
    from ..optics.pack import resolve_coatings
    from ..render.art import resolve_art
    from ..render.holdout import read_plates
    from ..render.prepare import settle
    from ..render.scatter import check_scatter
    from ..render.starburst_pass import read_soil

    settled = settle(project)
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
