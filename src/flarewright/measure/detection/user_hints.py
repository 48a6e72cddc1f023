"""Corrections by the user: ghosts to add to the search, ghosts to remove, and the report of their result."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import FlarewrightError
from ...model.measurement.capture import MergedRun
from ...model.measurement.corrections import Corrections, MarkedGhost
from ...model.measurement.ghost_model import AberrationGhost
from ...typing import Report
from ..core.views import View
from ..fitting.detected_ghost import DetectedGhost
from .rim_voting import RimCandidate

# score of a candidate from the user, higher than that of all others
_USER_SCORE = 1e9
# largest difference of frames of several rolls at one constellation, by the turntable's jitter, degrees
_SAME_DEG = 0.1


def candidate(
    pointed: MarkedGhost, views: Sequence[View], run: MergedRun, *, looked: int, factor: float
) -> RimCandidate:
    """Convert a ghost that the user marked in one frame to a candidate.

    Parameters
    ----------
    pointed : MarkedGhost
    views : sequence of View
        In order of rising constellation, at the size of the frames.
    run : MergedRun
    looked : int
        Number of views of the search.
    factor : float
        Pixels of a frame per pixel of the views of the search.

    Returns
    -------
    RimCandidate
        In pixels of the views of the search, with a score above all others.

    Raises
    ------
    FlarewrightError
        When the mark is outside the frames or the picture, or the light is on the axis, which leaves the speed unknown.
    """
    angles = np.array([view.constellation_deg for view in views])
    at = int(np.argmin(np.abs(angles - pointed.constellation_deg)))
    steps = np.diff(angles)
    if abs(angles[at] - pointed.constellation_deg) > float(steps.max(initial=0.0)):
        raise FlarewrightError(
            f"corrections: no frame shows {pointed.constellation_deg:g} degrees; use {angles[0]:g} to {angles[-1]:g}"
        )
    if not views[at].sigma > 0.0:
        raise FlarewrightError(
            "corrections: a ghost marked with the light on the axis has no speed; mark it in another frame"
        )
    if max(run.size_px) < pointed.radius_px:
        raise FlarewrightError(
            f"corrections: a ghost of radius {pointed.radius_px:g} pixels is larger than the picture"
        )
    if not all(0.0 <= place <= size for place, size in zip(pointed.centre_px, run.size_px, strict=True)):
        raise FlarewrightError(
            f"corrections: {_place(pointed)} is not in the picture of {run.size_px[0]} x {run.size_px[1]} pixels"
        )
    along, sigma = _placed(pointed, views, at)
    return RimCandidate(float(along / sigma) / factor, pointed.radius_px / factor, 0, looked - 1, _USER_SCORE)


def _placed(pointed: MarkedGhost, views: Sequence[View], nearest: int) -> tuple[float, float]:
    """Return the position of a mark towards the light, and the field.

    Captures of several rolls have one frame each at a constellation: ghosts lie on the light's line, so the mark is in
    the frame whose line it is nearest.
    """
    series: dict[float, View] = {}
    for view in sorted(views, key=lambda one: abs(one.constellation_deg - pointed.constellation_deg)):
        series.setdefault(view.nominal_roll_deg, view)
    here = views[nearest].constellation_deg
    found = []
    for view in series.values():
        if abs(view.constellation_deg - here) <= _SAME_DEG and view.sigma > 0.0:
            x, y, cosine, sine, _ = view.frame
            right, down = pointed.centre_px[0] - x, pointed.centre_px[1] - y
            found.append((abs(right * sine + down * cosine), right * cosine - down * sine, view.sigma))
    _, along, sigma = min(found)
    return float(along), sigma


def report_marks(
    corrections: Corrections, pointed: Sequence[RimCandidate], found: Sequence[DetectedGhost], report: Report
) -> None:
    """Report for each ghost that the user marked whether it was found, and its name.

    Parameters
    ----------
    corrections : Corrections
    pointed : sequence of RimCandidate
        Results of `candidate` for `corrections.add`.
    found : sequence of DetectedGhost
        In the same pixels.
    report : callable
        Receives one line per mark.
    """
    speeds = np.array([ghost.shapes[1].numbers[0] for ghost in found])
    for asked, one in zip(corrections.add, pointed, strict=True):
        away = np.abs(speeds - one.speed)
        if len(found) and away.min() < one.radius:
            report(f"the ghost marked {_place(asked)} is ghost {int(away.argmin()) + 1}")
        else:
            report(f"no ghost that moves with the light was found {_place(asked)}: mark ignored")


def without_removed(
    corrections: Corrections, ghosts: Sequence[AberrationGhost], report: Report
) -> tuple[AberrationGhost, ...]:
    """Drop the ghosts that the user removed, and report names that do not exist.

    Parameters
    ----------
    corrections : Corrections
    ghosts : sequence of AberrationGhost
    report : callable
        Receives one line per unknown name.
    """
    names = [ghost.name for ghost in ghosts]
    for name in corrections.remove:
        if name not in names:
            report(f"corrections: no ghost {name!r} to remove; found: {', '.join(names) or 'none'}")
    return tuple(ghost for ghost in ghosts if ghost.name not in corrections.remove)


def _place(pointed: MarkedGhost) -> str:
    x, y = pointed.centre_px
    return f"at ({x:g}, {y:g}) px, {pointed.constellation_deg:g} degrees"
