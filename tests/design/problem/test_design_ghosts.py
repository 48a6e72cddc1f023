"""The forward model of design, compared with the matrices of optics, finite differences, and drafts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flarewright as fw
from flarewright.design.problem.ghosts import differentiate, evaluate, placed_ghosts
from flarewright.design.problem.prescription import Structure, structure_of, vector_of
from flarewright.errors import LensError
from flarewright.kernels.design import ghosts as dg
from flarewright.kernels.design import vignetting
from flarewright.kernels.design.cost import irradiance_of_ghosts
from flarewright.kernels.jit.decorators import for_python
from flarewright.model import Lines
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order, path_matrices, vertex_positions
from flarewright.optics.lens.paths import ghost_path, ghost_paths
from flarewright.render.scene.resolve import load_lens

reduce_rows, sight_row = for_python(dg.reduce_rows), for_python(vignetting.sight_row)
fill_mirrors_of_ghosts = for_python(vignetting.fill_mirrors_of_ghosts)

LENSES = ("heliar-tronnier", "canon-28-80", "tessar-brendel", "nikon-28-75")


def vector(lens):
    order = first_order(lens)
    return vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance)


@pytest.mark.parametrize("name", LENSES)
def test_ghosts_are_those_of_the_matrices(name):
    lens = load_lens(name)
    structure, q = structure_of(lens), vector(lens)
    assert set(structure.pairs) == {
        (path.first_reflection, path.second_reflection) for path in ghost_paths(lens, "same-side")
    }
    sensor = vertex_positions(lens)[-1] + q[structure.rows]
    for entrance in (100.0, 30.0, 1.0):
        values = evaluate(structure, q[None], entrance)[0]
        for (j, i), value in zip(structure.pairs, values, strict=True):
            (ma,), total = path_matrices(lens, ghost_path(lens, j, i), D_LINE_NM, sensor)
            # the edge with the smaller image bounds a ghost; trace a ray through the ghost's middle
            by_stop, by_entrance = abs(total[0, 0] / ma[0, 0]) * q[0] / 2, abs(total[0, 0]) * entrance / 2
            y = -ma[0, 1] / ma[0, 0] if by_stop <= by_entrance else 0.0
            assert value[dg.PLACE] == pytest.approx(total[0, 0] * y + total[0, 1], rel=1e-8, abs=1e-8)
            assert abs(value[dg.RADIUS]) == pytest.approx(min(by_stop, by_entrance), rel=1e-8)
            assert value[dg.SCALE] == pytest.approx(total[0, 0], rel=1e-8)
            assert value[dg.BOUND] == (by_stop > by_entrance)
            # at the reach the two discs touch
            apart = abs(total[0, 0] * ma[0, 1] / ma[0, 0]) * value[dg.REACH]
            assert apart == pytest.approx(by_stop + by_entrance, rel=1e-8)


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("entrance", [100.0, 12.0, 0.5])
def test_derivatives_are_those_of_differences(name, entrance):
    lens = load_lens(name)
    structure, q = structure_of(lens), vector(lens)
    found = differentiate(structure, q, entrance)
    rows = structure.rows
    # the stop is flat and in air: no variable
    fixed = {1 + rows + structure.stop, 1 + 2 * rows + structure.stop}
    for v in set(range(len(q))) - fixed:
        step = 1e-6 * max(abs(q[v]), 1e-3)
        sides = []
        for way in (1.0, -1.0):
            moved = q.copy()
            moved[v] += way * step
            sides.append(differentiate(structure, moved, entrance))
        for exact, there, here in (
            (found.place, sides[0].values[:, dg.PLACE], sides[1].values[:, dg.PLACE]),
            (found.radius, sides[0].values[:, dg.RADIUS], sides[1].values[:, dg.RADIUS]),
            (found.scale, sides[0].values[:, dg.SCALE], sides[1].values[:, dg.SCALE]),
            (found.log_irradiance_by, sides[0].log_irradiance, sides[1].log_irradiance),
        ):
            measured = (there - here) / (2.0 * step)
            assert np.abs(measured - exact[:, v]).max() <= 3e-6 * np.abs(exact[:, v]).max() + 1e-9


@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.integers(0, 8))
@settings(max_examples=40, deadline=None)
def test_any_prescription_has_derivatives_of_differences(seed, rows, stop):
    stop %= rows
    random = np.random.default_rng(seed)
    glass = random.random(rows) < 0.7
    glass[[stop, -1]] = False
    glass[stop - 1 if stop else stop] = False
    structure = Structure(stop, tuple(bool(g) for g in glass))
    if not structure.pairs:
        return
    q = np.concatenate([
        [random.uniform(1.0, 20.0)], random.uniform(0.5, 20.0, rows), random.uniform(-0.05, 0.05, rows),
        np.where(glass, random.uniform(1.4, 2.0, rows), 1.0),
    ])  # fmt: skip
    q[1 + rows + stop] = 0.0
    found = differentiate(structure, q, 100.0)
    assert np.allclose(found.values, evaluate(structure, q[None], 100.0)[0], rtol=1e-12)
    way = random.normal(size=len(q)) * 1e-6 * np.maximum(np.abs(q), 1e-3)
    way[[1 + rows + stop, 1 + 2 * rows + stop]] = 0.0
    there, here = differentiate(structure, q + way, 100.0), differentiate(structure, q - way, 100.0)
    for column, exact in ((dg.PLACE, found.place), (dg.RADIUS, found.radius), (dg.SCALE, found.scale)):
        bound = found.values[:, dg.BOUND]
        same = (there.values[:, dg.BOUND] == bound) & (here.values[:, dg.BOUND] == bound)
        measured, reported = (there.values[:, column] - here.values[:, column]) / 2.0, exact @ way
        least = 1e-9 * np.abs(exact * way).max() + 1e-12 * np.abs(found.values[:, column]).max()
        assert np.all(np.abs(measured - reported)[same] <= 1e-4 * np.abs(exact * way).max(axis=1)[same] + least)


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("entrance", [100.0, 0.5])
def test_the_reach_has_derivatives_of_differences(name, entrance):
    lens = load_lens(name)
    structure, q = structure_of(lens), vector(lens)
    rows = structure.rows
    # the stop is flat and in air
    way = np.random.default_rng(1).normal(size=len(q)) * 1e-6 * np.maximum(np.abs(q), 1e-3)
    way[[1 + rows + structure.stop, 1 + 2 * rows + structure.stop]] = 0.0
    sides = [1.0 / evaluate(structure, (q + sign * way)[None], entrance)[0][:, dg.REACH_THESIS] for sign in (1.0, -1.0)]
    work, row = np.empty((dg.WORK_ROWS, rows)), np.empty(len(q))
    reduce_rows(q, rows, work)
    for g, (j, i) in enumerate(structure.pairs):
        sight_row(q, rows, structure.stop, j, i, entrance, work, np.empty(dg.TRAIL * rows), np.zeros((4, rows)), row)
        assert row @ way == pytest.approx(
            (sides[0][g] - sides[1][g]) / 2.0, rel=1e-5, abs=1e-7 * np.abs(row * way).max()
        )
    between = np.empty((len(structure.pairs), 2), np.int64)
    fill_mirrors_of_ghosts(structure.stop, rows, structure.mirrors, between)
    assert [(int(j), int(i)) for j, i in between] == list(structure.pairs)


def test_a_ghost_lands_where_the_draft_draws_it_and_is_as_bright():
    lens = load_lens("heliar-tronnier")
    field, size = 4.0, (400, 400)
    light = fw.Light(field_deg=(field, 0.0), spectrum=Lines(lines=((587.56, 1.0),)))
    project = fw.Project(
        lens="heliar-tronnier", f_number=16.0, lights=[light],
        coating=fw.Everywhere(coating=fw.Bare()), camera=fw.Camera(size_px=size, sensor_mm=(40.0, 40.0)),
        quality=fw.Quality(mode="draft", wavelengths=1, paths="same-side"), iris=fw.Iris(blades=0),
        output=fw.Output(layers="ghosts", starburst=False),
    )  # fmt: skip
    layers = {layer.name: layer for layer in fw.render(project).layers}
    ghosts = placed_ghosts(lens, f_number=16.0)
    order = first_order(lens, 16.0)
    light = differentiate(
        structure_of(lens), vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance), 29.0
    ).log_irradiance
    slope, seen, levels = np.tan(np.radians(field)), 0, []
    for ghost, log_irradiance in zip(ghosts, light, strict=True):
        layer = layers.get(f"ghost.{ghost.first_reflection}-{ghost.second_reflection}")
        x = ghost.place * slope
        if layer is None or abs(x) + abs(ghost.radius) > 19.0 or abs(ghost.radius) < 0.5 or slope > ghost.reach:
            continue
        flux = layer.pixels.sum(axis=2)
        left, _, width, _ = layer.window
        columns = (np.arange(width) + left + 0.5) / 10.0 - 20.0
        centre = (flux.sum(axis=0) * columns).sum() / flux.sum()
        spread = np.sqrt((flux.sum(axis=0) * (columns - centre) ** 2).sum() / flux.sum())
        assert centre == pytest.approx(x, abs=0.05 + 0.01 * abs(x))
        # a uniform disc's standard deviation along a line is half its radius
        assert 2.0 * spread == pytest.approx(abs(ghost.radius), rel=0.05)
        levels.append(np.median(flux[flux > 0.5 * flux.max()]) / np.exp(log_irradiance))
        seen += 1
    assert seen >= 4
    assert max(levels) / min(levels) < 1.05


@pytest.mark.parametrize("name", LENSES[:2])
def test_irradiance_alone_is_that_with_derivatives(name):
    lens = load_lens(name)
    structure, q = structure_of(lens), vector(lens)
    known = differentiate(structure, q, 100.0)
    light = np.empty(len(structure.pairs))
    irradiance_of_ghosts(q, structure.stop, structure.mirrors, known.values, light)
    assert light == pytest.approx(known.log_irradiance, rel=1e-12)


def test_what_design_cannot_do_is_said():
    lens = load_lens("heliar-tronnier")
    rows = list(lens.rows)
    rows[4] = rows[4].replace(medium=rows[3].medium)
    with pytest.raises(LensError, match="stands in glass"):
        structure_of(lens.replace(rows=tuple(rows)))
    rows = list(lens.rows)
    rows[0] = rows[0].replace(curvature_x=0.0)
    with pytest.raises(LensError, match="of revolution"):
        placed_ghosts(lens.replace(rows=tuple(rows)))
