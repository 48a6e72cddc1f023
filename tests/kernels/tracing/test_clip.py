"""Clipping triangles by rims, blades and borders: the kept part and the rest add up to the triangle."""

from __future__ import annotations

import numpy as np
import pytest
from drawing import area

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.tracing import clip as clipping
from flarewright.kernels.tracing.clip import MAX_VERTICES, PP, PQ, PSTOP, PX, PY
from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y
from flarewright.model import Iris
from flarewright.optics.pupil.iris import blade_edges, transmission

clip_triangle = for_python(clipping.clip_triangle)
cut_to_rectangle = for_python(clipping.cut_to_rectangle)
polygon_area = for_python(clipping.polygon_area)

IDENTITY = np.eye(2)
NO_BLADES = np.zeros((0, 4))


def node_table(pupil, rel=None, stops=None) -> np.ndarray:
    """Return nodes with equal sensor and pupil places; `stops` has two columns for each stop crossing."""
    stops = pupil if stops is None else stops
    data = np.zeros((len(pupil), STOP_X + stops.shape[1]))
    data[:, X], data[:, Y] = pupil.T
    data[:, WEIGHT] = data[:, ALIVE] = 1.0
    data[:, REL] = 0.0 if rel is None else rel
    data[:, STOP_X:] = stops
    return data


def clip(data, pupil, blades=NO_BLADES, triangle=(0, 1, 2), mirror=1.0, axes=IDENTITY) -> np.ndarray:
    crossings = (data.shape[1] - STOP_X) // 2
    polygon, other = np.empty((2, MAX_VERTICES, PSTOP + 2 * crossings))
    count = clip_triangle(
        data, pupil, np.array(triangle), mirror, crossings, blades, axes, polygon, other, np.empty(MAX_VERTICES)
    )
    return polygon[:count].copy()


def kept_area(polygon) -> float:
    return abs(polygon_area(polygon, len(polygon), PP, PQ))


TRIANGLE = np.array([[0.0, 0.0], [4.0, 1.0], [1.0, 3.0]])


def test_what_nothing_blocks_stays_whole():
    polygon = clip(node_table(TRIANGLE), TRIANGLE)
    np.testing.assert_array_equal(polygon[:, [PP, PQ]], TRIANGLE)
    assert kept_area(polygon) == pytest.approx(area(TRIANGLE))


def test_the_rim_cuts_where_the_relative_radius_is_one():
    polygon = clip(node_table(TRIANGLE, rel=[0.5, 1.5, 0.9]), TRIANGLE)
    rel = polygon[:, 2]
    assert rel.max() == pytest.approx(1.0)
    assert np.isclose(rel, 1.0).sum() == 2
    # the clipped corner takes half of one edge and 5 / 6 of the other
    assert kept_area(polygon) == pytest.approx(area(TRIANGLE) * (1.0 - 0.5 * (0.5 / 0.6)))


def test_beyond_the_rim_nothing_is_left():
    assert len(clip(node_table(TRIANGLE, rel=[1.1, 1.5, 2.0]), TRIANGLE)) == 0


def half_plane(nx: float, ny: float, offset: float) -> np.ndarray:
    return np.array([[nx, ny, offset, 0.0]])


def test_a_blade_and_its_opposite_share_the_triangle():
    rng = np.random.default_rng(5)
    for _ in range(200):
        turn, offset = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-2.0, 4.0)
        n = np.array([np.cos(turn), np.sin(turn)])
        one = clip(node_table(TRIANGLE), TRIANGLE, half_plane(*n, offset))
        other = clip(node_table(TRIANGLE), TRIANGLE, half_plane(*-n, -offset))
        shares = sum(kept_area(p) for p in (one, other) if len(p))
        assert shares == pytest.approx(area(TRIANGLE), rel=1e-12)


def test_blades_cut_at_every_crossing():
    """Three crossings at different places in the stop: the kept part passes all of them."""
    stops = np.concatenate([TRIANGLE, 1.0 - 0.5 * TRIANGLE, TRIANGLE[:, ::-1] - 1.0], axis=1)
    blades = blade_edges(Iris(blades=6), 2.0)
    polygon = clip(node_table(TRIANGLE, stops=stops), TRIANGLE, blades)
    assert 0.0 < kept_area(polygon) < area(TRIANGLE)
    for c in range(3):
        u, v = polygon[:, PSTOP + 2 * c] * (1 - 1e-9), polygon[:, PSTOP + 2 * c + 1] * (1 - 1e-9)
        assert (transmission(Iris(blades=6), 2.0, u, v) == 1.0).all()


@pytest.mark.parametrize("iris", [Iris(blades=6), Iris(blades=5, rounding=0.5, rotation_deg=20.0), Iris()])
def test_the_opening_keeps_its_area(iris):
    """A fine grid of triangles over the stop: the open area is pi h^2; chords approximate curved blades."""
    at = np.linspace(-3.0, 3.0, 61)
    x, y = np.meshgrid(at, at)
    pupil = np.stack([x.ravel(), y.ravel()], axis=1)
    data, blades = node_table(pupil), blade_edges(iris, 2.0)
    total = 0.0
    for r in range(60):
        for c in range(60):
            k = r * 61 + c
            for triangle in ((k, k + 1, k + 62), (k, k + 62, k + 61)):
                polygon = clip(data, pupil, blades, triangle)
                total += kept_area(polygon) if len(polygon) else 0.0
    assert total == pytest.approx(np.pi * 4.0, rel=1e-3)


def test_the_mirror_image_is_cut_by_the_same_blades():
    """The iris does not share the symmetry of the bundle, so different blades cut the two halves."""
    blades = half_plane(1.0, 0.0, 1.0)
    right, left = (clip(node_table(TRIANGLE), TRIANGLE, blades, mirror=m) for m in (1.0, -1.0))
    assert right[:, PX].max() == pytest.approx(1.0)
    assert kept_area(right) < area(TRIANGLE)
    assert kept_area(left) == pytest.approx(area(TRIANGLE))
    np.testing.assert_allclose(left[:, [PX, PP]], -TRIANGLE[:, [0, 0]])


def test_axes_turn_the_stop_upright():
    """An upper blade cuts the upper part of the picture, whatever the direction of the light."""
    turn = 0.7
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    polygon = clip(node_table(TRIANGLE), TRIANGLE, half_plane(0.0, 1.0, 1.5), axes=axes)
    upright = polygon[:, [PX, PY]] @ axes
    assert upright[:, 1].max() == pytest.approx(1.5)
    np.testing.assert_allclose(polygon[:, PSTOP : PSTOP + 2], upright)


def test_tiles_of_a_picture_share_a_polygon():
    rng = np.random.default_rng(2)
    for _ in range(100):
        corners = rng.uniform(-8.0, 20.0, (3, 2))
        total = 0.0
        for left in (-10.0, 0.0, 10.0):
            for top in (-10.0, 0.0, 10.0):
                polygon, other = np.zeros((2, MAX_VERTICES, 2))
                polygon[:3] = corners - [left, top]
                count = cut_to_rectangle(polygon, 3, other, np.empty(MAX_VERTICES), 10.0, 10.0)
                if count >= 3:
                    kept = polygon[:count]
                    assert kept.min() >= -1e-9
                    assert kept.max() <= 10.0 + 1e-9
                    total += area(kept)
        assert total == pytest.approx(area(corners), rel=1e-9, abs=1e-9)
