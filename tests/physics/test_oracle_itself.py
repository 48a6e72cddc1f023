"""Tests of the oracle: the check values of physics.md, and cases with closed-form answers."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from oracle import (
    OracleRow,
    System,
    direction,
    efl_bfl,
    entrance_box,
    estimate,
    find_region,
    flare_matrix,
    focused,
    ghost_paths,
    refine,
    reflectance,
    reflectance_sp,
    trace,
)
from prescriptions import CANON, FIVE, HELIAR, TESSAR, TRIPLET, system

HELIAR_ROWS = [  # typed again from the thesis: (R, d, n)
    (30.810, 7.700, 1.652),
    (-89.350, 1.850, 1.603),
    (580.380, 3.520, 1.0),
    (-80.630, 1.850, 1.643),
    (28.340, 4.180, 1.0),
    (None, 3.000, 1.0),
    (0.0, 1.850, 1.581),
    (32.190, 7.270, 1.694),
    (-52.990, 81.857, 1.0),
]
FLARE_MATRIX = {
    (1, 0): (-10.937364, 9.366928),
    (2, 0): (-8.347156, 1.154423),
    (4, 1): (14.405193, 348.213947),
    (8, 6): (-4.527134, -53.968777),
    (8, 7): (-9.326399, -252.167933),
}


@pytest.fixture(scope="module")
def heliar() -> System:
    rows = [
        OracleRow(0.0 if not R else 1.0 / R, d, n, 8.0 if R is None else 14.0, is_stop=R is None)
        for R, d, n in HELIAR_ROWS
    ]
    return focused(System(tuple(rows), 0.0))


# --- paraxial --------------------------------------------------------------------------------------------------


def test_heliar_focal_lengths(heliar):
    assert efl_bfl(heliar) == pytest.approx((99.235796, 81.315056), abs=6e-7)


def test_canon_focal_lengths():
    assert efl_bfl(system(CANON, 2.8)) == pytest.approx((35.8423, 38.3787), abs=6e-5)


@pytest.mark.parametrize("path", FLARE_MATRIX)
def test_flare_matrix_table(heliar, path):
    m = flare_matrix(heliar, path)
    assert m[0] == pytest.approx(FLARE_MATRIX[path], abs=6e-7)
    assert np.linalg.det(m) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("path", [None, *FLARE_MATRIX])
def test_traces_tend_to_the_matrix(heliar, path):
    """The traced position is A y + B u, u = -tan X; the upright picture has the opposite sign."""
    m = flare_matrix(heliar, path)
    for field, height in ((0.0, 1e-3), (1e-3, 0.0), (1e-3, 2e-3)):
        rays = trace(heliar, path, np.array([height]), np.array([0.0]), (field, 0.0))
        raw = m[0, 0] * height + m[0, 1] * direction((field, 0.0))[0] / direction((field, 0.0))[2]
        scale = abs(m[0, 0] * height) + abs(m[0, 1] * np.tan(np.radians(field)))
        assert rays.x[0] == pytest.approx(-raw, abs=1e-7 * scale + 1e-12)
        assert rays.y[0] == 0.0


@pytest.mark.parametrize(("table", "every", "same_side"), [(HELIAR, 28, 13), (TESSAR, 21, 9), (CANON, 351, 171)])
def test_ghost_counts(table, every, same_side):
    s = system(table, 4.0)
    assert (len(ghost_paths(s)), len(ghost_paths(s, same_side=True))) == (every, same_side)


def test_direct_image_lies_at_plus_efl_tan():
    s = system(HELIAR, 16.0)
    e = estimate(s, None, (3.0, -2.0), samples=2000, replicas=4)[0]
    efl = efl_bfl(s)[0]
    assert e.centroid_mm == pytest.approx([efl * np.tan(np.radians(a)) for a in (3.0, -2.0)], rel=3e-3)


# --- films -----------------------------------------------------------------------------------------------------

STACKS = [
    (1.0, (), 1.652),
    (1.652, (), 1.0),
    (1.652, (), 1.603),
    (1.0, ((1.38, 96.4),), 1.5),
    (1.5, ((1.38, 96.4),), 1.0),
    (1.0, ((1.38, 100.0), (2.1, 130.0), (1.62, 85.0)), 1.85),
    (1.85, ((1.62, 85.0), (2.1, 130.0), (1.38, 100.0)), 1.0),
]


@pytest.mark.parametrize(("n0", "films", "n1"), STACKS)
@pytest.mark.parametrize("degrees", [0.0, 10.0, 33.0, 36.9, 45.0, 70.0, 89.0])
@pytest.mark.parametrize("wavelength_nm", [420.0, 587.56])
def test_films_agree_with_tmm(n0, films, n1, degrees, wavelength_nm):
    tmm = pytest.importorskip("tmm")
    theta = np.radians(degrees)
    ours = reflectance_sp(n0, films, n1, np.array([np.cos(theta)]), wavelength_nm)
    n, d = [n0, *(f[0] for f in films), n1], [np.inf, *(f[1] for f in films), np.inf]
    theirs = [tmm.coh_tmm(p, n, d, theta, wavelength_nm) for p in "sp"]
    assert [r[0] for r in ours] == pytest.approx([t["R"] for t in theirs], abs=1e-12)
    if n0 * np.sin(theta) < n1:
        assert [1.0 - r[0] for r in ours] == pytest.approx([t["T"] for t in theirs], abs=1e-12)
    else:
        assert [r[0] for r in ours] == pytest.approx([1.0, 1.0], abs=1e-12)
    mean = reflectance(n0, films, n1, np.array([np.cos(theta)]), wavelength_nm)[0]
    assert mean == pytest.approx(0.5 * (theirs[0]["R"] + theirs[1]["R"]), abs=1e-12)


def test_quarter_wave_thickness_and_hand_value():
    assert round(532.0 / (4 * 1.38), 1) == 96.4
    r = reflectance(1.0, ((1.38, 532.0 / (4 * 1.38)),), 1.5, np.array([1.0]), 532.0)[0]
    assert r == pytest.approx(((1.5 - 1.38**2) / (1.5 + 1.38**2)) ** 2, abs=1e-14)
    ideal = reflectance(1.0, ((1.5**0.5, 532.0 / (4 * 1.5**0.5)),), 1.5, np.array([1.0]), 532.0)[0]
    assert ideal == pytest.approx(0.0, abs=1e-14)


def test_an_index_matched_film_is_no_film():
    c = np.cos(np.radians([0.0, 20.0, 38.0, 60.0]))
    assert reflectance(1.7, ((1.7, 321.0),), 1.0, c, 500.0) == pytest.approx(reflectance(1.7, (), 1.0, c, 500.0))


# --- closed forms ----------------------------------------------------------------------------------------------


def test_plane_parallel_plate():
    """A round hole before a plate: throughput, position and size of its ghost in closed form."""
    h, gap, t, n, behind, X = 4.0, 1.0, 3.0, 1.5, 10.0, 20.0
    plate = System(
        (
            OracleRow(0.0, gap, 1.0, h, is_stop=True),
            OracleRow(0.0, t, n, 50.0),
            OracleRow(0.0, 0.0, 1.0, 50.0),
        ),
        behind,
    )
    theta = np.radians(X)
    inside = np.arcsin(np.sin(theta) / n)
    c0, c1 = np.cos(theta), np.cos(inside)
    rs, rp = (c0 - n * c1) / (c0 + n * c1), (n * c0 - c1) / (n * c0 + c1)
    R = 0.5 * (rs**2 + rp**2)
    area = np.pi * h * h * c0
    for path, factor, crossings in ((None, (1 - R) ** 2, 1), ((2, 1), (1 - R) ** 2 * R**2, 3)):
        e = estimate(plate, path, (X, 0.0))[0]
        assert e.throughput_mm2 == pytest.approx(area * factor, abs=4 * e.throughput_se)
        assert e.relative_se < 1e-3
        x = (gap + behind) * np.tan(theta) + crossings * t * np.tan(inside)
        assert e.centroid_mm == pytest.approx([x, 0.0], abs=4 * max(e.centroid_se))
        assert max(e.centroid_se) < 0.01
        assert e.rms_radius_mm == pytest.approx(h / np.sqrt(2.0), abs=4 * e.rms_radius_se)


def test_thin_lens_and_its_ghost():
    """Power (n - 1)(c1 - c2); after two inner reflections (3n - 1)(c1 - c2)."""
    n, c1, c2 = 1.52, 1 / 80.0, -1 / 120.0
    thin = System(
        (
            OracleRow(c1, 0.0, n, 20.0),
            OracleRow(c2, 0.0, 1.0, 20.0),
            OracleRow(0.0, 0.0, 1.0, 10.0, is_stop=True),
        ),
        0.0,
    )
    y = np.array([1e-4])
    for path, power in ((None, (n - 1) * (c1 - c2)), ((1, 0), (3 * n - 1) * (c1 - c2))):
        rays = trace(replace(thin, sensor_distance=1 / power), path, 0 * y, y, (0.0, 0.0))
        assert rays.y[0] == pytest.approx(0.0, abs=1e-12)
        R = ((n - 1) / (n + 1)) ** 2
        assert rays.weight[0, 0] == pytest.approx((1 - R) ** 2 * (R**2 if path else 1.0), rel=1e-8)


def test_a_conic_of_minus_n_squared_is_free_of_spherical_aberration():
    n, f, h = 1.5, 50.0, 15.0
    rows = (
        OracleRow(0.0, 0.0, 1.0, h, is_stop=True),
        OracleRow(0.0, 8.0, n, 20.0),
        OracleRow(-1.0 / ((n - 1) * f), 0.0, 1.0, 20.0, conic=-(n**2)),
    )
    y = np.linspace(-h, h, 41)
    rays = trace(System(rows, f), None, 0.3 * y, y, (0.0, 0.0))
    assert np.abs(rays.x).max() < 1e-12
    assert np.abs(rays.y).max() < 1e-12
    sphere = System((*rows[:2], replace(rows[2], conic=0.0)), f)
    assert np.abs(trace(sphere, None, 0.3 * y, y, (0.0, 0.0)).y).max() > 0.5


def test_a_conic_of_zero_is_a_sphere():
    """Two formulas for one surface."""
    s = system(TRIPLET, 5.0)
    other = replace(s, rows=tuple(replace(r, conic=1e-13) for r in s.rows))
    x, y = np.random.default_rng(3).uniform(-4, 4, (2, 200))
    for path in (None, (6, 3), (5, 0)):
        a, b = trace(s, path, x, y, (7.0, 3.0)), trace(other, path, x, y, (7.0, 3.0))
        assert (a.alive == b.alive).all()
        assert a.x[a.alive] == pytest.approx(b.x[a.alive], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("path", [None, (1, 0), (4, 1), (6, 2), (8, 7)])
def test_light_runs_both_ways(heliar, path):
    """A ray reversed at the last vertex returns to where it entered, with the same R and T."""
    films = [((1.38, 90.0 + 5 * k), (2.0, 40.0)) for k in range(9)]
    there = replace(heliar.with_films(films), sensor_distance=0.0)
    n = len(there.rows)
    rows = []
    for k in range(n - 1, -1, -1):
        row = there.rows[k]
        rows.append(
            replace(
                row,
                curvature=-row.curvature,
                thickness=there.rows[k - 1].thickness if k else 0.0,
                index=there.rows[k - 1].index if k else 1.0,
                films=row.films[::-1],
            )
        )
    back = System(tuple(rows), 0.0)
    back_path = None if path is None else (n - 1 - path[1], n - 1 - path[0])
    field = (4.0, -2.5)
    for x, y in ((0.0, 0.0), (1.0, -0.5), (-0.8, 1.2)):
        a = trace(there, path, np.array([x]), np.array([y]), field)
        dx, dy, dz = a.direction[:, 0]
        away = (float(np.degrees(np.arctan(dx / dz))), float(np.degrees(np.arctan(dy / dz))))
        b = trace(back, back_path, -a.x, -a.y, away)
        assert (-b.x[0], -b.y[0]) == pytest.approx((x, y), abs=1e-10)
        assert b.weight[0, 0] == pytest.approx(a.weight[0, 0], rel=1e-10)
        assert b.rel_radius[0] == pytest.approx(a.rel_radius[0], rel=1e-10)


def test_ray_ends():
    """A miss, unwanted total reflection and a wrong direction end a ray; the others stay alive."""
    ball = System(
        (
            OracleRow(1 / 10.0, 0.0, 1.5, 5.0),
            OracleRow(0.0, 0.0, 1.0, 5.0),
            OracleRow(0.0, 0.0, 1.0, 1.0, is_stop=True),
        ),
        5.0,
    )
    rays = trace(ball, None, np.array([0.0, 9.0, 11.0]), np.zeros(3), (0.0, 0.0))
    assert rays.alive.tolist() == [True, True, False]
    assert rays.rel_radius[1] > 1.0  # recorded, not ended; the second step was negative
    steep = System((*ball.rows[:2], ball.rows[2]), 5.0)
    steep = replace(steep, rows=(OracleRow(0.0, 1.0, 1.5, 9.0), OracleRow(1 / 4.0, 0.0, 1.0, 9.0), ball.rows[2]))
    rays = trace(steep, None, np.array([0.0, 3.5]), np.zeros(2), (0.0, 0.0))
    assert rays.alive.tolist() == [True, False]  # sin = 3.5 / 4 > 1 / 1.5
    mirror = trace(steep, (1, 0), np.array([0.0, 2.7]), np.zeros(2), (0.0, 0.0))
    assert mirror.weight[0, 0] == pytest.approx(0.96**2 * 0.04**2)
    assert not mirror.alive[1]


def test_a_mirror_beyond_the_critical_angle_reflects_all():
    c = np.cos(np.radians([41.0, 42.0, 60.0, 89.0]))
    r = reflectance(1.5, (), 1.0, c, 550.0)
    assert r[0] < 1.0
    assert r[1:].tolist() == [1.0, 1.0, 1.0]
    coated = reflectance(1.5, ((1.38, 100.0),), 1.0, c, 550.0)
    assert coated[1:] == pytest.approx([1.0, 1.0, 1.0], abs=1e-13)


# --- the integrals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "path", [None, (4, 0), *(pytest.param(path, marks=pytest.mark.slow) for path in ((8, 6), (3, 1), (7, 4)))]
)
def test_importance_sampling_against_brute_force(path):
    """Throughput and centroid from uniform points over the whole entrance box, without regions, by the variance."""
    s, field = system(HELIAR, 4.5), (8.0, 3.0)
    e = estimate(s, path, field)[0]
    x0, x1, y0, y1 = entrance_box(s, field)
    rng = np.random.default_rng(5)
    n = 60_000
    rays = trace(s, path, rng.uniform(x0, x1, n), rng.uniform(y0, y1, n), field, drop_beyond=1.0)
    w = np.where(rays.alive, rays.weight[0], 0.0) * (x1 - x0) * (y1 - y0) * direction(field)[2]
    sigma = np.hypot(w.std() / np.sqrt(n), e.throughput_se)
    assert abs(w.mean() - e.throughput_mm2) < 4 * sigma
    a = rays.alive
    sigma = np.hypot(e.rms_radius_mm / np.sqrt(a.sum()), e.centroid_se)
    assert np.all(np.abs([np.average(v[a], weights=w[a]) for v in (rays.x, rays.y)] - e.centroid_mm) < 4 * sigma)


def test_small_regions_are_found():
    """Stopped down to f/128 a ghost's region is 1/1000 of the entrance; flux is proportional to the stop's area."""
    field = (5.0, 2.0)
    for path in [(8, 6), (2, 0)]:
        assert find_region(system(HELIAR, 128.0), path, field) is not None
        wide, tight = (estimate(system(HELIAR, n), path, field, samples=2000, replicas=4) for n in (64.0, 128.0))
        assert wide is not None
        assert tight is not None
        assert wide[0].throughput_mm2 / tight[0].throughput_mm2 == pytest.approx(4.0, rel=0.02)


def test_standard_errors_are_honest():
    """Twenty seeds vary as much as the replicas predict."""
    s, path, field = system(HELIAR, 4.5), (8, 6), (8.0, 3.0)
    # the search does not depend on the seed
    region = refine(s, path, field, find_region(s, path, field, grid=48))
    es = [estimate(s, path, field, samples=600, replicas=4, seed=k, region=region)[0] for k in range(20)]
    for value, error in (("throughput_mm2", "throughput_se"), ("rms_radius_mm", "rms_radius_se")):
        seen = np.std([getattr(e, value) for e in es], ddof=1)
        said = np.sqrt(np.mean([getattr(e, error) ** 2 for e in es]))
        assert 0.5 < seen / said < 1.7


def test_scale_and_mirror_symmetry():
    s = system(TRIPLET, 5.0)
    few = {"samples": 4000, "replicas": 6}
    a = estimate(s, (6, 2), (9.0, 4.0), **few)[0]
    b = estimate(s.scaled(2.0), (6, 2), (9.0, 4.0), **few)[0]
    assert b.throughput_mm2 == pytest.approx(4 * a.throughput_mm2, rel=1e-9)
    assert b.centroid_mm == pytest.approx(2 * a.centroid_mm, rel=1e-9)
    assert b.rms_radius_mm == pytest.approx(2 * a.rms_radius_mm, rel=1e-9)
    c = estimate(s, (6, 2), (-9.0, 4.0), **few)[0]
    assert c.throughput_mm2 == pytest.approx(a.throughput_mm2, abs=5 * np.hypot(a.throughput_se, c.throughput_se))
    sigma = np.hypot(a.centroid_se, c.centroid_se)
    assert np.all(np.abs(c.centroid_mm * [-1, 1] - a.centroid_mm) < 5 * sigma)


@pytest.mark.parametrize("name", FIVE)
def test_the_five_lenses_form_an_image(name):
    table, f_number = FIVE[name]
    s = system(table, f_number)
    e = estimate(s, None, (2.0, 1.0), samples=1500, replicas=4)[0]
    efl = efl_bfl(s)[0]
    area = np.pi * (efl / f_number / 2) ** 2
    n = [1.0, *(row.index for row in s.rows)]
    bare = np.prod([1 - ((a - b) / (a + b)) ** 2 for a, b in pairwise(n)])
    assert e.throughput_mm2 == pytest.approx(bare * area, rel=0.1)
    assert e.rms_radius_mm < 0.01 * efl
