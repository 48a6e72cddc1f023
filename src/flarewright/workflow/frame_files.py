"""Sequences of images that hide lights: a holdout or a depth picture for each frame of a shot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import ProjectError
from ..jobs.frame_list import FramePattern, frames_text
from ..model import Project


def holdout_files(project: Project) -> tuple[str, ...]:
    """Return the files that hide lights of a project, or names with a place for the number of the frame."""
    holdouts = [project.holdout, *(light.holdout for light in project.lights)]
    return tuple(name for each in holdouts if each is not None for name in (each.image, each.depth) if name is not None)


def holdout_sequences(project: Project) -> list[FramePattern]:
    """Return the sequences of images that hide lights."""
    return [pattern for pattern in map(FramePattern, sorted({*holdout_files(project)})) if pattern.numbered]


def check_holdout_frames(project: Project, frames: Sequence[int]) -> None:
    """Raise ProjectError if a frame of a sequence that hides lights is missing or no picture; reads headers only."""
    from ..io.images.plate_image import check_header

    for pattern in holdout_sequences(project):
        there = set(pattern.found())
        missing = [frame for frame in frames if frame not in there]
        if missing:
            raise ProjectError(
                f"the holdout {pattern.text} lacks frame{'s'[: len(missing) > 1]} {frames_text(missing)[:80]}; give "
                "frames that exist"
            )
        for frame in frames:
            check_header(pattern.path(frame))


def with_frame_files(project: Project, frame: float) -> Project:
    """Return a project with the files of a frame instead of names with a place for its number.

    Parameters
    ----------
    project : Project
        Its holdouts, and those of its lights, can be sequences.
    frame : float
        Number; between two frames, the nearest one's files.
    """
    changes: dict[str, Any] = {}
    number = round(frame)
    if project.holdout is not None:
        changes["holdout"] = _numbered(project.holdout, number)
    if any(light.holdout is not None for light in project.lights):
        changes["lights"] = tuple(
            light if light.holdout is None else light.replace(holdout=_numbered(light.holdout, number))
            for light in project.lights
        )
    return project.replace(**changes) if changes else project


def _numbered(holdout: Any, frame: int) -> Any:
    files = {
        key: str(FramePattern(name).path(frame))
        for key in ("image", "depth")
        if (name := getattr(holdout, key)) is not None and FramePattern(name).numbered
    }
    return holdout.replace(**files) if files else holdout
