"""Photographs without ghosts: star, haze, veil and noise, while the light stays in the picture or goes out of it."""

from dataclasses import replace

import numpy as np
import pytest
from star_run import ANGLES, HEAD, light_px, shoot, star
from synthetic_camera import Setup, expose, poses, scale_of, truth_of

from flarewright.cli.app import run as command
from flarewright.io.ghost_model_file import read_ghost_model

SETUP = Setup(size_px=(180, 120), angles_deg=tuple(3.0 * k for k in range(8)), pitch_deg=0.3, axis_offset_px=(2, -1))
FEW = replace(SETUP, size_px=(120, 80), angles_deg=(0.0, 5.0, 10.0, 15.0, 20.0, 25.0))
# the light goes no farther than a third of the picture's width
NEAR = replace(
    SETUP, lens="double-gauss-tronnier", size_px=(240, 160), angles_deg=tuple(1.0 * k for k in range(14)), seed=0
)


def ghosts_found(captures, run, *more):
    """Run the stages that find and fit, and return how many ghosts each has."""
    assert command(["measure", "run", str(captures), "-o", str(run), "--stages", "merge,find,fit", *more]) == 0
    return tuple(len(read_ghost_model(run / name).ghosts) for name in ("found.json", "model.json"))


def photographed(folder, camera, truths):
    lines = []
    for pose, light in zip(poses(camera), truths, strict=True):
        for j, seconds in enumerate(camera.exposures_s):
            name = f"{pose.number}-{j}.npy"
            np.save(folder / name, expose(camera, light, seconds, pose.brightness[j], (pose.number, j)))
            lines.append(f"{name},{pose.nominal_deg:g},{seconds!r},100,8,light\n")
    (folder / "captures.csv").write_text(HEAD + "".join(lines))
    (folder / "camera.json").write_text(f'{{"black_level": {camera.black}, "white_level": {camera.white}}}')
    return folder / "captures.csv"


def ghostless(setup):
    """Return what a setup's lens shows without its ghosts."""
    scale = scale_of(setup)
    # all but one are not drawn in the first place
    few = replace(setup, paths=("1-0",))
    truths = [truth_of(few, pose, scale) for pose in poses(setup)]
    return [truth.total - truth.ghosts for truth in truths]


def test_no_ghosts_are_found_where_there_are_none_in_small_pictures(tmp_path):
    captures = photographed(tmp_path, FEW, ghostless(FEW))
    assert ghosts_found(captures, tmp_path / "run", "--no-residual") == (0, 0)


@pytest.fixture(scope="module")
def going_out():
    return ghostless(SETUP)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_no_ghosts_are_found_where_there_are_none(going_out, tmp_path, seed):
    captures = photographed(tmp_path, replace(SETUP, seed=seed), going_out)
    assert ghosts_found(captures, tmp_path / "run") == (0, 0)


def test_what_a_star_leaves_around_it_is_no_ghost(tmp_path, capsys):
    captures = shoot(tmp_path, {angle: star(light_px(angle)) for angle in (0.0, 1.5, 3.0, 4.5)})
    assert ghosts_found(captures, tmp_path / "run", "--no-residual") == (0, 0)
    # there is something that a search takes for one
    assert "is no more than halo and star leave around the light: left out" in capsys.readouterr().err


@pytest.mark.slow
def test_what_a_star_leaves_around_it_at_more_constellations_is_no_ghost(tmp_path):
    captures = shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    assert ghosts_found(captures, tmp_path / "run") == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("haze", [0.05, 0.5])
def test_what_haze_leaves_around_a_light_that_stays_in_the_picture_is_no_ghost(tmp_path, haze):
    camera = replace(NEAR, haze=haze)
    assert ghosts_found(photographed(tmp_path, camera, ghostless(camera)), tmp_path / "run") == (0, 0)
