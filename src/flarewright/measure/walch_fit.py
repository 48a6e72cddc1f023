"""Fit a run's ghosts in Walch's way, for comparison (2017, chapters 7 and 8).

Every ghost is fitted in one picture after the other, each from where the one before ended, by online gradient descent
of his primitive; then each of its numbers becomes a polynomial over the constellation. He had grey pictures, so green
tells the shape, and the other colours their brightness.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import cast

import numpy as np

from ..io.sentences import count
from ..kernels.measure_bezier import BORDER, INNER, NUMBERS
from ..model.capture import MergedRun
from ..model.ghost_model import BezierGhost, GhostModel
from .compress import compress
from .dimmed import beside
from .journal import Journal
from .numbers import Floats, away_from_axis
from .reading import read_views
from .replay import draw
from .rest_fit import with_rest
from .single import Spot, spots_of_model
from .views import View, all_known, coarse
from .walch import circle, descend, window_of
from .walch import draw as drawn

Tell = Callable[[str], None]
Progress = Callable[[float, str], None]

# a ghost is fitted in pictures halved until it is no wider, pixels
_WIDE = 96
# room around a ghost, part of its radius and pixels
_AROUND, _ROOM = 0.25, 8
# part of the window that must have been measured
_MEASURED = 0.7
# ghosts that are one step of a journal, however many threads there are
_AT_ONCE = 8
# pictures without which a ghost has no life, and the radius of the smallest, pixels
_FEWEST, _SMALLEST = 3, 0.5
# so many numbers are lengths, the first ones
_LENGTHS = 11


def fit_as_walch(
    folder: Path,
    run: MergedRun,
    rough: GhostModel,
    *,
    every: int = 1,
    rounds: int = 60,
    rest: bool = True,
    threads: int | None = None,
    tell: Tell = lambda _: None,
    progress: Progress = lambda _part, _words: None,
    journal: Journal | None = None,
) -> GhostModel:
    """Fit the ghosts that were found with Walch's primitive and in his way.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    rough : GhostModel
        From `find_ghosts`: where each ghost is to begin with, and what lies over it.
    every : int
        As for `find_ghosts`.
    rounds : int
        Of `walch.descend`, for each picture.
    rest : bool
        Also learn what is left beside the ghosts.
    threads : int, optional
    tell, progress, journal
        As for `find_ghosts`.

    Returns
    -------
    GhostModel
        Of Bezier ghosts, with halo and star as any other. A ghost that too few pictures show is left out.

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few.
    """
    views = read_views(folder, run, every)
    seen = beside(views, rough.halo, rough.star)
    bare = cast(GhostModel, rough.replace(sprites=(), removed=()))
    whole = [draw(bare, view.constellation_deg, view.roll_deg, view.size_px) for view in seen]
    spots = [{spot.name: spot for spot in _spots(bare, view)} for view in seen]
    steps, found = journal or Journal(), []
    names = [ghost.name for ghost in rough.ghosts]

    def follow(name: str) -> list[Floats]:
        return list(_followed(name, bare, seen, whole, spots, rounds))

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for begin in range(0, len(names), _AT_ONCE):
            some = names[begin : begin + _AT_ONCE]

            def look(some: Sequence[str] = some) -> list[list[Floats]]:
                return list(pool.map(follow, some))

            for name, (angles, numbers) in zip(some, steps.step(look), strict=True):
                if len(angles) < _FEWEST:
                    tell(f"ghost {name}: too few pictures show it, left out")
                    continue
                found.append(_compressed(name, angles, numbers))
                tell(f"ghost {name}: {count(len(angles), 'picture')}")
            progress(min(begin + _AT_ONCE, len(names)) / len(names), f"ghost {some[-1]}")
    told = "fitted with Walch's primitive and by his gradient descent (2017), for comparison"
    model = cast(GhostModel, bare.replace(ghosts=tuple(found), remarks=(*rough.remarks, told)))
    return with_rest(model, views, threads, journal) if rest else model


def _spots(model: GhostModel, view: View) -> tuple[Spot, ...]:
    low, high = model.constellation_deg
    return spots_of_model(model, min(max(view.constellation_deg, low), high))


def _followed(
    name: str,
    model: GhostModel,
    views: Sequence[View],
    whole: Sequence[Floats],
    spots: Sequence[dict[str, Spot]],
    rounds: int,
) -> tuple[Floats, Floats]:
    """Fit one ghost from picture to picture; return at which constellations, shape (K,), and its numbers, (K, 19)."""
    ghost = next(one for one in model.ghosts if one.name == name)
    alone = cast(GhostModel, model.replace(ghosts=(ghost,)))
    angles, fitted = [], []
    before: tuple[Floats, Spot] | None = None
    for view, light, there in zip(views, whole, spots, strict=True):
        spot, numbers = there.get(name), None
        if spot is not None and spot.radius_px > _SMALLEST and max(spot.rgb) > 0.0:
            own = draw(alone, view.constellation_deg, view.roll_deg, view.size_px)
            numbers = _one(view.showing((view.pixels - light + own).astype(np.float32)), spot, before, rounds)
        before = None if spot is None or numbers is None else (numbers, spot)
        if numbers is not None:
            angles.append(view.constellation_deg)
            fitted.append(numbers)
    return np.array(angles), np.array(fitted).reshape(-1, NUMBERS)


def _one(view: View, spot: Spot, before: tuple[Floats, Spot] | None, rounds: int) -> Floats | None:
    """Fit one ghost in one picture; None where too little of it was measured."""
    times = max(0, int(np.ceil(np.log2(2.0 * spot.radius_px / _WIDE))))
    small, side = coarse(view, times), 0.5**times
    start = circle(spot.place_px, spot.radius_px, np.array(spot.rgb), np.array(spot.rgb))
    if before is not None:
        # as it was in the picture before, where the search saw it go
        start = before[0].copy()
        start[0] += spot.place_px - before[1].place_px
    start[:_LENGTHS] *= side
    margin = _ROOM + int(_AROUND * side * spot.radius_px)
    left, top, width, height = window_of(start, small.frame, small.size_px, margin)
    if min(width, height) < _ROOM:
        return None
    part = np.s_[top : top + height, left : left + width]
    known = all_known(small.variance[part])
    if known.mean() < _MEASURED:
        return None
    window = left, top, width, height
    # where nothing was measured he is right to begin with
    wanted = np.where(known[..., None], small.pixels[part], drawn(start, small.frame, window))
    numbers = descend(start, wanted[..., 1], small.frame, window, rounds=rounds).numbers
    numbers = _coloured(numbers, wanted, drawn(numbers, small.frame, window)[..., 1])
    numbers[:_LENGTHS] /= side
    return numbers


def _coloured(numbers: Floats, wanted: Floats, green: Floats) -> Floats:
    """Return numbers whose red and blue are as bright as a picture tells; shaped as green."""
    out = numbers.copy()
    power = max(float((green**2).sum()), 1e-300)
    for m in (0, 2):
        times = max(float((green * wanted[..., m]).sum()) / power, 0.0)
        out[BORDER + m], out[INNER + m] = times * numbers[BORDER + 1], times * numbers[INNER + 1]
    return out


def _compressed(name: str, constellation_deg: Floats, numbers: Floats) -> BezierGhost:
    """Turn each number into a polynomial over the constellation, which both sides of the axis share."""
    span = float(constellation_deg.min()), float(constellation_deg.max())
    away, ends = np.abs(constellation_deg), away_from_axis(span)
    curves = [compress(away, values, np.ones(values.size), ends) for values in numbers.T]
    return BezierGhost(
        name=name, numbers=tuple(curve.coefficients for curve in curves), visible_deg=span,
        uncertainty=tuple(curve.deviation for curve in curves),
    )  # fmt: skip
