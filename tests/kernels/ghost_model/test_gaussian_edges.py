"""Soft borders: the discrete Gaussian compared with SciPy's, a soft ghost with a blurred picture, derivatives."""

import numpy as np
import pytest
from scipy.special import ive
from test_ghost_mesh import FRAME, SIZE, bladed, draw, draw_finely, even, ghost

from flarewright.kernels.ghost_model.edge_coverage import sum_along_rows, sum_changes_along_rows
from flarewright.kernels.ghost_model.gaussian_edges import reach_of, taps_of
from flarewright.kernels.ghost_model.ghost_mesh import window_of
from flarewright.kernels.ghost_model.jacobian import draw_with_changes
from flarewright.kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_G, SOFT
from flarewright.kernels.jit.decorators import for_python

reach_to, fill_taps = for_python(reach_of), for_python(taps_of)


def soft_ghost(variance: float, discs: int = 1) -> np.ndarray:
    numbers = ghost(discs)
    numbers[SOFT] = variance
    return numbers


def blurred(picture: np.ndarray, variance: float) -> np.ndarray:
    """Return a picture blurred along both axes, extended by its border pixels."""
    reach = reach_to(variance)
    taps = ive(np.abs(np.arange(-reach, reach + 1)), variance)
    taps /= taps.sum()
    for axis in (0, 1):
        padded = np.pad(picture, [(reach, reach) if k == axis else (0, 0) for k in range(2)], mode="edge")
        size = picture.shape[axis]
        picture = sum(w * np.take(padded, np.arange(k, k + size), axis) for k, w in enumerate(taps))
    return picture


@pytest.mark.parametrize("variance", [1e-6, 0.03, 0.7, 5.0, 60.0])
def test_taps_are_the_discrete_gaussian(variance):
    reach = reach_to(variance)
    taps = np.empty(reach + 1)
    fill_taps(variance, taps)
    expected = ive(np.arange(reach + 1), variance)
    assert np.allclose(taps, expected, rtol=2e-3, atol=2e-4)
    n = np.arange(1, reach + 1)
    assert taps[0] + 2.0 * taps[1:].sum() == pytest.approx(1.0)
    assert 2.0 * (taps[1:] * n**2).sum() == pytest.approx(variance, rel=1e-2)


def finely(numbers: np.ndarray, discs: int, frame: np.ndarray) -> np.ndarray:
    plane = np.zeros((SIZE[1], SIZE[0] + 1))
    draw_with_changes(numbers, discs, 0.5, np.zeros(0, np.int64), frame, 0, 0, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    return plane[:, :-1]


@pytest.mark.parametrize("variance", [0.05, 0.8, 6.0])
# in the picture, and cut by its left, upper and right borders
@pytest.mark.parametrize("axis", [(100.3, 60.7), (-60.0, 20.0), (180.0, 130.0)])
def test_a_soft_ghost_is_a_sharp_one_blurred(variance, axis):
    frame = FRAME.copy()
    frame[:2] = axis
    sharp = finely(ghost(), 1, frame)
    assert sharp.any()
    expected = blurred(sharp, variance)
    assert np.allclose(finely(soft_ghost(variance), 1, frame), expected, atol=1e-3 * sharp.max())


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("variance", [0.3, 1.5, 8.0])
def test_a_replay_is_nearly_as_soft(kind, variance):
    numbers = kind(1)
    numbers[SOFT] = variance
    fitted, replayed = finely(numbers, 1, FRAME), draw(numbers, 1)
    # a replay's larger cells change sharp ghosts by 1.5 %, and moving the outline only approximates a blur at corners
    assert np.sqrt(np.mean((replayed - fitted) ** 2)) < (0.018 + 0.001 * variance) * np.sqrt(np.mean(fitted**2))
    assert replayed.sum() == pytest.approx(fitted.sum(), rel=5e-3)
    # no light beside the ghost
    assert np.abs(replayed[:, -3:]).max() < 1e-9


def test_pictures_of_fits_are_as_soft_and_windows_contain_the_blur():
    numbers = soft_ghost(2.0, 2)
    whole = draw_finely(numbers, 2)
    assert np.allclose(whole, blurred(draw_finely(ghost(2), 2), 2.0), atol=1e-3 * whole.max())
    left, top, width, height = window_of(numbers, 2, 0.5, FRAME, *SIZE)
    plane = np.zeros((height, width + 1))
    draw_with_changes(numbers, 2, 0.5, np.zeros(0, np.int64), FRAME, left, top, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    assert np.allclose(plane[:, :width], whole[top : top + height, left : left + width], atol=1e-9)
    assert plane[:, :width].sum() == pytest.approx(whole.sum(), rel=1e-6)


@pytest.mark.parametrize("variance", [0.0, 0.4, 3.0])
def test_the_derivative_by_softness_is_that_of_the_picture(variance):
    free = np.array([0, FIRST_G, 20, FIRST_DISC + 2, SOFT])
    frame = FRAME.copy()
    frame[4] = 0.8
    numbers = soft_ghost(variance)

    def picture(each):
        plane, changes = np.zeros((SIZE[1], SIZE[0] + 1)), np.zeros((SIZE[1], SIZE[0] + 1, free.size))
        draw_with_changes(each, 1, 0.5, free, frame, 0, 0, plane, changes)
        sum_along_rows(plane)
        sum_changes_along_rows(changes)
        return plane[:, :-1], changes[:, :-1]

    _, changes = picture(numbers)
    for q, n in enumerate(free):
        step = np.zeros(numbers.size)
        step[n] = 1e-4
        above, below = numbers + step, numbers - (step if n != SOFT or variance > 0.0 else 0.0 * step)
        apart = (above - below)[n]
        by_difference = (picture(above)[0] - picture(below)[0]) / apart
        scale = np.abs(by_difference).max()
        assert np.abs(changes[..., q] - by_difference).max() < 2e-2 * scale
        assert np.sqrt(((changes[..., q] - by_difference) ** 2).mean()) < 2e-3 * scale
