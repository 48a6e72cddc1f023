"""Search the accepted pupil of every path for every light; lights and paths share work where they are alike.

For distant points, a rotationally symmetric lens shows each path the same part of the pupil at equal field angles, and
nearly the same at similar ones. So between two lights less than `STEP_RAD` apart in field angle, a path's region
lies within the union of their two regions plus a margin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...optics.lens.paths import LightPath
from ...optics.rays.pupil_region import Region, find_region, first_look, front_box, join_boxes
from ...typing import Floats
from ..scene.art_rules import PLAIN, PathArt
from ..scene.shot import Shot
from .final_pass import FinalPass
from .traced_ghosts import find_final

# largest difference in field angle of two lights whose regions bound those of the lights between
STEP_RAD = np.radians(0.5)
# by which the union of both regions is widened, relative to its size
MARGIN = 0.15
# if the union is larger than either region by this factor, the region moves too fast to be bounded
MOST_GROWTH = 3.0
# fewer lights are searched one by one
LEAST_LIGHTS = 8
# largest number of paths traced together to their common first mirror; rays of more do not fit the processor's cache
GROUP_SIZE = 8


def group_by_mirror(paths: Sequence[LightPath]) -> list[list[LightPath]]:
    """Split paths into groups with a common first mirror; the groups keep the order of the paths.

    Parameters
    ----------
    paths : sequence of LightPath

    Returns
    -------
    list of list of LightPath
        Second mirrors rise within a group.
    """
    groups: list[list[LightPath]] = []
    for path in paths:
        group = groups[-1] if groups else []
        alike = group and len(path.mirrors) == 2 and group[-1].mirrors[:-1] == path.mirrors[:-1]
        if alike and len(group) < GROUP_SIZE and group[-1].mirrors < path.mirrors:
            group.append(path)
        else:
            groups.append([path])
    return groups


def ghost_search(
    shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt], quick: bool = False
) -> Callable[[Sequence[LightPath]], list[list[FinalPass]]]:
    """Return a function that searches the ghosts of a group of paths for every light.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
        All paths of the picture.
    art : mapping of str to PathArt
        Overrides by path name.
    quick : bool
        As in `optics.rays.pupil_region.find_region`.

    Returns
    -------
    callable
        Takes a group of `group_by_mirror`; returns the ghosts of each path in the order of the shots, without those
        that pass no light.
    """
    # paths whose mirrors all lie behind the stop share the way to the stop
    entry_path = next((path.entry for path in paths if path.entry is not None), None)
    entries = [
        None if entry_path is None else find_region(shot.packed, entry_path, shot.incidence.tilt, shot.opening.radius)
        for shot in shots
    ]
    rows = _rows(shots)

    def search_path(
        path: LightPath, inside: Sequence[Region | None], traced: Sequence[Floats | None]
    ) -> list[FinalPass]:
        changed = art.get(path.name, PLAIN)
        found: dict[int, FinalPass | None] = {}

        def at(k: int, around: Floats | None = None) -> FinalPass | None:
            if k not in found:
                found[k] = find_final(shots[k], path, changed, inside[k], around, quick, traced[k])
            return found[k]

        for row in [] if changed.framed else rows:
            for first, last in _spans(shots, row):
                ends = at(row[first]), at(row[last])
                for k in row[first + 1 : last]:
                    at(k, _between(shots[k], ends))
        return [item for item in map(at, range(len(shots))) if item is not None]

    def search_group(group: Sequence[LightPath]) -> list[list[FinalPass]]:
        # paths with a common first mirror share the entry
        inside = entries if group[0].entry is not None else [None] * len(shots)
        traced: list[Sequence[Floats | None]] = [[None] * len(group)] * len(shots)
        if len(group) > 1 and len(shots) < LEAST_LIGHTS:
            traced = [_first_look(shot, group, entry, quick) for shot, entry in zip(shots, inside, strict=True)]
        return [search_path(path, inside, [of_shot[k] for of_shot in traced]) for k, path in enumerate(group)]

    return search_group


def _first_look(shot: Shot, group: Sequence[LightPath], entry: Region | None, quick: bool) -> Sequence[Floats | None]:
    """Trace the first search grid of each path of a group; None for shapes that cannot be traced together."""
    if shot.packed.shapes is not None:
        return [None] * len(group)
    within = None if entry is None else entry.box
    # the rays meet later second mirrors first
    return list(first_look(shot.packed, group[::-1], shot.incidence.tilt, within, quick)[::-1])


def _rows(shots: Sequence[Shot]) -> list[list[int]]:
    """Group distant points that differ only in field angle, sorted by it; only groups of at least `LEAST_LIGHTS`."""
    groups: dict[tuple[float, ...], list[int]] = {}
    for k, shot in enumerate(shots):
        if shot.border is None and shot.packed.nearness == 0.0 and shot.packed.symmetric and shot.packed.halves == 2:
            groups.setdefault(tuple(shot.packed.wavelengths_nm), []).append(k)
    many = [group for group in groups.values() if len(group) >= LEAST_LIGHTS]
    return [sorted(group, key=lambda k: (-shots[k].incidence.tilt, k)) for group in many]


def _spans(shots: Sequence[Shot], row: Sequence[int]) -> list[tuple[int, int]]:
    """Split lights sorted by field angle into spans of at most STEP_RAD; each starts at the end of the previous."""
    tilts = [abs(shots[k].incidence.tilt) for k in row]
    spans, first = [], 0
    while first < len(row) - 1:
        last = first + 1
        while last + 1 < len(row) and tilts[last + 1] - tilts[first] <= STEP_RAD:
            last += 1
        spans.append((first, last))
        first = last
    return spans


def _between(shot: Shot, ends: tuple[FinalPass | None, FinalPass | None]) -> Floats | None:
    """Bound the region of a light between two others; None where their regions give no bound."""
    boxes = [item.region.box for item in ends if item is not None]
    if len(boxes) < 2:
        return None
    box = join_boxes(*boxes)
    area = [float((b[1] - b[0]) * (b[3] - b[2])) for b in (box, *boxes)]
    if area[0] > MOST_GROWTH * min(area[1:]):
        return None
    grown = box + MARGIN * np.repeat([box[1] - box[0], box[3] - box[2]], 2) * [-1.0, 1.0, -1.0, 1.0]
    front = front_box(shot.packed, shot.incidence.tilt)
    low, high = np.maximum(grown[0::2], front[0::2]), np.minimum(grown[1::2], front[1::2])
    return np.array([low[0], high[0], low[1], high[1]])
