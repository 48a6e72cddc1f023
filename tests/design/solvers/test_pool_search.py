"""The pool search finds planted lenses, stays inside its bounds, and resumes an interrupted search."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import planted

from flarewright.design.finishing.candidate import outcomes
from flarewright.design.problem.ghosts import evaluate
from flarewright.design.problem.prescription import Structure, glass_patterns, structures, surfaces_for
from flarewright.design.problem.target import problem_of
from flarewright.design.solvers import pool_search
from flarewright.design.solvers.polish import polish, polish_within
from flarewright.design.solvers.pool_search import PoolState, advance, neighbour, propose, solve
from flarewright.design.solvers.search_state import read_state, write_state
from flarewright.errors import FlarewrightError, ProjectError
from flarewright.kernels.design.arguments import Effort, FreeVariables, GhostAims, LensStructure
from flarewright.kernels.design.ghosts import RADIUS, REACH, REACH_THESIS
from flarewright.kernels.design.local_search import polish_many
from flarewright.model import Design, GhostTarget, Light, Plate, Project, QuarterWave
from flarewright.model.project.design import Bounds
from flarewright.render.scene.resolve import complete_lens, load_lens


# unknown signs take long: then only one structure beside the planted one is searched
@pytest.mark.parametrize(
    ("signed", "seed", "others"),
    [
        (True, 9, None),
        (False, 2, 1),
        pytest.param(True, 1, None, marks=pytest.mark.slow),
        pytest.param(False, 2, None, marks=pytest.mark.slow),
    ],
)
def test_a_planted_lens_is_found(signed, seed, others):
    problem, structure, _ = planted(signed=signed)
    if others is not None:
        beside = tuple(one for one in problem.structures if one != structure)
        problem = replace(problem, structures=(structure, *beside[:others]))
    state = solve(problem, seed=seed, time_limit=None, most_searches=20000)
    assert state.best.cost < 1e-14
    best = outcomes(state, problem, count=1)[0]
    assert best.fitness < 1e-8
    assert np.abs(best.residuals).max() < 1e-4


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_bounds_are_never_broken(seed):
    problem, _, _ = planted()
    random = np.random.default_rng(seed)
    structure = problem.structures[int(random.integers(len(problem.structures)))]
    known = problem.variables(structure)
    # also from starting points far outside
    starts = known.random_points(random, 3) + random.normal(size=(3, len(known.low))) * random.choice([0.0, 1.0, 50.0])
    for found in polish(problem, [(structure, x) for x in starts]):
        assert np.all(found.x >= known.low)
        assert np.all(found.x <= known.high)
        vector, bounds, rows = known.prescription(found.x), problem.bounds, structure.rows
        glass = np.array(structure.glass)
        d, c, n = vector[1 : 1 + rows], vector[1 + rows : 1 + 2 * rows], vector[1 + 2 * rows :]
        assert vector[0] == 6.0
        assert np.all((d[glass] >= bounds.glass[0]) & (d[glass] <= bounds.glass[1]))
        assert np.all((d[~glass] >= bounds.air[0]) & (d[~glass] <= bounds.air[1]))
        assert np.all((n[glass] >= bounds.n_d[0]) & (n[glass] <= bounds.n_d[1]))
        assert np.all(n[~glass] == 1.0)
        assert np.all(np.abs(c) <= 1.0 / bounds.least_radius)
        assert c[structure.stop] == 0.0


def test_proposals_stay_what_they_are_called():
    problem, _, _ = planted()
    state = solve(problem, seed=0, time_limit=None, most_searches=1)
    random = np.random.default_rng(0)
    for run in state.runs:
        for _ in range(50):
            structure, x = propose(run.members, problem, random)
            assert structure == run.home
            assert np.all(np.isfinite(x))


@pytest.mark.parametrize(("entrance", "steps", "some_hidden"), [(100.0, 5, False), (1.0, 0, True)])
def test_the_cost_is_that_of_the_objective(entrance, steps, some_hidden):
    # compare the kernel's cost with the sum written out
    problem, _, _ = planted(extra=0.0)
    structure = problem.structures[0]
    known, aim = problem.variables(structure), replace(problem.objective, entrance=entrance)
    start = known.random_points(np.random.default_rng(3), 1)
    ends, costs = np.empty_like(start), np.empty(1)
    matches = np.empty((1, len(aim.targets)), np.int64)
    limits = aim.limits * [1.0, 1.0, 0.0]
    lens = LensStructure(structure.stop, structure.mirrors, aim.entrance)
    space = FreeVariables(known.low, known.high, known.free, known.longest)
    aims = GhostAims(aim.slopes, aim.spans, aim.targets, aim.weights, True, 0.0)
    polish_many(start, lens, space, aims, limits, Effort(steps, 4, 0.0), ends, costs, matches)
    values = evaluate(structure, known.prescription(ends), aim.entrance)[0][matches[0]]
    place = aim.weights[:, 0] * (values[:, 0] * aim.slopes[0] - aim.targets[:, 0])
    size = aim.weights[:, 1] * (values[:, 1] - aim.targets[:, 1])
    beyond = aim.slopes[0] / values[:, REACH_THESIS]
    hidden = np.where(beyond > 1.0, aim.weights[:, 1] * np.abs(aim.targets[:, 1]) * beyond, 0.0)
    assert costs[0] == pytest.approx((place**2).sum() + (size**2).sum() + (hidden**2).sum(), rel=1e-9)
    assert hidden.any() == some_hidden
    assert costs[0] < 1e6


@pytest.mark.parametrize(("entrance", "some_hidden"), [(100.0, False), (0.1, True)])
def test_extra_ghosts_cost_by_their_visible_part(entrance, some_hidden):
    problem, _, _ = planted(extra=0.0)
    structure = problem.structures[0]
    known = problem.variables(structure)
    x = known.random_points(np.random.default_rng(3), 1)
    # no target has a weight, so each takes the ghost that would cost most
    aim = replace(problem.objective, entrance=entrance, limits=problem.objective.limits * [1.0, 1.0, 0.0])
    aim = replace(
        aim, targets=aim.targets[:2], weights=np.zeros((2, 3)), spans=np.array([0, 2]), extra=3.0, extra_part=1.0
    )
    (cost,) = polish_within(known, x, aim, 0)[1]
    values = evaluate(structure, known.prescription(x), entrance)[0]
    shown = aim.slopes[0] <= values[:, REACH]
    each = np.where(shown, 3.0 / np.abs(values[:, RADIUS]), 0.0)
    assert cost == pytest.approx(np.sort(each)[:-2].sum(), rel=1e-9)
    assert (~shown).any() == some_hidden


def test_threads_and_interruptions_do_not_change_the_result(tmp_path, monkeypatch):
    # short rounds, and proposals from pools soon
    monkeypatch.setattr(pool_search, "batch_size", lambda _: 4)
    monkeypatch.setattr(pool_search, "FIRST", 8)
    problem, _, _ = planted()
    whole = solve(problem, seed=5, time_limit=None, most_searches=128, threads=1)
    half = solve(problem, seed=5, time_limit=None, threads=4, most_searches=64)
    write_state(half, tmp_path / "search.json")
    resumed = solve(problem, time_limit=None, most_searches=128, threads=3, state=read_state(tmp_path / "search.json"))
    assert whole.searches == resumed.searches
    assert whole.next_run == resumed.next_run
    for one, other in zip(whole.runs, resumed.runs, strict=True):
        assert one.number == other.number
        assert [m.cost for m in one.members] == [m.cost for m in other.members]
        for m, k in zip(one.members, other.members, strict=True):
            assert np.array_equal(m.x, k.x)


def test_cancelling_and_time_end_a_search_with_what_there_is():
    problem, _, _ = planted()
    rounds = []
    state = solve(problem, time_limit=None, cancelled=lambda: len(rounds) >= 2, progress=rounds.append)
    assert len(rounds) == 2
    assert state.best is not None
    assert solve(problem, time_limit=1e-6).searches > 0


def test_a_base_lens_joins_the_first_run():
    problem, structure, _ = planted(begin=True)
    state = solve(problem, seed=0, time_limit=None, most_searches=100)
    assert state.best.cost < 1e-14
    assert state.best.structure == structure


def test_different_seeds_search_differently():
    problem, _, _ = planted()
    one, other = (solve(problem, seed=s, time_limit=None, most_searches=100) for s in (1, 2))
    assert one.best.cost != other.best.cost


def test_lenses_are_distinct_and_valid():
    problem, _, _ = planted()
    state = solve(problem, seed=2, time_limit=None, most_searches=200)
    found = outcomes(state, problem, count=4)
    assert len(found) >= 2
    for one in found:
        assert complete_lens(one.lens) is not None
        assert one.lens.sensor_distance == pytest.approx(one.vector[one.structure.rows])
    for k, one in enumerate(found):
        for other in found[:k]:
            assert one.structure != other.structure or np.abs(one.vector - other.vector).max() > 1e-3


@given(st.integers(2, 9))
def test_patterns_touch_glass_everywhere_and_none_is_missed(surfaces):
    found = glass_patterns(surfaces)
    every = [tuple(bool(k >> b & 1) for b in range(surfaces)) for k in range(2**surfaces)]
    good = [p for p in every if not p[-1] and all(p[k] or (k > 0 and p[k - 1]) for k in range(surfaces))]
    assert sorted(found) == sorted(good)


def test_structures_have_enough_ghosts_and_neighbours_as_many():
    random = np.random.default_rng(0)
    for surfaces, ghosts in ((8, 13), (8, 12), (12, 30)):
        found = structures(surfaces, ghosts)
        assert found
        for one in found:
            assert len(one.pairs) >= ghosts
            assert one.standing_in_air
            turned = neighbour(one, random)
            assert len(turned.pairs) == len(one.pairs)
            assert turned.standing_in_air
    assert structures(4, 100) == ()
    # equation 5.5 of the thesis includes the stop: 5, 10 and 15 ghosts need 7, 9 and 10 rows
    assert [surfaces_for(ghosts) + 1 for ghosts in (1, 5, 10, 15)] == [4, 7, 9, 10]


def project(**design):
    light = Light(field_deg=(6.0, 3.0))
    return Project(lens="heliar-tronnier", f_number=16.0, lights=(light,), design=Design(**design))


def test_ghost_targets_change_the_targets_they_name():
    plain, _ = problem_of(project())
    ghost_targets = (
        GhostTarget(ghost="4-1", move_mm=2.0, height=1.5),
        GhostTarget(ghost="8-6", action="remove"),
        GhostTarget(ghost="8-7", action="ignore"),
        GhostTarget(place_mm=-3.0, radius_mm=-1.0, weight=2.0),
    )
    changed, _ = problem_of(project(ghost_targets=ghost_targets))
    one, other = plain.objective, changed.objective
    at = {name: k for k, name in enumerate(other.names)}
    assert "8-6" not in at
    before = one.targets[one.names.index("4-1")]
    assert np.allclose(other.targets[at["4-1"]][:2], [before[0] + 2.0, before[1] * 1.5])
    assert not other.weights[at["8-7"]].any()
    assert np.allclose(other.targets[at["target 3"]][:2], [-3.0, -1.0])
    assert len(changed.begin_with) == 1
    assert plain.begin_with == ()
    same = [k for k in at if k not in ("4-1", "8-7", "target 3")]
    assert all(np.array_equal(one.targets[one.names.index(k)], other.targets[at[k]]) for k in same)


def test_fixed_rows_stay():
    ghost_target = GhostTarget(ghost="4-1", move_mm=1.0)
    problem, settled = problem_of(project(structure="lens", fixed_rows=(0, 1, 6), ghost_targets=(ghost_target,)))
    state = solve(problem, time_limit=None, most_searches=60)
    vector = problem.variables(state.best.structure).prescription(state.best.x)
    for row in (0, 1, 6):
        surface = settled.lens.rows[row]
        assert vector[1 + row] == surface.thickness
        assert vector[1 + 9 + row] == surface.curvature
        assert vector[1 + 18 + row] == surface.medium.n_d


def test_fixed_rows_count_without_the_filter():
    """Row 0 was the front of the filter; the remark on catalogue glasses, and scatter, count the lens' rows."""
    given = project(structure="lens", fixed_rows=(0, 8))
    plain, _ = problem_of(given)
    behind, settled = problem_of(given.replace(filter=Plate(glass="N-BK7", thickness=2.0)))
    assert plain.fixed_rows == (0, 8)
    assert behind.fixed_rows == (2, 10)
    assert settled.lens.rows[2].curvature == settled.opened.lens.rows[0].curvature
    covered = given.replace(camera=given.camera.replace(cover_glass=Plate(glass="N-BK7", thickness=1.0)))
    with pytest.raises(ProjectError, match="rows are 0 to 8"):
        problem_of(covered.replace(design=covered.design.replace(fixed_rows=(9,))))


def test_fixed_rows_keep_their_asphere_and_their_coating():
    """They came back as bare spheres, so the written lens had other ghosts than the rows that were to stay."""
    lens = load_lens("heliar-tronnier")
    own = lens.rows[6].replace(conic=-0.5, asphere=(1e-6,), coating=QuarterWave(center_wavelength_nm=550.0))
    lens = lens.replace(rows=(*lens.rows[:6], own, *lens.rows[7:]))
    given = project(structure="lens", fixed_rows=(6,)).replace(lens=lens)
    problem, settled = problem_of(given)
    found = outcomes(solve(problem, time_limit=None, most_searches=40), problem, count=1)[0].lens.rows[6]
    mine = settled.lens.rows[6]
    assert found == mine.replace(semi_diameter=found.semi_diameter)
    assert found.semi_diameter <= mine.semi_diameter
    # rays of the final quality would trace a sphere
    assert given.design is not None
    with pytest.raises(ProjectError, match="has 6, which is no centred sphere"):
        problem_of(given.replace(design=given.design.replace(quality="final")))


@pytest.mark.parametrize(
    ("design", "words"),
    [
        ({"ghost_targets": (GhostTarget(ghost="7-1", move_mm=1.0),)}, "no ghost 7-1"),
        ({"ghost_targets": (GhostTarget(ghost="4-1", light=3),)}, "no light 3"),
        ({"surfaces": 4}, "surfaces = 6 or more"),
        ({"structure": "lens", "ghost_targets": (GhostTarget(place_mm=1.0, radius_mm=1.0),)}, "has 13"),
        ({"structure": "lens", "fixed_rows": (40,)}, "rows are 0 to 8"),
        ({"brightness": "stop", "bounds": Bounds(stop_diameter=(1.0, 2.0))}, "outside stop_diameter"),
        ({"structure": "lens", "fixed_rows": tuple(range(9)), "brightness": "stop"}, "nothing to search"),
    ],
)
def test_impossible_targets_differ_from_unsolved_ones(design, words):
    with pytest.raises(ProjectError, match=words):
        solve(problem_of(project(**design))[0], time_limit=0.1)


def test_a_target_for_a_ghost_that_is_invisible_at_its_light_is_refused():
    """It was left out without a word, and the search could call all targets met."""
    lights = (Light(field_deg=(6.0, 3.0)), Light(field_deg=(45.0, 0.0)))
    aim = problem_of(project().replace(lights=lights))[0].objective
    seen = [{name.partition(" ")[0] for name in aim.names if name.endswith(f"light {light}")} for light in (0, 1)]
    hidden = sorted(seen[0] - seen[1])[0]

    def asked(**target):
        return problem_of(project(ghost_targets=(GhostTarget(ghost=hidden, **target),)).replace(lights=lights))[0]

    for wish in ({"move_mm": 1.0}, {"height": 2.0}, {"radius_mm": 1.0}):
        with pytest.raises(ProjectError, match=f"ghost {hidden} is invisible at that light"):
            asked(light=1, **wish)
        # at one of the lights it is visible
        assert f"{hidden} at light 0" in asked(**wish).objective.names
    # a colour is for design colors, and what is invisible is removed already
    for wish in ({"color": (1.0, 0.0, 0.0)}, {"action": "remove"}, {"action": "ignore"}):
        assert asked(light=1, **wish).objective.names == aim.names


def test_a_near_light_is_refused():
    """Its distance was ignored: the targets were the ghosts of a distant light, of which one was a third too large."""
    near = project().replace(lights=(Light(field_deg=(6.0, 3.0)), Light(field_deg=(6.0, 3.0), distance=300.0)))
    with pytest.raises(ProjectError, match=r"lights\[1\].distance: design places the ghosts of distant lights only"):
        problem_of(near)


def test_a_damaged_search_is_no_traceback(tmp_path):
    path = tmp_path / "search.json"
    for text in ("", "{", "[]", '{"version": 9}', '{"version": 1, "seed": 0}'):
        path.write_text(text)
        with pytest.raises(FlarewrightError):
            read_state(path)
    write_state(PoolState(3), path)
    assert read_state(path) == PoolState(3)
    # each restart is prepared before the first one starts
    many = {**json.loads(path.read_text()), "restarts": 10**9}
    path.write_text(json.dumps({key: value for key, value in many.items() if key != "digest"}))
    with pytest.raises(ProjectError, match="damaged or no search"):
        read_state(path)


def test_a_batch_is_a_function_of_its_seed():
    problem, _, _ = planted()
    state = solve(problem, seed=4, time_limit=None, most_searches=200)
    one, other = (advance(state.runs[0], problem, 4) for _ in range(2))
    assert [m.cost for m in one.members] == [m.cost for m in other.members]
    assert advance(state.runs[0], problem, 5).members[0].cost == pytest.approx(one.members[0].cost, rel=1.0)


def test_a_structure_in_glass_is_none():
    assert not Structure(2, (True, True, False, True, False)).standing_in_air


def test_targets_ask_for_what_the_project_asks_for():
    """A target holds place, radius and log irradiance of a ghost, each as changed by the project."""
    base = Project(lens="triplet-pestrecov", f_number=8.0, lights=(Light(field_deg=(6.0, 3.0)),))
    name = problem_of(base)[0].objective.names[0].partition(" ")[0]

    def target(**change):
        design = Design(brightness="fresnel", ghost_targets=(GhostTarget(ghost=name, **change),))
        return problem_of(base.replace(design=design))[0].objective.targets[0]

    place, radius, log_light = target()
    assert target(move_mm=1.5) == pytest.approx((place + 1.5, radius, log_light))
    assert target(height=2.0) == pytest.approx((place, 2.0 * radius, log_light))
    assert target(brightness=3.0) == pytest.approx((place, radius, log_light + np.log(3.0)))
    assert target(place_mm=-2.0, radius_mm=0.7)[:2] == pytest.approx((-2.0, 0.7))
