"""Cutting a convex polygon edge by edge along its ring of vertices."""

import numpy as np
import pytest

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.paraxial.iris_images import close_ring, cut_ring

CLOSE, CUT = for_python(close_ring), for_python(cut_ring)


def cut(corners, edges, slack=1e-9):
    """Return the corners of the part of a polygon that is inside all edges (a, b, high), shape (N, 2)."""
    room = len(corners) + 2 * len(edges)
    spots, ring = np.empty((room, 2)), np.empty((room, 2), dtype=np.int64)
    CLOSE(corners, spots, ring)
    head, used = 0, len(corners)
    for a, b, high in edges:
        head, used = CUT(spots, ring, head, used, a, b, high, slack)
        if head < 0:
            return np.empty((0, 2))
    order = [head]
    while ring[order[-1], 0] != head:
        order.append(ring[order[-1], 0])
        assert ring[order[-1], 1] == order[-2]
    return spots[order]


def cut_plainly(corners, edges):
    """Do the same by looking at every side (Sutherland and Hodgman 1974)."""
    for a, b, high in edges:
        kept = []
        for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            low, up = np.array([a, b]) @ here - high, np.array([a, b]) @ there - high
            kept += [here] if low <= 0.0 else []
            kept += [here + low / (low - up) * (there - here)] if (low <= 0.0) != (up <= 0.0) else []
        corners = np.array(kept).reshape(-1, 2)
        if len(corners) == 0:
            break
    return corners


def area(corners):
    x, y = corners.T if len(corners) else np.empty((2, 0))
    return 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def circle(sides, radius=1.0, at=(0.0, 0.0), turn=0.0):
    angle = turn + 2.0 * np.pi * np.arange(sides) / sides
    return np.stack([at[0] + radius * np.cos(angle), at[1] + radius * np.sin(angle)], axis=1)


def edges_of(corners):
    along = np.roll(corners, -1, axis=0) - corners
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    return np.column_stack([normal, (normal * corners).sum(axis=1)])


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_the_common_part_of_two_polygons_is_that_of_a_plain_cut(flip):
    random = np.random.default_rng(4)
    seen = set()
    for _ in range(40):
        mine = circle(int(random.integers(3, 65))) * random.uniform(0.3, 2.0, 2)
        iris = circle(
            int(random.integers(3, 49)),
            random.uniform(0.1, 2.5),
            random.uniform(-1.5, 1.5, 2),
            random.uniform(0.0, 6.0),
        )
        edges = edges_of(iris)
        # the image of an iris can be mirrored
        mine = mine * [flip, 1.0]
        wanted = area(cut_plainly(mine, edges))
        assert area(cut(mine, edges)) == pytest.approx(wanted, abs=1e-12)
        inside = min(area(mine), area(iris))
        seen.add("apart" if wanted == 0.0 else "inside" if wanted > inside * (1.0 - 1e-9) else "both")
    assert seen == {"apart", "inside", "both"}


def test_edges_through_corners_and_coincident_corners_do_no_harm():
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    assert area(cut(square, [(1.0, 1.0, 0.0)])) == pytest.approx(2.0)
    assert area(cut(square, edges_of(square))) == pytest.approx(4.0)
    doubled = np.repeat(circle(40), 3, axis=0)
    doubled[1::3] += 1e-16
    edges = edges_of(circle(16, 0.8, (0.5, 0.2)))
    assert area(cut(doubled, edges)) == pytest.approx(area(cut_plainly(circle(40), edges)), abs=1e-12)
    # the same edge twice, as at a second crossing of the stop without magnification
    assert area(cut(circle(40), [*edges, *edges])) == pytest.approx(area(cut(circle(40), edges)), abs=1e-12)


def test_nothing_is_left_where_an_edge_passes_nothing():
    assert len(cut(circle(12), [(1.0, 0.0, -1.5)])) == 0
    # an edge without direction, as where the image of the iris is a point beside it
    assert len(cut(circle(12), [(0.0, 0.0, -1.0)])) == 0
    assert area(cut(circle(12), [(0.0, 0.0, 1.0)])) == pytest.approx(area(circle(12)))
