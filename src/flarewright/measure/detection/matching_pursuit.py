"""Detect ghosts by matching pursuit: fit the best candidate, subtract it, and search the residual again."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from math import log

import numpy as np

from ...kernels.ghost_model.pupil_mesh import BELOW, FIRST_G, FIRST_I
from ...model.measurement.ghost_model import Blades
from ...sentences import count
from ...typing import Mask, Pixels, Progress, Report
from ..core.checkpoint import Journal
from ..core.neighbourhood import brightest
from ..core.parallel import map_batched, run_concurrently
from ..core.parameter_vector import NUMBERS, with_blades
from ..core.parameters import Shape, largest_size
from ..core.sampling import evenly_spaced
from ..core.views import View, pixel_distances
from ..fitting.amplitudes import usual_amplitude
from ..fitting.detected_ghost import DetectedGhost, darkened, subtract_ghosts
from ..fitting.footprint import overlap
from ..fitting.ghost_fit import brightens, cost_of
from ..fitting.joint_shapes import fit_shapes_jointly
from ..fitting.lifetimes import update_ranges, visible_range
from ..fitting.model_growth import grow
from ..fitting.patches import patches_of
from .blobs import blobs
from .crescents import crescents
from .rim_voting import RimCandidate, Slopes, candidates, slopes_of
from .settings import DetectionSettings, PursuitSettings

# start brightness of a candidate whose views show no light
_MIN_LIGHT = 1e-12


def start_shape(
    candidate: RimCandidate, views: Sequence[View], pixels: Sequence[Pixels],
    settings: DetectionSettings = DetectionSettings(),
) -> Shape:  # fmt: skip
    """Convert a candidate to a start shape: a uniform disc with the brightness measured in the views."""
    numbers = np.zeros(NUMBERS)
    numbers[0], numbers[3], numbers[FIRST_G] = candidate.speed, candidate.bend, candidate.radius
    numbers[FIRST_I] = candidate.radius**2
    # match the candidate's outline at its median field: x = s (f + f' v) + p (g + g' v), v = p s
    sigma = max(float(np.median([view.sigma for view in views])), settings.pursuit.least_sigma)
    bent = np.copysign(candidate.bent * candidate.radius / sigma, candidate.speed)
    numbers[0] -= bent
    numbers[2] = (candidate.flat - 1.0) * candidate.radius / sigma**2
    numbers[FIRST_G + 2] = bent
    numbers[BELOW + 1] = candidate.below
    numbers = with_blades(numbers, candidate.blades)
    shape = Shape(numbers)
    alone = [view.showing_one(picture) for view, picture in zip(views, pixels, strict=True)]
    numbers[FIRST_I] *= max(usual_amplitude(shape, alone, 1, 0.0, settings.fit) or 0.0, _MIN_LIGHT)
    return Shape(numbers)


def pursue(
    views: Sequence[View], masks: Sequence[Mask], *, most: int = 60, first: Sequence[RimCandidate] = (),
    rest: Sequence[Pixels] | None = None, iris: Blades | None = None, factor: float = 1.0,
    pool: ThreadPoolExecutor | None = None, report: Report = lambda _: None,
    progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: DetectionSettings = DetectionSettings(),
) -> list[DetectedGhost]:  # fmt: skip
    """Detect all ghosts of a run, in order of their votes.

    Parameters
    ----------
    views : sequence of View
        With the glow subtracted and the colours mixed to one (`mixed`). With many more views than
        `DetectionSettings.views`, chance reaches more votes.
    masks : sequence of ndarray of bool, shape (H, W)
        Pixels to search.
    most : int
        Maximum number of ghosts.
    first : sequence of RimCandidate
        Candidates to try before all others.
    rest : sequence of ndarray, shape (H, W), optional
        Residual of the views after known, fixed ghosts; None: no ghost is known.
    iris : Blades, optional
        Allows rims of this iris beside round ones.
    factor : float
        Pixels of a capture per pixel of these views; the report is in pixels of the captures.
    pool : executor, optional
    report : callable
        Receives one line per ghost.
    progress : callable
        Receives the finished fraction, estimated from the fall of the best score, and a text.
    journal : Journal, optional
        Records the expensive steps.
    settings : DetectionSettings

    Returns
    -------
    list of DetectedGhost
        The new ghosts, each with one shape for all colours.
    """
    # masked pixels have no weight in any fit
    shown = [
        replace(view, variance=np.where(mask[..., None], view.variance, np.inf).astype(np.float32))
        for view, mask in zip(views, masks, strict=True)
    ]
    wanted = [view.pixels[..., 1] for view in shown] if rest is None else list(rest)
    how = settings.pursuit
    least = max(how.score, how.score_per_view * len(views))
    search = _Search(shown, masks, wanted, least, iris, factor, pool, report, journal or Journal(), settings)
    report_progress = _Progress(progress, least)
    state, votes, waiting = _State(wanted), _Votes(), list(first)
    while len(state.found) < most:
        votes, trials = _vote(search, state, votes)
        report_progress(trials[0].score if trials else least, len(state.found))
        queue, waiting = [*waiting[: how.trials_per_vote], *trials], waiting[how.trials_per_vote :]
        if not queue:
            break
        before = len(state.found)
        state, votes = _try_candidates(search, state, votes, queue[: how.trials_per_vote])
        if len(state.found) > before:
            # the residual has changed: vote again
            state, votes = _fit_together(search, state), replace(votes, searched=0)
    if len(state.found) <= state.respanned:
        return state.found
    return update_ranges(state.found, shown, [state.left], [0] * len(state.found), pool, settings.fit)[0]


@dataclass(frozen=True)
class _Refused:
    """A refused candidate, the number of refusals, and the number of known ghosts at the last one."""

    candidate: RimCandidate
    times: int
    known: int


@dataclass(frozen=True)
class _Search:
    """What stays the same during a search: its pictures, the least score, and how it runs and reports."""

    views: Sequence[View]
    masks: Sequence[Mask]
    wanted: Sequence[Pixels]
    least: float
    iris: Blades | None
    factor: float
    pool: ThreadPoolExecutor | None
    report: Report
    steps: Journal
    settings: DetectionSettings


@dataclass(frozen=True)
class _State:
    """Progress of a search.

    Attributes
    ----------
    left : list of ndarray
        Residual after the found ghosts.
    found : list of DetectedGhost
    refused : list of _Refused
    respanned : int
        Number of known ghosts when their ranges were last updated.
    at_once : int
        Number of candidates to fit concurrently.
    """

    left: list[Pixels]
    found: list[DetectedGhost] = field(default_factory=list)
    refused: list[_Refused] = field(default_factory=list)
    respanned: int = 0
    at_once: int = 1


@dataclass(frozen=True)
class _Votes:
    """Candidates by their votes in the residual.

    Attributes
    ----------
    rims, small_blobs, crescents : list of RimCandidate
    searched : int
        Number of rims and of blobs that were requested; 0 when the residual has changed since.
    crescents_at : int
        Number of known ghosts when crescents were searched.
    """

    rims: list[RimCandidate] = field(default_factory=list)
    small_blobs: list[RimCandidate] = field(default_factory=list)
    crescents: list[RimCandidate] = field(default_factory=list)
    searched: int = 0
    crescents_at: int = -1


def _vote(search: _Search, state: _State, votes: _Votes) -> tuple[_Votes, list[RimCandidate]]:
    """Return the votes, searched again where too few are left, and the candidates to try, best first."""
    how, known, pool = search.settings.pursuit, len(state.found), search.pool
    requested = how.trials + len(state.refused)

    def trials_of(votes: _Votes) -> list[RimCandidate]:
        candidates = [*votes.rims[:requested], *votes.small_blobs[:requested], *votes.crescents]
        return _open_candidates(candidates, state.refused, known, search.least, how)

    if requested > votes.searched:
        searched = requested + how.reserve
        rims, small_blobs = search.steps.step(
            partial(_candidates, search.views, state.left, search.masks, searched, search.iris, pool, search.settings)
        )
        votes = replace(votes, rims=rims, small_blobs=small_blobs, searched=searched)
    trials = trials_of(votes)
    # residuals of ghosts vote for crescents as well: search these late, and again after more ghosts are subtracted
    enough = known >= how.respan_growth * votes.crescents_at if trials else known > votes.crescents_at
    if enough and (not trials or trials[0].score < how.crescents_from):
        found = search.steps.step(partial(_crescents, search.views, state.left, search.masks, pool, search.settings))
        votes = replace(votes, crescents=found, crescents_at=known)
        trials = trials_of(votes)
    return votes, trials


def _try_candidates(
    search: _Search, state: _State, votes: _Votes, queue: Sequence[RimCandidate]
) -> tuple[_State, _Votes]:
    """Fit candidates one after the other, and subtract each that is a ghost before the next is fitted."""
    how, best = search.settings.pursuit, queue[0].score
    while queue:
        trials = queue[: state.at_once]
        ghosts = search.steps.step(
            partial(_fit_candidates, trials, search.views, state.left, search.pool, search.settings)
        )
        for trial, ghost in zip(trials, ghosts, strict=True):
            queue = queue[1:]
            if ghost is None:
                refused = _with_refused(state.refused, trial, len(state.found), how)
                state = replace(state, refused=refused, at_once=how.concurrent)
                continue
            left = subtract_ghosts(state.left, [ghost], search.views, 1, search.pool)
            state = replace(state, found=[*state.found, ghost], left=left, at_once=1)
            votes = replace(votes, crescents=[one for one in votes.crescents if one is not trial])
            search.report(f"ghost {len(state.found)}: {_described(ghost, trial, search.factor)}")
            # candidates tried concurrently were fitted without this ghost: they stay in the queue
            queue = [one for one in queue if one.score >= how.least_score_ratio * best and not _stale(one, trial)]
            break
    return state, votes


def _fit_together(search: _Search, state: _State) -> _State:
    """Fit the shapes of all found ghosts jointly, and update their ranges when there are many more of them."""
    how, fit, pool = search.settings.pursuit, search.settings.fit, search.pool
    joint = partial(fit_shapes_jointly, steps=how.joint_steps, pool=pool, settings=fit)
    shapes = search.steps.step(partial(joint, state.found, search.views, search.wanted, 1))
    found = [replace(ghost, shapes=(one, one, one)) for ghost, one in zip(state.found, shapes, strict=True)]
    left, respanned = subtract_ghosts(search.wanted, found, search.views, 1, pool), state.respanned
    if len(found) >= how.respan_growth * respanned:
        found, (left,) = update_ranges(found, search.views, [left], [0] * len(found), pool, fit)
        respanned = len(found)
    return replace(state, found=found, left=left, respanned=respanned)


def _described(ghost: DetectedGhost, trial: RimCandidate, factor: float) -> str:
    numbers = factor * ghost.shapes[1].numbers
    rim = "round" if trial.blades is None else f"{trial.blades.count} blades"
    return (
        f"speed {numbers[0]:.0f} px, size {abs(numbers[FIRST_G]):.1f} px, {rim}, votes {trial.score:.1f}, views "
        f"{ghost.first}-{ghost.last}"
    )


def _with_refused(
    refused: Sequence[_Refused], trial: RimCandidate, known: int, settings: PursuitSettings
) -> list[_Refused]:
    """Return the refused candidates with one refusal added."""
    before = [one for one in refused if _same(one.candidate, trial, settings)]
    others = [one for one in refused if one not in before]
    return [*others, _Refused(trial, 1 + max((one.times for one in before), default=0), known)]


def _open_candidates(
    votes: Sequence[RimCandidate], refused: Sequence[_Refused], known: int, least: float, settings: PursuitSettings
) -> list[RimCandidate]:
    """Return the candidates to try with `known` ghosts, best first, whose score exceeds `least`.

    Near unknown ghosts a candidate explains little of the light in its windows, and its fit drifts to their light. A
    refused candidate therefore waits until many more ghosts are known, or one more if no other candidate remains.
    """
    likely = sorted([each for each in votes if each.score > least], key=lambda each: -each.score)
    for latest in (known // 2 - settings.retry_after, known - 1):
        barred = [one.candidate for one in refused if one.known > latest or one.times >= settings.most_tries]
        trials = [each for each in likely if not any(_same(each, other, settings) for other in barred)]
        if trials:
            return trials
    return []


class _Progress:
    """Reports the finished fraction of a search, from the fall of the best score towards the chance level."""

    def __init__(self, progress: Progress, least: float) -> None:
        self._progress, self._least, self._first, self._part = progress, least, 0.0, 0.0

    def __call__(self, score: float, found: int) -> None:
        self._first = max(self._first, score)
        if self._first > self._least:
            self._part = max(self._part, 1.0 - log(score / self._least) / log(self._first / self._least))
        self._progress(self._part, f"{count(found, 'ghost')}, votes {score:.1f} of at least {self._least:g}")


def _candidates(
    views: Sequence[View], rest: Sequence[Pixels], masks: Sequence[Mask], most: int, iris: Blades | None,
    pool: ThreadPoolExecutor | None, settings: DetectionSettings,
) -> tuple[list[RimCandidate], list[RimCandidate]]:  # fmt: skip
    """Return the best rims and the best blobs, best first."""
    slopes, width = _slopes(views, rest, masks, pool, settings), views[0].size_px[0]
    rims = candidates(slopes, width, most=most, iris=iris, pool=pool, settings=settings.rims)
    views = _with_subtraction_error(views, rest, beside=True, pool=pool, settings=settings.pursuit)
    small_blobs = blobs(views, rest, masks, most=most, pool=pool, settings=settings.blobs)
    return rims, small_blobs


def _crescents(
    views: Sequence[View], rest: Sequence[Pixels], masks: Sequence[Mask], pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> list[RimCandidate]:  # fmt: skip
    """Return the best crescents, best first."""
    return crescents(_slopes(views, rest, masks, pool, settings), views[0].size_px[0], pool=pool, settings=settings)


def _slopes(
    views: Sequence[View], rest: Sequence[Pixels], masks: Sequence[Mask], pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> Slopes:  # fmt: skip
    """Return the gradients of the residual."""
    views = _with_subtraction_error(views, rest, pool=pool, settings=settings.pursuit)
    return slopes_of(views, rest, masks, pool=pool, settings=settings.rims)


def _with_subtraction_error(
    views: Sequence[View], rest: Sequence[Pixels], *, beside: bool = False, pool: ThreadPoolExecutor | None,
    settings: PursuitSettings,
) -> list[View]:  # fmt: skip
    """Return views with higher variance where light was subtracted, as errors of the subtraction leave edges.

    With `beside`, raise the variance by more and in the surroundings, too: poorly drawn blobs leave blobs.
    """

    def one(view: View, picture: Pixels) -> View:
        known = np.abs(view.pixels[..., 1] - picture)
        if beside:
            known = np.float32(settings.left_as_blobs) * brightest(known, settings.blob_reach_px)
        else:
            known = np.float32(settings.left_behind) * known
        return replace(view, variance=view.variance + (known**2)[..., None])

    return map_batched(one, views, rest, pool=pool)


def _same(a: RimCandidate, b: RimCandidate, settings: PursuitSettings) -> bool:
    (speed, radius), (other_speed, other_radius) = a.usual, b.usual
    near = settings.same_place * (radius + other_radius) + settings.same_place_px
    overlap = min(a.last, b.last) - max(a.first, b.first)
    if abs(speed - other_speed) >= near or overlap < 0:
        return False
    return abs(radius - other_radius) < settings.same_size * near


def _stale(trial: RimCandidate, taken: RimCandidate) -> bool:
    """Return whether the votes of a candidate may stem from the borders of a ghost subtracted since."""
    (speed, radius), (taken_speed, taken_radius) = trial.usual, taken.usual
    larger = max(radius, taken_radius)
    return abs(speed - taken_speed) < 0.5 * larger and abs(radius - taken_radius) < 0.5 * larger


def _fit_candidates(
    trials: Sequence[RimCandidate], views: Sequence[View], rest: Sequence[Pixels], pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> list[DetectedGhost | None]:  # fmt: skip
    """Fit and test some candidates concurrently, each without the others."""
    return run_concurrently(
        *(partial(_fit_candidate, trial, views, rest, pool, settings) for trial in trials), pool=pool
    )


def _fit_candidate(
    trial: RimCandidate, views: Sequence[View], rest: Sequence[Pixels], pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> DetectedGhost | None:  # fmt: skip
    """Fit a candidate; return the ghost, or None when a test fails."""
    few = evenly_spaced(range(trial.first, trial.last + 1), settings.pursuit.first_views)
    shown = [views[k].showing_one(rest[k]) for k in few]
    starts = [trial]
    if trial.radius <= settings.pursuit.blob_px:
        shown = [_near_blob(trial, view, settings.pursuit) for view in shown]
        if trial.radius > settings.blobs.radii_px[0]:
            # the votes overestimate the radius of a blob of a few pixels
            starts.append(replace(trial, radius=settings.blobs.radii_px[0]))
    most = replace(settings.pursuit.first, below=trial.below > 0.0)
    kept = []
    for one in starts:
        start = start_shape(one, shown, [rest[k] for k in few], settings)
        fit = grow(start, shown, 1, most=most, pool=pool, settings=settings.fit)
        if fit is None or not brightens(fit.shape, shown):
            continue
        if _matches_candidate(trial, start, fit.shape, shown, settings):
            kept.append(fit)
    if not kept:
        return None
    shape = min(kept, key=lambda fit: fit.cost).shape
    patches = patches_of(shape, shown, 1, settings=settings.fit)
    if not patches:
        return None
    cost = partial(cost_of, patches=patches, error=settings.pursuit.trial_error, settings=settings.fit)
    before, after = cost(darkened(shape)), cost(shape)
    if not (after < (1.0 - settings.pursuit.explains) * before and before - after > settings.pursuit.sure**2):
        return None
    first, last = visible_range(shape, views, rest, (trial.first + trial.last) // 2, pool, settings.fit)
    if last - first + 1 < settings.fit.lifetimes.least_views:
        return None
    return DetectedGhost((shape, shape, shape), first, last)


def _matches_candidate(
    trial: RimCandidate, start: Shape, shape: Shape, views: Sequence[View], settings: DetectionSettings
) -> bool:
    """Return whether a fit has about the position and size of its candidate, as the votes hold only there."""
    if trial.radius <= settings.pursuit.blob_px:
        # a blob must stay within the area of its fit
        return largest_size(shape, [view.sigma for view in views]) <= trial.radius + settings.pursuit.beside_blob_px
    few = views[:: max(1, len(views) // settings.pursuit.overlap_views)]
    return overlap(start, shape, few, settings.fit) > settings.pursuit.covers


def _near_blob(blob: RimCandidate, view: View, settings: PursuitSettings) -> View:
    """Return a view limited to the surroundings of a blob: its fit would drift to brighter light farther off."""
    far = pixel_distances(view, blob.place(view.sigma)) > blob.radius + settings.beside_blob_px
    return replace(view, variance=np.where(far[..., None], np.inf, view.variance).astype(np.float32))
