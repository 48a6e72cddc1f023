"""Drawn polygons have exact areas, no seams, and keep slivers."""

from __future__ import annotations

import numpy as np
import pytest
from drawing import area, blank, channels, fill
from hypothesis import given, settings
from hypothesis import strategies as st

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.raster import polygons

splat_line = for_python(polygons.splat_line)


def convex(rng, count: int, width: float, height: float, size: float) -> np.ndarray:
    """Return a random convex polygon inside the picture: points on an ellipse in order."""
    turn = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    axes = rng.uniform(0.05, 1.0, 2) * size
    lean = rng.uniform(0.0, np.pi)
    at = np.stack([axes[0] * np.cos(turn), axes[1] * np.sin(turn)])
    at = np.array([[np.cos(lean), -np.sin(lean)], [np.sin(lean), np.cos(lean)]]) @ at
    reach = np.abs(at).max(axis=1)
    middle = rng.uniform(reach, np.maximum([width, height] - reach, reach + 1e-9))
    return at.T + middle


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(3, 12), size=st.floats(0.01, 14.0), turned=st.booleans())
def test_a_polygon_covers_its_area(seed, count, size, turned):
    """Either orientation, from a hundredth of a pixel to the whole picture; edges are known to 5e-7 of a pixel."""
    polygon = convex(np.random.default_rng(seed), count, 40.0, 31.0, size)
    canvas = blank(40, 31)
    fill(polygon[::-1] if turned else polygon, canvas, density=3.0)
    drawn, meant = channels(canvas, 40)[0].sum(dtype=float), 3.0 * area(polygon)
    # the absolute error grows with the length of the edges, which matters for slivers
    assert drawn == pytest.approx(meant, rel=1e-5, abs=1e-6 + 3.0 * 5e-7 * 2.0 * size)
    assert channels(canvas, 40).min() >= -1e-6
    assert channels(canvas, 40).max() <= 3.0 * (1.0 + 1e-5)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_a_pixel_holds_its_exact_share(seed):
    """Compare with counting points on a fine grid."""
    polygon = convex(np.random.default_rng(seed), 7, 8.0, 8.0, 3.9)
    canvas = blank(8, 8)
    fill(polygon, canvas)
    at = (np.arange(8 * 64) + 0.5) / 64
    x, y = np.meshgrid(at, at)
    inside = np.ones_like(x, dtype=bool)
    following = np.roll(polygon, -1, axis=0)
    for (ax, ay), (bx, by) in zip(polygon, following, strict=True):
        inside &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0.0
    share = inside.reshape(8, 64, 8, 64).mean(axis=(1, 3))
    np.testing.assert_allclose(channels(canvas, 8)[0], share, atol=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_triangles_that_tile_a_square_leave_no_seam(seed):
    """Every pixel of the square has full coverage for any triangulation: no gaps, no doubled edges."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    inner = rng.uniform(0.0, 1.0, (300, 2)) ** 2  # crowded in one corner, so some triangles are tiny
    edge = rng.uniform(0.0, 1.0, 20)
    frame = np.concatenate([np.stack([edge, 0 * edge], 1), np.stack([0 * edge + 1, edge], 1)])
    points = np.concatenate([inner, frame, frame[:, ::-1], [[0, 0], [0, 1], [1, 0], [1, 1]]]) * 29.0 + 1.0
    canvas = blank(31, 31)
    for triangle in Delaunay(points).simplices:
        fill(points[triangle], canvas, density=0.25)
    plane = channels(canvas, 31)[1]
    np.testing.assert_allclose(plane[1:30, 1:30], 0.25, atol=2e-6)
    assert np.abs(plane[[0, 30]]).max() < 1e-6
    assert np.abs(plane[:, [0, 30]]).max() < 1e-6


def test_triangles_on_whole_pixels_leave_no_seam():
    """Edges and corners lie exactly on pixel borders."""
    canvas = blank(16, 16)
    for x in range(0, 16, 4):
        for y in range(0, 16, 4):
            square = np.array([[x, y], [x + 4, y], [x + 4, y + 4], [x, y + 4]], float)
            fill(square[[0, 1, 2]], canvas)
            fill(square[[0, 2, 3]], canvas)
    np.testing.assert_allclose(channels(canvas, 16), 1.0, atol=1e-6)


def test_a_gradient_holds_its_flux():
    """For a linear density the sum is the integral, area times the density at the centroid."""
    triangle = np.array([[2.3, 3.1], [35.2, 8.4], [11.7, 27.9]])
    canvas = blank(40, 31)
    fill(triangle, canvas, density=0.5, gx=0.02, gy=-0.01)
    middle = triangle.mean(axis=0)
    meant = area(triangle) * (0.5 + 0.02 * middle[0] - 0.01 * middle[1])
    # partly covered pixels use the density at their centre
    assert channels(canvas, 40)[2].sum(dtype=float) == pytest.approx(meant, rel=5e-4)


def test_densities_outside_the_polygon_are_bounded():
    """A pixel whose centre lies outside must not extrapolate a steep slope below zero."""
    sliver = np.array([[3.9, 2.0], [4.05, 2.0], [4.0, 9.0]])
    canvas = blank(12, 12)
    fill(sliver, canvas, density=-3.9, gx=1.0, low=0.0, high=0.2)
    assert channels(canvas, 12).min() >= 0.0
    assert channels(canvas, 12).sum() <= 3 * 0.2 * area(sliver) * (1 + 1e-6)


def test_channels_take_their_weights_negative_ones_too():
    canvas = blank(10, 10)
    square = np.array([[1.5, 1.5], [7.25, 1.5], [7.25, 6.0], [1.5, 6.0]])
    fill(square, canvas, rgb=[1.0, -0.25, 0.0])
    sums = channels(canvas, 10).sum(axis=(1, 2), dtype=float)
    assert sums == pytest.approx([area(square), -0.25 * area(square), 0.0], rel=1e-6)


def test_a_polygon_up_to_the_border_of_the_picture():
    canvas = blank(9, 7)
    fill(np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 7.0], [0.0, 7.0]]), canvas)
    np.testing.assert_allclose(channels(canvas, 9), 1.0, rtol=1e-6)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_a_line_keeps_its_flux_inside_the_picture(seed):
    x0, y0, x1, y1 = np.random.default_rng(seed).uniform(2.0, 18.0, 4)
    plane = blank(20, 20)
    splat_line(x0, y0, x1, y1, 0.7, np.array([1.0, 2.0, -1.0]), plane)
    assert channels(plane, 20).sum(axis=(1, 2), dtype=float) == pytest.approx([0.7, 1.4, -0.7], rel=1e-5)
    # and lies along it
    weight = channels(plane, 20)[0]
    weight = weight / weight.sum()
    at = np.arange(20) + 0.5
    assert (weight.sum(axis=0) @ at, weight.sum(axis=1) @ at) == pytest.approx(((x0 + x1) / 2, (y0 + y1) / 2), abs=1e-3)


def test_a_line_outside_the_picture_is_lost_to_the_sensor():
    plane = blank(8, 8)
    splat_line(-30.0, -5.0, -20.0, 40.0, 1.0, np.ones(3), plane)
    assert not plane.any()
    splat_line(np.nan, 0.0, 3.0, 3.0, 0.0, np.ones(3), plane)
    assert np.isfinite(plane).all()


def test_rows_are_summed_from_their_differences():
    differences = np.random.default_rng(3).normal(size=(5, 700, 3)) * 1e-3
    pixels = np.empty(differences.shape, np.float32)
    polygons.sum_rows(differences, pixels)
    expected = np.cumsum(differences, axis=1)
    np.testing.assert_array_equal(pixels, expected.astype(np.float32))
    polygons.sum_rows(differences, differences)
    np.testing.assert_allclose(differences, expected, rtol=0.0, atol=1e-15)
