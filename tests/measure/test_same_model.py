"""What must not change a model: constellations left out, ghosts' order, where a fit begins, how the camera is held."""

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, SIZE, shape, views

from flarewright.io.merged import read_run, write_frame, write_run
from flarewright.measure.fit import render
from flarewright.measure.found import Found
from flarewright.measure.replay import replay
from flarewright.measure.settle import to_model
from flarewright.measure.stages import find_ghosts, fit_ghosts
from flarewright.model.capture import FrameInfo, MergedFrame, MergedRun
from flarewright.model.ghost_model import AberrationGhost, GhostModel

ANGLES = np.linspace(2.0, LARGEST, 12)
FOCAL = 900.0
# they stay in the picture also where it is lower than wide
PLANTED = (GHOSTS[1], GHOSTS[2])
# some over others: 62 over 55, 105 over 90, -100 over -110 and -75, and that over -40
CROWD = (
    *GHOSTS,
    shape(-75.0, 18.0, 0.4),
    shape(62.0, 20.0, 0.3),
    shape(28.0, 10.0, 0.8),
    shape(-100.0, 12.0, 0.5),
    shape(105.0, 16.0, 0.35),
)
LOOKED_AT = (4.0, 11.0, 20.0)
# part of the light by which fits of a crowd differ by where they begin, and from the truth; nine starts: 0.4 to 0.9 %
BEGUN_ELSEWHERE = 0.015


def write(folder, planted=PLANTED, *, roll_deg=0.0, seed=0) -> MergedRun:
    """Write a merged run of planted ghosts, the camera turned about its axis."""
    (folder / "frames").mkdir(parents=True)
    infos = []
    for k, view in enumerate(views(planted, angles=ANGLES, roll_deg=roll_deg, seed=seed)):
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
    for angle in LOOKED_AT:
        first, second = (replay(model, angle)[0].pixels for model in (one, other))
        assert np.sqrt(((first - second) ** 2).mean()) < 1e-3 * np.sqrt((first**2).mean())


def disturbed(ghost: AberrationGhost, rng: np.random.Generator) -> AberrationGhost:
    """Move a ghost by 2 pixels where the light is farthest, and change its size by 3 % and its light by 20 %."""
    place, size, light = rng.normal(0.0, (2.0, 0.03, 0.2))

    def changed(one):
        return one.replace(
            f=(one.f[0] + place, *one.f[1:]), g=tuple((1.0 + size) * term for term in one.g),
            intensity=tuple((1.0 + light) * (1.0 + size) ** 2 * term for term in one.intensity),
        )  # fmt: skip

    return ghost.replace(red=changed(ghost.red), green=changed(ghost.green), blue=changed(ghost.blue))


@pytest.mark.slow
def test_a_crowd_in_another_order_or_begun_elsewhere_gives_the_same_replay(tmp_path):
    """Nine ghosts, some over others: order changes nothing, and where they begin as little as noise."""
    run = write(tmp_path, CROWD)
    planted = to_model([Found((one,) * 3, 0, ANGLES.size - 1) for one in CROWD], views((), angles=ANGLES))
    rough = GhostModel(
        size_px=SIZE, axis_px=run.axis_px, focal_px=FOCAL, largest_deg=LARGEST,
        constellation_deg=(float(ANGLES[0]), LARGEST), ghosts=planted,
    )  # fmt: skip
    truth = [sum(render(one, view) for one in CROWD)[..., None] for view in views((), angles=LOOKED_AT)]

    def fitted(ghosts):
        model = fit_ghosts(tmp_path, run, rough.replace(ghosts=ghosts), rest=False)
        assert len(model.ghosts) == len(CROWD)
        return [replay(model, angle)[0].pixels for angle in LOOKED_AT]

    def apart(those, others):
        return max(
            float(np.sqrt(((a - b) ** 2).mean() / (a**2).mean())) for a, b in zip(those, others, strict=True)
        )  # fmt: skip

    begun = [
        tuple(disturbed(one, np.random.default_rng((seed, k))) for k, one in enumerate(planted)) for seed in (0, 1)
    ]
    starts = [[replay(rough.replace(ghosts=ghosts), angle)[0].pixels for angle in LOOKED_AT] for ghosts in begun]
    one, other = (fitted(ghosts) for ghosts in begun)
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(planted))
        assert apart(one, fitted(tuple(begun[0][k] for k in order))) < 1e-3
    # disturbed they are a fifth of the light off and more; fitted they agree with each other as well as with the truth
    for start, end in zip(starts, (one, other), strict=True):
        assert apart(truth, start) > 0.1
        assert apart(truth, end) < BEGUN_ELSEWHERE
    assert apart(one, other) < BEGUN_ELSEWHERE


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
    for angle in LOOKED_AT:
        first, second = (replay(model, angle, roll_deg=roll_deg)[0].pixels for model in models)
        assert np.sqrt(((first - second) ** 2).mean()) < 0.05 * np.sqrt((first**2).mean())
