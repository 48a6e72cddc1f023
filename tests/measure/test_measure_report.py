"""The report of a run: it stands alone, and its replays are laid on the right frames."""

import json
import re
from math import cos, radians, sin, tan

import numpy as np
import pytest
from measured_run import Measured
from test_replay import planted

from flarewright.cli.app import run
from flarewright.io.ghost_model_file import write_ghost_model
from flarewright.io.merged import write_frame, write_run
from flarewright.measure.replay import replay
from flarewright.model.capture import FrameInfo, MergedFrame, MergedRun


def test_the_report_of_a_merged_run_stands_alone(measured: Measured, tmp_path, capsys):
    assert run(["measure", "report", str(measured.folder), "-o", str(tmp_path / "a.html")]) == 0
    text = (tmp_path / "a.html").read_text()
    assert "<script" not in text
    assert not re.search(r"(src|href)=\"http", text)
    assert text.count("data:image/png;base64,") >= 7
    assert f"{measured.run.axis_px[0]:.2f} ±" in text
    assert run(["measure", "report", str(tmp_path)]) == 2
    assert "give a folder that flarewright measure merge has written" in capsys.readouterr().err


def test_a_replay_is_laid_on_its_frame_at_both_sides_and_any_roll(tmp_path, capsys):
    model = planted()
    width, height = model.size_px
    infos = []
    for k, (angle, roll) in enumerate(((-12.0, 0.0), (6.0, 0.0), (13.0, 70.0), (20.0, 70.0))):
        drawn = replay(model, abs(angle), roll_deg=roll if angle > 0.0 else roll + 180.0)[0].pixels
        spread = 0.01 * np.sqrt(np.square(drawn).mean())
        noisy = drawn + np.random.default_rng(k).normal(size=drawn.shape) * spread
        step = model.focal_px * tan(radians(angle))
        light = model.axis_px[0] + step * cos(radians(roll)), model.axis_px[1] - step * sin(radians(roll))
        info = FrameInfo(file=f"{k}.exr", constellation_deg=angle, nominal_deg=angle, light_px=light,
                         roll_deg=roll, nominal_roll_deg=roll, axis_px=model.axis_px, exposures_s=(1.0,))  # fmt: skip
        infos.append(info)
        variance = np.full((height, width, 3), spread**2, np.float32)
        write_frame(tmp_path, MergedFrame(info, noisy.astype(np.float32), variance))
    write_run(
        tmp_path, MergedRun(size_px=(width, height), frames=tuple(infos), axis_px=model.axis_px, px_per_rad=170.0)
    )
    write_ghost_model(tmp_path / "model.json", model)
    assert run(["measure", "report", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ghosts"] == 2
    text = (tmp_path / "report.html").read_text()
    decibels = [float(found) for found in re.findall(r"replayed, (-?[\d.]+) dB<", text)]
    assert len(decibels) == 4
    # what is left is the noise of the frames, which a misplaced ghost would drown
    assert min(decibels) > 20.0
    drawn = re.sub(r"base64,[^\"]*", "", text)
    assert not re.search(r"\b(nan|inf)\b", drawn)
    rows = re.findall(r"<td>([12])</td><td>([\d.]+) to ([\d.]+)</td>", drawn)
    assert {name for name, _, _ in rows} == {"1", "2"}
    assert float(next(low for name, low, _ in rows if name == "2")) == pytest.approx(5.0, abs=1.0)


def test_frames_of_both_sides_are_laid_on_a_model_of_both_sides(tmp_path, capsys):
    one = planted()
    left = one.ghosts[0].replace(visible_deg=(-25.0, -5.0))
    model = one.replace(constellation_deg=(-25.0, 25.0), ghosts=(left, *one.ghosts[1:]))
    width, height = model.size_px
    infos = []
    for k, angle in enumerate((-12.0, 0.5, 12.0)):
        drawn = replay(model, angle, roll_deg=15.0)[0].pixels
        light = model.axis_px[0] + model.focal_px * tan(radians(angle)) * cos(radians(15.0)), model.axis_px[1]
        info = FrameInfo(file=f"{k}.exr", constellation_deg=angle, nominal_deg=angle, light_px=light, roll_deg=15.0,
                         axis_px=model.axis_px, exposures_s=(1.0,))  # fmt: skip
        infos.append(info)
        write_frame(tmp_path, MergedFrame(info, drawn, np.full((height, width, 3), 1e-6, np.float32)))
    write_run(
        tmp_path, MergedRun(size_px=(width, height), frames=tuple(infos), axis_px=model.axis_px, px_per_rad=170.0)
    )
    write_ghost_model(tmp_path / "model.json", model)
    assert run(["measure", "report", str(tmp_path)]) == 0
    capsys.readouterr()
    text = (tmp_path / "report.html").read_text()
    decibels = [float(found) for found in re.findall(r"replayed, (-?[\d.]+) dB<", text)]
    assert len(decibels) == 3
    # nothing is left but rounding in the files
    assert min(decibels) > 60.0
