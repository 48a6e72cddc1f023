"""Lateral colour within a channel, compared with whole ghosts drawn at many wavelengths, and its derivatives."""

import numpy as np
import pytest
from test_ghost_mesh import FRAME, SIZE, bladed, draw, draw_finely, even, ghost

from flarewright.kernels.ghost_model.edge_coverage import sum_along_rows, sum_changes_along_rows
from flarewright.kernels.ghost_model.ghost_mesh import window_of
from flarewright.kernels.ghost_model.jacobian import draw_with_changes
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, FIRST_DISC, FIRST_G, LATERAL, SOFT

NONE = np.zeros(0, np.int64)


# f', g', f", g"; and these with the growth of f' and g' with w
UNEVEN, GROWING = (3.0, -1.2, 1.0, 0.7), (3.0, -1.2, 1.0, 0.7, 2.0, -3.0)


def colourful(kind, discs: int = 1, lateral=(3.0, -1.2), variance: float = 0.2) -> np.ndarray:
    numbers = kind(discs)
    numbers[SOFT] = variance
    numbers[LATERAL : LATERAL + len(lateral)] = lateral
    return numbers


def wavelength_by_wavelength(numbers: np.ndarray, discs: int, sigma: float = 0.5, count: int = 41) -> np.ndarray:
    """Return the sum of whole ghosts at many wavelengths of a Gaussian band."""
    f, g, bent_f, bent_g, f_grows, g_grows = numbers[LATERAL:BELOW]
    t = np.linspace(-2.2, 2.2, count)
    light = np.exp(-0.5 * t**2)
    light /= light.sum()
    t /= np.sqrt((light * t**2).sum())
    picture = 0.0
    for place, part in zip(t, light, strict=True):
        one = numbers.copy()
        one[0] += place * (f + sigma**2 * f_grows) + (place**2 - 1.0) * bent_f
        one[FIRST_G] += place * (g + sigma**2 * g_grows) + (place**2 - 1.0) * bent_g
        one[LATERAL:BELOW] = 0.0
        picture = picture + part * draw_finely(one, discs)
    return picture


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("lateral", [(3.0, -1.2), (0.3, 0.1), (-8.0, 2.0), UNEVEN, GROWING])
def test_lateral_colour_is_the_sum_of_ghosts_of_single_wavelengths(kind, lateral):
    numbers = colourful(kind, 1, lateral)
    expected, found = wavelength_by_wavelength(numbers, 1), draw_finely(numbers, 1)
    plain = draw_finely(colourful(kind, 1, (0.0, 0.0)), 1)

    def off(picture):
        return float(np.sqrt(((picture - expected) ** 2).mean()))

    # a change of size adds light in second order: (g' / g)^2
    grown = (np.abs(numbers[LATERAL + 1 : BELOW : 2]).sum() / numbers[FIRST_G]) ** 2
    # light inside the ghost is not spread, which matters where it varies nonlinearly
    assert off(found) < 0.001 * np.sqrt((expected**2).mean()) + 0.15 * off(plain), (off(found), off(plain))
    assert found.sum() == pytest.approx(expected.sum(), rel=grown + 5e-4)


def test_equal_shift_and_growth_leave_one_side_sharp():
    numbers = np.zeros_like(ghost())
    numbers[0], numbers[FIRST_G], numbers[20] = 80.0, 30.0, 900.0
    numbers[LATERAL : LATERAL + 2] = 4.0, 2.0
    upright = np.array([60.0, 70.0, 1.0, 0.0, 1.0])
    row = draw(numbers, 0, frame=upright)[70]
    # at half the field f' shifts by 2 and g' widens by 2: they cancel on the left and add up on the right
    level = row[100]
    assert np.count_nonzero((row > 0.02 * level) & (row < 0.98 * level) & (np.arange(SIZE[0]) < 100)) <= 2
    soft = (row > 0.02 * level) & (row < 0.98 * level) & (np.arange(SIZE[0]) > 100)
    assert 12 <= np.count_nonzero(soft) <= 20


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("lateral", [(3.0, -1.2), (-6.0, 1.5), UNEVEN, GROWING])
def test_a_replay_draws_nearly_the_same(kind, lateral):
    numbers = colourful(kind, 1, lateral, 0.3)
    fitted, replayed = draw_finely(numbers, 1), draw(numbers, 1)
    assert np.sqrt(np.mean((replayed - fitted) ** 2)) < 0.022 * np.sqrt(np.mean(fitted**2))
    assert replayed.sum() == pytest.approx(fitted.sum(), rel=5e-3)


def test_asymmetric_dispersion_leaves_a_tail_on_one_side():
    numbers = np.zeros_like(ghost())
    numbers[FIRST_G], numbers[20], numbers[LATERAL:BELOW] = 30.0, 900.0, (0.0, 2.0, 0.0, 1.0, 0.0, 0.0)
    row = draw(numbers, 0, frame=np.array([60.0, 70.0, 1.0, 0.0, 1.0]))[70]
    slope = np.abs(np.diff(row))[60:]
    place = np.arange(slope.size)
    middle = (slope * place).sum() / slope.sum()
    spread = np.sqrt((slope * (place - middle) ** 2).sum() / slope.sum())
    skewness = (slope * (place - middle) ** 3).sum() / slope.sum() / spread**3
    t = np.linspace(-2.2, 2.2, 1001)
    light = np.exp(-0.5 * t**2) / np.exp(-0.5 * t**2).sum()
    t /= np.sqrt((light * t**2).sum())
    away = 2.0 * t + (t**2 - 1.0)
    assert middle == pytest.approx(29.0, abs=0.1)
    assert spread == pytest.approx(np.sqrt((light * away**2).sum()), rel=0.05)
    assert skewness == pytest.approx((light * away**3).sum() / (light * away**2).sum() ** 1.5, rel=0.1)


@pytest.mark.parametrize("lateral", [(14.0, 3.0), (2.0, 0.0, 9.0, 2.0), (0.0, 0.0, 0.0, 0.0, 40.0, 9.0)])
def test_windows_contain_the_displaced_rims(lateral):
    numbers = colourful(ghost, 2, lateral, 1.0)
    whole = draw_finely(numbers, 2)
    left, top, width, height = window_of(numbers, 2, 0.5, FRAME, *SIZE)
    plane = np.zeros((height, width + 1))
    draw_with_changes(numbers, 2, 0.5, NONE, FRAME, left, top, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    assert np.allclose(plane[:, :width], whole[top : top + height, left : left + width], atol=1e-9)
    assert plane[:, :width].sum() == pytest.approx(whole.sum(), rel=1e-6)


def test_reversing_the_band_changes_nothing():
    one, other = colourful(ghost), colourful(ghost, lateral=(-3.0, 1.2))
    assert np.allclose(draw_finely(one, 1), draw_finely(other, 1), atol=1e-12)


def test_reversing_the_band_keeps_the_asymmetry():
    one, other = colourful(ghost, 1, GROWING), colourful(ghost, 1, (-3.0, 1.2, 1.0, 0.7, -2.0, 3.0))
    assert np.allclose(draw_finely(one, 1), draw_finely(other, 1), atol=1e-12)


@pytest.mark.parametrize("kind", [ghost, even, bladed])
@pytest.mark.parametrize("discs", [0, 2])
def test_derivatives_are_those_of_the_picture(discs, kind):
    numbers = colourful(kind, discs, GROWING, 0.4)
    free = np.concatenate([np.arange(FIRST_DISC + 3 * discs), np.arange(SOFT, BELOW)])
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
        # the number of taps changes with the variance, and a picture is extended by its border pixels
        inside = slice(4, -4) if n == SOFT else slice(None)
        assert off[inside, inside].max() < (3e-3 if n == SOFT else 1e-3) * scale + 1e-12, n
