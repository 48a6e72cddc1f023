"""What must not change a model: constellations that are left out, the order of ghosts, how the camera is held."""

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, SIZE, views

from flarewright.io.merged import read_run, write_frame, write_run
from flarewright.measure.replay import replay
from flarewright.measure.stages import find_ghosts, fit_ghosts
from flarewright.model.capture import FrameInfo, MergedFrame, MergedRun

ANGLES = np.linspace(2.0, LARGEST, 12)
FOCAL = 900.0
# they stay in the picture also where it is lower than wide
PLANTED = (GHOSTS[1], GHOSTS[2])


def write(folder, *, roll_deg=0.0, seed=0) -> MergedRun:
    """Write a merged run of planted ghosts, the camera turned about its axis."""
    (folder / "frames").mkdir(parents=True)
    infos = []
    for k, view in enumerate(views(PLANTED, angles=ANGLES, roll_deg=roll_deg, seed=seed)):
        x, y, cosine, sine, _ = (float(each) for each in view.frame)
        along = FOCAL * float(np.tan(np.radians(ANGLES[k])))
        info = FrameInfo(
            file=f"frames/{k:03d}.exr", constellation_deg=float(ANGLES[k]), nominal_deg=float(ANGLES[k]),
            roll_deg=roll_deg, nominal_roll_deg=roll_deg, light_px=(x + along * cosine, y - along * sine),
            axis_px=(x, y),
        )  # fmt: skip
        write_frame(folder, MergedFrame(info, view.pixels, view.variance))
        infos.append(info)
    run = MergedRun(size_px=SIZE, frames=tuple(infos), axis_px=(x, y), px_per_rad=FOCAL)
    write_run(folder, run)
    return run


def test_what_is_left_out_is_not_read(tmp_path):
    whole, half = tmp_path / "whole", tmp_path / "half"
    models = []
    for folder in (whole, half):
        run = write(folder)
        if folder is half:
            for frame in run.frames[1::2]:
                (folder / frame.file).unlink()
        rough = find_ghosts(folder, run, every=2)
        models.append(fit_ghosts(folder, run, rough, every=2))
    assert len(models[0].ghosts) == 2
    assert models[0].model_dump_json() == models[1].model_dump_json()


def test_ghosts_in_another_order_give_the_same_replay(tmp_path):
    run = write(tmp_path)
    rough = find_ghosts(tmp_path, run)
    assert len(rough.ghosts) == 2
    one = fit_ghosts(tmp_path, run, rough)
    other = fit_ghosts(tmp_path, run, rough.replace(ghosts=rough.ghosts[::-1]))
    for angle in (4.0, 11.0, 20.0):
        first, second = (replay(model, angle)[0].pixels for model in (one, other))
        assert np.sqrt(((first - second) ** 2).mean()) < 1e-3 * np.sqrt((first**2).mean())


@pytest.mark.parametrize("roll_deg", [90.0, 205.0])
def test_a_camera_that_is_rolled_measures_the_same_ghosts(tmp_path, roll_deg):
    models = []
    for k, roll in enumerate((0.0, roll_deg)):
        folder = tmp_path / f"{k}"
        run = write(folder, roll_deg=roll, seed=k)
        assert read_run(folder) == run
        models.append(fit_ghosts(folder, run, find_ghosts(folder, run)))
    level, rolled = ([each.green for each in model.ghosts] for model in models)
    assert len(level) == len(rolled) == 2
    for one, other in zip(level, rolled, strict=True):
        # place, its change with the field, size
        for a, b, at in ((one.f[0], other.f[0], 0), (one.f[3], other.f[3], 3), (one.g[0], other.g[0], 10)):
            error = np.hypot(one.uncertainty[at], other.uncertainty[at])
            assert abs(a - b) < 4.0 * error + 0.05
    # as the rolled camera would see it held level, and the other way round
    for angle in (4.0, 11.0, 20.0):
        first, second = (replay(model, angle, roll_deg=roll_deg)[0].pixels for model in models)
        assert np.sqrt(((first - second) ** 2).mean()) < 0.05 * np.sqrt((first**2).mean())
