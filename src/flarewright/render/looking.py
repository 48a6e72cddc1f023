"""Where each path accepts light, for every light: what is alike for lights or for paths is looked for once.

Of many distant points a lens of revolution shows each path the same part of the pupil at the same field angle, and
nearly the same a little beside. So between two lights less than `STEP_RAD` apart in field angle, a path's region
lies in what these two accept, and a bit around it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..optics.paths import LightPath
from ..optics.region import Region, first_look, front_box, join_boxes
from .art import PLAIN, PathArt
from .final_pass import FinalPass
from .ghosts_final import find_entry, find_final
from .shot import Shot

Floats = NDArray[np.float64]

# so far apart may two lights stand in field angle whose regions bound those between
STEP_RAD = np.radians(0.5)
# by this part of their size the regions of both are widened
MARGIN = 0.15
# where both together are so many times larger than either, the path moves too fast to tell
MOST_GROWTH = 3.0
# fewer lights are looked for one by one
MANY = 8
# so many paths of one first mirror are followed to it at once; of more the rays would not stay in the processor's cache
TOGETHER = 8

__all__ = ["kindred", "looking"]


def kindred(paths: Sequence[LightPath]) -> list[list[LightPath]]:
    """Divide paths into groups of one first mirror; together they have the order of the paths.

    Parameters
    ----------
    paths : sequence of LightPath

    Returns
    -------
    list of list of LightPath
        The second mirrors of each rise.
    """
    groups: list[list[LightPath]] = []
    for path in paths:
        group = groups[-1] if groups else []
        alike = group and len(path.mirrors) == 2 and group[-1].mirrors[:-1] == path.mirrors[:-1]
        if alike and len(group) < TOGETHER and group[-1].mirrors < path.mirrors:
            group.append(path)
        else:
            groups.append([path])
    return groups


def looking(
    shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt], quick: bool = False
) -> Callable[[Sequence[LightPath]], list[list[FinalPass]]]:
    """Return what looks for the ghosts of some paths, a group of `kindred`, by every light.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    art : mapping of str to PathArt
        What is changed by hand, by path name.
    quick : bool
        As in `optics.region.find_region`.

    Returns
    -------
    callable
        Takes paths, and returns the ghosts of each in the order of the shots, without those that pass no light.
    """
    # what reaches the stop is common to all paths whose mirrors stand behind it
    way_in = next((path.entry for path in paths if path.entry is not None), None)
    entries = [None if way_in is None else find_entry(shot, way_in) for shot in shots]
    rows = _rows(shots)

    def look(path: LightPath, inside: Sequence[Region | None], traced: Sequence[Floats | None]) -> list[FinalPass]:
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

    def look_at_all(group: Sequence[LightPath]) -> list[list[FinalPass]]:
        # of one first mirror: all come in the same way
        inside = entries if group[0].entry is not None else [None] * len(shots)
        traced: list[Sequence[Floats | None]] = [[None] * len(group)] * len(shots)
        if len(group) > 1 and len(shots) < MANY:
            traced = [_first_look(shot, group, entry, quick) for shot, entry in zip(shots, inside, strict=True)]
        return [look(path, inside, [of_shot[k] for of_shot in traced]) for k, path in enumerate(group)]

    return look_at_all


def _first_look(shot: Shot, group: Sequence[LightPath], entry: Region | None, quick: bool) -> Sequence[Floats | None]:
    """Trace where each path of a group is looked for first; nothing where the tracer does not follow several."""
    if shot.packed.shapes is not None:
        return [None] * len(group)
    within = None if entry is None else entry.box
    # the later second mirror is met first
    return list(first_look(shot.packed, group[::-1], shot.incidence.tilt, within, quick)[::-1])


def _rows(shots: Sequence[Shot]) -> list[list[int]]:
    """Collect the distant points that differ by their field angle alone, in its order, where they are many."""
    groups: dict[tuple[float, ...], list[int]] = {}
    for k, shot in enumerate(shots):
        if shot.border is None and shot.packed.nearness == 0.0 and shot.packed.symmetric and shot.packed.halves == 2:
            groups.setdefault(tuple(shot.packed.wavelengths_nm), []).append(k)
    many = [group for group in groups.values() if len(group) >= MANY]
    return [sorted(group, key=lambda k: (-shots[k].incidence.tilt, k)) for group in many]


def _spans(shots: Sequence[Shot], row: Sequence[int]) -> list[tuple[int, int]]:
    """Divide a row of lights into spans no wider than STEP_RAD; each begins where the last one ends."""
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
    """Bound what a light between two others accepts by what these do; None where that says nothing."""
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
