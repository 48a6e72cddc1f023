"""A ghost that was fitted for two is taken apart; one that was fitted for one stays."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import shape, views

from flarewright.kernels.measure_pupil import FIRST_I
from flarewright.measure.apart import taken_apart
from flarewright.measure.fit import refine
from flarewright.measure.footprint import footprint, overlap
from flarewright.measure.found import Found
from flarewright.measure.patches import patches_of
from flarewright.measure.shape import Shape, free_numbers

ANGLES = np.linspace(4.0, 22.0, 10)


def pair(side: float = 1.0) -> tuple[Shape, Shape]:
    """Return a small bright ghost and a larger one that goes along before it, on one side of the axis."""
    return shape(side * 58.0, 10.0, 1.0), shape(side * 76.0, 14.0, 0.6)


SMALL, LARGE = pair()


def fitted(start: Shape, shown) -> Found:
    """Return a ghost fitted to all that views show."""
    free = free_numbers(1, start.discs, 1, True)
    fit = refine(start, patches_of(start, shown, 1), free, width=240, steps=20)
    return Found((fit.shape,) * 3, 0, len(shown) - 1, (fit, fit, fit))


def nearest(true: Shape, ghosts, shown) -> float:
    """Return how much of a true ghost the best of some covers, and no more than it."""
    return max(overlap(true, shape, shown[::2]) for ghost in ghosts for shape in ghost.shapes)


def test_where_a_shape_has_light():
    (shown,) = views((), angles=[20.0])
    there = footprint(SMALL, shown)
    y, x = np.nonzero(there)
    assert there.sum() == pytest.approx(np.pi * 10.0**2, rel=0.2)
    assert shown.frame[0] < x.mean()
    assert abs(y.mean() + 0.5 - shown.frame[1]) < 0.5
    assert overlap(SMALL, SMALL, [shown]) == 1.0
    assert overlap(SMALL, shape(-58.0, 10.0, 1.0), [shown]) == 0.0
    dark = Shape(np.zeros_like(SMALL.numbers))
    assert overlap(dark, dark, [shown]) == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ghost_that_was_fitted_for_two_is_taken_apart(side):
    small, large = pair(side)
    shown = views((small, large), angles=ANGLES)
    one = fitted(shape(side * 68.0, 15.0, 1.0), shown)
    assert nearest(small, [one], shown) < 0.5
    told: list[str] = []
    two = taken_apart([one], shown, factor=2.0, tell=told.append)
    assert len(two) == 2
    # told as in pictures twice as wide
    assert told == [f"a ghost at speed {2.0 * one.shapes[1].numbers[0]:.0f} px was fitted for two"]
    assert nearest(small, two, shown) > 0.8
    assert nearest(large, two, shown) > 0.8
    # the first is the one that was there, with what it knew of its other colours
    assert two[0].fits[0] is not None
    assert two[1].fits == (None, None, None)


def test_a_ghost_that_was_fitted_for_one_stays():
    shown = views((LARGE,), angles=ANGLES)
    one = fitted(shape(71.0, 15.0, 1.0), shown)
    assert nearest(LARGE, [one], shown) > 0.9
    assert taken_apart([one], shown) == [one]


def test_two_that_are_known_stay():
    shown = views((SMALL, LARGE), angles=ANGLES)
    both = [Found((one,) * 3, 0, len(shown) - 1) for one in (SMALL, LARGE)]
    assert taken_apart(both, shown) == both


def test_one_that_a_person_removed_is_left_alone():
    shown = views((SMALL, LARGE), angles=ANGLES)
    one = replace(fitted(shape(68.0, 15.0, 1.0), shown), unwanted=True)
    assert taken_apart([one], shown) == [one]


def test_one_that_was_just_found_keeps_one_form_in_all_colours():
    shown = views((SMALL, LARGE), angles=ANGLES)
    (red, green, blue), first, last = fitted(shape(68.0, 15.0, 1.0), shown).shapes, 0, len(shown) - 1
    two = taken_apart([Found((red, green, blue), first, last)], shown)
    assert len(two) == 2
    for ghost in two:
        assert ghost.fits == (None, None, None)
        for colour in ghost.shapes:
            np.testing.assert_array_equal(colour.numbers[:FIRST_I], ghost.shapes[1].numbers[:FIRST_I])
