"""Hard constraints: exact derivatives, met by every returned lens and by real lenses."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import planted

from flarewright.design.finishing.candidate import outcomes
from flarewright.design.finishing.constraints import EDGE_TOLERANCE, TOLERANCE, breaches, keeps_limits
from flarewright.design.problem.from_scratch import random_ghost_targets, scratch_project
from flarewright.design.problem.objective import limits_of
from flarewright.design.problem.prescription import structure_of, vector_of
from flarewright.design.problem.problem import LensCandidate
from flarewright.design.problem.rims import _heights, beam_heights, clear_radii
from flarewright.design.problem.target import problem_of
from flarewright.design.solvers.polish import polish_within
from flarewright.design.solvers.pool_search import solve
from flarewright.kernels.design import edge_thickness as edges
from flarewright.kernels.design.ghosts import TRAIL, WORK_ROWS
from flarewright.kernels.jit.decorators import for_python
from flarewright.model.project.design import Bounds
from flarewright.optics.lens.paraxial import first_order
from flarewright.render.scene.resolve import load_lens

values_of, row_of = for_python(edges.edge_values), for_python(edges.edge_row)


def constrained(**bounds):
    problem, structure, vector = planted()
    limits = Bounds(**bounds)
    aim = replace(problem.objective, limits=limits_of(limits))
    return replace(problem, objective=aim, bounds=limits), structure, vector


def sag(c, r):
    return c * r * r / (1.0 + np.sqrt(1.0 - (c * r) ** 2))


@pytest.mark.parametrize(
    ("name", "f_number"),
    [("heliar-tronnier", 3.5), ("canon-28-80", 2.8), ("triplet-pestrecov", None), ("biotar-50-f1.4", 2.8)],
)
def test_surfaces_of_real_lenses_are_apart(name, f_number):
    lens = load_lens(name)
    order = first_order(lens, f_number)
    structure = structure_of(lens)
    vector = vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance)
    problem, _, _ = constrained(edge=0.0)
    assert breaches(problem, structure, vector) == ()
    # the beam is the textbook's marginal ray: at the stop's edge, with height efl / N at the front
    heights = beam_heights(structure, vector, 1000.0)
    assert heights[structure.stop] == pytest.approx(order.stop_semi_diameter)
    assert heights[0] == pytest.approx(0.5 * order.entrance_pupil_diameter, rel=1e-9)


@pytest.mark.parametrize("entrance", [100.0, 4.0])
def test_edges_change_as_their_derivatives_say(entrance):
    _, structure, vector = planted()
    rows, limits = structure.rows, np.array([2.5, 0.02])
    random = np.random.default_rng(1)
    work, beam, partial = np.empty((WORK_ROWS, rows)), np.empty(rows + 2), np.zeros((4, rows))
    met = 0
    for _ in range(12):
        q = vector * (1.0 + 0.2 * random.normal(size=len(vector)))
        q[1 + 2 * rows :] = np.where(structure.glass, 1.5 + 0.4 * random.random(rows), 1.0)

        def values(q):
            out = np.empty(2 * rows)
            edges.beam_of(q, structure.stop, entrance, work, beam)
            values_of(q, rows, structure.stop, limits, beam, out)
            return out

        at = values(q)
        for number in np.flatnonzero(at > 1e-3):
            values(q)
            found = np.empty(len(q))
            row_of(q, rows, structure.stop, int(number), limits, work, beam, np.empty(TRAIL * rows), partial, found)
            assert not partial.any()
            for v in np.flatnonzero(vector):
                step = 1e-6 * abs(q[v])
                near = [values(q + sign * step * (np.arange(len(q)) == v))[number] for sign in (1.0, -1.0)]
                assert found[v] == pytest.approx((near[0] - near[1]) / (2.0 * step), rel=1e-4, abs=1e-6)
                met += 1
    assert met > 40


def test_sags_go_on_straight_where_spheres_end():
    parts = for_python(edges.sag_parts)
    assert parts(0.02, 10.0)[0] == pytest.approx(sag(0.02, 10.0), rel=1e-12)
    for c, r in ((0.05, 19.0), (-0.05, 19.7), (-0.05, 30.0), (0.05, 25.0)):
        _, by_c, by_r = parts(c, r)
        assert by_c == pytest.approx((parts(c + 1e-7, r)[0] - parts(c - 1e-7, r)[0]) / 2e-7, rel=1e-4)
        assert by_r == pytest.approx((parts(c, r + 1e-6)[0] - parts(c, r - 1e-6)[0]) / 2e-6, rel=1e-4)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=12, deadline=None)
def test_surfaces_never_cross_and_edges_are_kept(seed):
    problem, _, _ = constrained(edge=0.5)
    random = np.random.default_rng(seed)
    structure = problem.structures[int(random.integers(len(problem.structures)))]
    known = problem.variables(structure)
    ends, costs = polish_within(known, known.random_points(random, 2), problem.objective)
    for x, cost in zip(ends, costs, strict=True):
        one = keeps_limits(problem, LensCandidate(float(cost), structure, x))
        if one is None:
            continue
        assert np.all((one.x >= known.low) & (one.x <= known.high))
        vector = known.prescription(one.x)
        beam = beam_heights(structure, vector, problem.objective.entrance)
        radii = clear_radii(structure, vector, problem.objective.slopes, problem.objective.entrance, edge=0.5)
        rows, d = structure.rows, vector[1:]
        c = vector[1 + rows : 1 + 2 * rows]
        assert np.all(np.abs(c) * beam <= 0.9 + EDGE_TOLERANCE)
        surfaces = [k for k in range(rows) if k != structure.stop]
        for k, m in pairwise(surfaces):
            gap = d[k:m].sum()
            # exact at the rims, and at every height below
            for r in np.linspace(0.0, min(radii[k], radii[m]), 9):
                assert gap + sag(c[m], r) - sag(c[k], r) >= min(0.5, 0.5 * gap) - 1e-9
            at_beam = min(beam[k], beam[m])
            assert gap + sag(c[m], at_beam) - sag(c[k], at_beam) >= min(0.5, 0.5 * gap) - EDGE_TOLERANCE - 1e-9


@pytest.mark.parametrize(
    ("seed", "searches"), [(0, 150), *(pytest.param(seed, 300, marks=pytest.mark.slow) for seed in (1, 2, 3))]
)
def test_hard_limits_are_kept_by_every_lens(seed, searches):
    # the triplet has a focal length of 36 mm, so it is no solution
    hard = ("focal_length", "f_number", "length", "edges")
    problem, _, _ = constrained(
        focal_length=(60.0, 60.0), f_number=(4.0, 8.0), length=25.0, back_focus=(20.0, 80.0), edge=0.3, hard=hard
    )
    state = solve(problem, seed=seed, time_limit=None, most_searches=searches)
    found = outcomes(state, problem, count=3)
    assert found
    for one in found:
        order = first_order(one.lens)
        assert order.efl == pytest.approx(60.0, rel=1.01 * TOLERANCE)
        speed = order.efl / order.entrance_pupil_diameter
        assert 4.0 * (1.0 - 2.0 * TOLERANCE) <= speed <= 8.0 * (1.0 + 2.0 * TOLERANCE)
        assert sum(row.thickness for row in one.lens.rows[:-1]) <= 25.0 * (1.0 + TOLERANCE)
        assert one.lens.sensor_distance >= 20.0
        assert breaches(problem, one.structure, one.vector) == ()


def test_lenses_are_found_inside_hard_limits():
    bounds = Bounds(focal_length=(50.0, 50.0), f_number=(2.8, 8.0), hard=("focal_length", "f_number", "edges"))
    project = scratch_project(random_ghost_targets(3, 1), (5.0, 5.0), surfaces=7)
    problem, _ = problem_of(project.replace(design=project.design.replace(bounds=bounds, extra=0.0)))
    found = outcomes(solve(problem, seed=0, time_limit=None, most_searches=600), problem, count=3)
    assert len(found) == 3
    assert found[0].fitness < 1e-6
    for one in found:
        assert first_order(one.lens).efl == pytest.approx(50.0, rel=1.01 * TOLERANCE)


def matrices_along(structure, vector, pair):
    """Multiply the matrices of `docs/physics.md` along a ghost's path; yield each row with the product before it."""
    rows, (j, i) = structure.rows, pair
    d, c = vector[1 : 1 + rows], vector[1 + rows : 1 + 2 * rows]
    n = [1.0, *vector[1 + 2 * rows :]]
    route = [(k, 1) for k in range(j + 1)] + [(k, -1) for k in range(j - 1, i - 1, -1)]
    route += [(k, 1) for k in range(i + 1, rows)]
    total, before = np.eye(2), None
    for place, (k, heading) in enumerate(route):
        if before is not None:
            total = np.array([[1.0, d[min(k, before)]], [0.0, 1.0]]) @ total
        yield k, total
        power = heading * c[k]
        if place in (j, 2 * j - i):
            total = np.array([[1.0, 0.0], [2.0 * power, 1.0]]) @ total
        else:
            n1, n2 = (n[k], n[k + 1]) if heading > 0 else (n[k + 1], n[k])
            total = np.array([[1.0, 0.0], [(n1 - n2) / n2 * power, n1 / n2]]) @ total
        before = k


@pytest.mark.parametrize("entrance", [1000.0, 3.0])
def test_the_rays_that_bound_a_ghost_are_as_high_as_matrices_say(entrance):
    _, structure, vector = planted()
    slope = 0.15
    for pair in structure.pairs:
        along = list(matrices_along(structure, vector, pair))
        to_stop = next(total for k, total in along if k == structure.stop)
        # through both edges of the bounding aperture: the entrance, or the stop as shifted by the light's angle
        if vector[0] > entrance * abs(to_stop[0, 0]):
            edges_mm = 0.5 * entrance * np.array([-1.0, 1.0])
        else:
            edges_mm = (0.5 * vector[0] * np.array([-1.0, 1.0]) - to_stop[0, 1] * slope) / to_stop[0, 0]
        expected = np.zeros(structure.rows)
        for k, total in along:
            expected[k] = max(expected[k], *np.abs(total[0, 0] * edges_mm + total[0, 1] * slope))
        np.testing.assert_allclose(_heights(structure, vector, pair, slope, entrance), expected, rtol=1e-9)
