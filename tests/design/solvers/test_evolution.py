"""Evolutionary solvers: they find planted lenses, stay inside the bounds, and are reproducible."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import planted

from flarewright.design.problem.objective import fitness_thesis, own_objective
from flarewright.design.problem.prescription import Structure, structures
from flarewright.design.problem.problem import Problem
from flarewright.design.solvers.cma_es import folded
from flarewright.design.solvers.evolution_log import Limits
from flarewright.design.solvers.genes import genes_of
from flarewright.design.solvers.polish import polish
from flarewright.design.solvers.pool_search import PoolState
from flarewright.design.solvers.solvers import NAMES, chosen, solve_with
from flarewright.design.thesis.benchmark import task_of
from flarewright.design.thesis.trials import Trial
from flarewright.errors import ProjectError
from flarewright.model.project.design import Bounds

# for the ghost of a singlet: number of evaluations, and the built-in cost to reach; the best of 20,000 random singlets
# costs 1e-3
SINGLET_NEEDS = {
    "pso:2x2": (40_000, 1e-6),
    "sade:2x2": (40_000, 1e-6),
    "de:2x2": (40_000, 1e-6),
    "de1220:2x2": (40_000, 1e-8),
    # the ant colony does not converge fully
    "gaco:2x4": (10_000, 5e-3),
    "cmaes": (10_000, 1e-6),
    "pools": (400, 1e-12),
}
# the same for the two ghosts of two singlets
NEEDS = {
    "pso:5x5": (120_000, 1e-4),
    "sade:5x5": (120_000, 1e-4),
    "de:5x5": (150_000, 1e-4),
    "de1220:5x5": (200_000, 1e-8),
    # the ant colony does not converge fully
    "gaco:3x10": (200_000, 0.1),
    "cmaes": (30_000, 1e-6),
    "pools": (400, 1e-12),
}


def singlet():
    """Return a problem with the ghost of a singlet before a stop, among such lenses."""
    structure = Structure(2, (True, False, False))
    vector = np.array([6.0, 3.0, 4.0, 40.0, 0.02, -0.01, 0.0, 1.6, 1.0, 1.0])
    return wanted(structure, vector)


def two_singlets():
    """Return a problem with the ghosts of two singlets around a stop, among such lenses."""
    structure = Structure(2, (True, False, False, True, False))
    vector = np.array([6.0, 3.0, 4.0, 5.0, 2.5, 40.0, 0.02, -0.01, 0.0, 0.015, -0.02, 1.6, 1.0, 1.0, 1.7, 1.0])
    return wanted(structure, vector)


def wanted(structure, vector):
    """Return a problem with the ghosts of a lens, among lenses of its structure."""
    bounds = Bounds(hard=())
    aim = own_objective(structure, vector, np.array([0.15]), bounds=bounds)
    return Problem(aim, (structure,), bounds, stop_diameter=6.0), structure, vector


def solver(text):
    """Return a solver, or skip the test if its package is not installed."""
    name = text.partition(":")[0]
    if name not in ("pools", "cmaes"):
        pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    elif name == "cmaes":
        pytest.importorskip("cmaes", reason="the extra evo is not installed: no cmaes")
    return chosen(text)


@pytest.mark.parametrize(
    ("lens", "text", "most", "enough"),
    [(singlet, text, *needs) for text, needs in SINGLET_NEEDS.items()]
    + [pytest.param(two_singlets, text, *needs, marks=pytest.mark.slow) for text, needs in NEEDS.items()],
)
def test_every_solver_finds_a_planted_lens(lens, text, most, enough):
    problem, _, _ = lens()
    found = solve_with(solver(text), problem, limits=Limits(None, most), seed=1)
    assert found.state.best.cost < enough
    # random lenses do not come close
    genes = genes_of(problem)
    assert np.median(genes.fitness(np.random.default_rng(1).random((200, genes.count)))) > 100.0 * enough
    costs = [step.best.cost for step in found.steps]
    assert costs == sorted(costs, reverse=True)


def test_names_are_all_tested():
    assert {text.partition(":")[0] for text in SINGLET_NEEDS} == set(NAMES)
    assert {text.partition(":")[0] for text in NEEDS} == set(NAMES)


@pytest.mark.parametrize("text", ["pso:3x4", "sade:3x4", "de:3x4", "de1220:3x4", "gaco:2x4", "cmaes"])
def test_the_same_seed_finds_the_same(text):
    problem, _, _ = planted()
    choice = solver(text)
    one, again, other = (solve_with(choice, problem, limits=Limits(None, 1500), seed=s) for s in (3, 3, 4))
    assert [step.best.cost for step in one.steps] == [step.best.cost for step in again.steps]
    assert np.array_equal(one.state.best.x, again.state.best.x)
    assert one.state.best.cost != other.state.best.cost


def assert_inside(problem, found):
    known = problem.variables(found.structure)
    assert np.all(found.x >= known.low)
    assert np.all(found.x <= known.high)
    assert found.structure.standing_in_air
    assert len(found.structure.pairs) == len(problem.structures[0].pairs)
    assert found.structure in problem.structures


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1.0, 30.0]))
@settings(max_examples=40, deadline=None)
def test_no_gene_leaves_the_bounds(seed, far):
    problem, _, _ = planted()
    genes, random = genes_of(problem), np.random.default_rng(seed)
    many = random.random((8, genes.count)) + far * random.normal(size=(8, genes.count))
    # include the corners, and NaN
    many[0], many[1], many[2, 0] = np.round(many[0]), 1.0, np.nan
    for found in genes.candidates(many, genes.fitness(many)):
        assert_inside(problem, found)


@given(st.integers(0, 10**6), st.sampled_from(["pso:2x3", "de1220:2x3", "gaco:2x3", "cmaes"]))
@settings(max_examples=12, deadline=None)
def test_no_solver_leaves_the_bounds(seed, text):
    problem, _, _ = planted()
    found = solve_with(solver(text), problem, limits=Limits(None, 500), seed=seed, measure="algorithm1")
    for one in (*found.state.ended, *(step.best for step in found.steps)):
        assert_inside(problem, one)


def test_a_lens_of_given_structure_keeps_its_fixed_rows():
    problem, structure, vector = planted()
    held = replace(problem, structures=(structure,), fixed=vector, fixed_rows=(0, 1))
    genes = genes_of(held)
    assert genes.count < genes_of(replace(problem, structures=(structure,))).count
    many = np.random.default_rng(0).random((20, genes.count))
    rows = structure.rows
    for found in genes.candidates(many, genes.fitness(many)):
        assert found.structure == structure
        values = held.variables(structure).prescription(found.x)
        for k in (0, 1):
            kept = [1 + k, 1 + rows + k, 1 + 2 * rows + k]
            assert values[kept] == pytest.approx(vector[kept], rel=1e-12)


def test_every_pattern_can_be_said():
    problem, _, _ = planted()
    genes = genes_of(problem)
    many = np.random.default_rng(0).random((500, genes.count))
    seen = {found.structure for found in genes.candidates(many, genes.fitness(many))}
    assert seen == set(problem.structures) == set(structures(6, len(problem.structures[0].pairs)))


@pytest.mark.parametrize("case", ["heliar", "canon"])
def test_a_lens_becomes_genes_and_back(case):
    task = task_of(Trial(case, 13.4))
    problem, (structure, vector) = task.problem, task.lens
    genes = genes_of(problem, "algorithm1")
    coded = genes.encode(structure, vector)[None]
    found = genes.candidates(coded, genes.fitness(coded))[0]
    assert found.structure == structure
    assert problem.variables(structure).prescription(found.x) == pytest.approx(vector, rel=1e-9, abs=1e-12)
    assert found.cost == pytest.approx(0.0, abs=1e-15)


def test_fitness_is_that_of_the_search_and_of_the_thesis():
    problem, _, _ = planted()
    many = np.random.default_rng(5).random((30, genes_of(problem).count))
    for measure in ("ours", "algorithm1"):
        genes = genes_of(problem, measure)
        for found in genes.candidates(many, genes.fitness(many)):
            if measure == "ours":
                # no step: the cost of the point itself
                expected = polish(problem, [(found.structure, found.x)], steps=0)[0].cost
            else:
                vector = problem.variables(found.structure).prescription(found.x)
                expected = fitness_thesis(problem.objective, found.structure, vector) + limit_cost(problem, found)
            assert found.cost == pytest.approx(expected, rel=1e-9)


def limit_cost(problem, found):
    """Return the cost of a lens that has no ghost targets."""
    aim = problem.objective
    free = replace(aim, weights=np.zeros_like(aim.weights), extra=0.0)
    return polish(replace(problem, objective=free), [(found.structure, found.x)], steps=0)[0].cost


def test_migration_brings_the_best_to_the_neighbours_only():
    pygmo = pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    from flarewright.design.solvers.evolution import migrate

    class Height:
        def fitness(self, x):
            return [float(x[0])]

        def get_bounds(self):
            return [0.0], [1.0]

    islands = [pygmo.population(pygmo.problem(Height()), 10, seed=k) for k in range(5)]
    for island in islands:
        for place in range(10):
            island.set_x(place, [0.5 + 0.04 * place])
    islands[0].set_x(7, [0.001])
    islands[0].set_x(8, [0.002])
    assert migrate(pygmo, islands) > 0
    best = [float(island.get_f().min()) for island in islands]
    assert best == [0.001, 0.001, 0.5, 0.5, 0.001]
    for island in islands:
        # no better individual is replaced by a migrant
        assert len(island) == 10
        assert island.get_x()[:, 0] == pytest.approx(island.get_f()[:, 0])
    migrate(pygmo, islands)
    assert [float(island.get_f().min()) for island in islands] == [0.001] * 5


@pytest.mark.parametrize("text", ["pso:2x4", "cmaes"])
def test_the_lens_that_is_there_joins(text):
    problem, _, _ = planted(begin=True)
    with_it = solve_with(solver(text), problem, limits=Limits(None, 300), seed=0)
    without = solve_with(solver(text), replace(problem, begin_with=()), limits=Limits(None, 300), seed=0)
    assert with_it.state.best.cost < 1e-15
    assert without.state.best.cost > 0.1


def test_it_ends_when_asked_and_keeps_the_best():
    problem, _, _ = planted()
    seen: list[PoolState] = []
    found = solve_with(
        solver("sade:3x4"), problem, limits=Limits(None, None, seen.append, lambda: len(seen) >= 5), seed=0
    )
    assert len(seen) == 5
    assert found.state.best is not None
    assert found.steps[-1].best.cost == min(state.best.cost for state in seen)


def test_folding_is_continuous_and_stays_inside():
    x = np.linspace(-5.0, 5.0, 2001)
    y = folded(x)
    assert y.min() >= 0.0
    assert y.max() <= 1.0
    assert np.abs(np.diff(y)).max() <= 0.0051
    assert folded(np.array([0.25, -0.25, 1.75, 2.25])) == pytest.approx([0.25] * 4)


@pytest.mark.parametrize("text", ["evolve", "pools:3x3", "pso:3", "pso:0x5", "cmaes:2x2", "pso:3x0"])
def test_an_unknown_solver_is_rejected(text):
    if text.startswith("pso"):
        pytest.importorskip("pygmo", reason="the extra evo is not installed: no pygmo")
    with pytest.raises(ProjectError, match=r"solver|archipelago"):
        chosen(text)


@pytest.mark.parametrize(("text", "package"), [("pso", "pygmo"), ("gaco", "pygmo"), ("cmaes", "cmaes")])
def test_a_missing_package_is_reported(monkeypatch, text, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ProjectError, match=rf"needs the package {package}.*flarewright\[evo\]"):
        chosen(text)
