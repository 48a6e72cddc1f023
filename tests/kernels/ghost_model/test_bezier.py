"""Walch's ghost: distances compared with polynomial roots, pictures with the transfer function of each distance."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model import bezier_distance as border
from flarewright.kernels.ghost_model.bezier import bezier_window, draw_beziers
from flarewright.kernels.jit.decorators import for_python

border_room, border_of = for_python(border.border_room), for_python(border.border_of)
border_distances = for_python(border.border_distances)

NUMBERS = np.array([
    20.0, 1.5, 30.0, 36.0, 24.0, 18.0, 15.0, 14.0, 17.0, 6.0, 15.0, 1.3, 1.8, 1.0, 0.8, 0.5, 0.3, 0.25, 0.2,
])  # fmt: skip
FRAME = np.array([60.2, 55.1, np.cos(0.4), np.sin(0.4), 1.0])


def signed_distances(numbers, points):
    """Return the kernel's signed distances of points, positive inside."""
    curves, places, work, found, x, y = border_room()
    apart, out = border_of(numbers, curves, places), []
    for some in np.split(points, range(border.LANES, len(points), border.LANES)):
        x[:], y[:] = some[-1] - [0.0, numbers[1]]
        x[: len(some)], y[: len(some)] = some[:, 0], some[:, 1] - numbers[1]
        border_distances(curves, places, apart, x, y, work, found)
        out.append(found[: len(some)].copy())
    return np.concatenate(out)


def by_roots(numbers, x, y):
    """Return the distance to the border by the roots of the fifth-order polynomial (equation 6.2)."""
    best = np.inf
    y = abs(y - numbers[1])
    for side, at, extent in ((-1.0, 5, numbers[3]), (1.0, 7, numbers[4])):
        p = np.array([
            [numbers[0], numbers[2]],
            [numbers[0] + side * numbers[at], numbers[2]],
            [numbers[0] + side * extent, numbers[at + 1]],
            [numbers[0] + side * extent, 0.0],
        ])  # fmt: skip
        power = np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) @ p
        cx, cy = np.polynomial.Polynomial(power[:, 0]) - x, np.polynomial.Polynomial(power[:, 1]) - y
        roots = (cx * cx.deriv() + cy * cy.deriv()).roots()
        roots = roots[np.abs(roots.imag) < 1e-9].real
        for t in (0.0, 1.0, *roots[(roots > 0.0) & (roots < 1.0)]):
            best = min(best, np.hypot(cx(t), cy(t)))
    return best


CIRCLE = np.array([5.0, 0.0, 60.0, 72.0, 72.0, *[33.0] * 4, *NUMBERS[9:]])
# concave on the left, and with control points on the ends of the right curve
HOLLOW = np.array([0.0, -3.0, 25.0, 60.0, 40.0, 55.0, 2.0, 0.0, 0.0, *NUMBERS[9:]])


# if two feet are almost equally far, the search may end at the farther one
@pytest.mark.parametrize(("numbers", "error"), [(NUMBERS, 1e-9), (CIRCLE, 1e-9), (HOLLOW, 1e-3)])
@pytest.mark.parametrize(("count", "apart"), [(80, 20.0), pytest.param(400, 8.0, marks=pytest.mark.slow)])
def test_distance_is_that_of_the_polynomials_roots(numbers, error, count, apart):
    rng = np.random.default_rng(3)
    # the rotated grid includes points on the middle line, which have a foot on either side
    grid = np.stack(np.meshgrid(np.arange(-80.0, 80.0, apart), np.arange(-70.0, 70.0, apart)), axis=-1).reshape(-1, 2)
    points = np.concatenate([rng.uniform(-60.0, 90.0, (count, 2)), grid, grid @ [[0.985, 0.174], [-0.174, 0.985]]])
    found = signed_distances(numbers, points)
    exact = [by_roots(numbers, *point) for point in points]
    assert np.allclose(np.abs(found), exact, rtol=0.0, atol=error)


def test_inside_is_positive():
    points = np.array([[20.0, 1.5], [20.0, 30.5], [20.0, 32.5], [-15.0, 1.5], [-17.0, 1.5], [43.0, 1.5], [45.0, 1.5]])
    found = signed_distances(NUMBERS, points)
    assert list(found > 0.0) == [True, True, False, True, False, True, False]


@pytest.mark.parametrize("numbers", [NUMBERS, CIRCLE, HOLLOW])
@pytest.mark.parametrize("count", [500, pytest.param(3000, marks=pytest.mark.slow)])
def test_inside_is_what_the_border_encloses(numbers, count):
    t = np.linspace(0.0, 1.0, 4001)[:, None]
    corners = []
    for side, at, extent in ((1.0, 7, numbers[4]), (-1.0, 5, numbers[3])):
        x0, height = numbers[0], numbers[2]
        p = np.array([[x0, height], [x0 + side * numbers[at], height], [x0 + side * extent, numbers[at + 1]],
                      [x0 + side * extent, 0.0]])  # fmt: skip
        curve = (1 - t) ** 3 * p[0] + 3 * (1 - t) ** 2 * t * p[1] + 3 * (1 - t) * t**2 * p[2] + t**3 * p[3]
        corners.append(curve if side > 0.0 else curve[::-1])
    x, y = np.concatenate(corners[::-1]).T
    points = np.random.default_rng(5).uniform(-90.0, 90.0, (count, 2))
    px, py = points[:, :1], np.abs(points[:, 1:] - numbers[1])
    # count how often an upward ray crosses the upper border
    over = (x[:-1] <= px) != (x[1:] <= px)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = y[:-1] + (px - x[:-1]) / (x[1:] - x[:-1]) * (y[1:] - y[:-1])
    inside = (over & (at > py)).sum(axis=1) % 2 == 1
    found = signed_distances(numbers, points)
    sure = np.abs(found) > 0.01
    np.testing.assert_array_equal(found[sure] > 0.0, inside[sure])


def transfer(distance, numbers):
    """Return the light of pixels at signed distances (equation 6.4), shape (..., 3)."""
    out, inside, power_out, power_in = numbers[9:13]
    levels, depths = numbers[13:16], numbers[16:19]
    far = np.abs(distance)[..., None]
    # falloffs of 0 are drawn as 1e-6
    faded_out, faded_in = np.clip(far / max(out, 1e-6), 0.0, 1.0), np.clip(far / max(inside, 1e-6), 0.0, 1.0)
    light_in = levels + (depths - levels) * faded_in**power_in
    return np.where(distance[..., None] >= 0.0, light_in, levels * (1.0 - faded_out**power_out))


def test_transfer_function_is_that_of_equation_6_4():
    # a nearly straight border seen from the side: the right end of a very high ghost
    numbers = NUMBERS.copy()
    numbers[:9] = 0.0, 0.0, 4000.0, 50.0, 10.0, 50.0, 3900.0, 10.0, 3900.0
    frame = np.array([0.0, 0.5, 1.0, 0.0, 1.0])
    pixels = np.zeros((1, 40, 3))
    draw_beziers(numbers[None], frame, 0, 0, pixels)
    expected = transfer(10.0 - (np.arange(40) + 0.5), numbers)
    assert np.allclose(pixels[0], expected, atol=1e-6)


def draw(numbers, window):
    left, top, width, height = window
    pixels = np.zeros((height, width, 3))
    draw_beziers(numbers[None], FRAME, left, top, pixels)
    return pixels


def test_nothing_lies_outside_the_window():
    whole = draw(NUMBERS, (0, 0, 150, 110))
    left, top, width, height = bezier_window(NUMBERS, FRAME, 150, 110)
    assert whole.sum() == pytest.approx(whole[top : top + height, left : left + width].sum())


@pytest.mark.parametrize("scale", [0.4, 1.0, 2.3])
@pytest.mark.parametrize(("outside", "inside"), [(3.0, 5.0), (12.0, 40.0), (0.0, 0.0)])
def test_pixels_far_from_the_border_are_drawn_like_the_others(scale, outside, inside):
    numbers = NUMBERS.copy()
    numbers[9:11] = outside, inside
    frame = np.array([FRAME[0], FRAME[1], np.cos(0.7), np.sin(0.7), scale])
    # the distance of every pixel, where the drawing skips pixels far from the border
    right, up = np.meshgrid(np.arange(150) + 0.5 - frame[0], frame[1] - 0.5 - np.arange(110))
    turn = np.array([[frame[2], -frame[3]], [frame[3], frame[2]]]) / scale
    distance = signed_distances(numbers, np.stack([right, up], axis=-1).reshape(-1, 2) @ turn).reshape(110, 150)
    quick = np.full((110, 150, 3), 0.25)
    draw_beziers(numbers[None], frame, 0, 0, quick)
    np.testing.assert_allclose(quick, 0.25 + transfer(distance, numbers), rtol=0.0, atol=1e-9)
    assert np.ptp(quick) > 0.1


def test_rows_may_be_drawn_a_few_at_a_time():
    ghosts = np.array([NUMBERS, CIRCLE, HOLLOW])
    whole, parts = np.zeros((2, 110, 150, 3))
    draw_beziers(ghosts, FRAME, 0, 0, whole)
    for top in range(0, 110, 11):
        draw_beziers(ghosts, FRAME, 0, top, parts[top : top + 11])
    np.testing.assert_allclose(parts, whole, rtol=0.0, atol=1e-12)
    alone = sum(draw(numbers, (0, 0, 150, 110)) for numbers in ghosts)
    np.testing.assert_allclose(whole, alone, rtol=0.0, atol=1e-12)
