"""The iris edge seen by rays, compared with NumPy."""

import numpy as np
import pytest

from flarewright.kernels.tracing.iris_edge import bounded_by_iris, largest_part, reached_edges, widen_box, widen_stops
from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X, X, Y

RADIUS, INNER = 1.0, 0.8
PLACE = np.array([[40.0, 3.0, -1.0], [30.0, 0.5, 4.0]])
SIZE = np.array([64.0, 48.0])


@pytest.fixture(params=range(4))
def bundle(request):
    """Random rays through two stop crossings, of which some end and some lie beyond a rim, and random triangles."""
    random = np.random.default_rng(request.param)
    rays = np.empty((60, STOP_X + 4))
    rays[:, ALIVE] = random.random(60) < 0.9
    rays[:, REL] = random.uniform(0.5, 1.1, 60)
    rays[:, [X, Y]] = random.normal(0.0, 12.0, (60, 2))
    rays[:, STOP_X:] = random.uniform(-0.8, 0.8, (60, 4))
    ended = rays[:, ALIVE] == 0.0
    rays[np.ix_(ended, [X, Y])] = np.inf
    return rays, random.integers(0, 60, (80, 3)), random


def radii(rays):
    return np.hypot(rays[:, STOP_X::2], rays[:, STOP_X + 1 :: 2])


def passing(rays, radius):
    return (rays[:, ALIVE] > 0.0) & (rays[:, REL] <= 1.0) & (radii(rays) <= radius).all(axis=1)


def landed(rays, mirror):
    with np.errstate(invalid="ignore"):
        return PLACE[:, :1] + PLACE[:, 1:] @ (rays[:, [X, Y]] * (mirror, 1.0)).T


def touching(rays, triangles, mirror):
    at = landed(rays, mirror)[:, triangles]
    alive = (rays[:, ALIVE] > 0.0)[triangles].all(axis=1)
    return alive & ((at.max(axis=2) >= 0.0) & (at.min(axis=2) <= SIZE[:, None])).all(axis=0)


def test_edges_are_reached_where_passing_rays_come_near(bundle):
    rays, *_ = bundle
    for inner in (INNER, 0.99):
        reached = np.zeros(2, dtype=np.bool_)
        reached_edges(rays, RADIUS, inner, reached)
        wanted = (passing(rays, RADIUS)[:, None] & (radii(rays) >= inner)).any(axis=0)
        np.testing.assert_array_equal(reached, wanted)
    # True items stay True
    reached = np.array([True, False])
    reached_edges(rays[:0], RADIUS, INNER, reached)
    assert reached.tolist() == [True, False]


def test_a_bundle_is_bounded_by_the_iris_alone_unless_a_rim_cuts_it_or_it_folds():
    x, y = (side.ravel() for side in np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]))
    rays = np.zeros((9, STOP_X + 2))
    rays[:, ALIVE], rays[:, REL], rays[:, X], rays[:, Y] = 1.0, 0.5, x, y
    rays[:, STOP_X], rays[:, STOP_X + 1] = 0.5 * x, 0.5 * y
    triangles = np.array([[4, 0, 1], [4, 1, 2], [4, 2, 5], [4, 5, 8], [4, 8, 7], [4, 7, 6], [4, 6, 3], [4, 3, 0]])
    assert bounded_by_iris(rays, triangles, RADIUS)
    cut, folded = rays.copy(), rays.copy()
    cut[0, REL] = 1.1
    assert not bounded_by_iris(cut, triangles, RADIUS)
    folded[4, X] = 3.0
    assert not bounded_by_iris(folded, triangles, RADIUS)
    # cuts and folds beyond the iris do not count, nor do rays that ended
    for changed in (cut, folded):
        changed[0, STOP_X], changed[4, STOP_X] = 2.0, 2.0
        assert bounded_by_iris(changed, triangles, RADIUS)
    cut[0, STOP_X], cut[0, ALIVE] = 0.0, 0.0
    assert bounded_by_iris(cut, triangles, RADIUS)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_boxes_hold_what_passes_and_what_is_seen(bundle, mirror):
    rays, triangles, random = bundle
    box = np.array([np.inf, -np.inf, np.inf, -np.inf])
    widen_box(rays, RADIUS, PLACE, mirror, box)
    at = landed(rays, mirror)[:, passing(rays, RADIUS)]
    np.testing.assert_allclose(box, np.stack([at.min(axis=1), at.max(axis=1)], axis=1).ravel(), rtol=1e-12)
    angle = random.uniform(0.0, 2.0 * np.pi)
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    boxes = np.tile([np.inf, -np.inf], (2, 2))
    # one visible placement suffices
    away = PLACE + np.array([[1e6, 0.0, 0.0], [0.0, 0.0, 0.0]])
    widen_stops(rays, triangles, np.stack([away, PLACE]), SIZE, mirror, axes, boxes)
    nodes = np.unique(triangles[touching(rays, triangles, mirror)])
    for c in range(2):
        stop = rays[nodes, STOP_X + 2 * c : STOP_X + 2 * c + 2] * [mirror, 1.0] @ axes
        wanted = np.stack([stop.min(axis=0), stop.max(axis=0)], axis=1).ravel()
        np.testing.assert_allclose(boxes[c], wanted, rtol=1e-12)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("ringed", [[True, False], [True, True], [False, False]])
def test_a_ghost_is_compared_with_all_light_at_its_lit_edge(bundle, mirror, ringed):
    rays, triangles, random = bundle
    own, least = random.random(60), random.random((6, 8)) + 0.2
    corners = np.array([[0.0, 0.0], SIZE])
    found = largest_part(rays, triangles, own, np.array(ringed), RADIUS, INNER, PLACE, corners, mirror, least)
    lit = (passing(rays, RADIUS)[:, None] & (radii(rays) >= INNER))[:, ringed].any(axis=1)
    chosen = triangles[touching(rays, triangles, mirror) & lit[triangles].any(axis=1)]
    column, row = landed(rays, mirror)[:, chosen] / 8.0
    there = least[np.clip(row, 0, 5).astype(int), np.clip(column, 0, 7).astype(int)].min(axis=1)
    bright = own[chosen].max(axis=1)
    assert found == pytest.approx((bright / np.maximum(there, bright)).max(initial=0.0))
