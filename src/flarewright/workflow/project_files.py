"""Open and check all files that a project's render reads, and collect the errors."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlarewrightError, ProjectError
from .frame_files import check_holdout_frames, holdout_sequences, with_frame_files
from .keyframes import is_still, last_frame

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..model import Project
    from ..render.scene.resolve import ResolvedProject


def open_project_files(file: Path | str, project: Project) -> ResolvedProject:
    """Read all files that a project's render reads, and check its lens at every key of its curves.

    Sequences of images that hide lights need the frames up to the last key.

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
        *_holdout_stages(project),
        *(partial(_check_moment, project, at_s) for at_s in _times(project)),
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


def _holdout_stages(project: Project) -> list[Callable[[], object]]:
    """Return what reads the images that hide lights: all headers of sequences, and the pixels of one frame."""
    from ..render.scene.holdout import read_plates

    shown = project
    try:
        if sequences := holdout_sequences(project):
            if is_still(project):
                # any frames of the sequences can be drawn
                frames = sorted(set.intersection(*(set(pattern.found()) for pattern in sequences)))
                if not frames:
                    raise ProjectError(
                        f"the holdouts {', '.join(each.text for each in sequences)} have no frame in common; give "
                        "sequences with the same numbers"
                    )
            else:
                frames = list(range(project.timeline.start, last_frame(project) + 1))
            check_holdout_frames(project, frames)
            shown = with_frame_files(project, frames[0])
    except FlarewrightError as error:
        return [partial(_raise, error)]
    return [partial(read_plates, shown, light) for light in shown.lights]


def _raise(error: FlarewrightError) -> None:
    raise error


def _times(project: Project) -> list[float]:
    """Return the times of the keys of zoom, focus, f-number, iris and gains."""
    return sorted({at_s for curve in project.curves for at_s in curve.at_s})


def _check_moment(project: Project, at_s: float) -> None:
    """Raise an error for values that the lens cannot have together at a time."""
    from ..render.scene.resolve import resolve_project
    from .keyframes import project_at, still

    moment = still(project_at(project, at_s))
    try:
        resolve_project(moment)
    except FlarewrightError as error:
        raise type(error)(f"at {at_s:g} s: {error}", error.problems) from None
