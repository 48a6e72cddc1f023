"""Proofs of impossibility: nothing possible is called impossible, and proven errors are lower bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from planted import planted

from flarewright.design.finishing.candidate import nearest_outcomes, outcomes
from flarewright.design.finishing.constraints import breaches, without_ghosts
from flarewright.design.problem.ghosts import evaluate
from flarewright.design.problem.impossible import obstacles
from flarewright.design.problem.objective import own_objective
from flarewright.design.problem.reachable_range import broken_limits, least_distances
from flarewright.design.problem.target import problem_of
from flarewright.design.results.report import search_summary, verdict
from flarewright.design.solvers.pool_search import solve
from flarewright.errors import ProjectError
from flarewright.model import Design, GhostTarget, Light, Project
from flarewright.model.project.design import Bounds


def project(*ghost_targets, lights=((6.0, 3.0),), **design):
    return Project(
        lens="heliar-tronnier", f_number=16.0, lights=tuple(Light(field_deg=one) for one in lights),
        design=Design(ghost_targets=ghost_targets, **design),
    )  # fmt: skip


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_what_a_lens_within_the_bounds_does_is_never_impossible(seed):
    problem, _, _ = planted()
    random = np.random.default_rng(seed)
    structure = problem.structures[int(random.integers(len(problem.structures)))]
    known = problem.variables(structure)
    vector = known.prescription(known.random_points(random, 1)[0])
    # tight bounds around the lens, so that the enclosure is meaningful
    low, high = vector * 0.98, vector * 1.02
    rows, air = structure.rows, ~np.array(structure.glass)
    held = np.concatenate([np.zeros(1 + 2 * rows, bool), air])
    low[held] = high[held] = vector[held]
    tight = replace(
        known, shortest=np.minimum(low, high)[: 1 + rows], largest=np.maximum(low, high)[: 1 + rows],
        low=np.concatenate([np.log(low[: 1 + rows]), np.minimum(low, high)[1 + rows :]]),
        high=np.concatenate([np.log(high[: 1 + rows]), np.maximum(low, high)[1 + rows :]]),
    )  # fmt: skip
    aim = own_objective(structure, vector, np.array([0.1, 0.2]), bounds=Bounds())
    here = replace(problem, objective=aim, structures=(structure,))
    object.__setattr__(here, "variables", lambda _: tight)
    assert not least_distances(here).any()
    assert obstacles(here) == ()


@pytest.mark.parametrize(("free", "move_mm"), [(8, -6.0), (8, 30.0), (7, 4.0), (4, 10.0)])
def test_few_free_variables_are_enclosed_sharply(free, move_mm):
    # one row is free: sampling all lenses shows how close a ghost can come
    bounds = Bounds(
        glass=(4.0, 8.0), air=(2.0, 12.0), back_focus=(80.0, 84.0), n_d=(1.6, 1.75), least_radius=25.0, hard=()
    )
    ghost_target = GhostTarget(ghost="4-1", move_mm=move_mm)
    fixed = tuple(k for k in range(9) if k != free)
    problem, _ = problem_of(project(ghost_target, structure="lens", fixed_rows=fixed, brightness="stop", bounds=bounds))
    known = problem.variables(problem.structures[0])
    obstacle = next(one for one in obstacles(problem) if one.target == "4-1")
    many = known.prescription(known.random_points(np.random.default_rng(0), 4000))
    values = evaluate(problem.structures[0], many, problem.objective.entrance)
    target = problem.objective.targets[problem.objective.names.index("4-1")]
    place = np.abs(values[..., 0] * problem.objective.slopes[0] - target[0])
    best = np.maximum(place, np.abs(values[..., 1] - target[1])).min()
    assert 0.7 * best < obstacle.least_error_mm <= best
    assert "nearer than" in obstacle.reason


def test_far_places_are_out_of_reach_of_few_surfaces():
    far = GhostTarget(place_mm=9000.0, radius_mm=0.01)
    problem, _ = problem_of(project(far, own_ghosts=False, surfaces=2, bounds=Bounds(least_radius=200.0)))
    (obstacle,) = obstacles(problem)
    assert obstacle.target == "target 0"
    assert obstacle.least_error_mm > 100.0
    near, _ = problem_of(project(far.replace(place_mm=1.0), own_ghosts=False, surfaces=2))
    assert obstacles(near) == ()


def test_places_off_the_line_are_reported_with_the_nearest_on_it():
    given = project(GhostTarget(at_mm=(0.0, 5.0), radius_mm=1.0), own_ghosts=False, lights=((5.0, 0.0),))
    problem, _ = problem_of(given)
    (obstacle,) = obstacles(problem, given)
    assert obstacle.least_error_mm == pytest.approx(5.0)
    assert problem.objective.targets[0, 0] == pytest.approx(0.0, abs=1e-12)
    on = project(GhostTarget(at_mm=(3.0, 4.0), radius_mm=1.0), own_ghosts=False, lights=((0.0001 * 3, 0.0001 * 4),))
    problem, _ = problem_of(on)
    assert obstacles(problem, on) == ()
    assert problem.objective.targets[0, 0] == pytest.approx(5.0)
    with pytest.raises(ProjectError, match="name it"):
        problem_of(project(GhostTarget(at_mm=(0.0, 5.0), radius_mm=1.0), lights=((5.0, 0.0), (2.0, 0.0))))


def test_targets_at_two_lights_that_no_ghost_can_meet():
    lights = ((6.0, 3.0), (3.0, 1.5))
    assert obstacles(problem_of(project(lights=lights, structure="lens"))[0]) == ()
    ghost_target = GhostTarget(ghost="4-1", light=0, height=2.0)
    problem, _ = problem_of(project(ghost_target, lights=lights, structure="lens"))
    (obstacle,) = obstacles(problem)
    assert "4-1" in obstacle.target
    assert "lights 0 and 1" in obstacle.reason
    # the found lens misses by no less, is called impossible, and every ghost's error is reported
    state = solve(problem, time_limit=None, most_searches=60)
    found = outcomes(state, problem, count=1)
    assert np.abs(found[0].residuals).max() >= obstacle.least_error_mm
    reported = search_summary(state, found, problem, (obstacle,))
    assert reported["verdict"] == "impossible"
    assert len(reported["lenses"][0]["ghosts"]) == len(problem.objective.targets)
    assert verdict(found[0]) != "impossible"
    # both lights alike: one ghost serves both
    both, _ = problem_of(project(GhostTarget(ghost="4-1", height=2.0), lights=lights, structure="lens"))
    assert obstacles(both) == ()


def limits_of(structure, vector):
    """Return focal length, f-number and length from explicit matrices."""
    rows = structure.rows
    height, slope, index, length, at_stop = 1.0, 0.0, 1.0, 0.0, 1.0
    for k in range(rows):
        d, c, n = vector[1 + k], vector[1 + rows + k], vector[1 + 2 * rows + k]
        if k == structure.stop:
            at_stop = height
        slope = (index * slope - (n - index) * c * height) / n
        height, index = height + d * slope, n
        length += d if k < rows - 1 else 0.0
    focal = -1.0 / slope
    return focal, focal * abs(at_stop) / vector[0], length


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_limits_that_a_lens_keeps_are_never_called_broken(seed):
    problem, _, _ = planted()
    random = np.random.default_rng(seed)
    structure = problem.structures[int(random.integers(len(problem.structures)))]
    vector = problem.variables(structure).prescription(problem.variables(structure).random_points(random, 1)[0])
    focal, speed, length = limits_of(structure, vector)
    assume(5.0 < focal < 2000.0)
    assume(0.4 < speed < 200.0)
    bounds = Bounds(
        hard=("focal_length", "f_number", "length"), focal_length=(focal, focal), f_number=(speed, speed),
        length=length, stop_diameter=(6.0, 6.0),
    )  # fmt: skip
    aim = own_objective(structure, vector, np.array([0.1]), bounds=bounds)
    assert broken_limits(replace(problem, objective=aim, bounds=bounds)) == ()
    assert breaches(replace(problem, objective=aim, bounds=bounds), structure, vector) == ()


def test_a_lens_too_short_for_its_glasses_is_proven_impossible():
    problem, _ = problem_of(project(bounds=Bounds(hard=("length",), length=3.0)))
    (one,) = broken_limits(problem)
    thinnest = min(sum(1.0 if g else 0.1 for g in each.glass[:-1]) for each in problem.structures)
    assert one.names == ("length",)
    assert one.nearest == pytest.approx(thinnest)
    (reported, *_) = obstacles(problem)
    assert "hard limit length" in reported.reason
    assert f"{thinnest:.4g} mm" in reported.reason
    # with enough room no obstacle is reported
    enough = problem_of(project(bounds=Bounds(hard=("length",), length=thinnest + 0.1)))[0]
    assert broken_limits(enough) == ()


def test_a_focal_length_that_one_free_row_cannot_reach_is_proven_impossible():
    rows = tuple(k for k in range(9) if k != 7)
    bounds = Bounds(hard=("focal_length",), focal_length=(20.0, 25.0), least_radius=40.0, glass=(1.0, 9.0))
    problem, _ = problem_of(project(structure="lens", fixed_rows=rows, bounds=bounds))
    (one,) = broken_limits(problem)
    assert one.names == ("focal_length",)
    (structure,) = problem.structures
    known = problem.variables(structure)
    many = known.prescription(known.random_points(np.random.default_rng(0), 4000))
    focal = [limits_of(structure, vector)[0] for vector in many]
    shortest = min(value for value in focal if value > 0.0)
    # the reported value is a bound, and close to that of real lenses
    assert 25.0 < one.nearest <= shortest
    assert one.nearest > 0.9 * shortest


def test_contradictory_limits_differ_from_ghosts_not_found():
    bounds = Bounds(hard=("edges", "focal_length", "f_number"), focal_length=(2000.0, 2000.0), f_number=(0.5, 0.5))
    problem, _ = problem_of(project(bounds=bounds))
    conflict = without_ghosts(problem, searches=24)
    assert {one.name for one in conflict} & {"edges", "focal_length", "f_number"}
    state = solve(problem, seed=0, time_limit=None, most_searches=100)
    assert outcomes(state, problem, count=1) == ()
    nearest = nearest_outcomes(state, problem, count=1)
    assert nearest[0].breaks
    data = search_summary(state, nearest, problem, (), conflict)
    assert data["verdict"] == "contradictory"
    assert data["lenses"][0]["breaks"]
    assert len(data["lenses"][0]["ghosts"]) == 13
    # compatible limits are no conflict
    kind = Bounds(hard=("edges", "focal_length", "f_number"), focal_length=(90.0, 110.0), f_number=(4.0, 8.0))
    assert without_ghosts(problem_of(project(bounds=kind))[0], searches=24) == ()
