"""Which way the light goes: the direct path and every two-reflection path, as steps over the rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..kernels.trace import REFLECT, REFRACT, STOP
from ..model import Lens, Stop


@dataclass(frozen=True)
class LightPath:
    """The rows a ray meets in order, and what it does there.

    Attributes
    ----------
    first_reflection, second_reflection : int or None
        Rows of the two mirrors (j, then i < j); None for the direct path.
    rows, actions : ndarray, shape (S,), int64
        Row of each step; REFRACT, REFLECT or STOP.
    sensor : bool
        The first mirror is the sensor, which stands as one row more behind the lens' own.
    """

    first_reflection: int | None
    second_reflection: int | None
    rows: NDArray[np.int64]
    actions: NDArray[np.int64]
    sensor: bool = False

    @property
    def name(self) -> str:
        """Name of the path: "j-i", "sensor-i", or "direct"."""
        if self.first_reflection is None:
            return "direct"
        return f"{'sensor' if self.sensor else self.first_reflection}-{self.second_reflection}"

    @cached_property
    def stop_crossings(self) -> int:
        """How often the path crosses the stop: 1 or 3."""
        return int(np.count_nonzero(self.actions == STOP))


def _path(lens: Lens, legs: tuple[range, ...], mirrors: tuple[int, ...]) -> LightPath:
    rows: list[int] = []
    actions: list[int] = []
    for number, leg in enumerate(legs):
        for row in leg:
            rows.append(row)
            actions.append(STOP if isinstance(lens.rows[row], Stop) else REFRACT)
        # every leg but the last ends at a mirror
        if number < len(mirrors):
            actions[-1] = REFLECT
    first, second = mirrors if mirrors else (None, None)
    return LightPath(first, second, np.array(rows, dtype=np.int64), np.array(actions, dtype=np.int64))


def direct_path(lens: Lens) -> LightPath:
    """Return the path that makes the picture: every row once, no reflection."""
    return _path(lens, (range(len(lens.rows)),), ())


def ghost_path(lens: Lens, j: int, i: int) -> LightPath:
    """Return the path that reflects first at row j, then at row i < j.

    Parameters
    ----------
    lens : Lens
    j, i : int
        Rows, counted from 0 at the front; neither is the stop.

    Returns
    -------
    LightPath
    """
    legs = (range(j + 1), range(j - 1, i - 1, -1), range(i + 1, len(lens.rows)))
    return _path(lens, legs, (j, i))


def sensor_path(lens: Lens, i: int) -> LightPath:
    """Return the path that reflects first at the sensor, then at row i.

    Parameters
    ----------
    lens : Lens
    i : int
        Not the stop.

    Returns
    -------
    LightPath
        The sensor is row len(lens.rows) of its steps.
    """
    count = len(lens.rows)
    there, back, again = range(count), range(count - 1, i - 1, -1), range(i + 1, count)
    rows = [*there, count, *back, *again]
    actions = [STOP if row < count and isinstance(lens.rows[row], Stop) else REFRACT for row in rows]
    actions[count] = actions[count + len(back)] = REFLECT
    return LightPath(count, i, np.array(rows, dtype=np.int64), np.array(actions, dtype=np.int64), sensor=True)


def ghost_paths(lens: Lens, which: str = "all", *, sensor: bool = False) -> tuple[LightPath, ...]:
    """Enumerate the two-reflection paths (Hullin 2011, section 4.1 and "Aperture Culling").

    Parameters
    ----------
    lens : Lens
    which : {"all", "same-side"}
        All n(n-1)/2 paths of n surfaces, or the f(f-1)/2 + b(b-1)/2 that reflect twice on one side of the stop.
    sensor : bool
        Whether the sensor is a mirror too: one path more for each surface, or each behind the stop.

    Returns
    -------
    tuple of LightPath
        Ordered by (j, i), the sensor's last.
    """
    stop = lens.stop_row
    mirrors = [k for k in range(len(lens.rows)) if k != stop]
    pairs = [(j, i) for j in mirrors for i in mirrors if i < j]
    if which == "same-side":
        pairs = [(j, i) for j, i in pairs if (j < stop) == (i < stop)]
    own = tuple(ghost_path(lens, j, i) for j, i in pairs)
    if not sensor:
        return own
    return own + tuple(sensor_path(lens, i) for i in mirrors if which == "all" or i > stop)
