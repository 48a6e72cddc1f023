"""Open and check all files that a project's render reads, and collect the errors."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlarewrightError, ProjectError

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..model import Project
    from ..render.scene.resolve import ResolvedProject


def open_project_files(file: Path | str, project: Project) -> ResolvedProject:
    """Read all files that a project's render reads.

    Parameters
    ----------
    file : path or str
        File of the project, or another name of it, for messages.
    project : Project
        Project with a lens.

    Raises
    ------
    FlarewrightError
        With all errors of the project.
    """
    from ..io.images.mask_image import read_mask
    from ..optics.rays.pack import resolve_coatings
    from ..render.scattering.scatter_pass import check_scatter
    from ..render.scene.art_rules import resolve_art
    from ..render.scene.holdout import read_plates
    from ..render.scene.resolve import resolve_project
    from ..render.starburst.starburst_pass import read_soil
    from ..sentences import summary

    settled = resolve_project(project)
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
        raise ProjectError(summary(str(file), list(errors)), tuple(errors))
    return settled
