"""Catalogue glasses: named in the lens, inside the bounds, and as good as an exhaustive search."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from planted import planted

from flarewright.design.finishing.candidate import outcomes
from flarewright.design.finishing.glass_rounding import held_indices, with_catalogue_glasses
from flarewright.design.problem.glass_list import glass_list
from flarewright.design.problem.objective import own_objective
from flarewright.design.problem.problem import LensCandidate
from flarewright.design.problem.target import problem_of
from flarewright.design.solvers.polish import polish, polish_within
from flarewright.design.solvers.pool_search import solve
from flarewright.errors import GlassError, ProjectError
from flarewright.io.lens.glass_catalogue import by_name
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.lens.toml_lens import read_lens
from flarewright.model import Design, Light, Project
from flarewright.render.scene.resolve import complete_lens


def with_glasses(problem, *entries):
    glasses = glass_list(entries, (1.5, 2.0))
    bounds = problem.bounds.replace(n_d=(glasses.n_d[0], glasses.n_d[-1]))
    return replace(problem, glasses=glasses, bounds=bounds)


def test_a_list_is_of_makers_and_names():
    schott = glass_list(("schott",), (1.5, 2.0))
    assert len(schott.glasses) > 40
    assert all(glass.maker == "SCHOTT" for glass in schott.glasses)
    assert np.all(np.diff(schott.n_d) >= 2e-4)
    assert schott.n_d[0] >= 1.5
    assert schott.n_d[-1] <= 2.0
    two = glass_list(("N-SF11", "HOYA BSC7", "N-BK7"), (1.5, 2.0))
    # BSC7 and N-BK7 have one index: the first in the list is used
    assert [glass.full_name for glass in two.glasses] == ["HOYA BSC7", "SCHOTT N-SF11"]
    assert len(glass_list(("all",), (1.5, 2.0)).glasses) > len(schott.glasses)
    with pytest.raises(GlassError, match="near names"):
        glass_list(("N-BK77",), (1.5, 2.0))
    with pytest.raises(ProjectError, match=r"between 1\.9 and 2"):
        glass_list(("N-BK7",), (1.9, 2.0))


def test_branching_finds_what_trying_every_glass_finds():
    # without brightness any glass will do: the curvatures compensate
    plain, structure, vector = planted()
    aim = own_objective(structure, vector, np.array([0.15]), bounds=plain.bounds, brightness="fresnel", extra=0.0)
    problem = with_glasses(replace(plain, objective=aim), "N-BK7", "N-SK16", "F2", "N-SF11")
    known = problem.variables(structure)
    start = known.search_point(vector)
    start = polish(problem, [(structure, start)], steps=200)[0]
    found, chosen = with_catalogue_glasses(problem, start)
    gaps = [k for k, glass in enumerate(structure.glass) if glass]
    assert sorted(chosen) == gaps
    index = found.x[1 + 2 * structure.rows :]
    assert all(index[gap] == problem.glasses.n_d[number] for gap, number in chosen.items())
    costs = []
    for numbers in product(range(4), repeat=len(gaps)):
        held = held_indices(problem, dict(zip(gaps, numbers, strict=True)))
        costs.append(polish_within(known.with_indices(held), start.x[None], problem.objective, 200)[1][0])
    assert found.cost <= 1.02 * min(costs)
    assert found.cost < 0.2 * np.median(costs)


def test_lenses_name_their_glasses(tmp_path):
    problem, _, _ = planted(begin=True)
    problem = with_glasses(problem, "SCHOTT")
    state = solve(problem, seed=3, time_limit=None, most_searches=50)
    found = outcomes(state, problem, count=2)
    assert len(found) == 2
    for one in found:
        assert one.fitness < one.fitness_any_index + 0.05
        write_lens(one.lens, tmp_path / "lens.toml")
        lens = complete_lens(read_lens(tmp_path / "lens.toml")[0])
        for row, medium in enumerate(getattr(row, "medium", None) for row in lens.rows):
            assert (medium is not None) == one.structure.glass[row]
            if medium is not None:
                glass = by_name(medium.glass)
                assert (glass.maker, glass.full_name) == ("SCHOTT", one.glasses[row])
                assert medium.n_d == pytest.approx(glass.n_d, abs=1e-9)
                assert medium.dispersion == glass.dispersion


def test_one_glass_leaves_nothing_to_choose():
    problem, structure, vector = planted()
    problem = with_glasses(problem, "N-BK7")
    known = problem.variables(structure)
    one = LensCandidate(np.inf, structure, known.search_point(vector))
    _, chosen = with_catalogue_glasses(problem, one)
    assert set(chosen.values()) == {0}
    assert sorted(chosen) == [k for k, glass in enumerate(structure.glass) if glass]


def test_fixed_rows_keep_their_own_glass():
    design = Design(structure="lens", fixed_rows=(0,), glasses="N-BK7")
    problem, settled = problem_of(
        Project(lens="heliar-tronnier", f_number=16.0, lights=(Light(field_deg=(6.0, 3.0)),), design=design)
    )
    found = outcomes(solve(problem, time_limit=None, most_searches=40), problem, count=1)[0]
    assert found.lens.rows[0].medium == settled.lens.rows[0].medium
    assert {row: name for row, name in found.glasses.items() if row} == dict.fromkeys((1, 3, 6, 7), "SCHOTT N-BK7")


def test_the_schema_knows_both_ways_to_name_glasses():
    schema = Design.model_json_schema()["properties"]["glasses"]
    kinds = {one["type"] for one in schema["anyOf"]}
    assert kinds == {"string", "array"}
    assert Design(glasses="SCHOTT").glasses == ("SCHOTT",)
    assert Design(glasses=["N-BK7", "N-SF6"]).glasses == ("N-BK7", "N-SF6")
