"""From a rough ghost to a full one: numbers are freed, rims added and colours spread only as far as they pay."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..kernels.measure_mesh import parting_of
from ..kernels.measure_pupil import DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, MOST_DISCS, SOFT
from .fit import MODEL_ERROR, Fit, cost_of, improve, refine
from .patches import AREA, Patch, coarser, patches_of, shows
from .shape import Indices, Shape, free_numbers, parted
from .shared_out import shared_out
from .views import View

# part of the cost by which a rim, or a higher order, or lateral colour, must lower it to stay
RIM_PAYS = 0.02
ORDER_PAYS = 0.02
# where the search for a rim begins: its centre over s, and how far it bites into the first rim at the largest field
_CENTRES = (-2.4, -1.2, -0.6, 0.6, 1.2, 2.4)
_BITES = (0.3, 0.9)
# pixels of a patch that is looked at in half its resolution for where a rim may lie
_FINE = 1500
# borders that are sharper, pixels, show no colours that part
_SOFT = 0.5
# how far wavelengths may part, one standard deviation over the least radius: of thinner ghosts more than the rim moves
_FARTHEST = 0.4


@dataclass(frozen=True)
class Growth:
    """How far a ghost may grow.

    Attributes
    ----------
    order, intensity_order, discs : int
        At most.
    offset : bool
        Every view has an unknown even background around the ghost: others that are not known yet.
    error : float
        Part of the light that the model may miss.
    soft : bool
        Whether borders may be soft, once place and size are known.
    below : bool
        Whether place and size may be divided by a polynomial, once they are known.
    alike : bool
        See `fit.refine`.
    area : int
        See `patches.patches_of`.
    """

    order: int = 2
    intensity_order: int = 1
    discs: int = 2
    offset: bool = True
    error: float = MODEL_ERROR
    soft: bool = True
    below: bool = True
    alike: bool = True
    area: int = AREA


def grow(
    shape: Shape,
    views: Sequence[View],
    channel: int,
    *,
    most: Growth = Growth(),
    pool: ThreadPoolExecutor | None = None,
) -> Fit | None:
    """Fit a ghost in stages.

    Parameters
    ----------
    shape : Shape
        Place, size and brightness, roughly.
    views : sequence of View
        Their pixels hold this ghost alone, as far as it is known.
    channel : int
    most : Growth
    pool : executor, optional

    Returns
    -------
    Fit or None
        None when no view shows it.
    """
    width = views[0].size_px[0]
    refined = partial(refine, width=width, offset=most.offset, error=most.error, alike=most.alike, pool=pool)
    cost = partial(cost_of, offset=most.offset, error=most.error)

    def polish(start: Shape, order: int, light: int, steps: int, old: Shape | None) -> tuple[Fit, list[Patch]] | None:
        # a ghost that shrinks shall not forget the light that it leaves
        patches = patches_of(start, views, channel, beside=old, area=most.area)
        if not patches or not shows(start, views):
            return None
        free = free_numbers(order, start.discs, light, most.soft and order > 0, below=most.below and order > 0)
        return refined(start, patches, free, steps=steps), patches

    found = polish(shape, 0, 0, 8, None)
    order = 0
    while found is not None:
        fit, patches = found
        grown: Shape | None = None
        if fit.shape.discs < most.discs:
            grown = _with_rim(fit.shape, patches, free_numbers(order, 0, min(order, 1)), width, most, pool)
            before = cost(fit.shape, patches)
            if grown is not None and cost(grown, patches) < (1.0 - RIM_PAYS) * before:
                # a rim may leave too little to fit: then it is none
                rimmed = polish(grown, order, min(order, most.intensity_order), 6, fit.shape)
                if rimmed is not None:
                    found = rimmed
                    continue
        if order >= most.order:
            break
        higher = polish(fit.shape, order + 1, min(order + 1, most.intensity_order), 10, shape)
        if higher is None:
            break
        before = cost(fit.shape, higher[1])
        if order == 1 and higher[0].cost > (1.0 - ORDER_PAYS) * before:
            break
        found, order = higher, order + 1
    return None if found is None else found[0]


def spread_by_colour(
    fit: Fit,
    views: Sequence[View],
    channel: int,
    *,
    most: Growth = Growth(),
    pool: ThreadPoolExecutor | None = None,
) -> Fit:
    """Let the wavelengths of a ghost's channel part, if that pays and they stay within it: borders softer on one side.

    Parameters
    ----------
    fit : Fit
        From `grow`.
    views : sequence of View
        Their pixels hold this ghost alone, as far as it is known.
    channel : int
    most : Growth
        `error` and `alike` count.
    pool : executor, optional

    Returns
    -------
    Fit
        The one that was given, if it does not pay.
    """
    start = parted(fit.shape)
    patches = patches_of(start, views, channel)
    if fit.shape.numbers[SOFT] < _SOFT**2 or not patches:
        return fit
    free = np.union1d(fit.free, np.array([SOFT, LATERAL, LATERAL + 1]))
    apart = refine(
        start, patches, free, width=views[0].size_px[0], steps=20, error=most.error, alike=most.alike, pool=pool
    )
    shape = apart.shape
    farthest = max(parting_of(shape.numbers, shape.discs, patch.sigma, patch.frame) for patch in patches)
    pays = apart.cost < (1.0 - ORDER_PAYS) * cost_of(fit.shape, patches, error=most.error)
    return apart if pays and farthest < _FARTHEST else fit


def _with_rim(
    shape: Shape, patches: Sequence[Patch], free: np.ndarray, width: int, most: Growth, pool: ThreadPoolExecutor | None
) -> Shape | None:
    """Return the best shape with one more rim, tried from several places on a third of the patches."""
    if shape.discs >= MOST_DISCS:
        return None
    few = patches[:: max(1, len(patches) // 8)]
    rough = [coarser(patch) if patch.pixels.size > _FINE else patch for patch in few]
    at = FIRST_DISC + DISC_NUMBERS * shape.discs
    largest = max(patch.sigma for patch in patches)
    own = np.concatenate([free[free >= FIRST_I], [at, at + 2]])
    starts = []
    for centre in _CENTRES:
        for bite in _BITES:
            numbers = shape.numbers.copy()
            numbers[at : at + 3] = centre, 0.0, 1.0 + abs(centre) * largest - bite
            # what is seen is what the rim leaves: the whole is larger, and its middle lies towards the rim's bite
            away = 0.5 * bite * np.sign(centre)
            numbers[0] -= 0.5 * away * numbers[FIRST_G] / max(largest, 0.1)
            numbers[FIRST_G] *= 1.0 + 0.25 * bite
            starts.append(replace(shape, numbers=numbers, discs=shape.discs + 1))

    def tried(look: Sequence[Patch], numbers: Indices, steps: int, start: Shape) -> tuple[Shape, float]:
        return improve(
            start, look, numbers, width=width, steps=steps, offset=most.offset, error=most.error, alike=most.alike
        )

    # each in one thread: a trial is too small to be shared out
    trials = shared_out(partial(tried, rough, own, 3), starts, pool=pool)
    promising = [trial for trial, _ in sorted(trials, key=lambda each: each[1])[:3]]
    best = shared_out(partial(tried, few, np.concatenate([free, [at, at + 2]]), 6), promising, pool=pool)
    return min(best, key=lambda each: each[1])[0]
