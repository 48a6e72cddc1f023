"""An ablation of each stage: one changed setting changes the result as its sentence in the settings says."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted_run import FOCAL, LARGEST, SMALL, shape, views, write_small
from star_run import KNOWN, light_px, shoot, star

from flarewright.io.measurement.captures import read_captures
from flarewright.measure.compression.prune import rounded_to_error
from flarewright.measure.compression.settings import CompressionSettings
from flarewright.measure.detection.rim_voting import candidates, slopes_of
from flarewright.measure.detection.settings import DetectionSettings, RimSettings
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.joint_intensities import solve_intensities
from flarewright.measure.fitting.lifetimes import visible_range
from flarewright.measure.fitting.settings import FitSettings, JointSettings, LifetimeSettings
from flarewright.measure.glow.rejection import is_residual_glow
from flarewright.measure.glow.settings import RejectionSettings
from flarewright.measure.merging.settings import DriftSettings, MergeSettings
from flarewright.measure.pipeline.merge_stage import merge_captures
from flarewright.measure.pipeline.settings import MeasureSettings
from flarewright.measure.tracking.follow import follow
from flarewright.measure.tracking.settings import TrackingSettings
from flarewright.measure.walch.polynomials import fit_polynomial
from flarewright.measure.walch.settings import WalchSettings
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.workflow.measure_run import run_stages

ONE = shape(-20.0, 12.0, 0.6)
FEW = np.linspace(4.0, LARGEST, 6)


def shown(level=1.0):
    """Return small views of the ghost at a part of its brightness."""
    numbers = ONE.numbers.copy()
    numbers[20:30] *= level
    return views((replace(ONE, numbers=numbers),), angles=FEW, size=SMALL)


def test_merging_corrects_a_drift_of_at_least_so_many_frames(tmp_path):
    gains = 1.0 + 0.03 * np.random.default_rng(4).normal(size=6)
    scenes = {0.5 * k: star(light_px(0.5 * k)) * np.float32(gain) for k, gain in enumerate(gains)}
    captures = read_captures(shoot(tmp_path, scenes))
    assert all(frame.gain != 1.0 for frame in merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN).frames)
    settings = MergeSettings(drift=DriftSettings(least_frames=7))
    run = merge_captures(captures, tmp_path, tmp_path / "run", camera=KNOWN, settings=settings)
    assert {frame.gain for frame in run.frames} == {1.0}


def test_detection_subtracts_the_level_from_the_vote_of_each_view():
    seen = shown()
    masks = [np.ones(view.pixels.shape[:2], bool) for view in seen]
    slopes = slopes_of(seen, [view.pixels[..., 1] for view in seen], masks)
    low, high = (
        candidates(slopes, SMALL[0], most=1, settings=RimSettings(level=level))[0].score for level in (0.1, 0.15)
    )
    assert low - high == pytest.approx(0.05 * len(seen), abs=1e-6)


def test_fitting_needs_so_much_brightness_of_a_visible_ghost():
    dim = shown(level=0.5)
    own = [view.pixels[..., 1] for view in dim]
    assert visible_range(ONE, dim, own, 3) == (0, len(FEW) - 1)
    strict = FitSettings(lifetimes=LifetimeSettings(there=0.7))
    assert visible_range(ONE, dim, own, 3, settings=strict) == (3, 3)


def test_fitting_drops_ghosts_that_explain_less_than_is_needed():
    ghost = DetectedGhost((ONE, ONE, ONE), 0, len(FEW) - 1)
    assert len(solve_intensities([ghost], shown())) == 1
    assert solve_intensities([ghost], shown(), settings=FitSettings(joint=JointSettings(needed=2.0))) == []


def test_tracking_sees_a_ghost_of_so_much_of_its_brightness():
    def states(settings):
        (track,) = follow(("1",), [(ONE, ONE, ONE)], shown(level=0.5)[2:4], settings=settings).ghosts
        return {step.state for step in track.steps}

    assert states(TrackingSettings()) == {"seen"}
    assert states(TrackingSettings(there=0.7)) == {"faint"}


def test_glow_is_what_the_limits_of_offset_and_brightness_say():
    faint = shape(70.0, 8.0, 0.02)
    lit = []
    for view in views((faint,), angles=FEW, size=SMALL):
        x, y, cosine, sine, _ = view.frame
        at = x + 70.0 * view.sigma * cosine, y - 70.0 * view.sigma * sine
        lit.append(replace(view, light_px=at, pixels=view.pixels + np.float32(1.0)))
    ghost = DetectedGhost((faint, faint, faint), 0, len(FEW) - 1)
    without = RejectionSettings(limits=(), hidden_size=0.0, coarse_px=0.0)
    assert is_residual_glow([ghost], lit) == [True]
    assert is_residual_glow([ghost], lit, without) == [False]


def test_compression_rounds_to_a_part_of_the_deviation():
    assert rounded_to_error(1.23456, 0.01) == 1.2346
    assert rounded_to_error(1.23456, 0.01, CompressionSettings(rounding=0.5)) == 1.235


def test_walch_fits_polynomials_of_at_most_an_order():
    at = np.linspace(0.0, 18.0, 12)
    line = at, 2.0 * at, np.ones(12), (0.0, 18.0)
    assert fit_polynomial(*line).coefficients == pytest.approx((18.0, 18.0))
    assert fit_polynomial(*line, WalchSettings(most_order=0)).coefficients == pytest.approx((18.0,))


@pytest.fixture
def stubbed(tmp_path, monkeypatch):
    """Return an empty run without the work of its stages, and the settings that each stage received."""
    write_small(tmp_path, ())
    received = []
    model = GhostModel(
        size_px=SMALL, axis_px=(9.0, 9.0), focal_px=FOCAL, largest_deg=20.0, constellation_deg=(0.0, 20.0)
    )
    for stage in ("find", "fit"):
        path = f"flarewright.measure.pipeline.{stage}_stage.{stage}_ghosts"
        monkeypatch.setattr(path, lambda *_, settings, **__: received.append(settings) or model)
    return tmp_path, received


def test_a_stage_runs_again_when_its_settings_change_and_no_other_does(stubbed):
    folder, received = stubbed

    def kept(settings):
        return [one.kept for one in run_stages(folder, ("find", "fit"), residual=False, settings=settings)]

    fit, search = MeasureSettings(fit=FitSettings(views=9)), MeasureSettings(detection=DetectionSettings(views=9))
    assert kept(None) == [False, False]
    assert kept(MeasureSettings()) == [True, True]
    assert kept(MeasureSettings(tracking=TrackingSettings(sure=9.0))) == [True, True]
    assert kept(fit) == [True, False]
    assert kept(search) == [False, False]
    assert received[2:] == [fit, search, search]


def test_the_example_of_the_documentation_sets_what_it_says(stubbed, monkeypatch):
    folder, received = stubbed
    monkeypatch.chdir(folder.parent)
    (example,) = re.findall(r"```python\n(from dataclasses.*?)```", Path(DOCS).read_text(encoding="utf-8"), re.S)
    exec(example.replace('Path("run")', f"Path({str(folder)!r})"), {})
    assert [settings.detection.pursuit.sure for settings in received] == [8.0]


DOCS = Path(__file__).parents[2] / "docs" / "python.md"
