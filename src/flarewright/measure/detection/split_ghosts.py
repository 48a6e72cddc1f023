"""Split a detected ghost whose fit covers two ghosts.

The fit of a ghost can grow over the light of an unknown neighbour. The residual then holds too little of the neighbour
to get votes. The light of the ghost plus the residual still shows both borders. If another border in it is clearer
than that of the ghost, fit two ghosts, and keep them if they explain the light better.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ...model.measurement.ghost_model import Blades
from ...typing import Indices, Pixels, Report
from ..core.checkpoint import Journal
from ..core.parameters import Shape
from ..core.rim_kinds import rims_of
from ..core.sampling import evenly_spaced
from ..core.views import View, all_finite
from ..fitting.detected_ghost import (
    CHANNELS,
    DetectedGhost,
    add_to_residual,
    by_brightness,
    channel_noise,
    exchange,
    formed,
    isolated_views,
    lay_over,
    leading,
    residual_of,
)
from ..fitting.footprint import footprint, overlap
from ..fitting.ghost_fit import Fit, brightens, cost_of, fitted_numbers, refine
from ..fitting.model_growth import grow
from ..fitting.patches import patches_of
from ..fitting.settings import FitSettings
from .matching_pursuit import start_shape
from .rim_voting import RimCandidate, rim_outline, searched, slopes_of
from .settings import DetectionSettings, SplitSettings

_NO_ERROR = 1e-6


def split_ghosts(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], *, iris: Blades | None = None, factor: float = 1.0,
    pool: ThreadPoolExecutor | None = None, report: Report = lambda _: None, journal: Journal | None = None,
    settings: DetectionSettings = DetectionSettings(),
) -> list[DetectedGhost]:  # fmt: skip
    """Split detected ghosts that cover two ghosts each.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
    views : sequence of View
        With the glow subtracted; pixels to ignore have infinite variance.
    iris : Blades, optional
        Allows rims of this iris for the new ghosts, beside round ones.
    factor : float
        Pixels of a capture per pixel of these views; the report is in pixels of the captures.
    pool : executor, optional
    report : callable
        Receives one line per split ghost.
    journal : Journal, optional
        Records the expensive steps.
    settings : DetectionSettings

    Returns
    -------
    list of DetectedGhost
        All ghosts, then the new ones. All colours of a new ghost have the brightness of the leading colour of the
        ghost it was split from; `joint_intensities.lit` corrects that.
    """
    noise, steps = channel_noise(views), journal or Journal()
    rests = [residual_of(ghosts, views, m, pool) for m in range(CHANNELS)]
    out, others = list(ghosts), list[DetectedGhost]()
    for k in by_brightness(ghosts):
        old = out[k]
        if old.unwanted:
            continue
        lead = leading(old, noise)
        pair = steps.step(partial(_split, old, lead, views, rests[lead], iris, pool, settings))
        if pair is None:
            continue
        out[k], other = pair
        exchange(old.shapes[lead], out[k].shapes[lead], old, views, rests[lead], pool)
        lay_over(other.shapes[lead], other, views, rests[lead], -1.0, pool)
        others.append(other)
        report(f"split the ghost of speed {factor * old.shapes[1].numbers[0]:.0f} px into two")
    return [*out, *others]


def _split(
    ghost: DetectedGhost, lead: int, views: Sequence[View], rest: Sequence[Pixels], iris: Blades | None,
    pool: ThreadPoolExecutor | None, settings: DetectionSettings,
) -> tuple[DetectedGhost, DetectedGhost] | None:  # fmt: skip
    """Return a refitted ghost and the ghost split from it; None when it covers one ghost only."""
    how = settings.splitting
    shown = [_with_model_error(view, how) for view in isolated_views(ghost, lead, views, rest, how.views, pool)]
    hidden = _hidden(ghost.shapes[lead], shown, lead, iris, pool, settings)
    if hidden is None:
        return None
    span, other = hidden
    pair = _fit_pair(ghost, other, span, shown, lead, pool, settings)
    if pair is None:
        return None
    fit, other = pair
    numbers = evenly_spaced(range(ghost.first, ghost.last + 1), settings.splitting.views)
    new = DetectedGhost((other, other, other), numbers[span.start], numbers[span.stop - 1])
    if ghost.fits[lead] is None:
        # a ghost fresh from detection: all colours have one geometry
        red, green, blue = (formed(fit.shape, own) for own in ghost.shapes)
        return replace(ghost, shapes=(red, green, blue)), new
    shapes, fits = list(ghost.shapes), list(ghost.fits)
    shapes[lead], fits[lead] = fit.shape, fit
    return replace(ghost, shapes=(shapes[0], shapes[1], shapes[2]), fits=(fits[0], fits[1], fits[2])), new


def _hidden(
    old: Shape, shown: Sequence[View], lead: int, iris: Blades | None, pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> tuple[range, Shape] | None:  # fmt: skip
    """Return the views and the shape of another ghost with a clearer border in the views of one; None if there is none.

    The views are a range of indices into `shown`.
    """
    candidate = _clearest_border(old, shown, lead, iris, pool, settings)
    if candidate is None:
        return None
    span = range(candidate.first, candidate.last + 1)
    there = [shown[k] for k in span]
    start = start_shape(candidate, there, [view.pixels[..., lead] for view in there], settings)
    few = there[:: settings.splitting.view_stride]
    if overlap(start, old, few, settings.fit) > settings.splitting.same_overlap:
        return None
    fit = grow(start, there, lead, most=settings.splitting.first, pool=pool, settings=settings.fit)
    if fit is None or not brightens(fit.shape, there):
        return None
    return None if overlap(start, fit.shape, few, settings.fit) < settings.pursuit.covers else (span, fit.shape)


def _fit_pair(
    ghost: DetectedGhost, other: Shape, span: range, shown: Sequence[View], lead: int, pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> tuple[Fit, Shape] | None:  # fmt: skip
    """Fit two ghosts in turn; return None when they do not explain enough more than one."""
    old = ghost.shapes[lead]
    free, its = fitted_numbers(ghost.fits[lead], old), fitted_numbers(None, other)

    def without_other() -> list[View]:
        return [_without(other, view) if k in span else view for k, view in enumerate(shown)]

    fit, one = None, old
    for _ in range(settings.splitting.rounds):
        fit = _fitted(one, without_other(), lead, free, pool, settings)
        if fit is None:
            return None
        one = fit.shape
        refit = _fitted(other, [_without(one, shown[k]) for k in span], lead, its, pool, settings)
        if refit is None:
            return None
        other = refit.shape
    if fit is None or not (brightens(one, shown) and brightens(other, [shown[k] for k in span])):
        return None
    # compare the costs in equal windows
    cost = partial(cost_of, offset=False, error=_NO_ERROR, settings=settings.fit)
    whole, parted = (
        patches_of(one, look, lead, beside=old, settings=settings.fit) for look in (shown, without_other())
    )
    if cost(one, parted) > (1.0 - settings.splitting.least_gain) * cost(old, whole):
        return None
    return fit, other


def _clearest_border(
    shape: Shape, shown: Sequence[View], lead: int, iris: Blades | None, pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> RimCandidate | None:  # fmt: skip
    """Return the clearest border in the views of one ghost if it has more votes than that of the ghost."""
    middle = shown[len(shown) // 2]
    place, size = _centroid(shape, middle, settings.fit)
    if not size > 0.0:
        return None
    slopes = slopes_of(
        shown, [view.pixels[..., lead] for view in shown], [all_finite(view.variance) for view in shown], lead, pool,
        settings.rims,
    )  # fmt: skip
    sigma, how = max(middle.sigma, settings.splitting.least_sigma), settings.splitting
    speeds = (place + how.most_distance * size * np.linspace(-1.0, 1.0, how.places)) / sigma
    smallest, largest = (
        max(how.least_size * size, how.least_size_px),
        max(how.most_size * size, 2.0 * how.least_size_px),
    )
    sizes = np.geomspace(smallest, largest, how.sizes)
    kinds = rims_of(iris)
    rims = np.stack([rim_outline(kind, settings.rims) for kind in kinds])
    scores, runs = searched(slopes, speeds, sizes, rims, pool=pool, settings=settings.rims)
    s, r = np.unravel_index(int(np.argmax(scores)), scores.shape)
    its_places = np.abs(speeds * sigma - place) < settings.splitting.own_place * size
    its_sizes = np.abs(sizes - size) < settings.splitting.own_size * size
    own = float(scores[np.ix_(its_places, its_sizes)].max(initial=0.0))
    best = float(scores[s, r])
    first, last, kind = (int(each) for each in runs[s, r])
    if best < settings.splitting.least_votes or best <= own or last - first + 1 < settings.fit.lifetimes.least_views:
        return None
    return RimCandidate(float(speeds[s]), float(sizes[r]), first, last, best, kinds[kind])


def _centroid(shape: Shape, view: View, settings: FitSettings) -> tuple[float, float]:
    """Return the centroid of a shape, from the axis towards the light, and the radius of a disc of equal area."""
    y, x = np.nonzero(footprint(shape, view, settings))
    if not y.size:
        return 0.0, 0.0
    ax, ay, cosine, sine, _ = view.frame
    along = (x + 0.5 - ax) * cosine - (y + 0.5 - ay) * sine
    return float(along.mean()), float(np.sqrt(y.size / np.pi))


def _with_model_error(view: View, settings: SplitSettings) -> View:
    """Return a view with the expected model error added to its variance."""
    missed = (settings.model_error * np.maximum(view.pixels, 0.0)) ** 2
    return replace(view, variance=(view.variance + missed).astype(np.float32))


def _without(shape: Shape, view: View) -> View:
    """Return a view of one ghost with a shape subtracted."""
    picture = view.pixels[..., 0].copy()
    add_to_residual(shape, view, picture, -1.0)
    return view.showing_one(picture)


def _fitted(
    start: Shape, views: Sequence[View], lead: int, free: Indices, pool: ThreadPoolExecutor | None,
    settings: DetectionSettings,
) -> Fit | None:  # fmt: skip
    """Fit a ghost to views of it alone; return None when it is outside all of them."""
    patches = patches_of(start, views, lead, area=settings.splitting.area_px, settings=settings.fit)
    if not patches:
        return None
    return refine(
        start, patches, free, width=views[0].size_px[0], steps=settings.splitting.steps, offset=False, error=_NO_ERROR,
        pool=pool, settings=settings.fit,
    )  # fmt: skip
