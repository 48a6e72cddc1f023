"""Ghosts that were found one after the other are begun anew, plainly and all at once.

While most ghosts are unknown, a fit makes up for their light with what it may: rims that cut a border off, light that
fades over the pupil. Once the others are known these stay, though that light has another reason now. Without them all
ghosts together find their places.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ..kernels.measure_pupil import FIRST_DISC, FIRST_I
from .fit import cost_of
from .found import Found, alone, by_light, exchange, rest_of
from .joint import lit
from .jointly import fitted_jointly
from .journal import Journal
from .patches import patches_of
from .shape import Shape, without_discs
from .views import View

# how often all are fitted at once and their light is solved; steps of each fit
_ROUNDS, _STEPS = 6, 10
# part of the squares by which each rim that a ghost had must lower them: in a crowd any form is a little better
_PAYS = 0.1
# views that tell whether a ghost needs the rims that it had, and pixels of a window there
_VIEWS, _AREA = 16, 3500


def begun_anew(
    ghosts: Sequence[Found],
    views: Sequence[View],
    *,
    pool: ThreadPoolExecutor | None = None,
    journal: Journal | None = None,
) -> list[Found]:
    """Fit all ghosts at once from plain ones at the same places.

    Parameters
    ----------
    ghosts : sequence of Found
        All colours of each alike.
    views : sequence of View
        Glow taken off, all colours as one (`mixed`); what shall not count has infinite variance.
    pool : executor, optional
    journal : Journal, optional
        Of the dear steps.

    Returns
    -------
    list of Found
        As many, all colours alike in form; rims but their first only where these explain more than a plain ghost does.
    """
    pixels, steps = [view.pixels[..., 1] for view in views], journal or Journal()
    # nobody is left out: where all of them are is just being found
    out = lit([_plain(ghost) for ghost in ghosts], views, needed=-np.inf, pool=pool)
    for _ in range(_ROUNDS):
        shapes = steps.step(partial(fitted_jointly, out, views, pixels, 1, steps=_STEPS, pool=pool))
        out = [replace(ghost, shapes=(one, one, one)) for ghost, one in zip(out, shapes, strict=True)]
        out = lit(out, views, needed=-np.inf, pool=pool)
    return lit(_with_rims(ghosts, out, views, pool), views, needed=-np.inf, pool=pool)


def _with_rims(
    before: Sequence[Found], after: Sequence[Found], views: Sequence[View], pool: ThreadPoolExecutor | None
) -> list[Found]:
    """Return plain ghosts, or as they were before where these explain what the others leave of them better."""
    out, rest = list(after), rest_of(after, views, 1, pool)
    for k in by_light(after):
        old, new = before[k].shapes[1], after[k].shapes[1]
        if not old.discs:
            continue
        patches = patches_of(new, alone(after[k], 1, views, rest, _VIEWS, pool), 1, beside=old, area=_AREA)
        if not patches:
            continue
        costs = [cost_of(each, patches, offset=False) for each in (old, new)]
        if costs[0] >= (1.0 - _PAYS) ** old.discs * costs[1]:
            continue
        exchange(new, old, after[k], views, rest, pool)
        out[k] = before[k]
    return out


def _plain(ghost: Found) -> Found:
    """Return a ghost that no rim cuts but its first, evenly bright over pupil and field."""
    red, green, blue = (_plain_shape(shape) for shape in ghost.shapes)
    return replace(ghost, shapes=(red, green, blue))


def _plain_shape(shape: Shape) -> Shape:
    numbers = without_discs(shape).numbers
    numbers[FIRST_I + 1 : FIRST_DISC] = 0.0
    return Shape(numbers)
