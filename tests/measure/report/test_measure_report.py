"""The report of a run is self-contained, and its replays match their frames."""

import base64
import json
import re
from dataclasses import replace
from io import BytesIO
from math import cos, radians, sin, tan

import numpy as np
import pytest
from PIL import Image
from star_run import ANGLES, light_px, shoot, star
from test_model_image import planted

import flarewright as fw
from flarewright.cli.app import run
from flarewright.io.measurement.captures import read_captures
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.io.measurement.merged import read_frame, write_frame, write_run
from flarewright.measure.pipeline.merge_stage import merge_captures
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.report.frames import frames_section, outlines_section, replays_section
from flarewright.measure.report.overview import write_overview
from flarewright.measure.report.page import write_report
from flarewright.model.measurement.capture import CameraNoise, FrameInfo, MergedFrame, MergedRun
from flarewright.model.measurement.ghost_model import Halo
from flarewright.render.image.display import auto_exposure, view, view_text


def test_the_report_of_a_merged_run_stands_alone(tmp_path, capsys):
    captures = read_captures(shoot(tmp_path, {angle: star(light_px(angle)) for angle in ANGLES}))
    merged = merge_captures(captures, tmp_path, tmp_path / "run")
    assert run(["measure", "report", str(tmp_path / "run"), "-o", str(tmp_path / "a.html")]) == 0
    text = (tmp_path / "a.html").read_text()
    assert "<script" not in text
    assert not re.search(r"(src|href)=\"http", text)
    assert text.count("data:image/png;base64,") >= len(ANGLES) + 1
    assert f"{merged.axis_px[0]:.2f} ±" in text
    assert run(["measure", "report", str(tmp_path)]) == 2
    assert "give a folder written by flarewright measure merge" in capsys.readouterr().err


def test_a_replay_is_laid_on_its_frame_at_both_sides_and_any_roll(tmp_path, capsys):
    model = planted()
    width, height = model.size_px
    infos = []
    for k, (angle, roll) in enumerate(((-12.0, 0.0), (6.0, 0.0), (13.0, 70.0))):
        drawn = replay_model(model, abs(angle), roll_deg=roll if angle > 0.0 else roll + 180.0)[0].pixels
        spread = 0.01 * np.sqrt(np.square(drawn).mean())
        noisy = drawn + np.random.default_rng(k).normal(size=drawn.shape) * spread
        step = model.focal_px * tan(radians(angle))
        light = model.axis_px[0] + step * cos(radians(roll)), model.axis_px[1] - step * sin(radians(roll))
        info = FrameInfo(file=f"{k}.exr", constellation_deg=angle, nominal_deg=angle, light_px=light,
                         roll_deg=roll, nominal_roll_deg=roll, axis_px=model.axis_px, exposures_s=(1.0,))  # fmt: skip
        infos.append(info)
        variance = np.full((height, width, 3), spread**2, np.float32)
        write_frame(tmp_path, MergedFrame(info, noisy.astype(np.float32), variance))
    light = CameraNoise(luminance_cd_m2=2e4, solid_angle_sr=1e-3)
    write_run(
        tmp_path,
        MergedRun(
            size_px=(width, height), frames=tuple(infos), axis_px=model.axis_px, px_per_rad=170.0, camera=light
        ),
    )  # fmt: skip
    write_ghost_model(tmp_path / "model.json", model)
    assert run(["measure", "report", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ghosts"] == 2
    text = (tmp_path / "report.html").read_text()
    assert "20000 cd/m², 0.001 sr: 20 lx" in text
    decibels = [float(found) for found in re.findall(r"replayed, (-?[\d.]+) dB<", text)]
    assert len(decibels) == 3
    # only the frames' noise remains; a misplaced ghost would exceed it
    assert min(decibels) > 20.0
    drawn = re.sub(r"base64,[^\"]*", "", text)
    assert not re.search(r"\b(nan|inf)\b", drawn)
    rows = re.findall(r"<td>([12])</td><td>([\d.]+) to ([\d.]+)</td>", drawn)
    assert {name for name, _, _ in rows} == {"1", "2"}
    assert float(next(low for name, low, _ in rows if name == "2")) == pytest.approx(5.0, abs=1.0)


def run_of(folder, model, angles=(6.0, 12.0, 18.0), noise=1e-3, gain=None, **changes):
    """Write a run of frames with a model's flare, and return it."""
    width, height = model.size_px
    infos = []
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    for k, angle in enumerate(angles):
        drawn = replay_model(model, angle)[0].pixels
        noisy = drawn + np.random.default_rng(k).normal(size=drawn.shape) * noise
        light = model.axis_px[0] + model.focal_px * tan(radians(angle)), model.axis_px[1]
        info = FrameInfo(file=f"frames/{k}.exr", constellation_deg=angle, nominal_deg=angle, light_px=light,
                         axis_px=model.axis_px, exposures_s=(0.5, 2.0), gain=gain or 1.0 + 0.01 * k)  # fmt: skip
        infos.append(info)
        facts = {"ratios": [{"value": 1.02, "error": 0.001}, {"value": 1.0, "error": 0.0}]}
        (folder / "frames" / f"{k}.json").write_text(json.dumps(facts))
        variance = np.full((height, width, 3), max(noise, 1e-6) ** 2, np.float32)
        write_frame(folder, MergedFrame(info, (noisy * info.gain).astype(np.float32), variance * info.gain**2))
    fields = {"size_px": (width, height), "frames": tuple(infos), "axis_px": model.axis_px, "px_per_rad": 170.0}
    written = MergedRun(**{**fields, **changes})
    write_run(folder, written)
    return written


def pictures_of(html):
    return [
        np.asarray(Image.open(BytesIO(base64.b64decode(data))).convert("RGB")).astype(int)
        for data in re.findall(r"base64,([^\"]+)", html)
    ]


def test_a_ghost_that_a_replay_lacks_is_plain_to_see_in_the_difference(tmp_path):
    """The light is a hundred times as bright as ghosts; the scale of the differences follows the ghosts."""
    halo = Halo(radius_px=(1.0, 4.0), radiance=((900.0, 900.0, 900.0), (90.0, 90.0, 90.0)))
    model = planted().replace(star=None, halo=halo)
    written = run_of(tmp_path, model)
    lacking = model.replace(ghosts=model.ghosts[1:])
    *_, off = pictures_of(replays_section(tmp_path, written, written.frames[1:2], lacking))
    single = next(one for one in replay_model(model, 12.0, single=True) if one.name == "ghost.1")
    x, y, w, h = single.window
    lit = single.pixels.mean(axis=2) > 0.5 * single.pixels.mean(axis=2).max()
    assert np.abs(off[y : y + h, x : x + w][lit] - 127).mean() > 40
    assert np.abs(off[:20, -20:] - 127).max() < 10
    assert "black to white: ± " in replays_section(tmp_path, written, written.frames[1:2], lacking)


def test_frames_and_replays_are_shown_as_a_render_of_the_model_is(tmp_path):
    """The page's pictures equal the PNG of `flarewright render model.json`: exposure, camera colours and all."""
    colours = ((1.5, -0.4, -0.1), (-0.2, 1.4, -0.2), (0.05, -0.6, 1.55))
    model = planted().replace(to_rec709=colours)
    written = run_of(tmp_path, model, (12.0,), noise=0.0, gain=1.0, to_rec709=colours)
    (info,) = written.frames
    frame = read_frame(tmp_path, info)
    write_frame(tmp_path, replace(frame, variance=np.where(frame.radiance > 9.0, np.inf, 1e-12).astype(np.float32)))
    clipped = (frame.radiance > 9.0).any(axis=2)
    assert 0 < clipped.sum() < 200
    write_ghost_model(tmp_path / "model.json", model)
    light = fw.Light(field_deg=(12.0, 0.0))
    camera = fw.Camera(size_px=model.size_px, sensor_mm=(36.0, 36.0 * 90 / 160))
    rendered = fw.render_measured(fw.Project(lens=str(tmp_path / "model.json"), lights=[light], camera=camera))
    html = replays_section(tmp_path, written, written.frames, model)
    (stops,) = (float(found) for found in re.findall(r"measured, ([+-][\d.]+) stops<", html))
    assert stops == pytest.approx(auto_exposure(rendered.layers[0].pixels), abs=0.1)
    measured, replayed, _ = pictures_of(html)
    expected = view(rendered.layers[0].pixels, auto_exposure(rendered.layers[0].pixels)).astype(int)
    for shown in (measured, replayed):
        assert np.abs(shown - expected)[~clipped].max() <= 2
        assert (shown[clipped] == 255).all()
    (alone,) = pictures_of(frames_section(tmp_path, written, written.frames))
    np.testing.assert_array_equal(alone, measured)


def test_a_frame_with_noise_below_black_is_seen(tmp_path):
    """A logarithmic scale from the darkest pixels would be undefined there."""
    model = planted()
    written = run_of(tmp_path, model, (18.0,), noise=0.01)
    measured, _, _ = pictures_of(replays_section(tmp_path, written, written.frames, model))
    lit = replay_model(model, 18.0)[1].pixels.max(axis=2) > 1.0
    dark = np.hypot(*np.meshgrid(np.arange(160) - 135, np.arange(90) - 44)) > 100
    assert measured[lit].mean() > 100
    assert measured[dark].mean() < 20


def test_the_overview_says_how_it_is_exposed(tmp_path):
    model = planted()
    written = run_of(tmp_path, model)
    write_overview(tmp_path, written)
    with Image.open(tmp_path / "merged.png") as picture:
        reported, shown = picture.info["Description"], np.asarray(picture).astype(int)
    light = np.max([np.zeros((90, 160, 3)), *(read_frame(tmp_path, info).radiance for info in written.frames)], axis=0)
    assert reported.startswith(view_text(auto_exposure(light), "filmic", "rec709", automatic=True))
    # nothing is drawn above and below the mirror line
    expected = view(light, auto_exposure(light))
    np.testing.assert_array_equal(shown[:30], expected[:30])


def test_ghosts_are_outlined_and_named_over_frames_and_curves_say_whose_they_are(tmp_path):
    model = planted()
    written = run_of(tmp_path, model)
    colours = {"1": "#1d5fa8", "2": "#c8413b"}
    html = outlines_section(tmp_path, written, written.frames[1:2], model, colours)
    assert len(re.findall(r">1</text>", html)) == len(re.findall(r">2</text>", html)) == 5
    (picture,) = pictures_of(html)
    red = (picture[..., 0] > 200) & (picture[..., 1] < 140) & (picture[..., 2] < 140)
    blue = (picture[..., 2] > 200) & (picture[..., 0] < 140)
    # thin closed lines, not areas
    assert 40 < np.count_nonzero(red) < 600
    assert 40 < np.count_nonzero(blue) < 600
    write_report(tmp_path, written, model, tmp_path / "r.html")
    text = re.sub(r"base64,[^\"]*", "", (tmp_path / "r.html").read_text())
    charts = [one for one in re.findall(r"<svg.*?</svg>", text, re.DOTALL) if "Where the ghosts" in one]
    assert ">1</text>" in charts[0]
    assert ">2</text>" in charts[0]
    assert "0.5 s: 1.02, 2 s: 1<" in text
    assert "1.0000 to 1.0200" in text
    assert "Light relative to its neighbours" in text
    assert "<td>-0</td>" not in text
    assert text.index("<h2>Ghosts</h2>") < text.index("<h2>The model's numbers</h2>")
    assert "8.89 pixels (1/18 of the width)" in text


def test_a_model_of_another_camera_is_left_out_and_refused_where_it_was_chosen(tmp_path, capsys):
    model = planted()
    run_of(tmp_path, model)
    other = tmp_path / "other.json"
    for change in ({"size_px": (180, 120)}, {"axis_px": (70.0, 44.6)}, {"focal_px": 250.0}):
        write_ghost_model(other, model.replace(**change))
        assert run(["measure", "report", str(tmp_path), "--model", str(other)]) == 2
        reported = capsys.readouterr().err
        assert "does not belong to the frames" in reported
        assert reported.count("\n") == 1
        assert not (tmp_path / "report.html").exists()
    write_ghost_model(tmp_path / "compact.json", model.replace(size_px=(180, 120)))
    (tmp_path / "tracks.json").write_text("{}")
    assert run(["measure", "report", str(tmp_path), "--json"]) == 0
    reported = capsys.readouterr()
    data = json.loads(reported.out)
    assert data["ghosts"] is None
    assert "pictures of 180 x 120 pixels, and the frames have 160 x 90" in data["remarks"][0]
    assert "is omitted" in reported.err
    assert "is omitted" in (tmp_path / "report.html").read_text()


def test_runs_without_frames_and_frames_of_another_size_are_refused(tmp_path, capsys):
    model = planted()
    run_of(tmp_path / "a", model, size_px=(96, 64))
    run_of(tmp_path / "b", model, frames=())
    for folder, words in (("a", "0.exr has 160 x 90 pixels, and the run 96 x 64"), ("b", "a run without frames")):
        assert run(["measure", "report", str(tmp_path / folder)]) == 2
        reported = capsys.readouterr().err
        assert words in reported
        assert "merge again" in reported
        assert not (tmp_path / folder / "report.html").exists()


def test_frames_of_both_sides_are_laid_on_a_model_of_both_sides(tmp_path, capsys):
    one = planted()
    left = one.ghosts[0].replace(visible_deg=(-25.0, -5.0))
    model = one.replace(constellation_deg=(-25.0, 25.0), ghosts=(left, *one.ghosts[1:]))
    width, height = model.size_px
    infos = []
    for k, angle in enumerate((-12.0, 0.5, 12.0)):
        drawn = replay_model(model, angle, roll_deg=15.0)[0].pixels
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
    # only rounding in the files remains
    assert min(decibels) > 60.0
