"""One ghost that was fitted for two is taken apart: a clearer border than its own tells of the other.

Beside a ghost that is not known yet a fit grows over its light. Then little of that is left, and nobody votes for it.
But each ghost's own light together with what no other explains has the borders of all that it was fitted for: where one
of them is clearer than its own, two ghosts are fitted, and stay if they explain that light better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ..model.ghost_model import Blades
from .evenly import evenly
from .find import Candidate, rim_outline, rims_of, searched, slopes_of
from .fit import Fit, brightens, cost_of, fitted_numbers, refine
from .footprint import footprint, overlap
from .found import CHANNELS, Found, add_light, alone, by_light, exchange, formed, lay_over, leading, noise_of, rest_of
from .grow import Growth, grow
from .journal import Journal
from .patches import patches_of
from .pursuit import COVERS, beginning
from .shape import Indices, Shape
from .spans import LEAST_VIEWS
from .views import Pixels, View, all_known

# views that tell, and votes that another border must have, which are more than its own
_VIEWS, _LEAST_VOTES = 16, 2.0
# a border that shares more than this part of what either covers is its own; one view in so many tells
_ALIKE, _EVERY = 0.7, 4
# where the other is looked for: how far around a ghost's middle, and how large, parts of its own size; and how finely
_AROUND, _SMALLEST, _LARGEST, _PLACES, _SIZES = 1.2, 0.3, 1.4, 61, 30
# a border that votes for the same ghost: middle and size, parts of its size
_OWN_PLACE, _OWN_SIZE = 0.15, 0.12
# a field below which a place over the field tells nothing, and the least size that is looked for, pixels
_LEAST_SIGMA, _LEAST_SIZE = 0.1, 2.0
# part of the squares that two ghosts must explain beyond what one does
_PAYS = 0.02
# part of the light that a model may miss; it is the same for one ghost and for two, or what is brighter would be missed
# for less: so views are that much less certain, and fits may miss nothing more
_ERROR, _NOTHING = 0.05, 1e-6
# how both are fitted: the other as one that was just found, then each beside the other, so often
_FIRST = Growth(order=1, discs=1, error=_NOTHING, soft=False, below=False, alike=False, area=2500)
_TURNS, _STEPS, _AREA = 3, 6, 3500


def taken_apart(
    ghosts: Sequence[Found],
    views: Sequence[View],
    *,
    iris: Blades | None = None,
    factor: float = 1.0,
    pool: ThreadPoolExecutor | None = None,
    tell: Callable[[str], None] = lambda _: None,
    journal: Journal | None = None,
) -> list[Found]:
    """Take ghosts apart that were fitted for two.

    Parameters
    ----------
    ghosts : sequence of Found
    views : sequence of View
        Glow taken off; what shall not count has infinite variance.
    iris : Blades, optional
        Rims that the other may have, beside a round one.
    factor : float
        Pixels of the captures in one of these views: what is told is in the captures'.
    pool : executor, optional
    tell : callable
        Gets a line for each.
    journal : Journal, optional
        Of the dear steps.

    Returns
    -------
    list of Found
        All, and after them the new ones: as bright in every colour as in the one that tells most of what they were
        taken from. `joint.lit` makes up for that.
    """
    noise, steps = noise_of(views), journal or Journal()
    rests = [rest_of(ghosts, views, m, pool) for m in range(CHANNELS)]
    out, others = list(ghosts), list[Found]()
    for k in by_light(ghosts):
        old = out[k]
        if old.unwanted:
            continue
        lead = leading(old, noise)
        pair = steps.step(partial(_as_two, old, lead, views, rests[lead], iris, pool))
        if pair is None:
            continue
        out[k], other = pair
        exchange(old.shapes[lead], out[k].shapes[lead], old, views, rests[lead], pool)
        lay_over(other.shapes[lead], other, views, rests[lead], -1.0, pool)
        others.append(other)
        tell(f"a ghost at speed {factor * old.shapes[1].numbers[0]:.0f} px was fitted for two")
    return [*out, *others]


def _as_two(
    ghost: Found,
    lead: int,
    views: Sequence[View],
    rest: Sequence[Pixels],
    iris: Blades | None,
    pool: ThreadPoolExecutor | None,
) -> tuple[Found, Found] | None:
    """Return a ghost anew, and the other that it was fitted for; None when it was fitted for one."""
    shown = [_doubted(view) for view in alone(ghost, lead, views, rest, _VIEWS, pool)]
    hidden = _hidden(ghost.shapes[lead], shown, lead, iris, pool)
    if hidden is None:
        return None
    life, other = hidden
    pair = _beside_each_other(ghost, other, life, shown, lead, pool)
    if pair is None:
        return None
    fit, other = pair
    numbers = evenly(range(ghost.first, ghost.last + 1), _VIEWS)
    new = Found((other, other, other), numbers[life.start], numbers[life.stop - 1])
    if ghost.fits[lead] is None:
        # as it was found: all colours of one form
        red, green, blue = (formed(fit.shape, own) for own in ghost.shapes)
        return replace(ghost, shapes=(red, green, blue)), new
    shapes, fits = list(ghost.shapes), list(ghost.fits)
    shapes[lead], fits[lead] = fit.shape, fit
    return replace(ghost, shapes=(shapes[0], shapes[1], shapes[2]), fits=(fits[0], fits[1], fits[2])), new


def _hidden(
    old: Shape, shown: Sequence[View], lead: int, iris: Blades | None, pool: ThreadPoolExecutor | None
) -> tuple[range, Shape] | None:
    """Return the ghost of which a shape's views show a clearer border than its own, and the views in which they do."""
    candidate = _clearer(old, shown, lead, iris, pool)
    if candidate is None:
        return None
    life = range(candidate.first, candidate.last + 1)
    there = [shown[k] for k in life]
    start, few = beginning(candidate, there, [view.pixels[..., lead] for view in there]), there[::_EVERY]
    if overlap(start, old, few) > _ALIKE:
        return None
    fit = grow(start, there, lead, most=_FIRST, pool=pool)
    if fit is None or not brightens(fit.shape, there) or overlap(start, fit.shape, few) < COVERS:
        return None
    return life, fit.shape


def _beside_each_other(
    ghost: Found, other: Shape, life: range, shown: Sequence[View], lead: int, pool: ThreadPoolExecutor | None
) -> tuple[Fit, Shape] | None:
    """Fit a ghost and another in turn; None when they do not explain enough beyond what the ghost does."""
    old = ghost.shapes[lead]
    free, its = fitted_numbers(ghost.fits[lead], old), fitted_numbers(None, other)

    def without_other() -> list[View]:
        return [_without(other, view) if k in life else view for k, view in enumerate(shown)]

    fit, one = None, old
    for _ in range(_TURNS):
        fit = _fitted(one, without_other(), lead, free, pool)
        if fit is None:
            return None
        one = fit.shape
        anew = _fitted(other, [_without(one, shown[k]) for k in life], lead, its, pool)
        if anew is None:
            return None
        other = anew.shape
    if fit is None or not (brightens(one, shown) and brightens(other, [shown[k] for k in life])):
        return None
    # in the same windows
    cost = partial(cost_of, offset=False, error=_NOTHING)
    whole, parted = (patches_of(one, look, lead, beside=old) for look in (shown, without_other()))
    if cost(one, parted) > (1.0 - _PAYS) * cost(old, whole):
        return None
    return fit, other


def _clearer(
    shape: Shape, shown: Sequence[View], lead: int, iris: Blades | None, pool: ThreadPoolExecutor | None
) -> Candidate | None:
    """Return the border in views of one ghost that is clearest, if it is clearer than its own."""
    middle = shown[len(shown) // 2]
    place, size = _placed(shape, middle)
    if not size > 0.0:
        return None
    slopes = slopes_of(
        shown, [view.pixels[..., lead] for view in shown], [all_known(view.variance) for view in shown], lead, pool
    )
    sigma = max(middle.sigma, _LEAST_SIGMA)
    speeds = (place + _AROUND * size * np.linspace(-1.0, 1.0, _PLACES)) / sigma
    sizes = np.geomspace(max(_SMALLEST * size, _LEAST_SIZE), max(_LARGEST * size, 2.0 * _LEAST_SIZE), _SIZES)
    kinds = rims_of(iris)
    scores, runs = searched(slopes, speeds, sizes, np.stack([rim_outline(kind) for kind in kinds]), pool=pool)
    s, r = np.unravel_index(int(np.argmax(scores)), scores.shape)
    its_places = np.abs(speeds * sigma - place) < _OWN_PLACE * size
    its_sizes = np.abs(sizes - size) < _OWN_SIZE * size
    own = float(scores[np.ix_(its_places, its_sizes)].max(initial=0.0))
    best = float(scores[s, r])
    first, last, kind = (int(each) for each in runs[s, r])
    if best < _LEAST_VOTES or best <= own or last - first + 1 < LEAST_VIEWS:
        return None
    return Candidate(float(speeds[s]), float(sizes[r]), first, last, best, kinds[kind])


def _placed(shape: Shape, view: View) -> tuple[float, float]:
    """Return where the middle of a shape is, from the axis towards the light, and the radius of as large a disc."""
    y, x = np.nonzero(footprint(shape, view))
    if not y.size:
        return 0.0, 0.0
    ax, ay, cosine, sine, _ = view.frame
    along = (x + 0.5 - ax) * cosine - (y + 0.5 - ay) * sine
    return float(along.mean()), float(np.sqrt(y.size / np.pi))


def _doubted(view: View) -> View:
    """Return a view less certain by what a model may miss of its light."""
    missed = (_ERROR * np.maximum(view.pixels, 0.0)) ** 2
    return replace(view, variance=(view.variance + missed).astype(np.float32))


def _without(shape: Shape, view: View) -> View:
    """Return a view of one ghost without a shape's light."""
    picture = view.pixels[..., 0].copy()
    add_light(shape, view, picture, -1.0)
    return view.showing_one(picture)


def _fitted(
    start: Shape, views: Sequence[View], lead: int, free: Indices, pool: ThreadPoolExecutor | None
) -> Fit | None:
    """Fit a ghost in views of it alone; None when they do not show it."""
    patches = patches_of(start, views, lead, area=_AREA)
    if not patches:
        return None
    return refine(
        start, patches, free, width=views[0].size_px[0], steps=_STEPS, offset=False, error=_NOTHING, pool=pool
    )
