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
    """

    first_reflection: int | None
    second_reflection: int | None
    rows: NDArray[np.int64]
    actions: NDArray[np.int64]

    @property
    def name(self) -> str:
        """Name of the path: "j-i", or "direct"."""
        return "direct" if self.first_reflection is None else f"{self.first_reflection}-{self.second_reflection}"

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


def ghost_paths(lens: Lens, which: str = "all") -> tuple[LightPath, ...]:
    """Enumerate the two-reflection paths (Hullin 2011, section 4.1 and "Aperture Culling").

    Parameters
    ----------
    lens : Lens
    which : {"all", "same-side"}
        All n(n-1)/2 paths of n surfaces, or the f(f-1)/2 + b(b-1)/2 that reflect twice on one side of the stop.

    Returns
    -------
    tuple of LightPath
        Ordered by (j, i).
    """
    stop = lens.stop_row
    mirrors = [k for k in range(len(lens.rows)) if k != stop]
    pairs = [(j, i) for j in mirrors for i in mirrors if i < j]
    if which == "same-side":
        pairs = [(j, i) for j, i in pairs if (j < stop) == (i < stop)]
    return tuple(ghost_path(lens, j, i) for j, i in pairs)
