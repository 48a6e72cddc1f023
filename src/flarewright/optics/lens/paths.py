"""Light paths through a lens as steps over its rows: direct, two and four reflections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from ...kernels.tracing.sequential import KEEP, LAND, REFLECT, REFRACT, STOP
from ...model import Lens
from ...typing import Indices


# paths compare by identity; the cache of `steps_between` makes equal paths identical
@dataclass(frozen=True, eq=False)
class LightPath:
    """The rows that a ray meets in order, and its action at each.

    Attributes
    ----------
    first_reflection, second_reflection : int or None
        Rows of the first two mirrors (j, then i < j); None for the direct path.
    rows, actions : ndarray, shape (S,), int64
        Row of each step; REFRACT, REFLECT or STOP. Shared between users of the path: must not be modified.
    sensor : bool
        Whether the sensor is one of the mirrors; its row follows the last row of the lens.
    later_reflections : tuple of int
        Rows of the third and fourth mirror of a four-reflection path.
    """

    first_reflection: int | None
    second_reflection: int | None
    rows: Indices
    actions: Indices
    sensor: bool = False
    later_reflections: tuple[int, ...] = ()

    @property
    def mirrors(self) -> tuple[int, ...]:
        """Rows of all mirrors, in the order of the reflections."""
        if self.first_reflection is None or self.second_reflection is None:
            return ()
        return (self.first_reflection, self.second_reflection, *self.later_reflections)

    @cached_property
    def name(self) -> str:
        """Name of the path: "j-i", "j-i-k-l", with "sensor" for the sensor's row, or "direct"."""
        if self.first_reflection is None:
            return "direct"
        # the sensor lies behind every surface, so it is the largest row among the mirrors
        last = max(self.mirrors) if self.sensor else None
        return "-".join("sensor" if row == last else str(row) for row in self.mirrors)

    @cached_property
    def steps(self) -> Indices:
        """Rows and actions, shape (2, S)."""
        return np.stack([self.rows, self.actions])

    @cached_property
    def stop_crossings(self) -> int:
        """Number of stop crossings: 1, 3 or 5."""
        return int(np.count_nonzero(self.actions == STOP))

    @cached_property
    def entry(self) -> LightPath | None:
        """The steps up to the stop; None when a mirror comes first."""
        stop = int(np.argmax(self.actions == STOP))
        if (self.actions[: stop + 1] == REFLECT).any():
            return None
        return LightPath(None, None, self.rows[: stop + 1], self.actions[: stop + 1])


def _path(lens: Lens, mirrors: tuple[int, ...]) -> LightPath:
    """Return the path between mirrors of a lens; row len(lens.rows) is the sensor."""
    return steps_between(len(lens.rows), lens.stop_row, mirrors)


def mirrors_of(name: str, count: int) -> tuple[int, ...]:
    """Return the mirrors in a ghost's name, for a lens with `count` rows; the sensor's number is `count`."""
    return tuple(count if row == "sensor" else int(row) for row in name.split("-"))


# cached: interactive previews use the same hundreds of paths for each picture
@lru_cache(maxsize=8192)
def steps_between(count: int, stop: int, mirrors: tuple[int, ...]) -> LightPath:
    """Return the path along some mirrors of a lens with `count` rows; `stop` is the row of the stop."""
    rows: list[int] = []
    actions: list[int] = []
    start, heading = 0, 1
    for end in (*mirrors, None):
        leg = range(start, count if end is None else end + heading, heading)
        rows += leg
        actions += [STOP if row == stop else REFRACT for row in leg]
        # every leg but the last ends at a mirror
        if end is not None:
            actions[-1] = REFLECT
            start, heading = end - heading, -heading
    first, second = mirrors[:2] if mirrors else (None, None)
    steps = np.array(rows, dtype=np.int64), np.array(actions, dtype=np.int64)
    return LightPath(first, second, *steps, count in mirrors, mirrors[2:])


def joined_path_steps(paths: Sequence[LightPath]) -> tuple[Indices, Indices]:
    """Return the steps by which `kernels.tracing.sequential` traces several paths at once, sharing common beginnings.

    Parameters
    ----------
    paths : sequence of LightPath
        Sorted so that the length of the shared beginning of successive pairs never falls: for one first mirror, by
        descending second mirror.

    Returns
    -------
    rows, actions : ndarray, shape (S,), int64
        Shared beginnings occur once: KEEP stores the rays before a path diverges, LAND ends the path, and the next path
        continues from the stored rays.
    """
    steps: list[Indices] = []
    walked = 0
    for path, following in pairwise(paths):
        one, other = path.steps, following.steps
        count = min(one.shape[1], other.shape[1])
        same = (one[:, :count] == other[:, :count]).all(axis=0)
        shared = count if same.all() else int(np.argmin(same))
        if shared < walked:
            raise ValueError(f"{following.name} diverges from {path.name} before that diverges from the path before it")
        steps += [one[:, walked:shared], np.array([[0], [KEEP]]), one[:, shared:], np.array([[0], [LAND]])]
        walked = shared
    rows, actions = np.concatenate([*steps, paths[-1].steps[:, walked:]], axis=1)
    return rows, actions


def direct_path(lens: Lens) -> LightPath:
    """Return the path of the image: every row once, no reflection."""
    return _path(lens, ())


def ghost_path(lens: Lens, j: int, i: int) -> LightPath:
    """Return the path that reflects first at row j, then at row i < j.

    Parameters
    ----------
    lens : Lens
    j, i : int
        Rows, counted from 0 at the front; neither is the stop.
    """
    return _path(lens, (j, i))


def sensor_path(lens: Lens, i: int) -> LightPath:
    """Return the path that reflects first at the sensor, then at row i.

    Parameters
    ----------
    lens : Lens
    i : int
        A surface, not the stop.

    Returns
    -------
    LightPath
        The sensor is row len(lens.rows) of its steps.
    """
    return _path(lens, (len(lens.rows), i))


def four_path(lens: Lens, j: int, i: int, k: int, m: int) -> LightPath:
    """Return the path that reflects at rows j, i < j, k > i and m < k, in this order.

    Parameters
    ----------
    lens : Lens
    j, i, k, m : int
        Rows other than the stop; j and k may be the sensor, row len(lens.rows).
    """
    return _path(lens, (j, i, k, m))


def ghost_paths(lens: Lens, which: str = "all", *, sensor: bool = False) -> tuple[LightPath, ...]:
    """Enumerate the two-reflection paths (Hullin 2011, section 4.1 and "Aperture Culling").

    Parameters
    ----------
    lens : Lens
    which : {"all", "same-side"}
        All n(n-1)/2 paths of n surfaces, or the f(f-1)/2 + b(b-1)/2 that reflect twice on one side of the stop.
    sensor : bool
        Whether the sensor is a mirror too: adds one path for each surface, or each behind the stop.

    Returns
    -------
    tuple of LightPath
        Sorted by (j, i), those with the sensor last.
    """
    return _paths_between(len(lens.rows), lens.stop_row, which, sensor)


@lru_cache(maxsize=64)
def _paths_between(count: int, stop: int, which: str, sensor: bool) -> tuple[LightPath, ...]:
    """Return the paths of two reflections through `count` rows; `stop` is the row of the stop."""
    mirrors = [k for k in range(count) if k != stop]
    pairs = [(j, i) for j in mirrors for i in mirrors if i < j]
    if which == "same-side":
        pairs = [(j, i) for j, i in pairs if (j < stop) == (i < stop)]
    if sensor:
        pairs += [(count, i) for i in mirrors if which == "all" or i > stop]
    return tuple(steps_between(count, stop, pair) for pair in pairs)
