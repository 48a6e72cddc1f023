"""Traced ghosts: first order in the limit, equal to real rays, and lenses are finished with them."""

from dataclasses import replace

import numpy as np
import pytest
from planted import planted
from sensor_rays import trace_rays

from flarewright.design.finishing.candidate import outcomes
from flarewright.design.finishing.constraints import breaches
from flarewright.design.finishing.traced import traced_ghosts
from flarewright.design.finishing.traced_polish import STEPS, finish, traced_misfits
from flarewright.design.problem.ghosts import evaluate
from flarewright.design.problem.prescription import structure_of, vector_of
from flarewright.design.problem.target import problem_of
from flarewright.design.solvers.pool_search import solve
from flarewright.model import AsLens, Design, GhostTarget, Light, Project
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import ghost_path
from flarewright.optics.rays.pack import pack_lens, resolve_coatings
from flarewright.render.scene.resolve import load_lens

LENS = load_lens("heliar-tronnier")
STRUCTURE = structure_of(LENS)


def test_small_stops_and_angles_are_first_order():
    vector = vector_of(LENS, 4.5, 81.3)
    exact = evaluate(STRUCTURE, vector[None], 100.0)[0]
    errors = []
    for part in (1e-2, 1e-3):
        small = vector.copy()
        small[0] *= part
        found = traced_ghosts(STRUCTURE, small, 0.1 * part, 100.0)
        wanted = np.stack([exact[:, 0] * 0.1, exact[:, 1]], axis=1)
        errors.append(np.abs(found / part - wanted).max())
    # errors of first order are of third power
    assert errors[1] < 1e-4
    assert errors[1] == pytest.approx(errors[0] / 100.0, rel=0.3)


@pytest.mark.parametrize("pair", [(2, 1), (4, 1), (8, 6)])
def test_the_disc_is_that_of_rays_sent_through_the_whole_front(pair):
    f_number, field = 16.0, 6.0
    order = first_order(LENS, f_number)
    packed = pack_lens(LENS, order, resolve_coatings(LENS, AsLens()),
                       np.array([587.5618]))  # fmt: skip
    # no aiming: very many rays, of which those inside the stop's radius count; 59 to 755 of them do, which determines
    # the disc to 3e-4 mm and 4e-4 of its radius
    side = 201
    grid = np.linspace(-20.0, 20.0, side)
    x, y = (part.ravel() for part in np.meshgrid(grid, grid))
    rays = trace_rays(packed, ghost_path(LENS, *pair), x, y, (0.0, field))
    p = np.stack([rays["stop_x"], rays["stop_y"]], axis=1) / order.stop_semi_diameter
    inside = (rays["status"] == 1.0) & (np.hypot(*p.T) < 1.0)
    # rays are uniform at the front, not at the stop: each gets the weight of its area there
    grown = np.full(x.size, np.nan)
    px, py = (p[:, axis].reshape(side, side) for axis in (0, 1))
    area = np.abs(np.gradient(px, axis=0) * np.gradient(py, axis=1) - np.gradient(px, axis=1) * np.gradient(py, axis=0))
    grown[:] = area.ravel()
    w, p, at = grown[inside], p[inside], np.stack([rays["x"], rays["y"]], axis=1)[inside]
    system = np.array([[w.sum(), (w * p[:, 1]).sum()], [(w * p[:, 1]).sum(), (w[:, None] * p**2).sum()]])
    place, radius = np.linalg.solve(system, [(w * at[:, 1]).sum(), (w[:, None] * p * at).sum()])
    vector = vector_of(LENS, 2.0 * order.stop_semi_diameter, order.sensor_distance)
    (found,) = traced_ghosts(STRUCTURE, vector, float(np.tan(np.radians(field))), 100.0, [pair])
    # the upright picture is rotated by 180 degrees; seen from the light's side it is not
    assert abs(found[0]) == pytest.approx(abs(place), abs=0.02)
    assert abs(found[1]) == pytest.approx(abs(radius), rel=0.01)
    rough = evaluate(STRUCTURE, vector[None], 100.0)[0][STRUCTURE.pairs.index(pair)]
    # the traced result differs from first order
    assert abs(found[0] - rough[0] * np.tan(np.radians(field))) > 0.02 or abs(found[1] - rough[1]) > 0.02


def test_a_lens_is_finished_where_first_order_ends():
    problem, structure, vector = planted()
    wide = replace(problem, structures=(structure,), stop_diameter=None)
    vector[0] = 4.0
    wide = replace(wide, objective=replace(wide.objective, slopes=np.array([0.1])))
    # targets: the traced ghosts of the lens
    targets, weights = wide.objective.targets.copy(), wide.objective.weights.copy()
    targets[:, :2] = traced_ghosts(structure, vector, 0.1, 100.0)
    # too few rays reach one of them for a fit
    lost = ~np.isfinite(targets[:, 0])
    assert lost.sum() == 1
    targets[lost], weights[lost] = 0.0, 0.0
    wide = replace(wide, objective=replace(wide.objective, targets=targets, weights=weights))
    known = wide.variables(structure)
    moved = known.search_point(vector)
    moved[known.free] += np.random.default_rng(0).normal(size=known.free.size) * 0.002 * known.longest
    done = finish(wide, structure, known, moved, structure.pairs)
    assert np.abs(done.before.off).max() > 0.02
    assert np.abs(done.after.off).max() < 0.02 * np.abs(done.before.off).max()
    assert np.all((done.x >= known.low) & (done.x <= known.high))
    off = traced_misfits(wide, structure, known.prescription(done.x), structure.pairs)
    assert np.array_equal(off.off, done.after.off)


# number of finishing steps
@pytest.mark.parametrize("steps", [1, pytest.param(STEPS, marks=pytest.mark.slow)])
def test_final_quality_makes_lenses_whose_traced_ghosts_are_nearer(monkeypatch, steps):
    monkeypatch.setattr("flarewright.design.finishing.traced_polish.STEPS", steps)
    # the fewest lenses whose rays are traced
    monkeypatch.setattr("flarewright.design.finishing.candidate.TRACED", 1)
    ghost_targets = (GhostTarget(ghost="2-1", height=1.2),)
    design = Design(ghost_targets=ghost_targets, quality="final", structure="lens")
    project = Project(lens="triplet-pestrecov", f_number=8.0, lights=(Light(field_deg=(10.0, 5.0)),), design=design)
    problem, _ = problem_of(project)
    state = solve(problem, seed=0, time_limit=None, most_searches=50)
    found = outcomes(state, problem, count=2)
    for one in found:
        before, after = one.fitness_traced
        assert after <= before
        off = traced_misfits(problem, one.structure, one.vector, one.ghosts)
        assert off.cost == pytest.approx(after)
        assert one.residuals == pytest.approx(off.off)
        assert not breaches(problem, one.structure, one.vector)
    # the best lens is better than the best one of first order
    assert found[0].fitness_traced[1] == min(one.fitness_traced[1] for one in found)
    (first,) = outcomes(state, replace(problem, traced=False), count=1)
    assert first.fitness_traced is None
    rough = traced_misfits(problem, first.structure, first.vector, first.ghosts)
    assert found[0].fitness_traced[1] < rough.cost


def test_a_ghost_that_no_rays_make_is_reported():
    problem, structure, vector = planted()
    vector[0] = 4.0
    (gone,) = np.flatnonzero(np.isnan(traced_ghosts(structure, vector, 0.1, 100.0)[:, 0]))
    here = replace(problem, objective=replace(problem.objective, slopes=np.array([0.1])))
    found = traced_misfits(here, structure, vector, structure.pairs)
    assert np.flatnonzero(found.lost).tolist() == [gone]
    weighted = ((here.objective.weights[:, :2] * found.off) ** 2).sum()
    assert found.cost == pytest.approx((weighted + 1.0) / len(found.off))
