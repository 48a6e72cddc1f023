"""Search by picture: its error equals that of drawn pictures, its derivatives are exact, and it decreases."""

from dataclasses import replace

import numpy as np
import pytest
from planted import planted

from flarewright.design.finishing.candidate import outcomes
from flarewright.design.problem.from_scratch import random_ghost_targets, scratch_project
from flarewright.design.problem.ghosts import evaluate
from flarewright.design.problem.grey_picture import disc_picture, light_of_ghosts
from flarewright.design.problem.problem import LensCandidate
from flarewright.design.problem.target import problem_of
from flarewright.design.problem.target_image import canvas
from flarewright.design.solvers import pool_search
from flarewright.design.solvers.polish import finer, finest, polish, polish_within
from flarewright.design.solvers.pool_search import PoolState, solve
from flarewright.kernels.design import picture_search as kernel
from flarewright.kernels.design.ghosts import BOUND, PLACE, RADIUS, REACH_THESIS
from flarewright.kernels.jit.decorators import for_python
from flarewright.model import Design, GhostTarget, Iris, Light, Project

compare = for_python(kernel.compare)

HALF = 20.0
SPANS = np.array([0, 5])
TARGETS = np.array([[-9.0, 3.0, 0.0], [0.5, -1.2, 0.0], [4.0, 6.0, 0.0], [17.0, 9.0, 0.0], [11.0, 0.7, 0.0]])


def drawn(places, radii, levels, direction, shapes):
    """Draw the same ghosts with the other implementation, 768 pixels wide."""
    return disc_picture(places, radii, levels[:, None], direction, HALF, 768, shapes)[..., 0]


@pytest.mark.parametrize(
    ("direction", "blades"),
    [
        ((0.5**0.5, 0.5**0.5), 6),
        ((0.5**0.5, 0.5**0.5), 0),
        ((0.96, -0.28), 5),
        pytest.param((0.0, 1.0), 8, marks=pytest.mark.slow),
        pytest.param((-1.0, 0.0), 6, marks=pytest.mark.slow),
    ],
)
def test_the_cost_is_the_error_of_drawn_pictures(direction, blades):
    problem, structure, vector = planted(signed=False)
    picture = canvas(TARGETS, SPANS, [direction], light=0.6, half_frame=(HALF, HALF), blades=blades).fine
    aim = replace(problem.objective, picture=picture, limits=np.zeros((4, 3)))
    known = problem.variables(structure)
    # other lenses near the planted one, with some hidden and some round ghosts
    points = known.search_point(vector) + np.random.default_rng(1).normal(size=(6, 1 + 3 * structure.rows)) * 0.02
    ends, costs = polish_within(known, points, aim, 0)
    assert np.array_equal(ends, np.clip(points, known.low, known.high))
    wanted = drawn(TARGETS[:, 0], TARGETS[:, 1], 0.6 / np.abs(TARGETS[:, 1]), direction, np.full(5, blades))
    assert 1.0 / picture.shown.unit == pytest.approx(np.mean(wanted**2), rel=0.02)
    for x, cost in zip(ends, costs, strict=True):
        values = evaluate(structure, known.prescription(x)[None], aim.entrance)[0]
        slope = aim.slopes[0]
        levels = np.where(slope > values[:, REACH_THESIS], 0.0, 0.6 / np.abs(values[:, RADIUS]))
        shapes = np.where(values[:, BOUND] == 0.0, blades, 0)
        found = drawn(values[:, PLACE] * slope, values[:, RADIUS], levels, direction, shapes)
        assert cost == pytest.approx(np.mean((found - wanted) ** 2) / np.mean(wanted**2), rel=0.03)


@pytest.mark.parametrize("blades", [0, 6])
def test_derivatives_are_those_of_differences(blades):
    picture = canvas(TARGETS, SPANS, [(0.6, 0.8)], light=0.3, half_frame=(HALF, 0.7 * HALF), blades=blades).shown
    random = np.random.default_rng(3)
    shapes = np.array([0.0, 1.0, 0.0, kernel.ROUND, 0.0]) if blades else np.full(5, kernel.ROUND)
    places, sizes = TARGETS[:, 0] + random.normal(size=5), np.abs(TARGETS[:, 1]) * random.uniform(0.7, 1.3, 5)
    columns = picture.wanted.shape[2]

    def error(places, sizes):
        by = np.empty((5, 5))
        total = compare(
            np.stack([places, sizes, picture.light / sizes, shapes], axis=1), picture.edges[0], picture.rows,
            picture.limits[0], picture.start, picture.pixel, picture.wanted[0], np.empty(columns + 2), np.empty((5, 4)),
            np.empty(columns), np.empty(columns + 1), by,
        )  # fmt: skip
        return total, by

    _, by = error(places, sizes)
    assert np.all(by[:, kernel.PLACE_PLACE] > 0.0)
    h = 1e-6
    for g in range(5):
        e = h * (np.arange(5) == g)
        by_place = (error(places + e, sizes)[0] - error(places - e, sizes)[0]) / (2.0 * h)
        by_size = (error(places, sizes + e)[0] - error(places, sizes - e)[0]) / (2.0 * h)
        assert by[g, kernel.BY_PLACE] == pytest.approx(by_place, rel=2e-3, abs=1e-8)
        assert by[g, kernel.BY_RADIUS] == pytest.approx(by_size, rel=2e-3, abs=1e-8)


def scratch(count, seed):
    return problem_of(scratch_project(random_ghost_targets(count, seed), (5.45, 5.45), signed=False))[0]


def test_a_local_search_makes_the_picture_better_inside_the_bounds():
    problem = scratch(8, 0)
    structure = problem.structures[0]
    known, aim = problem.variables(structure), problem.objective
    points = known.random_points(np.random.default_rng(0), 30)
    near, _ = polish_within(known, points, replace(aim, picture=None))
    before = polish_within(known, near, aim, 0)[1]
    ends, costs = polish_within(known, near, aim)
    assert np.all(costs <= before)
    assert np.median(costs / before) < 0.9
    assert np.all((ends >= known.low) & (ends <= known.high))
    assert polish_within(known, ends, aim, 0)[1] == pytest.approx(costs, rel=1e-12)
    # a point above the cost threshold stays where it is
    worth = float(np.median(before))
    kept, _ = polish_within(known, near, aim, worth=worth)
    assert np.array_equal(kept[before > worth], near[before > worth])
    assert not np.array_equal(kept[before <= worth], near[before <= worth])


@pytest.mark.parametrize("searches", [100, pytest.param(1500, marks=pytest.mark.slow)])
def test_lenses_found_by_the_picture_have_better_pictures_than_those_by_places_and_sizes(searches):
    problem = scratch(10, 0)
    plain = replace(problem, objective=replace(problem.objective, picture=None))
    fine = finer(problem)
    best = [
        finest(fine, solve(one, seed=0, time_limit=None, most_searches=searches).best, 0).cost
        for one in (problem, plain)
    ]
    assert best[0] < 0.9 * best[1]
    assert finer(fine) is fine


def test_ghosts_that_a_lens_can_have_are_met_exactly_all_the_same():
    problem, _, _ = planted(signed=False, begin=True)
    aim = problem.objective
    picture = canvas(aim.targets, aim.spans, [(1.0, 0.0)], light=light_of_ghosts(10), half_frame=(18.0, 12.0), blades=6)
    problem = replace(problem, objective=replace(aim, picture=picture))
    state = solve(problem, seed=0, time_limit=None, most_searches=100)
    assert state.best.cost < 1e-14
    assert outcomes(state, problem, count=1)[0].fitness < 1e-8


def test_lenses_have_the_cost_of_the_finer_picture():
    problem = scratch(8, 1)
    state = solve(problem, seed=0, time_limit=None, most_searches=100)
    (best,) = outcomes(state, problem, count=1)
    known = problem.variables(best.structure)
    (cost,) = polish_within(known, known.search_point(best.vector)[None], finer(problem).objective, 0)[1]
    assert best.cost == pytest.approx(cost, rel=1e-6)


def test_a_run_can_begin_with_the_best_of_others():
    problem, structure, _ = planted()
    known = problem.variables(structure)
    points = known.random_points(np.random.default_rng(0), pool_search.KEPT)
    ended = tuple(LensCandidate(float(k), structure, x) for k, x in enumerate(points))
    state = PoolState(7, ended=ended, next_run=pool_search.INHERIT_EVERY)
    found = pool_search._with_new_runs(state, problem)
    heirs = [run.members for run in found.runs]
    assert len(heirs[0]) > 1
    assert all(one in ended for one in heirs[0])
    assert not any(heirs[1 : pool_search.INHERIT_EVERY])
    assert pool_search._with_new_runs(state, problem).runs[0].members == heirs[0]
    few = pool_search._with_new_runs(replace(state, ended=ended[:-1]), problem)
    assert not any(run.members for run in few.runs)
    # it proposes points from them at once
    after = pool_search.advance(found.runs[0], problem, 7)
    assert len(after.members) > len(heirs[0])


def test_hidden_targets_are_not_drawn():
    picture = canvas(
        TARGETS, SPANS, [(1.0, 0.0)], light=0.6, half_frame=(HALF, HALF), blades=6, drawn=np.arange(5) != 2
    )
    others = canvas(
        np.delete(TARGETS, 2, axis=0), np.array([0, 4]), [(1.0, 0.0)], light=0.6, half_frame=(HALF, HALF), blades=6
    )
    assert np.array_equal(picture.shown.wanted, others.shown.wanted)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, "needs signed = false"),
        ({"signed": False, "brightness": "fresnel"}, "draws every ghost"),
        ({"signed": False, "ghost_targets": (GhostTarget(ghost="4-1", action="ignore"),)}, "draws every ghost"),
    ],
)
def test_what_a_picture_cannot_judge_is_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        Design(judge="picture", **settings)


def test_several_lights_have_pictures_of_their_own():
    design = Design(judge="picture", signed=False)
    lights = (Light(field_deg=(4.0, 0.0)), Light(field_deg=(0.0, -8.0)))
    problem, _ = problem_of(Project(lens="heliar-tronnier", lights=lights, design=design))
    assert problem.objective.picture.shown.wanted.shape[0] == 2
    # the lens' own ghosts are its targets, so the pictures match
    kept = design.replace(fixed_rows=(0,), structure="lens")
    plain, _ = problem_of(Project(lens="heliar-tronnier", lights=lights, design=kept))
    known = plain.variables(plain.structures[0])
    assert polish_within(known, known.search_point(plain.fixed)[None], plain.objective, 0)[1][0] < 1e-9


def test_polishing_keeps_what_meets_its_targets():
    problem, structure, vector = planted(signed=False)
    aim = problem.objective
    picture = canvas(aim.targets, aim.spans, [(1.0, 0.0)], light=0.5, half_frame=(18.0, 12.0), blades=6)
    problem = replace(problem, objective=replace(aim, picture=picture))
    x = problem.variables(structure).search_point(vector)
    (found,) = polish(problem, [(structure, x)])
    assert found.cost < 1e-14
    assert found.x == pytest.approx(x, abs=1e-6)


def test_the_target_picture_has_the_iris_of_the_project():
    lights, design = (Light(field_deg=(4.0, 0.0)),), Design(judge="picture", signed=False)
    shown = [
        problem_of(Project(lens="heliar-tronnier", lights=lights, design=design, iris=Iris(blades=blades)))[0]
        .objective.picture.shown.wanted
        for blades in (6, 8)
    ]  # fmt: skip
    plain = problem_of(Project(lens="heliar-tronnier", lights=lights, design=design))[0].objective.picture.shown.wanted
    # the Heliar's own iris has six blades
    assert np.array_equal(shown[0], plain)
    assert not np.array_equal(shown[1], plain)
