"""A ghost whose fit covers two ghosts is split; a ghost that covers one is not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planted_run import shape, views

from flarewright.kernels.ghost_model.pupil_mesh import FIRST_I
from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.detection.split_ghosts import split_ghosts
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.footprint import footprint, overlap
from flarewright.measure.fitting.ghost_fit import refine
from flarewright.measure.fitting.patches import patches_of

ANGLES = np.linspace(4.0, 22.0, 6)


def pair(side: float = 1.0) -> tuple[Shape, Shape]:
    """Return a small bright ghost and a larger one that moves ahead of it, on one side of the axis."""
    return shape(side * 58.0, 10.0, 1.0), shape(side * 76.0, 14.0, 0.6)


SMALL, LARGE = pair()


def fitted(start: Shape, shown) -> DetectedGhost:
    """Return a ghost fitted to all light of the views."""
    free = free_numbers(1, start.discs, 1, True)
    fit = refine(start, patches_of(start, shown, 1), free, width=240, steps=20)
    return DetectedGhost((fit.shape,) * 3, 0, len(shown) - 1, (fit, fit, fit))


@cache
def covering(side: float = 1.0):
    """Return views of a pair of ghosts, and one ghost fitted to both."""
    shown = views(pair(side), angles=ANGLES)
    return shown, fitted(shape(side * 68.0, 15.0, 1.0), shown)


def nearest(true: Shape, ghosts, shown) -> float:
    """Return the largest overlap (intersection over union) of a true ghost with the given ones."""
    return max(overlap(true, shape, shown[::2]) for ghost in ghosts for shape in ghost.shapes)


def test_the_footprint_of_a_shape():
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


@pytest.mark.parametrize("side", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_a_ghost_that_covers_two_is_split(side):
    small, large = pair(side)
    shown, one = covering(side)
    assert nearest(small, [one], shown) < 0.5
    reported: list[str] = []
    two = split_ghosts([one], shown, factor=2.0, report=reported.append)
    assert len(two) == 2
    # reported in pixels of pictures twice as wide
    assert reported == [f"split the ghost of speed {2.0 * one.shapes[1].numbers[0]:.0f} px into two"]
    assert nearest(small, two, shown) > 0.8
    assert nearest(large, two, shown) > 0.8
    # the first ghost is the original, with its fits of the other colours
    assert two[0].fits[0] is not None
    assert two[1].fits == (None, None, None)


def test_a_ghost_that_covers_one_is_not_split():
    shown = views((LARGE,), angles=ANGLES)
    one = fitted(shape(71.0, 15.0, 1.0), shown)
    assert nearest(LARGE, [one], shown) > 0.9
    assert split_ghosts([one], shown) == [one]


def test_two_known_ghosts_are_not_split():
    shown = views((SMALL, LARGE), angles=ANGLES)
    both = [DetectedGhost((one,) * 3, 0, len(shown) - 1) for one in (SMALL, LARGE)]
    assert split_ghosts(both, shown) == both


def test_a_ghost_removed_by_the_user_is_not_split():
    shown, one = covering()
    one = replace(one, unwanted=True)
    assert split_ghosts([one], shown) == [one]


def test_a_ghost_before_its_first_fit_keeps_equal_colours():
    shown, one = covering()
    (red, green, blue), first, last = one.shapes, 0, len(shown) - 1
    two = split_ghosts([DetectedGhost((red, green, blue), first, last)], shown)
    assert len(two) == 2
    for ghost in two:
        assert ghost.fits == (None, None, None)
        for colour in ghost.shapes:
            np.testing.assert_array_equal(colour.numbers[:FIRST_I], ghost.shapes[1].numbers[:FIRST_I])
