"""Soft ghosts drawn on a coarser grid have the same light at the same place, whole and clipped by the picture."""

import numpy as np
import pytest
from test_ghost_mesh import FRAME, bladed, draw, even, ghost

from flarewright.kernels.ghost_model.edge_coverage import sum_along_rows
from flarewright.kernels.ghost_model.jacobian import draw_with_changes
from flarewright.kernels.ghost_model.pupil_mesh import LATERAL, SOFT

# standard deviations of 5, 8.1, 10.5 and 14 pixels are drawn on grids of 2, 3, 4 and 5
SOFTNESS = [25.0, 65.0, 110.0, 200.0]
# wide enough to contain all blurred light
WHOLE = (400, 320)
PLACE = FRAME.copy()
PLACE[:2] = 150.3, 170.7


def finely(numbers):
    """Return a ghost as a fit draws it, on the grid of the picture."""
    plane = np.zeros((WHOLE[1], WHOLE[0] + 1))
    draw_with_changes(numbers, 1, 0.5, np.zeros(0, np.int64), PLACE, 0, 0, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    return plane[:, :-1]


def soft(kind, variance):
    numbers = kind(1)
    numbers[SOFT] = variance
    return numbers


@pytest.mark.parametrize("variance", SOFTNESS)
@pytest.mark.parametrize("kind", [ghost, even, bladed])
def test_a_soft_ghost_is_that_of_the_finest_grid(kind, variance):
    numbers = soft(kind, variance)
    coarse, fine = draw(numbers, 1, frame=PLACE, size=WHOLE), finely(numbers)
    assert np.abs(coarse - fine).max() < 0.012 * fine.max()
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.005 * np.sqrt(np.mean(fine**2))
    assert coarse.sum() == pytest.approx(fine.sum(), rel=2e-3)


@pytest.mark.parametrize("variance", SOFTNESS)
def test_place_and_spread_are_unchanged(variance):
    """A coarse grid must keep the moments up to second order."""

    def moments(picture):
        y, x = np.mgrid[: WHOLE[1], : WHOLE[0]]
        total = picture.sum()
        middle = np.array([(picture * at).sum() for at in (x, y)]) / total
        spread = np.array([(picture * (at - m) ** 2).sum() for at, m in zip((x, y), middle, strict=True)]) / total
        return middle, spread

    (place, size), (there, wide) = (
        moments(draw(soft(ghost, each), 1, frame=PLACE, size=WHOLE)) for each in (variance, 0.0)
    )
    assert place == pytest.approx(there, abs=0.02)
    assert size == pytest.approx(wide + variance, rel=0.01)


@pytest.mark.parametrize("variance", SOFTNESS)
# windows that cut the ghost on all sides, also between pixels of the coarse grid
@pytest.mark.parametrize("window", [(170, 130, 60, 50), (201, 90, 133, 97), (0, 0, 231, 141), (191, 151, 64, 64)])
def test_a_part_of_a_picture_is_a_part_of_the_whole_one(variance, window):
    numbers = soft(ghost, variance)
    left, top, width, height = window
    frame = PLACE.copy()
    frame[:2] -= left, top
    part = draw(numbers, 1, frame=frame, size=(width, height))
    everywhere = draw(numbers, 1, frame=PLACE, size=WHOLE)
    whole = everywhere[top : top + height, left : left + width]
    assert whole.max() > 0.3 * everywhere.max()
    # the coarse grid has another origin
    assert np.abs(part - whole).max() < 0.012 * everywhere.max()


def test_colours_that_part_are_drawn_coarsely_too():
    numbers = soft(even, 64.0)
    numbers[LATERAL : LATERAL + 4] = 3.0, 1.5, 0.8, -0.5
    coarse, fine = draw(numbers, 1, frame=PLACE, size=WHOLE), finely(numbers)
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.006 * np.sqrt(np.mean(fine**2))


def test_what_is_beyond_the_picture_adds_nothing():
    frame = PLACE.copy()
    frame[:2] = 900.0, 900.0
    assert not draw(soft(ghost, 110.0), 1, frame=frame).any()
