"""Paths with common beginnings, traced together, give the same result as each traced alone."""

from dataclasses import replace

import numpy as np
import pytest

from flarewright.kernels.tracing.sequential import ALIVE, STOP_X, X
from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.optics.lens.paths import ghost_paths, joined_path_steps
from flarewright.optics.rays.bundle import trace_points
from flarewright.optics.rays.pupil_region import cells_across, find_region, first_look, front_box
from flarewright.render.ghosts.pupil_search import GROUP_SIZE, group_by_mirror
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots


@pytest.fixture(scope="module")
def shot_and_paths():
    project = Project(
        lens="heliar-tronnier", lights=(Light(field_deg=(9.0, 5.0)),), camera=Camera(size_px=(160, 90)),
        quality=Quality(wavelengths=3), output=Output(starburst=False),
    )  # fmt: skip
    settled = resolve_project(project)
    return make_shots(settled, make_opening(settled, None))[0], ghost_paths(settled.lens)


@pytest.mark.parametrize("most", [3, GROUP_SIZE])
def test_groups_hold_every_path_once_in_order(shot_and_paths, most, monkeypatch):
    monkeypatch.setattr("flarewright.render.ghosts.pupil_search.GROUP_SIZE", most)
    _, paths = shot_and_paths
    groups = group_by_mirror(paths)
    assert [path for group in groups for path in group] == list(paths)
    # the last of eight surfaces reflects to seven others
    assert max(map(len, groups)) == min(most, 7)
    assert all(len({path.first_reflection for path in group}) == 1 for group in groups)
    # whatever is left out by hand, and in whatever order
    assert [len(group) for group in group_by_mirror(paths[::-1])] == [1] * len(paths)
    assert [path for group in group_by_mirror(paths[::3]) for path in group] == list(paths[::3])


def test_each_path_of_a_group_is_traced_as_if_alone(shot_and_paths):
    shot, paths = shot_and_paths
    tilt, packed = shot.incidence.tilt, shot.packed
    box, (nx, ny) = front_box(packed, tilt), cells_across(packed, (24, 48))
    x, y = np.linspace(box[0], box[1], nx + 1), np.linspace(box[2], box[3], ny + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2).reshape(-1, 2)
    crossings, ended = set(), 0
    for group in group_by_mirror(paths):
        data = first_look(packed, group[::-1], tilt, quick=True)[::-1]
        for path, mine in zip(group, data, strict=True):
            alone = trace_points(packed, 1, path, tilt, points)
            crossings.add(path.stop_crossings)
            lives = alone[:, ALIVE] > 0.0
            np.testing.assert_array_equal(mine[:, ALIVE] > 0.0, lives)
            # weights are typical of all wavelengths
            same = [k for k in range(alone.shape[1]) if k != 2]
            np.testing.assert_allclose(mine[lives][:, same], alone[lives][:, same], rtol=1e-6, atol=1e-9)
            # the last row that a failed ray reached
            np.testing.assert_array_equal(mine[~lives, X], alone[~lives, X])
            assert not mine[:, STOP_X + 2 * path.stop_crossings :].any()
            ended += int((~lives).sum())
            found = [find_region(packed, path, tilt, shot.opening.radius, quick=True, traced=t) for t in (None, mine)]
            assert (found[0] is None) == (found[1] is None)
            if found[0] is not None:
                np.testing.assert_allclose(found[1].box, found[0].box, rtol=1e-9, atol=1e-9)
                assert found[1].flux == pytest.approx(found[0].flux, rel=1e-9)
    assert crossings == {1, 3}
    assert ended > 1000


def test_paths_that_turn_back_earlier_come_later(shot_and_paths):
    _, paths = shot_and_paths
    group = next(group for group in group_by_mirror(paths) if len(group) > 2)
    with pytest.raises(ValueError, match="diverges from"):
        joined_path_steps(group)


def test_one_colour_of_a_region_holds_all_light_of_it(shot_and_paths):
    """Searched on the whole front, and around the region of a light beside."""
    shot, paths = shot_and_paths
    packed, tilt, radius = shot.packed, shot.incidence.tilt, shot.opening.radius
    x0, x1, y0, y1 = front_box(packed, tilt)
    points = np.random.default_rng(1).uniform((x0, y0), (x1, y1), (20_000, 2))
    lit, beside = 0, 0
    for path in paths:
        rays = trace_points(packed, 1, path, tilt, points)
        passing = (rays[:, ALIVE] > 0.0) & (rays[:, 3] <= 1.0)
        for column in range(STOP_X, STOP_X + 2 * path.stop_crossings, 2):
            passing &= np.hypot(rays[:, column], rays[:, column + 1]) <= radius
        whole = find_region(packed, path, tilt, radius, one_color=True)
        near = find_region(packed, path, tilt + 2e-3, radius)
        found = find_region(packed, path, tilt, radius, one_color=True, beside=near)
        beside += whole is not None and found is not None and not np.array_equal(found.box, whole.box)
        for region in (whole, found) if passing.any() else ():
            assert region is not None
            low, high = region.box[0::2], region.box[1::2]
            assert ((points[passing] >= low) & (points[passing] <= high)).all()
            lit += int(passing.sum())
    assert lit > 1000
    assert beside > 10


def test_a_region_beside_that_lies_outside_the_front_changes_nothing(shot_and_paths):
    """A light of 60 degrees ended in a division by zero: the front of one side lies beside the region of the other."""
    shot, paths = shot_and_paths
    sought = (shot.packed, paths[3], shot.incidence.tilt, shot.opening.radius)
    alone = find_region(*sought, one_color=True)
    assert alone is not None
    for place in (-500.0, 500.0):
        beside = replace(alone, box=alone.box + place)
        found = find_region(*sought, one_color=True, beside=beside)
        assert found is not None
        assert np.array_equal(found.box, alone.box)
