"""Range of views in which a ghost is visible."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ...typing import Pixels
from ..core.parameters import Shape
from ..core.views import View
from .amplitudes import presences
from .detected_ghost import DetectedGhost, by_brightness, lay_over
from .settings import FitSettings


def visible_range(
    shape: Shape, views: Sequence[View], own: Sequence[Pixels], middle: int, pool: ThreadPoolExecutor | None = None,
    settings: FitSettings = FitSettings(),
) -> tuple[int, int]:  # fmt: skip
    """Return the first and the last view of the visible range of a shape around one view.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
    own : sequence of ndarray, shape (H, W)
        Pictures that hold this ghost alone: all other known ghosts are subtracted.
    middle : int
        View in the middle of its votes. Where nothing shows it there, as between both sides of the axis, the range
        with the most visible views is returned.
    pool : executor, optional
    settings : FitSettings

    Notes
    -----
    The range ends at two consecutive views without the ghost. Undecided views, and views that the ghost lies outside
    of, count as visible.
    """
    seen = _visible(shape, views, own, 1, pool, settings)
    first, last = _visible_range(_not_gone(seen), middle)
    if seen[middle] is False and last - first + 1 < settings.lifetimes.least_views:
        return _most_visible_range(seen, (first, last))
    return first, last


def update_ranges(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], rests: Sequence[Sequence[Pixels]], leads: Sequence[int],
    pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> tuple[list[DetectedGhost], list[list[Pixels]]]:  # fmt: skip
    """Determine the visible range of each ghost again, brightest first.

    The first range of a ghost dates from its detection, when light of unknown ghosts could shorten or extend it.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
    views : sequence of View
    rests : sequence of sequences of ndarray, shape (H, W)
        Residual of each view, all ghosts subtracted, for each colour or the first colours only.
    leads : sequence of int
        Colour in which to measure each ghost.
    pool : executor, optional
    settings : FitSettings

    Returns
    -------
    ghosts : list of DetectedGhost
    rests : list of lists of ndarray, shape (H, W)
        Residuals with these ghosts subtracted.
    """
    out, left = list(ghosts), [[picture.copy() for picture in rest] for rest in rests]
    for k in by_brightness(ghosts):
        ghost, lead = out[k], leads[k]
        lay_over(ghost.shapes[lead], ghost, views, left[lead], 1.0, pool)
        seen = _visible(ghost.shapes[lead], views, left[lead], lead, pool, settings)
        first, last = _most_visible_range(seen, (0, 0))
        if last - first + 1 >= settings.lifetimes.least_views:
            out[k] = replace(ghost, first=first, last=last)
        lay_over(ghost.shapes[lead], out[k], views, left[lead], -1.0, pool)
        if (out[k].first, out[k].last) != (ghost.first, ghost.last):
            for m in set(range(len(left))) - {lead}:
                lay_over(ghost.shapes[m], ghost, views, left[m], 1.0, pool)
                lay_over(ghost.shapes[m], out[k], views, left[m], -1.0, pool)
    return out, left


def _visible(
    shape: Shape, views: Sequence[View], own: Sequence[Pixels], channel: int, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> list[bool | None]:  # fmt: skip
    """Return for each view whether it shows a shape; None: undecided."""
    alone = [view.showing_one(each) for view, each in zip(views, own, strict=True)]
    return [
        bool(seen.amplitude > settings.lifetimes.there) if np.isfinite(seen.error)
        and seen.error <= settings.lifetimes.most_error else None
        for seen in presences(shape, alone, channel, pool=pool, settings=settings)
    ]  # fmt: skip


def _not_gone(seen: Sequence[bool | None]) -> list[bool]:
    """Return where a shape is visible or undecided."""
    return [each is not False for each in seen]


def _most_visible_range(seen: Sequence[bool | None], none: tuple[int, int]) -> tuple[int, int]:
    """Return, of all ranges around a visible view, the one with the most visible views, or `none`."""
    ranges = {_visible_range(_not_gone(seen), at) for at, each in enumerate(seen) if each}
    return max(ranges, key=lambda one: (seen[one[0] : one[1] + 1].count(True), -one[0]), default=none)


def _visible_range(there: Sequence[bool], middle: int) -> tuple[int, int]:
    """Return the first and the last index of the run of visible views around one view, across single gaps."""
    first = last = middle
    while first > 0 and (there[first - 1] or (first > 1 and there[first - 2])):
        first -= 1
    while last < len(there) - 1 and (there[last + 1] or (last < len(there) - 2 and there[last + 2])):
        last += 1
    return first, last
