"""Find ghost after ghost: the best candidate is fitted, taken off, and the rest is looked through again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import log

import numpy as np
from numpy.typing import NDArray

from ..io.sentences import count
from ..kernels.measure_pupil import BELOW, FIRST_G, FIRST_I
from ..model.ghost_model import Blades
from .evenly import evenly
from .find import Candidate, Slopes, candidates, slopes_of
from .fit import brightens, cost_of
from .footprint import overlap
from .found import Found, darkened, left_beside
from .grow import Growth, grow
from .jointly import fitted_jointly
from .journal import Journal
from .lunes import lunes
from .numbers import NUMBERS, with_blades
from .patches import patches_of
from .presence import usual_amplitude
from .shape import Shape, largest_size
from .shared_out import shared_out, side_by_side
from .spans import LEAST_VIEWS, respanned, span_of
from .specks import RADII, highest_near, specks
from .views import Pixels, View, distances

# votes below which a candidate is chance, and so many of each view where there are many: what is left of ghosts has as
# many
SCORE, _OF_EACH = 0.9, 0.04
# part of the light's squares inside its windows that a ghost must explain
EXPLAINS = 0.06
# standard deviations of its brightness over all views
SURE = 6.0
# part of the light taken off that may stay behind
LEFT_BEHIND = 0.08
# and as specks, so many pixels around the light
LEFT_AS_SPECKS, _BESIDE = 0.2, 3
# a candidate no larger than this is looked at with what is this far around it, pixels
SPECK, BESIDE_SPECK = 3.5, 3.0
# part of what either covers that a fit shares with the outline it began at; so many views tell
COVERS, _LOOKED = 0.35, 4
# who was refused is tried again when twice as many ghosts are known, and so many more; but no more often than this
_SOON, _TRIES = 2, 3
# steps of all ghosts at once after some were found
_TOUCHES = 6
# all are asked anew where they are there when by so much more ghosts are known
_MANY_MORE = 1.1
# candidates that are looked for beside those that were refused, and more, so that not every refusal is a new search
_TRIALS, _SPARE = 12, 20
# candidates that are tried before votes are cast again, and the part of the best one's votes that they must have when
# any was taken; so many are tried at a time after one was refused, for then the next mostly is as well
_ROUND, _NEARLY, _AT_ONCE = 4, 0.6, 2
# views that a first fit looks at
_FEW = 16
# by which a candidate that views show no light of begins
_LEAST_LIGHT = 1e-12
# lunes are looked for once the best other candidate has fewer votes than this
_LUNES_FROM = 6.0
# a candidate's form is told at no smaller field
_LEAST_SIGMA = 0.05
# how far a candidate grows: most of what lies beside it is not known yet, so its misfit tells nothing of it, and
# fine pictures no more than coarse ones
_FIRST = Growth(order=1, discs=1, error=0.05, soft=False, below=False, alike=False, area=2500)


def beginning(candidate: Candidate, views: Sequence[View], pixels: Sequence[Pixels]) -> Shape:
    """Return a candidate as a shape: an even disc as bright as the views say."""
    numbers = np.zeros(NUMBERS)
    numbers[0], numbers[3], numbers[FIRST_G] = candidate.speed, candidate.bend, candidate.radius
    numbers[FIRST_I] = candidate.radius**2
    # low and bent as it is in the middle of its life: x = s (f + f' v) + p (g + g' v), v = p s
    sigma = max(float(np.median([view.sigma for view in views])), _LEAST_SIGMA)
    bent = np.copysign(candidate.bent * candidate.radius / sigma, candidate.speed)
    numbers[0] -= bent
    numbers[2] = (candidate.flat - 1.0) * candidate.radius / sigma**2
    numbers[FIRST_G + 2] = bent
    numbers[BELOW + 1] = candidate.below
    numbers = with_blades(numbers, candidate.blades)
    shape = Shape(numbers)
    alone = [view.showing_one(picture) for view, picture in zip(views, pixels, strict=True)]
    numbers[FIRST_I] *= max(usual_amplitude(shape, alone, 1, 0.0) or 0.0, _LEAST_LIGHT)
    return Shape(numbers)


def pursue(
    views: Sequence[View],
    masks: Sequence[NDArray[np.bool_]],
    *,
    most: int = 60,
    first: Sequence[Candidate] = (),
    rest: Sequence[Pixels] | None = None,
    iris: Blades | None = None,
    factor: float = 1.0,
    pool: ThreadPoolExecutor | None = None,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[float, str], None] = lambda _part, _words: None,
    journal: Journal | None = None,
) -> list[Found]:
    """Find all ghosts of a run, brightest votes first.

    Parameters
    ----------
    views : sequence of View
        Glow taken off, all colours as one (`mixed`); with many more than `stages.SEARCHED` chance reaches more votes.
    masks : sequence of ndarray of bool, shape (H, W)
        Where to look.
    most : int
    first : sequence of Candidate
        Tried before all others.
    rest : sequence of ndarray, shape (H, W), optional
        What views show beside ghosts that are known already and stay as they are; None: none is.
    iris : Blades, optional
        Rims that ghosts may have, beside round ones.
    factor : float
        Pixels of the captures in one of these views: what is told is in the captures'.
    pool : executor, optional
    tell : callable
        Gets a line for each ghost.
    progress : callable
        Gets the finished part, estimated by how far the best votes have fallen, and words.
    journal : Journal, optional
        Of the dear steps.

    Returns
    -------
    list of Found
        The new ones, all colours alike.
    """
    # masked pixels weigh nothing, in all fits
    shown = [
        replace(view, variance=np.where(mask[..., None], view.variance, np.inf).astype(np.float32))
        for view, mask in zip(views, masks, strict=True)
    ]
    wanted = [view.pixels[..., 1] for view in shown] if rest is None else list(rest)
    left = list(wanted)
    found: list[Found] = []
    refused: list[_Refused] = []
    waiting = list(first)
    steps = journal or Journal()
    least = max(SCORE, _OF_EACH * len(views))
    fallen = _Fallen(progress, least)
    rims: list[Candidate] = []
    small: list[Candidate] = []
    known_to = asked_at = 0
    at_once = 1
    low: list[Candidate] = []
    low_at = -1
    while len(found) < most:
        asked = _TRIALS + len(refused)
        if asked > known_to:
            known_to = asked + _SPARE
            rims, small = steps.step(partial(_candidates, shown, left, masks, known_to, iris, pool))
        trials = _open([*rims[:asked], *small[:asked], *low], refused, len(found), least)
        # what is left of ghosts votes for lunes as well, so they are looked for late, and again when more is taken off
        enough = len(found) >= _MANY_MORE * low_at if trials else len(found) > low_at
        if enough and (not trials or trials[0].score < _LUNES_FROM):
            low, low_at = steps.step(partial(_lunes, shown, left, masks, pool)), len(found)
            trials = _open([*rims[:asked], *small[:asked], *low], refused, len(found), least)
        fallen(trials[0].score if trials else least, len(found))
        trials, waiting = [*waiting[:_ROUND], *trials], waiting[_ROUND:]
        queue, before = trials[:_ROUND], len(found)
        while queue:
            ghosts = steps.step(partial(_tried, queue[:at_once], shown, left, pool))
            for trial, ghost in zip(queue[:at_once], ghosts, strict=True):
                queue = queue[1:]
                if ghost is None:
                    refused, at_once = _with_refused(refused, trial, len(found)), _AT_ONCE
                    continue
                found.append(ghost)
                low = [one for one in low if one is not trial]
                tell(f"ghost {len(found)}: {_described(ghost, trial, factor)}")
                left = left_beside(left, [ghost], shown, 1, pool)
                # those tried beside it did not know of it: they are tried again
                queue = [one for one in queue if one.score >= _NEARLY * trials[0].score and not _stale(one, trial)]
                at_once = 1
                break
        if not trials:
            break
        if len(found) > before:
            shapes = steps.step(partial(fitted_jointly, found, shown, wanted, 1, steps=_TOUCHES, pool=pool))
            found = [replace(ghost, shapes=(one, one, one)) for ghost, one in zip(found, shapes, strict=True)]
            left = left_beside(wanted, found, shown, 1, pool)
            if len(found) >= _MANY_MORE * asked_at:
                found, (left,) = respanned(found, shown, [left], [0] * len(found), pool)
                asked_at = len(found)
            # who voted for what was there before has to look again
            known_to = 0
    return respanned(found, shown, [left], [0] * len(found), pool)[0] if len(found) > asked_at else found


def _described(ghost: Found, trial: Candidate, factor: float) -> str:
    numbers = factor * ghost.shapes[1].numbers
    rim = "round" if trial.blades is None else f"{trial.blades.count} blades"
    return (
        f"speed {numbers[0]:.0f} px, size {abs(numbers[FIRST_G]):.1f} px, {rim}, votes {trial.score:.1f}, views "
        f"{ghost.first}-{ghost.last}"
    )


@dataclass(frozen=True)
class _Refused:
    """A candidate that was refused so many times, the last time when so many ghosts were known."""

    candidate: Candidate
    times: int
    known: int


def _with_refused(refused: Sequence[_Refused], trial: Candidate, known: int) -> list[_Refused]:
    """Return who was refused, with one more."""
    before = [one for one in refused if _same(one.candidate, trial)]
    others = [one for one in refused if one not in before]
    return [*others, _Refused(trial, 1 + max((one.times for one in before), default=0), known)]


def _open(votes: Sequence[Candidate], refused: Sequence[_Refused], known: int, least: float) -> list[Candidate]:
    """Return the candidates to try while so many ghosts are known, the best first, with more than so many votes.

    Beside ghosts that are not known yet one explains little of what is in its windows, and runs off to their light. So
    one that was refused waits until many more are known; where nothing else is left, until any more are.
    """
    likely = sorted([each for each in votes if each.score > least], key=lambda each: -each.score)
    for latest in (known // 2 - _SOON, known - 1):
        barred = [one.candidate for one in refused if one.known > latest or one.times >= _TRIES]
        trials = [each for each in likely if not any(_same(each, other) for other in barred)]
        if trials:
            return trials
    return []


class _Fallen:
    """Tells the finished part of a search by its best votes, which fall until only chance is left."""

    def __init__(self, progress: Callable[[float, str], None], least: float) -> None:
        self._progress, self._least, self._first, self._part = progress, least, 0.0, 0.0

    def __call__(self, score: float, found: int) -> None:
        self._first = max(self._first, score)
        if self._first > self._least:
            self._part = max(self._part, 1.0 - log(score / self._least) / log(self._first / self._least))
        self._progress(self._part, f"{count(found, 'ghost')}, votes {score:.1f} of at least {self._least:g}")


def _candidates(
    views: Sequence[View],
    rest: Sequence[Pixels],
    masks: Sequence[NDArray[np.bool_]],
    most: int,
    iris: Blades | None,
    pool: ThreadPoolExecutor | None,
) -> tuple[list[Candidate], list[Candidate]]:
    """Return the best rims and the best specks, best first."""
    rims = candidates(_slopes(views, rest, masks, pool), views[0].size_px[0], most=most, iris=iris, pool=pool)
    small = specks(_doubted(views, rest, beside=True, pool=pool), rest, masks, most=most, pool=pool)
    return rims, small


def _lunes(
    views: Sequence[View],
    rest: Sequence[Pixels],
    masks: Sequence[NDArray[np.bool_]],
    pool: ThreadPoolExecutor | None,
) -> list[Candidate]:
    """Return the best lunes, best first."""
    return lunes(_slopes(views, rest, masks, pool), views[0].size_px[0], pool=pool)


def _slopes(
    views: Sequence[View], rest: Sequence[Pixels], masks: Sequence[NDArray[np.bool_]], pool: ThreadPoolExecutor | None
) -> Slopes:
    """Return the borders of what is left."""
    return slopes_of(_doubted(views, rest, pool=pool), rest, masks, pool=pool)


def _doubted(
    views: Sequence[View], rest: Sequence[Pixels], *, beside: bool = False, pool: ThreadPoolExecutor | None
) -> list[View]:
    """Return the views less certain where light was taken off: a part of it stays behind as edges.

    With `beside` also around there: of a speck whose form is not drawn well enough a larger part stays, as specks.
    """

    def one(view: View, picture: Pixels) -> View:
        known = np.abs(view.pixels[..., 1] - picture)
        if beside:
            known = LEFT_AS_SPECKS * highest_near(highest_near(known, _BESIDE, axis=0), _BESIDE, axis=1)
        else:
            known = LEFT_BEHIND * known
        return replace(view, variance=view.variance + (known**2)[..., None])

    return shared_out(one, views, rest, pool=pool)


def _same(a: Candidate, b: Candidate) -> bool:
    (speed, radius), (other_speed, other_radius) = a.usual, b.usual
    near = 0.1 * (radius + other_radius) + 4.0
    overlap = min(a.last, b.last) - max(a.first, b.first)
    return abs(speed - other_speed) < near and abs(radius - other_radius) < 0.6 * near and overlap >= 0


def _stale(trial: Candidate, taken: Candidate) -> bool:
    """Tell whether a candidate had its votes from the borders of one that was taken off since."""
    (speed, radius), (taken_speed, taken_radius) = trial.usual, taken.usual
    larger = max(radius, taken_radius)
    return abs(speed - taken_speed) < 0.5 * larger and abs(radius - taken_radius) < 0.5 * larger


def _tried(
    trials: Sequence[Candidate], views: Sequence[View], rest: Sequence[Pixels], pool: ThreadPoolExecutor | None
) -> list[Found | None]:
    """Fit some candidates, each as if it were the only one, and judge them."""
    return side_by_side(*(partial(_try, trial, views, rest, pool) for trial in trials), pool=pool)


def _try(
    trial: Candidate, views: Sequence[View], rest: Sequence[Pixels], pool: ThreadPoolExecutor | None
) -> Found | None:
    """Fit a candidate and judge it."""
    few = evenly(range(trial.first, trial.last + 1), _FEW)
    shown = [views[k].showing_one(rest[k]) for k in few]
    starts = [trial]
    if trial.radius <= SPECK:
        shown = [_near(trial, view) for view in shown]
        if trial.radius > RADII[0]:
            # a rim of a few pixels is seen too large
            starts.append(replace(trial, radius=RADII[0]))
    most = replace(_FIRST, below=trial.below > 0.0)
    kept = []
    for one in starts:
        start = beginning(one, shown, [rest[k] for k in few])
        fit = grow(start, shown, 1, most=most, pool=pool)
        if fit is not None and brightens(fit.shape, shown) and _stays(trial, start, fit.shape, shown):
            kept.append(fit)
    if not kept:
        return None
    shape = min(kept, key=lambda fit: fit.cost).shape
    patches = patches_of(shape, shown, 1)
    if not patches:
        return None
    before, after = cost_of(darkened(shape), patches, error=0.05), cost_of(shape, patches, error=0.05)
    if not (after < (1.0 - EXPLAINS) * before and before - after > SURE**2):
        return None
    first, last = span_of(shape, views, rest, (trial.first + trial.last) // 2, pool)
    if last - first + 1 < LEAST_VIEWS:
        return None
    return Found((shape, shape, shape), first, last)


def _stays(trial: Candidate, start: Shape, shape: Shape, views: Sequence[View]) -> bool:
    """Tell whether a fit is about where its candidate was seen, and as large: elsewhere nobody voted for it."""
    if trial.radius <= SPECK:
        # a speck is no larger than what was looked at
        return largest_size(shape, [view.sigma for view in views]) <= trial.radius + BESIDE_SPECK
    return overlap(start, shape, views[:: max(1, len(views) // _LOOKED)]) > COVERS


def _near(speck: Candidate, view: View) -> View:
    """Return a view of what is next to a speck: all that lies farther off is more than it, and fits run off to that."""
    far = distances(view, speck.place(view.sigma)) > speck.radius + BESIDE_SPECK
    return replace(view, variance=np.where(far[..., None], np.inf, view.variance).astype(np.float32))
