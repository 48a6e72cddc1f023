"""In which views a ghost is there, from its birth to its death."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from .found import Found, by_light, lay_over
from .presence import presences
from .shape import Shape
from .views import Pixels, View

# how bright a ghost must be in a view, by its own measure, to be there
THERE = 0.35
# a view whose measure is less certain than this cannot tell
_UNSURE = 0.5
# two views tell place and size, and nothing of whether it goes along with the light
LEAST_VIEWS = 3


def span_of(
    shape: Shape, views: Sequence[View], own: Sequence[Pixels], middle: int, pool: ThreadPoolExecutor | None = None
) -> tuple[int, int]:
    """Return the first and the last of the views around one of them in which a shape is there.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
    own : sequence of ndarray, shape (H, W)
        What each shows of it, as far as it is known.
    middle : int
        Where it is there for certain.
    pool : executor, optional

    Notes
    -----
    A view that does not reach it, or cannot tell, is no reason for a death, and neither is a single one without it.
    """
    return _around([each is not False for each in _shown(shape, views, own, 1, pool)], middle)


def respanned(
    ghosts: Sequence[Found],
    views: Sequence[View],
    rests: Sequence[Sequence[Pixels]],
    leads: Sequence[int],
    pool: ThreadPoolExecutor | None = None,
) -> tuple[list[Found], list[list[Pixels]]]:
    """Ask all views anew in which of them each ghost is there, the brightest first.

    When a ghost was found others were not known: light of theirs hid where it goes on, or passed for its own.

    Parameters
    ----------
    ghosts : sequence of Found
    views : sequence of View
    rests : sequence of sequences of ndarray, shape (H, W)
        What each view shows beside all ghosts, colour by colour, or of the first colours.
    leads : sequence of int
        The colour that each ghost is looked for in.
    pool : executor, optional

    Returns
    -------
    ghosts : list of Found
    rests : list of lists of ndarray, shape (H, W)
        Beside these.
    """
    out, left = list(ghosts), [[picture.copy() for picture in rest] for rest in rests]
    for k in by_light(ghosts):
        ghost, lead = out[k], leads[k]
        lay_over(ghost.shapes[lead], ghost, views, left[lead], 1.0, pool)
        seen = _shown(ghost.shapes[lead], views, left[lead], lead, pool)
        # the longest life of which views are certain
        lives = {_around([each is not False for each in seen], at) for at, each in enumerate(seen) if each}
        first, last = max(lives, key=lambda life: (seen[life[0] : life[1] + 1].count(True), -life[0]), default=(0, 0))
        if last - first + 1 >= LEAST_VIEWS:
            out[k] = replace(ghost, first=first, last=last)
        lay_over(ghost.shapes[lead], out[k], views, left[lead], -1.0, pool)
        if (out[k].first, out[k].last) != (ghost.first, ghost.last):
            for m in set(range(len(left))) - {lead}:
                lay_over(ghost.shapes[m], ghost, views, left[m], 1.0, pool)
                lay_over(ghost.shapes[m], out[k], views, left[m], -1.0, pool)
    return out, left


def _shown(
    shape: Shape, views: Sequence[View], own: Sequence[Pixels], channel: int, pool: ThreadPoolExecutor | None
) -> list[bool | None]:
    """Tell which views show a shape; None of those that cannot tell."""
    alone = [view.showing_one(each) for view, each in zip(views, own, strict=True)]
    return [
        bool(seen.amplitude > THERE) if np.isfinite(seen.error) and seen.error <= _UNSURE else None
        for seen in presences(shape, alone, channel, pool=pool)
    ]


def _around(there: Sequence[bool], middle: int) -> tuple[int, int]:
    """Return the first and the last of those around a place, over single gaps."""
    first = last = middle
    while first > 0 and (there[first - 1] or (first > 1 and there[first - 2])):
        first -= 1
    while last < len(there) - 1 and (there[last + 1] or (last < len(there) - 2 and there[last + 2])):
        last += 1
    return first, last
