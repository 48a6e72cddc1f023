"""Ghosts that were found one after the other are begun anew, plainly and all at once.

While most ghosts are unknown, a fit makes up for their light with what it may: rims that cut a border off, light that
fades over the pupil. Once the others are known these stay, for a rim in a wrong place holds a ghost fast that would
otherwise move on. Without them all ghosts together find their places.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ..kernels.measure_pupil import FIRST_DISC, FIRST_I
from .found import Found
from .joint import lit
from .jointly import fitted_jointly
from .journal import Journal
from .shape import Shape, without_discs
from .views import View

# how often all are fitted at once and their light is solved; steps of each fit
_ROUNDS, _STEPS = 6, 10


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
        As many, without rims but their first and all colours alike in form; a later fit finds rims that are needed.
    """
    pixels, steps = [view.pixels[..., 1] for view in views], journal or Journal()
    # nobody is left out: where all of them are is just being found
    out = lit([_plain(ghost) for ghost in ghosts], views, needed=-np.inf, pool=pool)
    for _ in range(_ROUNDS):
        shapes = steps.step(partial(fitted_jointly, out, views, pixels, 1, steps=_STEPS, pool=pool))
        out = [replace(ghost, shapes=(one, one, one)) for ghost, one in zip(out, shapes, strict=True)]
        out = lit(out, views, needed=-np.inf, pool=pool)
    return out


def _plain(ghost: Found) -> Found:
    """Return a ghost that no rim cuts but its first, evenly bright over pupil and field."""
    red, green, blue = (_plain_shape(shape) for shape in ghost.shapes)
    return replace(ghost, shapes=(red, green, blue))


def _plain_shape(shape: Shape) -> Shape:
    numbers = without_discs(shape).numbers.copy()
    numbers[FIRST_I + 1 : FIRST_DISC] = 0.0
    return Shape(numbers)
