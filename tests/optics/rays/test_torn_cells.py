"""Triangles in which some rays fail."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.tracing.sequential import ALIVE, WEIGHT, X, Y
from flarewright.optics.lens.paths import LightPath
from flarewright.optics.rays.bundle import Bundle
from flarewright.optics.rays.torn_cells import cut_failed_triangles

SIDE = 24


def fan(ends) -> tuple[Bundle, np.ndarray]:
    """Return SIDE x SIDE cells over the unit square, fans of eight triangles; `ends(x, y)` marks failed rays."""
    at = np.linspace(0.0, 1.0, 2 * SIDE + 1)
    pupil = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange(len(pupil)).reshape(2 * SIDE + 1, 2 * SIDE + 1)
    around = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    triangles = [
        [number[2 * i + 1, 2 * j + 1], number[2 * i + a, 2 * j + b], number[2 * i + c, 2 * j + d]]
        for i in range(SIDE)
        for j in range(SIDE)
        for (a, b), (c, d) in zip(around, around[1:] + around[:1], strict=True)
    ]
    data = np.zeros((len(pupil), 7))
    data[:, X] = 3.0 * pupil[:, 0] - pupil[:, 1] + 5.0
    data[:, Y] = 2.0 * pupil[:, 1] + 0.5 * pupil[:, 0]
    data[:, WEIGHT] = 0.1 + 0.2 * pupil[:, 0]
    data[:, ALIVE] = 1.0
    dark = ends(*pupil.T)
    # the data of a failed ray must have no effect
    data[dark] = np.inf
    data[dark, ALIVE] = 0.0
    none = np.zeros(0, dtype=np.int64)
    return Bundle(LightPath(1, 0, none, none), pupil, np.array(triangles, dtype=np.int64), {}, 1), data


def areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def lit(bundle: Bundle, data: np.ndarray) -> np.ndarray:
    return (data[bundle.triangles, ALIVE] > 0.0).all(axis=1)


@pytest.mark.parametrize("turn_deg", [0.0, 17.0, 45.0, pytest.param(63.0, marks=pytest.mark.slow), 90.0])
def test_half_of_a_plane_keeps_its_area(turn_deg):
    """For borders that cross the cells at many places, area lost and gained by the cuts cancels."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    found = []
    for shift in np.linspace(-0.5, 0.5, 11) / SIDE:
        bundle, data = fan(lambda x, y, shift=shift: c * (x - 0.5) + s * (y - 0.5) > shift)
        whole, more = cut_failed_triangles(bundle, data)
        keeps = lit(whole, more)
        assert np.isfinite(more[more[:, ALIVE] > 0.0]).all()
        # cut within their triangles: no part is inverted or overlaps another
        assert (areas(whole.pupil, whole.triangles[keeps]) > 0.0).all()
        found.append(areas(whole.pupil, whole.triangles[keeps]).sum())
        assert found[-1] > areas(bundle.pupil, bundle.triangles[lit(bundle, data)]).sum()
    assert np.mean(found) == pytest.approx(0.5, abs=3e-3)


def test_rays_on_the_cut_go_on_as_their_neighbours_run():
    bundle, data = fan(lambda x, y: (x - 0.4) ** 2 + (y - 0.5) ** 2 > 0.09)
    whole, more = cut_failed_triangles(bundle, data)
    new = slice(len(data), None)
    x, y = whole.pupil[new].T
    # a cell whose passing rays lie on a line gives no slopes
    known = np.abs(more[new, X] - (3.0 * x - y + 5.0)) < 1e-9
    assert known.mean() > 0.6
    np.testing.assert_allclose(more[new][known, Y], (2.0 * y + 0.5 * x)[known], atol=1e-9)
    np.testing.assert_allclose(more[new][known, WEIGHT], (0.1 + 0.2 * x)[known], atol=1e-9)
    keeps = lit(whole, more)
    assert areas(whole.pupil, whole.triangles[keeps]).sum() == pytest.approx(np.pi * 0.09, rel=0.01)


def test_slopes_are_the_least_squares_of_a_cell():
    """Against NumPy's solver, for rays that no plane fits and that fail here and there."""
    random = np.random.default_rng(3)
    bundle, data = fan(lambda x, y: random.random(len(x)) < 0.3)
    data[:, X] = np.where(data[:, ALIVE] > 0.0, np.cos(9.0 * bundle.pupil[:, 0]) * bundle.pupil[:, 1], np.inf)
    whole, more = cut_failed_triangles(bundle, data)
    alive, checked = data[:, ALIVE] > 0.0, 0
    for begin, cut, last in whole.triangles[len(bundle.triangles) :]:
        cell = np.unique(bundle.triangles[bundle.triangles[:, 0] == begin])
        passing = cell[alive[cell]]
        # parts that begin at a cell's centre and have two cuts: the last one is on an edge from there
        if len(passing) < 4 or cut < len(data):
            continue
        centred, values = bundle.pupil[passing] - bundle.pupil[passing].mean(axis=0), data[passing, X]
        slopes, _, rank, _ = np.linalg.lstsq(centred, values - values.mean(), rcond=1e-6)
        if rank == 2:
            expected = data[begin, X] + (whole.pupil[last] - bundle.pupil[begin]) @ slopes
            assert more[last, X] == pytest.approx(expected, abs=1e-9)
            checked += 1
    assert checked > 200


@pytest.mark.parametrize("ends", [lambda x, y: x > 2.0, lambda x, y: x > -1.0])
def test_what_is_whole_or_dark_is_left_alone(ends):
    bundle, data = fan(ends)
    whole, more = cut_failed_triangles(bundle, data)
    assert whole is bundle
    assert more is data
