"""Fit of detected ghosts in all their parameters."""

import numpy as np
from planted_run import LARGEST, NOISE, shape, views

from flarewright.kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_G
from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.fitting.alternating_fit import fit_all
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import refine, render
from flarewright.measure.fitting.levenberg_marquardt import FAR
from flarewright.measure.fitting.patches import patches_of
from flarewright.measure.fitting.settings import FitSettings

TRUE = shape(-60.0, 34.0, 0.5)
FEW = np.linspace(1.0, LARGEST, 7)


def missed(one, seen):
    """Return the root mean square error of a shape's picture over the noise of a pixel."""
    return float(np.sqrt(np.mean([np.square(render(one, view) - render(TRUE, view)) for view in seen]))) / NOISE


def test_a_fit_from_far_does_not_end_in_a_wrong_valley():
    # a stretched pupil with reduced intensity looks the same: a long first step ends in a wrong valley
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


def test_a_false_rim_from_the_search_is_removed_by_the_fit():
    seen = views((TRUE,), angles=FEW[::2])
    numbers = TRUE.numbers.copy()
    numbers[FIRST_DISC : FIRST_DISC + 3] = -0.8, 0.0, 0.9
    cut = Shape(numbers, 1)
    (ghost,) = fit_all([DetectedGhost((cut, cut, cut), 0, len(seen) - 1)], seen, settings=FitSettings(rounds=1))
    assert ghost.shapes[1].discs == 0
    assert missed(ghost.shapes[1], seen) < 1.0
