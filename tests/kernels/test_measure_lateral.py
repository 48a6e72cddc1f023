"""Lateral colour within a channel: against whole ghosts drawn one wavelength after another, and derivatives."""

import numpy as np
import pytest
from test_measure_mesh import FRAME, SIZE, bladed, draw, draw_finely, even, ghost

from flarewright.kernels.measure_changes import draw_with_changes
from flarewright.kernels.measure_edges import sum_along_rows, sum_changes_along_rows
from flarewright.kernels.measure_mesh import window_of
from flarewright.kernels.measure_pupil import FIRST_DISC, FIRST_G, LATERAL, SOFT

NONE = np.zeros(0, np.int64)


def colourful(kind, discs: int = 1, lateral=(3.0, -1.2), variance: float = 0.2) -> np.ndarray:
    numbers = kind(discs)
    numbers[SOFT] = variance
    numbers[LATERAL:] = lateral
    return numbers


def wavelength_by_wavelength(numbers: np.ndarray, discs: int, count: int = 41) -> np.ndarray:
    """Draw the whole ghost at many wavelengths of a Gaussian band."""
    t = np.linspace(-2.2, 2.2, count)
    light = np.exp(-0.5 * t**2)
    light /= light.sum()
    t /= np.sqrt((light * t**2).sum())
    picture = 0.0
    for place, part in zip(t, light, strict=True):
        one = numbers.copy()
        one[0] += place * numbers[LATERAL]
        one[FIRST_G] += place * numbers[LATERAL + 1]
        one[LATERAL:] = 0.0
        picture = picture + part * draw_finely(one, discs)
    return picture


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("lateral", [(3.0, -1.2), (0.3, 0.1), (-8.0, 2.0)])
def test_a_rim_of_many_wavelengths_is_that_of_ghosts_of_one_each(kind, lateral):
    numbers = colourful(kind, 1, lateral)
    expected, found = wavelength_by_wavelength(numbers, 1), draw_finely(numbers, 1)
    plain = draw_finely(colourful(kind, 1, (0.0, 0.0)), 1)

    def off(picture):
        return float(np.sqrt(((picture - expected) ** 2).mean()))

    # what grows adds light: g' / g squared
    grown = (lateral[1] / numbers[FIRST_G]) ** 2
    # within the ghost light that curves is not spread
    assert off(found) < 0.001 * np.sqrt((expected**2).mean()) + 0.15 * off(plain), (off(found), off(plain))
    assert found.sum() == pytest.approx(expected.sum(), rel=grown + 5e-4)


def test_colour_that_shifts_and_widens_alike_leaves_one_side_sharp():
    numbers = np.zeros_like(ghost())
    numbers[0], numbers[FIRST_G], numbers[20], numbers[LATERAL:] = 80.0, 30.0, 900.0, (4.0, 2.0)
    upright = np.array([60.0, 70.0, 1.0, 0.0, 1.0])
    row = draw(numbers, 0, frame=upright)[70]
    # at half the field f' shifts by 2, and g' widens by 2: left they cancel, right they add up
    level = row[100]
    assert np.count_nonzero((row > 0.02 * level) & (row < 0.98 * level) & (np.arange(SIZE[0]) < 100)) <= 2
    soft = (row > 0.02 * level) & (row < 0.98 * level) & (np.arange(SIZE[0]) > 100)
    assert 12 <= np.count_nonzero(soft) <= 20


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("lateral", [(3.0, -1.2), (-6.0, 1.5)])
def test_a_replay_draws_it_nearly_alike(kind, lateral):
    numbers = colourful(kind, 1, lateral, 0.3)
    fitted, replayed = draw_finely(numbers, 1), draw(numbers, 1)
    assert np.sqrt(np.mean((replayed - fitted) ** 2)) < 0.022 * np.sqrt(np.mean(fitted**2))
    assert replayed.sum() == pytest.approx(fitted.sum(), rel=5e-3)


def test_windows_hold_what_colour_moves():
    numbers = colourful(ghost, 2, (14.0, 3.0), 1.0)
    whole = draw_finely(numbers, 2)
    left, top, width, height = window_of(numbers, 2, 0.5, FRAME, *SIZE)
    plane = np.zeros((height, width + 1))
    draw_with_changes(numbers, 2, 0.5, NONE, FRAME, left, top, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    assert np.allclose(plane[:, :width], whole[top : top + height, left : left + width], atol=1e-9)
    assert plane[:, :width].sum() == pytest.approx(whole.sum(), rel=1e-6)


def test_both_signs_turned_it_is_the_same():
    one, other = colourful(ghost), colourful(ghost, lateral=(-3.0, 1.2))
    assert np.allclose(draw_finely(one, 1), draw_finely(other, 1), atol=1e-12)


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("discs", [0, 2])
def test_derivatives_are_those_of_the_picture(discs, kind):
    numbers = colourful(kind, discs, (3.0, -1.2), 0.4)
    free = np.concatenate([np.arange(FIRST_DISC + 3 * discs), [SOFT, LATERAL, LATERAL + 1]])
    plane = np.zeros((SIZE[1], SIZE[0] + 1))
    changes = np.zeros((SIZE[1], SIZE[0] + 1, free.size))
    draw_with_changes(numbers, discs, 0.5, free, FRAME, 0, 0, plane, changes)
    sum_along_rows(plane)
    sum_changes_along_rows(changes)
    assert np.allclose(plane[:, :-1], draw_finely(numbers, discs), atol=1e-13)
    for q, n in enumerate(free):
        step = np.zeros(numbers.size)
        step[n] = 1e-4 if n == SOFT else 1e-5
        by_difference = (draw_finely(numbers + step, discs) - draw_finely(numbers - step, discs)) / (2.0 * step[n])
        off, scale = np.abs(by_difference - changes[:, :-1, q]), np.abs(by_difference).max()
        # taps are computed, and cut off, anew for every variance
        assert np.sqrt((off**2).mean()) < 2e-3 * scale if n == SOFT else off.max() < 1e-3 * scale + 1e-12, n
