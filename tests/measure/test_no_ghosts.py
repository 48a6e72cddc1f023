"""Photographs without ghosts: star, haze, veil and noise, while the light goes out of the picture."""

from dataclasses import replace

import numpy as np
import pytest
from star_run import HEAD
from synthetic_camera import Setup, expose, poses, scale_of, truth_of

from flarewright.cli.app import run as command
from flarewright.io.ghost_model_file import read_ghost_model

SETUP = Setup(size_px=(180, 120), angles_deg=tuple(3.0 * k for k in range(8)), pitch_deg=0.3, axis_offset_px=(2, -1))


@pytest.fixture(scope="module")
def ghostless():
    scale = scale_of(SETUP)
    truths = [truth_of(SETUP, pose, scale) for pose in poses(SETUP)]
    return [truth.total - truth.ghosts for truth in truths]


@pytest.mark.parametrize("seed", [0, 1])
def test_no_ghosts_are_found_where_there_are_none(ghostless, tmp_path, seed):
    camera = replace(SETUP, seed=seed)
    lines = []
    for pose, light in zip(poses(camera), ghostless, strict=True):
        for j, seconds in enumerate(camera.exposures_s):
            name = f"{pose.number}-{j}.npy"
            np.save(tmp_path / name, expose(camera, light, seconds, pose.brightness[j], (pose.number, j)))
            lines.append(f"{name},{pose.nominal_deg:g},{seconds!r},100,8,light\n")
    (tmp_path / "captures.csv").write_text(HEAD + "".join(lines))
    (tmp_path / "camera.json").write_text(f'{{"black_level": {camera.black}, "white_level": {camera.white}}}')
    run = tmp_path / "run"
    assert (
        command(["measure", "run", str(tmp_path / "captures.csv"), "-o", str(run), "--stages", "merge,find,fit"]) == 0
    )
    assert read_ghost_model(run / "found.json").ghosts == ()
    assert read_ghost_model(run / "model.json").ghosts == ()
