"""Counter-based random numbers, and Monte Carlo rays through stacks of plates with closed-form results."""

from dataclasses import replace

import numpy as np
import pytest

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.montecarlo import philox as counted
from flarewright.kernels.montecarlo.forward import AT_BARREL, AT_STOP, ENTERED, IN_PICTURE, LOST, RETURNED, TALLIES
from flarewright.model import Camera, Light, Lines, Project
from flarewright.render.reference.batches import BALANCE, Sums, ray_source, run_batch
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

philox = for_python(counted.philox)
refill = for_python(counted.refill)

# Random123, kat_vectors: philox4x32, 10 rounds; counter, key, answer
KNOWN = [
    ((0, 0, 0, 0, 0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 6, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("given", "answer"), KNOWN)
def test_philox_gives_its_authors_answers(given, answer):
    assert tuple(int(word) for word in philox(*(np.uint64(word) for word in given))) == answer


def test_numbers_are_even_and_independent():
    stream, pool = np.array([0, 1, 2, 3, 4, 5], dtype=np.uint64), np.empty(4)
    numbers = np.empty((20000, 4))
    for row in numbers:
        refill(stream, pool)
        row[:] = pool
    assert numbers.min() > 0.0
    assert numbers.max() < 1.0
    counts = np.histogram(numbers, bins=64, range=(0.0, 1.0))[0]
    expected = numbers.size / 64
    # chi-squared of 63 degrees of freedom lies below 110 but for 2e-4
    assert ((counts - expected) ** 2 / expected).sum() < 110.0
    correlation = np.corrcoef(numbers.T)[np.triu_indices(4, 1)]
    assert np.abs(correlation).max() < 4.0 / np.sqrt(len(numbers))


def stack_of_plates(reflectances, *, tilt_deg=0.0, semi=1e4):
    """Return a shot of flat surfaces between equal media, each with a constant reflectance at all angles."""
    project = Project(
        lens="heliar-tronnier",
        lights=(Light(field_deg=(0.0, tilt_deg), spectrum=Lines(lines=((587.56, 1.0),))),),
        camera=Camera(size_px=(32, 32), sensor_mm=(4e5, 4e5)),
    )
    settled = resolve_project(project)
    shot = make_shots(settled, make_opening(settled, None))[0]
    count = len(reflectances) + 1
    half_height = np.full(count, semi)
    inverse = np.append(1.0 / half_height[:-1], 0.0)
    table = np.zeros((1, count, 5))
    table[0, :-1] = np.array(reflectances)[:, None]
    packed = replace(
        shot.packed,
        curvature=np.zeros(count),
        conic=np.zeros(count),
        z_vertex=np.arange(count, dtype=np.float64),
        semi=half_height,
        inv_semi=inverse,
        n_gap=np.ones((1, count + 1)),
        reflectance=table,
        sensor_z=float(count),
    )
    wide = replace(shot.opening, blades=np.array([[0.0, 1.0, 1e7, 1e-7]]))
    return replace(shot, packed=packed, opening=wide)


def gathered(shot, batches, *, side=16, seed=0):
    source = ray_source(shot, seed, side=side, light=0)
    sums = Sums(0, {}, {})
    for batch in range(batches):
        sums.add(run_batch([source], batch, picture=False))
    return sums


@pytest.mark.parametrize(
    ("surfaces", "R"),
    [
        # light between seven good mirrors takes many reflections
        pytest.param(surfaces, R, marks=pytest.mark.slow if (surfaces, R) == (7, 0.7) else ())
        for surfaces in (2, 4, 7)
        for R in (0.04, 0.3, 0.7)
    ],
)
def test_parallel_plates_sum_the_series_of_all_orders(surfaces, R):
    """N surfaces pass (1 - R) / (1 + (N - 1) R) in all orders (G. G. Stokes 1862); two, (1-R)^2 R^2k in order 2k."""
    sums = gathered(stack_of_plates([R] * surfaces), 40)
    mean, error = sums.mean("figures"), np.sqrt(sums.variance("figures"))
    entered = mean[ENTERED]
    passed = mean[IN_PICTURE:TALLIES].sum()
    expected = (1.0 - R) / (1.0 + (surfaces - 1) * R)
    noise = np.hypot(error[RETURNED], error[IN_PICTURE:TALLIES].sum())
    assert passed / entered == pytest.approx(expected, abs=4.0 * noise / entered + 1e-12)
    assert mean[RETURNED] / entered == pytest.approx(1.0 - expected, abs=4.0 * noise / entered + 1e-12)
    assert mean[AT_STOP] == mean[AT_BARREL] == mean[LOST] == 0.0
    if surfaces == 2:
        for k in range(3):
            got, sigma = mean[IN_PICTURE + k] / entered, error[IN_PICTURE + k] / entered
            assert got == pytest.approx((1.0 - R) ** 2 * R ** (2 * k), abs=4.0 * sigma + 1e-12)


def test_unequal_plates():
    """Two surfaces pass (1 - R1)(1 - R2) / (1 - R1 R2)."""
    R1, R2 = 0.5, 0.15
    sums = gathered(stack_of_plates([R1, R2]), 40)
    mean, error = sums.mean("figures"), np.sqrt(sums.variance("figures"))
    passed = mean[IN_PICTURE:TALLIES].sum() / mean[ENTERED]
    sigma = np.hypot(error[RETURNED], error[IN_PICTURE:TALLIES].sum()) / mean[ENTERED]
    assert passed == pytest.approx((1.0 - R1) * (1.0 - R2) / (1.0 - R1 * R2), abs=4.0 * sigma)


def test_two_reflections_by_path():
    """The first two reflections are split, not sampled: the flux of each path through three plates is exact."""
    R = np.array([0.1, 0.2, 0.3])
    sums = gathered(stack_of_plates(R), 2)
    paths = sums.mean("paths").sum(axis=0) / sums.mean("figures")[ENTERED]
    T = 1.0 - R
    expected = np.zeros((4, 4))
    expected[1, 0] = T[0] * R[1] * R[0] * T[1] * T[2]
    expected[2, 1] = T[0] * T[1] * R[2] * R[1] * T[2]
    expected[2, 0] = T[0] * T[1] * R[2] * T[1] * R[0] * T[1] * T[2]
    np.testing.assert_allclose(paths, expected, rtol=1e-9, atol=1e-15)


def test_four_reflections_by_path():
    """The rays recorded for each four-reflection path of three plates carry the flux given by the reflectances."""
    R = np.array([0.1, 0.2, 0.3])
    T = 1.0 - R
    shot = stack_of_plates(R)
    source = ray_source(shot, 0, side=64, light=0, followed=(2.0, 0.0))
    batches = 20
    found = np.zeros((batches, 4**4))
    entered = 0.0
    for batch in range(batches):
        result = run_batch([source], batch, picture=False, fours=100_000)
        np.add.at(found[batch], result["fours"][:, 0].astype(int), result["fours"][:, 1])
        entered += result["figures"][ENTERED] / batches
    mean, error = found.mean(axis=0) / entered, found.std(axis=0, ddof=1) / np.sqrt(batches) / entered
    expected = np.zeros(4**4)
    for j, i, k, m in np.ndindex(3, 3, 3, 3):
        if i < j and k > i and m < k:
            passed = [*range(j), *range(i + 1, j), *range(i + 1, k), *range(m + 1, k), *range(m + 1, 3)]
            expected[((j * 4 + i) * 4 + k) * 4 + m] = R[[j, i, k, m]].prod() * T[passed].prod()
    assert np.count_nonzero(expected) == np.count_nonzero(mean) == 8
    assert (np.abs(mean - expected) <= 4.5 * error).all()
    assert error.sum() < 0.05 * expected.sum()


def test_without_reflectance_there_are_no_ghosts():
    shot = stack_of_plates([0.0] * 5, tilt_deg=20.0)
    mean = gathered(shot, 2).mean("figures")
    assert mean[IN_PICTURE] == pytest.approx(mean[ENTERED], rel=1e-12)
    assert np.count_nonzero(mean[ENTERED + 1 : TALLIES]) == 1
    assert abs(mean[BALANCE]) < 1e-12 * mean[ENTERED]


def test_conics_and_the_shape_table_agree():
    """A negligible asphere sends every row through the shape table; the light is the same."""
    lens = load_lens("triplet-pestrecov")
    bent = (lens.rows[0].replace(asphere=(1e-30,)), *lens.rows[1:])
    found = []
    for rows in (lens.rows, bent):
        project = Project(lens=lens.replace(rows=rows), lights=(Light(field_deg=(6.0, 3.0)),), f_number=5.6)
        settled = resolve_project(project)
        shot = make_shots(settled, make_opening(settled, None))[0]
        assert (shot.packed.shapes is None) == (rows is lens.rows)
        # use the same points of the front for both
        source = ray_source(shot, 0, side=48, light=0)
        box = np.array([-15.0, 15.0, -16.0, 16.0])
        source = replace(source, points=source.points._replace(box=box))
        found.append(run_batch([source], 0, picture=True))
    np.testing.assert_allclose(found[0]["paths"], found[1]["paths"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found[0]["blocks"][0], found[1]["blocks"][0], rtol=1e-6, atol=1e-9)
    # light beyond a rim is counted as LOST by one code path and as AT_BARREL by the other
    ends = [[f[k] for k in (ENTERED, AT_STOP, RETURNED, IN_PICTURE)] for f in (one["figures"] for one in found)]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-6)
    outside = [one["figures"][AT_BARREL] + one["figures"][LOST] for one in found]
    assert outside[0] == pytest.approx(outside[1], rel=1e-4)


def test_a_narrow_stop_and_rims_absorb():
    """A beam of 10 mm radius through rims of 10 and 5 mm and a stop of 2 mm: fluxes are proportional to areas."""
    shot = stack_of_plates([0.0, 0.0], semi=10.0)
    packed = replace(shot.packed, inv_semi=np.array([0.1, 0.2, 0.0]))
    opening = replace(shot.opening, blades=np.array([[0.0, 1.0, 2.0, 0.5]]))
    sums = gathered(replace(shot, packed=packed, opening=opening), 30, side=64)
    mean, error = sums.mean("figures"), np.sqrt(sums.variance("figures"))
    for k, area in ((ENTERED, 100.0), (AT_BARREL, 75.0), (AT_STOP, 21.0), (IN_PICTURE, 4.0)):
        assert mean[k] == pytest.approx(np.pi * area, abs=4.0 * error[k])
        assert error[k] < 2e-3 * np.pi * 100.0
