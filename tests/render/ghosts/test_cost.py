"""`render --profile`: the counts are those of the drawn grids, and timing changes no pixel."""

import json

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.kernels.tracing.adaptive_grid import REASONS
from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.optics.lens.paths import ghost_path
from flarewright.optics.rays.bundle import Bundle, Refinement, trace_grid
from flarewright.render.ghosts.cost import STAGES, covered_px
from flarewright.render.ghosts.traced_ghosts import find_final
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots


def project(**quality):
    return Project(
        lens="heliar-tronnier", f_number=8.0, lights=(Light(field_deg=(8.0, 4.0)),), camera=Camera(size_px=(64, 36)),
        quality=Quality(wavelengths=3, **quality), output=Output(starburst=False),
    )  # fmt: skip


@pytest.fixture(scope="module")
def profiled():
    return render(project(bridge=False, ringing="off"), threads=1, profile=True)


def square(columns):
    """Return a bundle of two triangles over a square of 4 x 2 mm, whose left side is at `columns` pixels."""
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]])
    data = np.zeros((4, 5))
    # the upright picture is the sensor turned by 180 degrees
    data[:, 0], data[:, 1], data[:, 4] = -corners[:, 0], corners[:, 1], 1.0
    return Bundle(None, corners, np.array([[0, 1, 2], [0, 2, 3]]), {0: data}, 1), np.array([columns, 1.0, 5.0, 5.0])


@pytest.mark.parametrize(("columns", "area"), [(1.0, 200.0), (-30.0, 0.0), (-12.0, 100.0)])
def test_the_pixels_are_those_of_triangles_in_the_picture(columns, area):
    bundle, place = square(columns)
    assert covered_px(bundle, bundle.traced[0], np.eye(2), place, (40, 40)) == pytest.approx(area)


def test_rays_that_end_cover_nothing():
    bundle, place = square(1.0)
    bundle.traced[0][1, 4] = 0.0
    assert covered_px(bundle, bundle.traced[0], np.eye(2), place, (40, 40)) == pytest.approx(100.0)


def test_a_profile_changes_no_pixel_and_counts_each_ghost_once(profiled):
    plain = render(project(bridge=False, ringing="off"), threads=2)
    assert plain.profile is None
    np.testing.assert_array_equal(profiled.layers[0].pixels, plain.layers[0].pixels)
    costs = profiled.profile.ghosts
    assert len(costs) == len({cost.path for cost in costs}) > 5
    assert [cost.total for cost in costs] == sorted((cost.total for cost in costs), reverse=True)
    for cost in costs:
        assert set(cost.seconds) <= set(STAGES)
        assert cost.drawings <= 3
        assert set(cost.halved) == set(REASONS)
        # a cell has four to eight triangles, on each side of the meridian
        assert 8 * cost.cells * cost.drawings <= cost.triangles <= 16 * cost.cells * cost.drawings
    assert profiled.profile.search_s > 0.0


def test_counts_do_not_depend_on_threads(profiled):
    other = render(project(bridge=False, ringing="off"), threads=2, profile=True)

    def counts(rendering):
        return {
            cost.path: (cost.rays, cost.cells, cost.drawings, cost.triangles, cost.fragments, cost.detail, cost.halved)
            for cost in rendering.profile.ghosts
        }

    assert counts(other) == counts(profiled)


def test_a_finer_grid_is_halved_more_often_where_places_bend():
    fast = project().replace(lens="takumar-50-f1.4", f_number=1.4, lights=(Light(field_deg=(-9.0, 5.0)),))
    settled = resolve_project(fast)
    shot = make_shots(settled, make_opening(settled, None))[0]
    path = ghost_path(load_lens("takumar-50-f1.4"), 5, 2)
    region = find_final(shot, path).region
    grids = [
        trace_grid(shot.packed, path, shot.incidence.tilt, (shot.opening.radius, shot.opening.inner), region, fine)
        for fine in (Refinement(1e-6), Refinement(4.0), Refinement(40.0))
    ]
    bends = [int(grid.halved[REASONS.index("bend of places")]) for grid in grids]
    assert bends[0] == 0
    assert bends[0] <= bends[1] < bends[2], bends
    triangles = [len(grid.triangles) for grid in grids]
    assert triangles[0] <= triangles[1] < triangles[2], triangles


SMALL = [
    "render", "triplet-pestrecov", "--light", "8,4", "--size", "32x18", "--wavelengths", "3", "--no-starburst",
    "--no-png",
]  # fmt: skip


def test_the_command_prints_a_table_and_one_json_object(tmp_path, capsys):
    assert run([*SMALL, "--profile", "--json", "-o", str(tmp_path / "a.exr")]) == 0
    out, err = capsys.readouterr()
    profile = json.loads(out)["profile"]
    assert profile["ghosts"][0]["path"] in err
    assert "cells halved" in err
    assert sum(ghost["drawings"] for ghost in profile["ghosts"]) > 5


@pytest.mark.parametrize("quality", ["draft", "reference"])
def test_other_qualities_have_no_profile(quality, tmp_path, capsys):
    output = tmp_path / "a.exr"
    assert run([*SMALL, "--profile", "--quality", quality, "-o", str(output)]) == 2
    assert f"--profile is for final quality, not for {quality}; omit it" in capsys.readouterr().err
    assert not output.exists()
