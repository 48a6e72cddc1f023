"""The drift of a light source is corrected, and a steady light is left unchanged."""

import numpy as np
import pytest
from star_run import KNOWN, light_px, shoot, star

from flarewright.io.measurement.captures import read_captures
from flarewright.io.measurement.merged import read_frame, read_run, write_frame
from flarewright.measure.pipeline.merge_stage import merge_captures
from flarewright.model.measurement.capture import MergedFrame

ANGLES = tuple(0.5 * k for k in range(10))


def merged(folder, gains, near=None):
    """Merge photographs of a light with gains; `near`: gains of the pixels within 14 pixels of the light."""
    scenes = {
        angle: star(light_px(angle)) * np.float32(gain * (1.0 - 0.02 * angle))
        for angle, gain in zip(ANGLES, gains, strict=True)
    }
    for (angle, scene), gain in zip(scenes.items(), () if near is None else near, strict=near is not None):
        x, y = np.arange(96) + 0.5 - light_px(angle)[0], np.arange(64)[:, None] + 0.5 - light_px(angle)[1]
        scene[np.hypot(x, y) < 14.0] *= np.float32(gain)
    captures = read_captures(shoot(folder, scenes))
    return merge_captures(captures, folder, folder / "run", camera=KNOWN), scenes


def test_what_the_light_does_is_taken_out_and_what_the_lens_does_stays(tmp_path):
    planted = 1.0 + 0.03 * np.random.default_rng(4).normal(size=len(ANGLES))
    run, scenes = merged(tmp_path, planted)
    assert any("drifted by" in remark for remark in run.remarks)
    found = np.array([info.gain for info in run.frames])
    # a change proportional to the angle is attributed to the lens
    line = np.polynomial.polynomial.polyfit(ANGLES, np.log(planted), 1)
    expected = planted / np.exp(np.polynomial.polynomial.polyval(ANGLES, line))
    np.testing.assert_allclose(found, expected, atol=4.0 * max(info.gain_error for info in run.frames) + 2e-3)
    # ghosts, here a veil far from the light, are corrected with the light
    for info, gain, scene in zip(run.frames, expected, scenes.values(), strict=True):
        frame = read_frame(tmp_path / "run", info)
        corner = frame.radiance[:20, -20:].mean()
        assert corner == pytest.approx(scene[:20, -20:].mean() / gain, rel=0.02)
        raw = read_frame(tmp_path / "run", info.replace(gain=1.0))
        np.testing.assert_allclose(raw.variance, frame.variance * info.gain**2, rtol=1e-5)
    # the file of a frame keeps the photographed values
    info = run.frames[3]
    before = (tmp_path / "run" / info.file).read_bytes()
    frame = read_frame(tmp_path / "run", info)
    write_frame(tmp_path / "run", MergedFrame(info, frame.radiance, frame.variance))
    assert len(before) > 0
    again = read_frame(tmp_path / "run", info)
    np.testing.assert_allclose(again.radiance, frame.radiance, rtol=1e-5)
    assert read_run(tmp_path / "run").frames == run.frames


@pytest.mark.slow
def test_a_steady_light_is_left_alone(tmp_path):
    run, _ = merged(tmp_path, np.ones(len(ANGLES)))
    assert {info.gain for info in run.frames} == {1.0}
    assert not any("drifted by" in remark for remark in run.remarks)


def test_what_changes_near_the_light_alone_is_none_of_the_light(tmp_path):
    ghost = 1.0 + 0.03 * np.random.default_rng(4).normal(size=len(ANGLES))
    run, _ = merged(tmp_path, np.ones(len(ANGLES)), near=ghost)
    assert {info.gain for info in run.frames} == {1.0}
    assert not any("drifted by" in remark for remark in run.remarks)


@pytest.mark.slow
def test_a_drift_is_found_beside_what_else_changes_near_the_light(tmp_path):
    rng = np.random.default_rng(4)
    planted, ghost = 1.0 + 0.04 * rng.normal(size=(2, len(ANGLES)))
    run, _ = merged(tmp_path, planted, near=ghost)
    line = np.polynomial.polynomial.polyfit(ANGLES, np.log(planted), 1)
    expected = planted / np.exp(np.polynomial.polynomial.polyval(ANGLES, line))
    found = np.array([info.gain for info in run.frames])
    assert found.std() > 0.02
    assert np.abs(found - expected).mean() < 0.25 * np.abs(expected - 1.0).mean()
