"""The synthetic camera, on which other tests rely, matches its specification."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_camera import (
    Setup,
    dark_mm,
    expose,
    ghosts_of,
    ideal_frame,
    light_places,
    make,
    poses,
    project_of,
    scale_of,
    truth_of,
)

from flarewright.render.scene.direct_image import direct_image
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

SMALL = Setup(size_px=(90, 60), angles_deg=(0.0, 6.0, 12.0), sensor_width_mm=36.0, axis_offset_px=(1, -1))


@pytest.fixture(scope="module")
def scene():
    scale = scale_of(SMALL)
    pose = poses(SMALL)[1]
    return pose, scale, truth_of(SMALL, pose, scale)


def test_photographs_have_the_mean_and_variance_of_photon_and_read_noise(scene):
    _, _, truth = scene
    time, count = SMALL.exposures_s[-1], 24
    shots = np.stack([expose(SMALL, truth.total, time, 1.0, (k,)) for k in range(count)])
    stack = shots.astype(np.float64) - SMALL.black
    full, gain = SMALL.white - SMALL.black, SMALL.electrons_per_unit
    units = truth.total.astype(np.float64) * time * full
    free = units < 0.9 * full
    variance = units / gain + (SMALL.read_noise / gain) ** 2 + 1.0 / 12.0
    z = ((stack.mean(axis=0) - units) / np.sqrt(variance / count))[free]
    assert abs(z.mean()) < 4.0 / np.sqrt(z.size)
    assert z.std() == pytest.approx(1.0, abs=0.05)
    assert np.mean((stack.var(axis=0, ddof=1) / variance)[free]) == pytest.approx(1.0, abs=0.02)
    assert (stack[:, units > 1.2 * full] == full).all()


def test_the_same_seed_makes_the_same_photographs_and_another_does_not(scene, tmp_path, monkeypatch):
    _, _, truth = scene
    assert np.array_equal(expose(SMALL, truth.total, 1.0, 1.0, (3,)), expose(SMALL, truth.total, 1.0, 1.0, (3,)))
    other = expose(replace(SMALL, seed=5), truth.total, 1.0, 1.0, (3,))
    assert not np.array_equal(expose(SMALL, truth.total, 1.0, 1.0, (3,)), other)
    assert poses(SMALL) == poses(SMALL) != poses(replace(SMALL, seed=5))
    monkeypatch.setenv("FLAREWRIGHT_SYNTHETIC_CACHE", str(tmp_path / "kept"))
    one = replace(SMALL, angles_deg=(6.0,))
    first = make(one)
    stamp = (first / "truth.json").stat().st_mtime_ns
    assert make(one) == first
    assert (first / "truth.json").stat().st_mtime_ns == stamp
    assert len(list(first.glob("capture-*.npy"))) == 3


def test_the_light_is_where_the_star_is_and_ghosts_where_their_light_is(scene):
    pose, scale, truth = scene
    star = (truth.total - truth.ghosts)[..., 1]
    y, x = np.unravel_index(star.argmax(), star.shape)
    assert (x + 0.5, y + 0.5) == pytest.approx(truth.light_px, abs=1.0)
    ghosts = ghosts_of(SMALL, pose, scale)
    assert sum(one.flux[1] for one in ghosts) == pytest.approx(truth.ghosts[..., 1].sum(), rel=1e-3)
    for one in ghosts:
        assert np.abs(one.outline_px.mean(axis=0) - one.centre_px).max() < 5.0


def test_a_perfect_table_has_nominal_angles_and_an_ideal_frame_is_the_truth(scene):
    perfect = poses(SMALL.steady)
    assert [one.constellation_deg for one in perfect] == pytest.approx(SMALL.angles_deg)
    assert [one.field_deg[1] for one in perfect] == pytest.approx([0.0] * 3)
    pose, _, truth = scene
    frame = ideal_frame(SMALL, truth, pose)
    z = ((frame.radiance - truth.total) / np.sqrt(frame.variance))[frame.valid]
    assert z.std() == pytest.approx(1.0, abs=0.03)
    assert frame.valid.mean() > 0.9


@pytest.mark.slow
def test_truth_is_the_same_at_two_densities_of_rays():
    coarse = replace(SMALL, lens="flektogon-35", quality="final", size_px=(90, 60), f_number=5.6, wavelengths=1)
    fine = replace(coarse, tolerance_px=0.06)
    pose, scale = poses(coarse)[1], scale_of(coarse)
    one, other = (truth_of(setup, pose, scale).ghosts.astype(np.float64) for setup in (coarse, fine))
    assert not np.array_equal(one, other)
    assert np.sqrt(np.mean((one - other) ** 2) / np.mean(other**2)) < 0.01
    assert one.sum() == pytest.approx(other.sum(), rel=2e-3)


def test_a_light_hidden_by_rims_has_an_extrapolated_position():
    setup = Setup(
        lens="takumar-50-f1.4", f_number=5.6, angles_deg=tuple(range(2, 30, 3)), size_px=(90, 60), tilt_deg=0.0,
        axis_offset_px=(1, -1), wander_deg=0.0, pitch_deg=0.0, pitch_wander_deg=0.0,
    )  # fmt: skip
    places = []
    for pose in poses(setup):
        settled = resolve_project(project_of(setup, pose, "passes"))
        image = direct_image(settled.lens, make_shots(settled, make_opening(settled, None))[0])
        places.append((*image.position_mm, *dark_mm(setup, pose), bool(image.throughput_mm2.any())))
    table = np.array(places)
    lit = table[:, 4] > 0.0
    assert lit[:6].all()
    # the projection fits its samples to less than one pixel of 90, and extrapolates beyond them
    assert np.hypot(*(table[lit, :2] - table[lit, 2:4]).T).max() < 36.0 / 90.0
    assert (np.diff(table[:, 2]) > 0.0).all()
    # a rendering places a dark light at its ideal position, not at the centre
    assert (table[:, 0] > 0.0).all()


def test_the_last_rays_of_a_light_do_not_define_its_position(scene):
    pose, _, _ = scene

    def places(passed):
        reported = {"direct_throughput_mm2": [passed, 0.5 * passed], "direct_position_mm": (-9.0, 4.0)}
        return light_places(SMALL, pose, SimpleNamespace(summary={"lights": [reported]}))

    image = (0.5 * 90 + 1 - 9.0 * 2.5, 0.5 * 60 - 1 - 4.0 * 2.5)
    most = truth_of(SMALL, pose, 1.0).light_px
    assert places(1e4) == (image, image)
    light, there = places(1e-3)
    assert there == image
    # the position follows the projection of the lens, as for a visible light
    assert light == pytest.approx(most, abs=0.2)
    assert places(0.0) == (light, light)
