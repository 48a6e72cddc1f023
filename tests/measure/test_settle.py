"""Found ghosts, fitted in all their numbers."""

import numpy as np
from planted_run import LARGEST, NOISE, shape, views

from flarewright.kernels.measure_pupil import FIRST_DISC, FIRST_G
from flarewright.measure.fit import refine, render
from flarewright.measure.found import Found
from flarewright.measure.marquardt import FAR
from flarewright.measure.patches import patches_of
from flarewright.measure.settle import Settling, settle
from flarewright.measure.shape import Shape, free_numbers

TRUE = shape(-60.0, 34.0, 0.5)
FEW = np.linspace(1.0, LARGEST, 7)


def missed(one, seen):
    """Return how far a shape is from the true one's light, in parts of a pixel's noise."""
    return float(np.sqrt(np.mean([np.square(render(one, view) - render(TRUE, view)) for view in seen]))) / NOISE


def test_a_fit_from_far_does_not_end_where_numbers_stand_in_for_each_other():
    # the pupil stretched in its middle and thinned there looks the same: a first step far along ends in a wrong valley
    seen = views((TRUE,), angles=FEW)
    numbers = TRUE.numbers.copy()
    numbers[0] += 6.0
    numbers[FIRST_G] *= 1.1
    start = Shape(numbers)
    patches = patches_of(start, seen, 1)
    free = free_numbers(1, 0, 1)
    fit = refine(start, patches, free, width=240, steps=60, error=0.01, tails=False, alike=False, damping=FAR)
    assert missed(start, seen) > 5.0
    assert missed(fit.shape, seen) < 0.1
    assert abs(fit.shape.numbers[FIRST_G] - TRUE.numbers[FIRST_G]) < 0.5


def test_a_rim_that_the_search_took_for_one_goes_when_the_ghost_is_fitted():
    seen = views((TRUE,), angles=FEW)
    numbers = TRUE.numbers.copy()
    numbers[FIRST_DISC : FIRST_DISC + 3] = -0.8, 0.0, 0.9
    cut = Shape(numbers, 1)
    (ghost,) = settle([Found((cut, cut, cut), 0, len(seen) - 1)], seen, how=Settling(rounds=1))
    assert ghost.shapes[1].discs == 0
    assert missed(ghost.shapes[1], seen) < 1.0
