"""The mesh of a measured ghost: flux, coverage and derivatives compared with independent computations."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model.draw import draw_ghosts
from flarewright.kernels.ghost_model.edge_coverage import sum_along_rows, sum_changes_along_rows
from flarewright.kernels.ghost_model.ghost_mesh import window_of
from flarewright.kernels.ghost_model.jacobian import draw_with_changes
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, BLADES, FIRST_DISC, FIRST_G, FIRST_I, TURN
from flarewright.measure.core.parameter_vector import NUMBERS

SIZE = (240, 140)


def ghost(discs: int = 1) -> np.ndarray:
    """Return a ghost with every aberration."""
    numbers = np.zeros(NUMBERS)
    numbers[:10] = 150.0, 3.0, -4.0, 12.0, 0.0, 1.0, 0.0, 0.3, 0.0, -1.0
    numbers[FIRST_G : FIRST_G + 10] = 40.0, 5.0, 4.0, -3.0, 0.0, 0.0, 0.7, 0.0, 1.5, 0.0
    numbers[FIRST_I : FIRST_I + 4] = 1.0, 0.3, -0.2, 0.1
    cuts = ((0.9, 0.1, 1.1), (-0.7, 0.0, 1.2))
    for k in range(discs):
        numbers[FIRST_DISC + 3 * k : FIRST_DISC + 3 * k + 3] = cuts[k]
    return numbers


FRAME = np.array([100.3, 60.7, np.cos(0.3), np.sin(0.3), 1.0])


def draw(numbers, discs, sigma=0.5, frame=FRAME, size=SIZE):
    plane = np.zeros((size[1], size[0] + 1))
    draw_ghosts(numbers[None], np.array([discs]), np.ones(1), sigma, frame, plane)
    sum_along_rows(plane)
    return plane[:, :-1]


def draw_finely(numbers, discs):
    plane = np.zeros((SIZE[1], SIZE[0] + 1))
    draw_with_changes(numbers, discs, 0.5, np.zeros(0, np.int64), FRAME, 0, 0, plane, np.zeros((1, 1, 0)))
    sum_along_rows(plane)
    return plane[:, :-1]


def test_a_disc_has_its_size_and_radiance():
    numbers = np.zeros(NUMBERS)
    numbers[0], numbers[FIRST_G], numbers[FIRST_I] = 80.0, 30.0, 900.0
    picture = draw(numbers, 0)
    assert picture.sum() == pytest.approx(900.0 * np.pi, rel=1e-9)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    centre = FRAME[0] + 40.0 * FRAME[2], FRAME[1] - 40.0 * FRAME[3]
    away = np.hypot(x - centre[0], y - centre[1])
    assert np.allclose(picture[away < 28.5], 1.0, rtol=1e-9)
    assert np.allclose(picture[away > 31.5], 0.0, atol=1e-12)
    # second moment of a disc: r^2 / 2
    assert (picture * away**2).sum() / picture.sum() == pytest.approx(450.0, rel=2e-3)


@pytest.mark.parametrize("roll", [0.0, 0.7, 3.0])
def test_blades_are_a_polygon_of_the_same_area_that_does_not_turn_with_the_light(roll):
    numbers = np.zeros(NUMBERS)
    numbers[FIRST_G], numbers[FIRST_I] = 40.0, 1600.0
    numbers[BLADES], numbers[TURN] = 5.0, 1.1
    frame = np.array([100.3, 60.7, np.cos(roll), np.sin(roll), 1.0])
    picture = draw(numbers, 0, frame=frame)
    assert picture.sum() == pytest.approx(1600.0 * np.pi, rel=1e-9)
    # apothem of a pentagon of area pi
    away = np.sqrt(np.pi / (5.0 * np.tan(np.pi / 5.0)))
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    out = [(x - 100.3) * np.cos(1.1 + 0.4 * np.pi * k) + (60.7 - y) * np.sin(1.1 + 0.4 * np.pi * k) for k in range(5)]
    inside = 40.0 * away - np.max(out, axis=0)
    assert np.allclose(picture[inside > 1.0], 1.0, rtol=1e-9)
    assert np.allclose(picture[inside < -1.0], 0.0, atol=1e-12)


def test_blades_are_cut_by_discs():
    numbers = np.zeros(NUMBERS)
    numbers[FIRST_G], numbers[FIRST_I], numbers[BLADES] = 40.0, 1.0, 6.0
    numbers[FIRST_DISC : FIRST_DISC + 3] = 1.2, 0.2, 0.9
    # counting points on this grid gives the area to 1e-4
    p = np.linspace(-1.2, 1.2, 801)
    xi, eta = np.meshgrid(p, p)
    sides = [xi * np.cos(np.pi * k / 3.0 - 0.3) + eta * np.sin(np.pi * k / 3.0 - 0.3) for k in range(6)]
    open_part = np.max(sides, axis=0) <= np.sqrt(np.pi / (6.0 * np.tan(np.pi / 6.0)))
    open_part &= np.hypot(xi - 0.625, eta) <= 0.9
    assert draw(numbers, 1).sum() == pytest.approx(open_part.sum() * (p[1] - p[0]) ** 2, rel=2e-3)


def test_flux_is_conserved_through_folds_and_discs_cut_the_pupil():
    numbers = ghost(2)
    numbers[FIRST_I : FIRST_I + 10] = 0.0
    numbers[FIRST_I] = 2.0
    numbers[FIRST_G : FIRST_G + 2] = 4.0, 30.0
    p = np.linspace(-1.0, 1.0, 801)
    xi, eta = np.meshgrid(p, p)
    open_part = (xi**2 + eta**2 <= 1.0) & (np.hypot(xi - 0.4625, eta) <= 1.1) & (np.hypot(xi + 0.35, eta) <= 1.2)
    area = open_part.sum() * (p[1] - p[0]) ** 2
    assert draw(numbers, 2).sum() == pytest.approx(2.0 * area, rel=2e-3)


def test_a_closed_pupil_is_dark():
    numbers = ghost(1)
    numbers[FIRST_DISC : FIRST_DISC + 3] = 8.0, 0.0, 1.0
    assert not draw(numbers, 1).any()
    assert window_of(numbers, 1, 0.5, FRAME, *SIZE)[2] == 0


def even(discs: int = 1) -> np.ndarray:
    """Return a ghost with a nearly linear map, whose triangles are joined to cells."""
    numbers = ghost(discs)
    numbers[FIRST_G + 1 : FIRST_G + 10] *= 0.1
    return numbers


def test_joined_cells_are_as_bright_as_the_pupil_is():
    numbers = np.zeros(NUMBERS)
    numbers[0], numbers[FIRST_G] = 80.0, 30.0
    numbers[FIRST_I : FIRST_I + 3] = 900.0, 200.0, 240.0
    picture = draw(numbers, 0)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    right, up = x - FRAME[0], FRAME[1] - y
    xi = (FRAME[2] * right + FRAME[3] * up - 40.0) / 30.0
    eta = (FRAME[2] * up - FRAME[3] * right) / 30.0
    u = xi**2 + eta**2
    inside = u < 0.9
    expected = (900.0 + 200.0 * u + 240.0 * 0.5 * xi) / 900.0
    off = (picture / expected - 1.0)[inside]
    assert np.abs(off).max() < 0.06
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert picture.sum() == pytest.approx((900.0 + 100.0) * np.pi, rel=2e-3)


def bladed(discs: int = 1) -> np.ndarray:
    """Return a ghost with every aberration and seven blades."""
    numbers = ghost(discs)
    numbers[BLADES], numbers[TURN] = 7.0, 0.4
    return numbers


def growing(discs: int = 1) -> np.ndarray:
    """Return a ghost with every aberration and a divisor that makes it grow with the field."""
    numbers = ghost(discs)
    numbers[BELOW:] = 0.2, -0.6
    return numbers


def test_place_and_size_are_divided_by_a_polynomial():
    # f and g are constant, so pupil points on the line through the light land on that line
    numbers, sigma = np.zeros(NUMBERS), 0.8
    numbers[0], numbers[FIRST_G], numbers[FIRST_I], numbers[BELOW:] = 30.0, 12.0, 400.0, (-0.3, -0.7)
    upright = np.array([60.0, 70.0, 1.0, 0.0, 1.0])
    picture = draw(numbers, 0, sigma, upright)
    at = np.linspace(-1.0, 1.0, 4001)
    lands = 60.0 + (sigma * 30.0 + 12.0 * at) / (1.0 - 0.3 * sigma * at - 0.7 * sigma**2)
    seen = np.flatnonzero(picture[70] > 0.02 * picture[70].max())
    assert seen[0] == pytest.approx(lands.min(), abs=1.0)
    assert seen[-1] + 1.0 == pytest.approx(lands.max(), abs=1.0)
    # all light of the pupil lands
    assert picture.sum() == pytest.approx(400.0 * np.pi, rel=1e-6)


def test_the_divisor_is_bounded_away_from_0():
    numbers = ghost(1)
    numbers[BELOW + 1] = -4.0
    assert np.isfinite(draw(numbers, 1, 0.9)).all()
    # at this field the divisor is clamped, so the derivative by its parameter is 0
    free, changes = np.array([BELOW + 1]), np.zeros((SIZE[1], SIZE[0] + 1, 1))
    draw_with_changes(numbers, 1, 0.9, free, FRAME, 0, 0, np.zeros((SIZE[1], SIZE[0] + 1)), changes)
    assert not changes.any()


@pytest.mark.parametrize("kind", [ghost, even, bladed, growing])
@pytest.mark.parametrize("discs", [0, 1, 2])
def test_derivatives_are_those_of_the_picture(discs, kind):
    numbers = kind(discs)
    free = np.concatenate([np.arange(FIRST_DISC + 3 * discs), np.arange(BELOW, NUMBERS)])
    left, top, width, height = window_of(numbers, discs, 0.5, FRAME, *SIZE)
    plane, changes = np.zeros((height, width + 1)), np.zeros((height, width + 1, free.size))
    draw_with_changes(numbers, discs, 0.5, free, FRAME, left, top, plane, changes)
    sum_along_rows(plane)
    sum_changes_along_rows(changes)
    part = slice(top, top + height), slice(left, left + width)
    assert np.allclose(plane[:, :-1], draw_finely(numbers, discs)[part], atol=1e-13)
    # a replay's cells are larger
    picture = draw(numbers, discs)[part]
    assert np.sqrt(np.mean((picture - plane[:, :-1]) ** 2)) < 0.015 * np.sqrt(np.mean(picture**2))
    assert picture.sum() == pytest.approx(plane[:, :-1].sum(), rel=3e-3)
    for q, n in enumerate(free):
        step = np.zeros(NUMBERS)
        step[n] = 1e-7 if n >= BELOW else 1e-6
        by_difference = (draw_finely(numbers + step, discs) - draw_finely(numbers - step, discs))[part]
        by_difference /= 2.0 * step[n]
        assert np.abs(by_difference - changes[:, :-1, q]).max() < 1e-4 * np.abs(by_difference).max() + 1e-12, n


def test_clipping_by_the_window_does_not_change_the_rest():
    numbers = ghost(1)
    whole = draw(numbers, 1)
    frame = FRAME.copy()
    frame[:2] -= 120.0, 40.0
    assert np.allclose(draw(numbers, 1, frame=frame, size=(100, 60)), whole[40:100, 120:220], atol=1e-12)


def test_roll_turns_the_ghost_about_the_axis():
    numbers, axis = ghost(1), np.array([70.0, 70.0])
    upright = draw(numbers, 1, frame=np.array([*axis, 1.0, 0.0, 1.0]), size=(140, 140))
    quarter = draw(numbers, 1, frame=np.array([*axis, 0.0, 1.0, 1.0]), size=(140, 140))
    assert np.allclose(np.rot90(upright), quarter, atol=1e-12)


def test_a_ghost_many_times_larger_than_its_window_is_drawn():
    """A diverging search may try one: its outline is traced pixel by pixel only inside the window."""
    numbers = np.zeros(NUMBERS)
    numbers[FIRST_G], numbers[FIRST_I] = 1e13, 2e26
    plane, changes = np.zeros((20, 31)), np.zeros((20, 31, 2))
    draw_with_changes(numbers, 0, 0.5, np.array([FIRST_G, FIRST_I]), FRAME, 40, 30, plane, changes)
    sum_along_rows(plane)
    sum_changes_along_rows(changes)
    assert np.allclose(plane[:, :-1], 2.0)
    # radiance is proportional to light over the squared size
    assert np.allclose(changes[:, :-1, 0], -4e-13, atol=0.0)
    assert np.allclose(changes[:, :-1, 1], 1e-26, atol=0.0)
