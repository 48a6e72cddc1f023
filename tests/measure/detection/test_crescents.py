"""Search for crescents: ghosts that shrink and slow down as the light moves off axis, flat and bent."""

from functools import cache

import numpy as np
import pytest
from planted_run import SIZE, views

from flarewright.kernels.ghost_model.pupil_mesh import BELOW, FIRST_G, FIRST_I
from flarewright.measure.core.parameter_vector import NUMBERS
from flarewright.measure.core.parameters import Shape
from flarewright.measure.detection.crescents import crescent_outline, crescents
from flarewright.measure.detection.matching_pursuit import pursue, start_shape
from flarewright.measure.detection.rim_voting import RimCandidate, candidates, slopes_of
from flarewright.measure.fitting.ghost_fit import render

ANGLES = np.linspace(6.0, 22.0, 7)
BELOW_W = 1.8


def crescent(speed: float, size: float = 55.0, level: float = 1.0) -> Shape:
    """Return a ghost that flattens with the field and whose ends lie nearer to the axis."""
    numbers = np.zeros(NUMBERS)
    numbers[0], numbers[2] = speed, -1.0 * size
    numbers[FIRST_G], numbers[FIRST_G + 2] = size, np.copysign(0.25 * size, speed)
    numbers[FIRST_I] = level * size**2
    numbers[BELOW + 1] = BELOW_W
    return Shape(numbers)


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Return intersection over union of two pictures."""
    there = [picture > 0.3 * np.median(picture[picture > 0.02 * picture.max()]) for picture in (one, other)]
    return float(np.count_nonzero(there[0] & there[1]) / np.count_nonzero(there[0] | there[1]))


def slopes(shown):
    everywhere = [np.ones((SIZE[1], SIZE[0]), bool) for _ in shown]
    return slopes_of(shown, [view.pixels[..., 1] for view in shown], everywhere)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_area_and_normals_of_an_outline(side):
    flat, bent = 0.3, 0.2
    spots = crescent_outline(flat, bent, side)
    along, down = spots[:, 0], spots[:, 1]
    area = 0.5 * abs(np.sum(along * np.roll(down, -1) - np.roll(along, -1) * down))
    # bending shifts whole rows and keeps the area; a polygon of 40 corners has 0.4 % less
    assert area == pytest.approx(np.pi * flat, rel=0.01)
    tangents = np.roll(spots[:, :2], -1, axis=0) - np.roll(spots[:, :2], 1, axis=0)
    across = (tangents * spots[:, 2:]).sum(axis=1) / np.hypot(*tangents.T)
    assert np.abs(across).max() < 0.02
    assert np.hypot(spots[:, 2], spots[:, 3]) == pytest.approx(1.0)
    # the ends lie nearer to the axis than the middle, and normals point outwards
    assert side * along[np.abs(down).argmax()] < -0.5 * bent
    assert (spots[:, 2] * side)[(side * along).argmax()] > 0.99


@cache
def searched_crescent(speed, roll):
    """Return views of a crescent, their gradients, and the best candidate."""
    shown = views((crescent(speed),), angles=ANGLES, roll_deg=roll)
    found = slopes(shown)
    return shown, found, crescents(found, SIZE[0])[0]


@pytest.mark.parametrize("speed", [-260.0, pytest.param(260.0, marks=pytest.mark.slow)])
def test_a_crescent_is_found(speed):
    planted = crescent(speed)
    shown, found, best = searched_crescent(speed, 0.0)
    assert best.score > 2.0 * candidates(found, SIZE[0], most=1)[0].score
    middle = shown[(best.first + best.last) // 2]
    start = start_shape(best, shown, [view.pixels[..., 1] for view in shown])
    assert overlap(render(start, middle), render(planted, middle)) > 0.6


def test_a_rolled_camera_sees_the_same_crescent():
    best = [searched_crescent(-260.0, roll)[2] for roll in (0.0, 143.0)]
    assert best[1].usual == pytest.approx(best[0].usual, abs=6.0)
    assert best[1].below == best[0].below


def test_the_start_shape_of_a_crescent_has_its_outline():
    candidate = RimCandidate(150.0, 40.0, 0, 4, 9.0, below=1.5, flat=0.4, bent=0.2)
    (view,) = views((), angles=[15.0])
    start = start_shape(candidate, [view], [view.pixels[..., 1]])
    start.numbers[FIRST_I] = 40.0**2
    rows, columns = np.nonzero(render(start, view) > 0.0)
    outline = candidate.place(view.sigma) + candidate.size(view.sigma) * crescent_outline(0.4, 0.2, 1.0)[:, 0]
    assert columns.min() + 0.5 - view.frame[0] == pytest.approx(outline.min(), abs=2.5)
    assert columns.max() + 0.5 - view.frame[0] == pytest.approx(outline.max(), abs=2.5)
    assert 0.5 * (rows.max() + 1 - rows.min()) == pytest.approx(candidate.size(view.sigma), abs=1.5)


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_the_search_finds_crescents_after_all_other_candidates(every):
    planted = crescent(-260.0)
    shown = views((planted,), angles=np.linspace(6.0, 22.0, 11)[::every])
    found = pursue(shown, [np.ones((SIZE[1], SIZE[0]), bool) for _ in shown], most=1)
    # in later views the crescent is a few pixels long, and the rough fit of the search may be inaccurate
    for view in shown[: 8 // every]:
        assert max(overlap(render(ghost.shapes[1], view), render(planted, view)) for ghost in found) > 0.9
