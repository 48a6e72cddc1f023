"""Coatings for target colours: the forward model against the thin-film reference, and planted coatings found."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flarewright.design.coatings import color_search
from flarewright.design.coatings.color_chart import channel_chart, channel_curves
from flarewright.design.coatings.color_genes import ColorGenes, colors_with
from flarewright.design.coatings.color_search import solve_colors
from flarewright.design.coatings.colors import (
    WAVELENGTHS_NM,
    ColorProblem,
    coated,
    color_problem,
    colors_of,
    indices_of,
    mirrors_of,
    own_colors,
    pair_map,
    perceived_differences,
    reflectances,
    uses,
)
from flarewright.design.problem.objective import algorithm_2
from flarewright.design.problem.prescription import structure_of
from flarewright.design.solvers.evolution_log import Limits
from flarewright.design.solvers.solvers import chosen
from flarewright.errors import ProjectError
from flarewright.measure.core.checkpoint import journal
from flarewright.model import Camera, Design, GhostTarget, Light, Plate, Preset, Project
from flarewright.model.project.design import Bounds
from flarewright.optics.coatings.thin_film import stack_reflectance
from flarewright.optics.lens.paths import ghost_path
from flarewright.render.plots.svg import Line
from flarewright.render.scene.resolve import load_lens

LENS = load_lens("heliar-tronnier")
STRUCTURE = structure_of(LENS)


def problem_for(values, kind, bounds=None):
    count = len(STRUCTURE.pairs)
    ones, no, bounds = np.ones((count, 3)), np.zeros(count, bool), bounds or Bounds()
    blank = ColorProblem(STRUCTURE, indices_of(LENS), ones, ones[:, 0], no, kind, bounds)
    targets = colors_of(blank, values)
    return ColorProblem(STRUCTURE, blank.n_d, targets, blank.weights, blank.hue_only, kind, blank.bounds)


@given(st.floats(1.38, 1.9), st.floats(25.0, 750.0), st.floats(1.0, 2.0), st.floats(1.45, 2.0))
@settings(max_examples=60, deadline=None)
def test_many_thicknesses_at_once_are_those_one_by_one(index, thickness, front, back):
    (found,) = reflectances("film", front, back, np.array([[index, thickness]]))
    alone = stack_reflectance(front, back, (index,), (thickness,), np.array(WAVELENGTHS_NM), 1.0)
    assert np.allclose(found, alone, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", ["quarter-wave", "film"])
def test_colours_are_those_of_the_coated_lens(kind):
    random = np.random.default_rng(1)
    count = len(mirrors_of(STRUCTURE))
    values = random.uniform(400.0, 740.0, (count, 1))
    if kind == "film":
        values = np.stack([random.uniform(1.4, 1.9, count), random.uniform(30.0, 700.0, count)], axis=1)
    problem = problem_for(values, kind)
    assert np.allclose(
        own_colors(coated(LENS, mirrors_of(STRUCTURE), kind, values), STRUCTURE), problem.targets, rtol=1e-9
    )


def test_a_path_is_passed_as_often_as_it_goes():
    reflections, passes = uses(STRUCTURE)
    rows = mirrors_of(STRUCTURE)
    for g, (j, i) in enumerate(STRUCTURE.pairs):
        path = ghost_path(LENS, j, i)
        for m, k in enumerate(rows):
            met = int(np.count_nonzero(path.rows == k))
            mirror = int(k in (j, i))
            assert reflections[g, m] == mirror
            assert passes[g, m] == met - mirror


@pytest.mark.parametrize("kind", ["quarter-wave", "film"])
def test_planted_coatings_are_found(kind):
    random = np.random.default_rng(7)
    count = len(mirrors_of(STRUCTURE))
    values = random.uniform(400.0, 740.0, (count, 1))
    if kind == "film":
        values = np.stack([random.uniform(1.4, 1.85, count), random.uniform(60.0, 160.0, count)], axis=1)
    problem = problem_for(values, kind)
    found = solve_colors(problem, starts=2)
    # quarter waves are unique; free films have many settings that look nearly the same, and one of them is found
    missed = algorithm_2(problem.targets, found.colors)
    bare = algorithm_2(problem.targets, own_colors(LENS, STRUCTURE))
    assert missed < (1e-6 if kind == "quarter-wave" else 0.05 * bare)
    if kind == "quarter-wave":
        assert found.values == pytest.approx(values, abs=1e-3)
    low, high = np.array([(380.0, 750.0)] if kind == "quarter-wave" else [(1.38, 1.9), (25.0, 750.0)]).T
    assert np.all((found.values >= low) & (found.values <= high))
    if kind == "quarter-wave":
        assert np.array_equal(found.values, solve_colors(problem, starts=2, threads=1).values)


def project(*ghost_targets):
    light = Light(field_deg=(6.0, 3.0))
    return Project(lens="heliar-tronnier", lights=(light,), design=Design(ghost_targets=ghost_targets))


# one descent each with one, two and three films, and fewer settings than usual
@pytest.mark.slow
@pytest.mark.parametrize(("indices", "drawn", "starts"), [(4, 128, 3), (14, 8192, 6)])
def test_several_films_meet_what_one_cannot(monkeypatch, indices, drawn, starts):
    monkeypatch.setattr(color_search, "INDICES", indices)
    monkeypatch.setattr(color_search, "DRAWN", drawn)
    # colours that two films on every surface reflect
    random = np.random.default_rng(3)
    count = len(mirrors_of(STRUCTURE))
    values = np.stack([random.uniform(1.4, 1.9, count), random.uniform(40.0, 200.0, count)] * 2, axis=1)
    values[:, 2] = random.uniform(1.4, 1.9, count)
    values[:, 3] = random.uniform(200.0, 500.0, count)
    planted = problem_for(values, "film")
    missed, films = {}, {}
    for layers in (1, 2, 3):
        found = solve_colors(replace(planted, layers=layers), starts=starts)
        assert found.values.shape == (count, 2 * layers)
        n, d = found.values[:, ::2], found.values[:, 1::2]
        assert np.all((n >= 1.38) & (n <= 1.9) & (d <= 750.0) & ((d >= 25.0) | (d == 0.0)))
        # the written lens has these films, in their order
        lens = coated(LENS, mirrors_of(STRUCTURE), "film", found.values)
        assert np.allclose(own_colors(lens, STRUCTURE), found.colors, rtol=1e-9)
        missed[layers], films[layers] = found.cost, (d > 0.0).sum(axis=1)
    assert missed[2] < 0.5 * missed[1]
    assert missed[3] < 0.5 * missed[1]
    assert films[2].max() == 2


def test_films_are_listed_from_the_side_of_the_lower_index():
    films = np.array([[1.38, 120.0, 1.8, 60.0]])
    (air_first,) = reflectances("film", 1.0, 1.6, films)
    alone = stack_reflectance(1.0, 1.6, (1.38, 1.8), (120.0, 60.0), np.array(WAVELENGTHS_NM), 1.0)
    assert np.allclose(air_first, alone, rtol=1e-12)
    assert np.allclose(reflectances("film", 1.6, 1.0, films)[0], alone, rtol=1e-12)
    other = stack_reflectance(1.0, 1.6, (1.8, 1.38), (60.0, 120.0), np.array(WAVELENGTHS_NM), 1.0)
    assert np.abs(other - alone).max() > 0.01
    # a film of thickness 0 is absent
    absent = np.array([[1.38, 120.0, 1.5, 0.0]])
    assert np.allclose(reflectances("film", 1.0, 1.6, absent), reflectances("film", 1.0, 1.6, absent[:, :2]))


# the same number of random settings reaches 0.27 of the median at best
@pytest.mark.parametrize(
    ("text", "kind", "most"),
    [
        ("sade:1x2", "quarter-wave", 300),
        pytest.param("pso:1x2", "film", 300, marks=pytest.mark.slow),
        ("cmaes", "film", 6000),
        pytest.param("sade:3x6", "quarter-wave", 6000, marks=pytest.mark.slow),
        pytest.param("pso:3x6", "film", 6000, marks=pytest.mark.slow),
    ],
)
def test_solvers_that_evolve_choose_coatings_too(text, kind, most):
    package = "cmaes" if text == "cmaes" else "pygmo"
    pytest.importorskip(package, reason=f"the extra evo is not installed: no {package}")
    random = np.random.default_rng(7)
    count = len(mirrors_of(STRUCTURE))
    values = random.uniform(400.0, 740.0, (count, 1))
    if kind == "film":
        values = np.stack([random.uniform(1.4, 1.85, count), random.uniform(60.0, 160.0, count)], axis=1)
    problem, steps = problem_for(values, kind), []
    found = colors_with(
        chosen(text), problem, limits=Limits(None, most), seed=1, measure="algorithm2", note=steps.append
    )
    low, high = problem.limits()
    assert np.all((found.values >= low) & (found.values <= high))
    assert found.cost == pytest.approx(float(algorithm_2(problem.targets, found.colors)))
    costs = [float(algorithm_2(problem.targets, colors_of(problem, step.values))) for step in steps]
    assert costs == sorted(costs, reverse=True)
    assert found.cost == pytest.approx(costs[-1])
    genes = ColorGenes(problem, "algorithm2")
    assert found.cost < 0.25 * np.median(genes.fitness(np.random.default_rng(1).random((200, genes.count))))


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 3]))
@settings(max_examples=20, deadline=None)
def test_genes_of_coatings_stay_inside_and_cost_what_they_should(seed, layers):
    random = np.random.default_rng(seed)
    count = len(mirrors_of(STRUCTURE))
    problem = problem_for(random.uniform(400.0, 700.0, (count, 1)), "quarter-wave")
    problem = replace(problem, kind="film", layers=layers)
    genes = ColorGenes(problem)
    many = random.random((5, genes.count)) + random.choice([0.0, 10.0]) * random.normal(size=(5, genes.count))
    many[0] = np.round(many[0])
    values = genes.values(many)
    n, d = values[..., ::2], values[..., 1::2]
    assert np.all((n >= 1.38) & (n <= 1.9) & (d <= 750.0 + 1e-9) & ((d >= 25.0 - 1e-9) | (d == 0.0)))
    assert np.all(d[..., 0] > 0.0)
    for one, cost in zip(values, genes.fitness(many), strict=True):
        found = colors_of(problem, one)
        expected = ((found / problem.targets.sum(axis=1, keepdims=True)
                     - problem.targets / problem.targets.sum(axis=1, keepdims=True)) ** 2).sum()  # fmt: skip
        assert cost == pytest.approx(expected, rel=1e-9)


def test_a_target_colour_turns_a_ghost_red():
    ghost_target = GhostTarget(ghost="4-1", color=(1.0, 0.2, 0.2), weight=5.0)
    problem, lens = color_problem(project(ghost_target), "quarter-wave")
    g = problem.structure.pairs.index((4, 1))
    assert problem.hue_only[g]
    assert not np.delete(problem.hue_only, g).any()
    before = own_colors(lens, problem.structure)
    assert problem.targets[g].sum() == pytest.approx(before[g].sum())
    after = solve_colors(problem, starts=3).colors
    assert after[g, 0] / after[g].sum() > before[g, 0] / before[g].sum() + 0.1


def test_an_interrupted_search_of_coatings_resumes_to_the_same_values(tmp_path, monkeypatch):
    monkeypatch.setattr(color_search, "ROUND", 1)
    problem, _ = color_problem(project(GhostTarget(ghost="4-1", color=(1.0, 0.2, 0.2))), "quarter-wave")
    whole = solve_colors(problem, starts=4, seed=2)
    with suppress(KeyboardInterrupt), journal(tmp_path / "j", "d") as steps:

        def twice(make, cut, left=[1, 1]):  # noqa: B006
            if not left:
                raise KeyboardInterrupt
            left.pop()
            return steps.step(make, cut)

        solve_colors(problem, starts=4, seed=2, step=twice)
    with journal(tmp_path / "j", "d") as steps:
        assert steps.remembered == 2
        resumed = solve_colors(problem, starts=4, seed=2, step=steps.step)
    assert resumed.values.tobytes() == whole.values.tobytes()
    assert resumed.cost == whole.cost
    # a batch that ends early is not recorded
    with journal(tmp_path / "k", "d") as steps:
        solve_colors(problem, starts=4, seed=2, step=steps.step, cancelled=lambda: True)
        assert steps.empty


def test_cemented_rows_stay_bare_unless_the_file_coats_them():
    """Cemented surfaces take no film."""
    ghost_target = GhostTarget(ghost="4-1", color=(1.0, 0.2, 0.2))
    problem, lens = color_problem(project(ghost_target), "quarter-wave")
    assert problem.kept == (1, 7)
    assert problem.rows.tolist() == [0, 2, 3, 4, 6, 8]
    found = solve_colors(problem, starts=3)
    worn = coated(lens, problem.rows, "quarter-wave", found.values)
    assert [k for k, row in enumerate(worn.rows) if getattr(row, "coating", None) is None] == [1, 5, 7]
    # the reported colours are those of the lens, including the bare rows
    assert np.allclose(own_colors(worn, problem.structure), found.colors, rtol=1e-9)
    genes = ColorGenes(problem)
    assert genes.count == 6
    at = (found.values - 380.0).ravel() / (750.0 - 380.0)
    assert genes.fitness(at[None])[0] == pytest.approx(found.cost, rel=1e-6)
    # the thesis coats every row
    thesis = project(ghost_target).replace(coating=Preset(name="thesis"))
    assert color_problem(thesis, "quarter-wave")[0].kept == ()


def test_a_lens_without_a_surface_in_air_cannot_be_coated():
    problem, _ = color_problem(project(), "film")
    with pytest.raises(ProjectError, match="nothing to coat"):
        solve_colors(replace(problem, kept=tuple(mirrors_of(STRUCTURE))))


@pytest.mark.parametrize("ghost_target", [GhostTarget(ghost="7-1"), GhostTarget(place_mm=1.0, radius_mm=1.0)])
def test_colours_are_for_ghosts_of_the_lens(ghost_target):
    with pytest.raises(ProjectError, match="own ghosts"):
        color_problem(project(ghost_target), "film")


def test_a_coated_zoom_keeps_its_positions_and_plates_are_refused():
    """The written lens was that at the project's zoom, without positions, and a filter was among its rows."""
    lights = (Light(field_deg=(5.0, 5.0)),)
    given = Project(lens="canon-70-200", zoom="tele", lights=lights)
    problem, lens = color_problem(given, "quarter-wave")
    coats = coated(lens, problem.rows, problem.kind, np.full((len(problem.rows), 1), 500.0))
    assert coats.positions == load_lens("canon-70-200").positions
    for changes, words in (
        ({"filter": Plate(thickness=2.0)}, "filter is no part"),
        ({"camera": Camera(cover_glass=Plate(thickness=1.0))}, "camera.cover_glass is no part"),
    ):
        with pytest.raises(ProjectError, match=words):
            color_problem(given.replace(**changes), "quarter-wave")


def test_colours_without_any_weight_are_refused():
    ghost_targets = [GhostTarget(ghost=f"{j}-{i}", action="ignore") for j, i in STRUCTURE.pairs]
    with pytest.raises(ProjectError, match="weight above 0"):
        solve_colors(color_problem(project(*ghost_targets), "film")[0])


def test_the_map_shows_the_colours_of_its_two_mirrors():
    n_d, bounds = indices_of(LENS), Bounds()
    picture = pair_map(n_d, (4, 1), bounds)
    assert picture.shape == (186, 186, 3)
    assert np.allclose(np.linalg.norm(picture, axis=2), 1.0)
    one = reflectances("quarter-wave", n_d[4], n_d[5], np.array([[400.0]]))[0]
    both = one * reflectances("quarter-wave", n_d[1], n_d[2], np.array([[480.0]]))[0]
    assert np.allclose(picture[10, 50], both / np.linalg.norm(both))


def test_judged_by_the_eye_colours_come_nearer_to_the_eye():
    # colours out of reach of three quarter waves
    ghost_targets = tuple(
        GhostTarget(ghost=ghost, color=color)
        for ghost, color in (("4-1", (1.0, 0.1, 0.05)), ("8-6", (0.1, 0.2, 1.0)), ("1-0", (0.2, 1.0, 0.2)))
    )
    project = Project(
        lens="heliar-tronnier", lights=(Light(field_deg=(5.0, 5.0)),), design=Design(ghost_targets=ghost_targets)
    )
    sums = []
    for perceptual in (False, True):
        problem, _ = color_problem(project, "quarter-wave", perceptual=perceptual)
        found = solve_colors(problem, starts=8)
        sums.append((perceived_differences(problem, found.colors) ** 2).sum())
        if perceptual:
            assert found.cost == pytest.approx(sums[-1], rel=1e-6)
    assert sums[1] < sums[0]


def test_curves_of_one_surface_are_the_textbooks():
    n_d = indices_of(LENS)
    across, reflectance = channel_curves(n_d, 0, Bounds())
    # a quarter wave reflects least at its centre: ((n0 ns - n1^2) / (n0 ns + n1^2))^2 with magnesium fluoride
    n = n_d[1]
    least = ((n - 1.38**2) / (n + 1.38**2)) ** 2
    for channel, wavelength in enumerate(WAVELENGTHS_NM):
        at = int(np.argmin(reflectance[:, channel]))
        assert across[at] == pytest.approx(wavelength, abs=2.0)
        assert reflectance[at, channel] == pytest.approx(least, abs=2e-5)
    assert "row 0" in channel_chart(n_d, 0, Bounds()).title


def test_the_chart_draws_each_channel_in_its_colour():
    """The curve that ends at its channel's reflectance at the last centre wavelength has that channel's hue."""
    n_d = indices_of(LENS)
    across, reflectance = channel_curves(n_d, 0, Bounds())
    drawn = channel_chart(n_d, 0, Bounds())
    # curves are the polylines with one point per wavelength
    curves = [mark for mark in drawn.marks if isinstance(mark, Line) and len(mark.points) >= len(across)]
    assert len(curves) == 3
    # y points down in the chart, so the highest end of a curve is the largest reflectance
    order = np.argsort([-curve.points[-1][1] for curve in curves])
    for curve, channel in zip([curves[k] for k in order], np.argsort(reflectance[-1]), strict=True):
        red_green_blue = [int(curve.colour[k : k + 2], 16) for k in (1, 3, 5)]
        assert int(np.argmax(red_green_blue)) == channel


@pytest.mark.parametrize(
    ("kind", "bounds", "fixed"),
    [
        ("film", {"film_index": (1.38, 1.38)}, (0, 1.38)),
        ("film", {"film_nm": (100.0, 100.0)}, (1, 100.0)),
        ("quarter-wave", {"center_wavelength_nm": (550.0, 550.0)}, (0, 550.0)),
    ],
)
def test_a_bound_may_be_a_single_value(kind, bounds, fixed):
    """Divisions by its width used to end in a traceback."""
    values = np.full((len(mirrors_of(STRUCTURE)), 1), 500.0)
    if kind == "film":
        values = np.tile([1.6, 120.0], (len(values), 1))
    problem = replace(problem_for(values, kind), bounds=Bounds(**bounds))
    found = solve_colors(problem, starts=1)
    column, value = fixed
    worn = found.values[:, 1] > 0.0 if kind == "film" else np.ones(len(values), dtype=bool)
    assert np.isfinite(found.cost)
    assert found.values[worn, column] == pytest.approx(np.full(worn.sum(), value))
