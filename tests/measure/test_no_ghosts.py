"""Photographs without ghosts: star, haze, veil and noise, while the light stays in the picture or leaves it."""

from dataclasses import replace

import numpy as np
import pytest
from star_run import ANGLES, HEAD, light_px, shoot, star
from synthetic_camera import Setup, expose, poses, scale_of, truth_of

from flarewright.cli.app import run as command
from flarewright.io.measurement.ghost_model_file import read_ghost_model
from flarewright.measure.detection import matching_pursuit

SETUP = Setup(size_px=(180, 120), angles_deg=tuple(3.0 * k for k in range(8)), pitch_deg=0.3, axis_offset_px=(2, -1))
FEW = replace(SETUP, size_px=(120, 80), angles_deg=(0.0, 5.0, 10.0, 15.0, 20.0, 25.0))
# the light moves at most a third of the picture's width off the axis
NEAR = replace(
    SETUP, lens="double-gauss-tronnier", size_px=(240, 160), angles_deg=tuple(1.0 * k for k in range(14)), seed=0
)


def ghosts_found(captures, run, *more):
    """Run the stages find and fit; return the number of ghosts of each."""
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
    """Return a picture of the lens of a setup without its ghosts."""
    scale = scale_of(setup)
    # draw only one ghost, which is then removed
    few = replace(setup, paths=("1-0",))
    truths = [truth_of(few, pose, scale) for pose in poses(setup)]
    return [truth.total - truth.ghosts for truth in truths]


@pytest.mark.slow
def test_small_pictures_without_ghosts_have_none(tmp_path):
    captures = photographed(tmp_path, FEW, ghostless(FEW))
    assert ghosts_found(captures, tmp_path / "run", "--no-residual") == (0, 0)


@pytest.fixture(scope="module")
def leaving_the_picture():
    return ghostless(SETUP)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_pictures_without_ghosts_have_none(leaving_the_picture, tmp_path, seed):
    captures = photographed(tmp_path, replace(SETUP, seed=seed), leaving_the_picture)
    assert ghosts_found(captures, tmp_path / "run") == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("searched", [False, True], ids=["rims", "also crescents"])
def test_residual_light_of_a_star_is_no_ghost(searched, tmp_path, capsys, monkeypatch):
    if not searched:
        monkeypatch.setattr(matching_pursuit, "_crescents", lambda *_: [])
    captures = shoot(tmp_path, {angle: star(light_px(angle)) for angle in (0.0, 1.5, 3.0, 4.5)})
    assert ghosts_found(captures, tmp_path / "run", "--no-residual") == (0, 0)
    # the search detects something, which is then rejected
    assert "is no brighter than the residual of halo and star: left out" in capsys.readouterr().err


@pytest.mark.slow
def test_residual_light_of_a_star_at_more_constellations_is_no_ghost(tmp_path):
    captures = shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES})
    assert ghosts_found(captures, tmp_path / "run") == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("haze", [0.05, 0.5])
def test_residual_haze_around_a_light_in_the_picture_is_no_ghost(tmp_path, haze):
    camera = replace(NEAR, haze=haze)
    assert ghosts_found(photographed(tmp_path, camera, ghostless(camera)), tmp_path / "run") == (0, 0)
