"""Motion blur: how many sub-frames a moving flare needs, and their mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil, hypot

import numpy as np

from ..measure.replay.measured_project import is_measured
from ..model import Layer, Project
from ..model.matte import GhostMatte
from ..optics.lens.paths import direct_path, ghost_paths
from ..render.image.compose import add_layer
from ..render.image.ghost_ranking import GhostRanking
from ..render.scene.opening import make_opening
from ..render.scene.paraxial_place import ghost_frame
from ..render.scene.resolve import resolve_project
from ..render.scene.shots import make_shots
from ..typing import Floats, Pixels

MOST_SUBFRAMES = 64
"""Largest number of sub-frames that is chosen automatically."""
STEP_PX = 1.0
"""Largest motion of a ghost's edge between two sub-frames, pixels."""

# x, y and radius in pixels, by light and path
_Places = dict[tuple[int, str], tuple[float, float, float]]


def subframe_times(at_s: float, open_s: float, number: int) -> tuple[float, ...]:
    """Return the times of sub-frames: the middles of equal parts of a shutter's time around a frame's time.

    Parameters
    ----------
    at_s : float
        Time of the frame.
    open_s : float
        Time that the shutter is open, half of it before the frame.
    number : int

    Returns
    -------
    tuple of float

    Examples
    --------
    >>> subframe_times(1.0, 0.5, 2)
    (0.875, 1.125)
    """
    return tuple(at_s + open_s * ((k + 0.5) / number - 0.5) for k in range(number))


def subframe_count(projects: Sequence[Project]) -> int:
    """Return the number of sub-frames for which no ghost's edge moves more than `STEP_PX` from one to the next.

    Parameters
    ----------
    projects : sequence of Project
        Samples over the open shutter, in the order of time.

    Returns
    -------
    int
        1 to `MOST_SUBFRAMES`.
    """
    return max(1, min(MOST_SUBFRAMES, ceil(motion_px(projects) / STEP_PX - 1e-6)))


def motion_px(projects: Sequence[Project]) -> float:
    """Return the longest way of an edge of the flare over some moments.

    Parameters
    ----------
    projects : sequence of Project
        In the order of time, of the same lens.

    Returns
    -------
    float
        The most that the centre of a ghost, or of the direct image, moves plus the change of its radius, pixels, by
        matrices (`render.scene.paraxial_place`). Ghosts that never reach the picture do not count.

    Notes
    -----
    A measured flare has no matrices: its lights' ways on the sensor of the ideal lens count, twice, because its ghosts
    move the other way.
    """
    if all(project == projects[0] for project in projects):
        return 0.0
    if is_measured(projects[0]):
        return 2.0 * _way([_lights(project) for project in projects])
    moments = [_ghosts(project) for project in projects]
    # a ghost that enters or leaves the picture moves all the time
    seen = set().union(*(names for _, names in moments))
    return _way([{name: place for name, place in places.items() if name in seen} for places, _ in moments])


def _way(moments: Sequence[_Places]) -> float:
    """Return the longest way of any ghost that exists at all moments."""
    longest = 0.0
    for name in moments[0]:
        if all(name in moment for moment in moments):
            steps = pairwise(moment[name] for moment in moments)
            longest = max(longest, sum(hypot(bx - ax, by - ay) + abs(br - ar) for (ax, ay, ar), (bx, by, br) in steps))
    return longest


def _ghosts(project: Project) -> tuple[_Places, set[tuple[int, str]]]:
    """Return places and radii of ghosts and of the direct images, and which count: those that meet the picture."""
    settled = resolve_project(project)
    width, height = settled.project.camera.size_px
    paths = [direct_path(settled.lens), *ghost_paths(settled.lens, project.quality.paths)]
    # a mask's pixels do not change places
    opening = make_opening(settled, None)
    found: _Places = {}
    seen: set[tuple[int, str]] = set()
    for k, shot in enumerate(make_shots(settled, opening)):
        scale = np.abs(shot.to_pixels[2:])
        for number, path in enumerate(paths):
            frame = ghost_frame(shot, path)
            (x, y), radius = np.array(frame.centre) * scale, frame.radius * float(scale.max())
            if not np.isfinite(x + y + radius):
                continue
            found[k, str(number)] = (float(x), float(y), float(radius))
            if number == 0 or max(abs(x) - 0.5 * width, abs(y) - 0.5 * height) < radius:
                seen.add((k, str(number)))
    return found, seen


def _lights(project: Project) -> _Places:
    """Return where an ideal lens of the default field images the lights."""
    width = project.camera.size_px[0]
    scale = width / project.camera.sensor[0]
    focal = 36.0
    return {
        (k, ""): (*(scale * focal * float(np.tan(np.radians(angle))) for angle in light.field_deg), 0.0)  # type: ignore[misc]
        for k, light in enumerate(project.lights)
    }


class MeanMatte:
    """The mean of the mattes of sub-frames, added one after the other.

    Twice as many objects as the matte has are kept at a pixel while it is made: one that is faint in a sub-frame can
    become one of the brightest.

    Parameters
    ----------
    ranks : int
        Of the mattes, and of their mean.
    """

    def __init__(self, ranks: int) -> None:
        self._ranks, self._number = ranks, 0
        self._ranking: GhostRanking | None = None
        self._total: Pixels | None = None

    def add(self, matte: GhostMatte) -> None:
        """Add the matte of a sub-frame."""
        height, width = matte.total.shape
        if self._ranking is None or self._total is None:
            self._ranking, self._total = GhostRanking((width, height), 2 * self._ranks), np.zeros_like(matte.total)
        self._ranking.merge(matte)
        self._total += matte.total
        self._number += 1

    def mean(self) -> GhostMatte | None:
        """Return the mean; None without a matte."""
        if self._ranking is None or self._total is None:
            return None
        return self._ranking.matte(self._total / np.float32(self._number), self._ranks, 1.0 / self._number)


def mean_layers(frames: Iterable[Sequence[Layer]], size_px: tuple[int, int], number: int) -> tuple[Layer, ...]:
    """Return the mean of the layers of sub-frames, which conserves their energy.

    Parameters
    ----------
    frames : iterable of sequence of Layer
        Consumed one after the other, so that only one of them is in memory.
    size_px : tuple of int
        Width and height of the picture.
    number : int
        How many frames there are.

    Returns
    -------
    tuple of Layer
        In the order in which names first occur, at the size of the picture; 0 where a frame lacks a layer.
    """
    width, height = size_px
    sums: dict[str, Floats] = {}
    kept: dict[str, Layer] = {}
    for layers in frames:
        for layer in layers:
            total = sums.setdefault(layer.name, np.zeros((height, width, 3)))
            kept.setdefault(layer.name, layer)
            add_layer(total, layer)
    window = (0, 0, width, height)
    return tuple(
        # the variance of a mean of independent values
        replace(
            kept[name],
            pixels=(total / (number**2 if name.endswith(".variance") else number)).astype(np.float32),
            window=window,
        )
        for name, total in sums.items()
    )
