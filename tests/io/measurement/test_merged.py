"""Merged runs on disk: round trips, and errors for damaged files."""

from pathlib import Path

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.io.measurement.merged import read_frame, read_run, write_frame, write_run
from flarewright.model.measurement.capture import FrameInfo, MergedFrame, MergedRun


def _frame() -> MergedFrame:
    info = FrameInfo(
        file="frame-0.exr", constellation_deg=3.01, nominal_deg=3.0, roll_deg=359.5, light_px=(5.2, 3.0),
        axis_px=(2.0, 3.1), exposures_s=(0.1, 1.0),
    )  # fmt: skip
    rng = np.random.default_rng(1)
    variance = rng.uniform(1e-12, 1.0, (6, 8, 3)).astype(np.float32)
    variance[2, 3] = np.inf
    return MergedFrame(info, rng.normal(size=(6, 8, 3)).astype(np.float32), variance)


def test_a_run_comes_back_exactly(tmp_path: Path) -> None:
    frame = _frame()
    run = MergedRun(size_px=(8, 6), frames=(frame.info,), axis_px=(2.0, 3.1), px_per_rad=480.0)
    write_frame(tmp_path, frame)
    write_run(tmp_path, run)
    again = read_run(tmp_path)
    assert again == run
    back = read_frame(tmp_path, again.frames[0])
    assert np.array_equal(back.radiance, frame.radiance)
    assert np.array_equal(back.variance, frame.variance)
    assert not back.valid[2, 3].any()
    assert back.valid.sum() == 8 * 6 * 3 - 3


def test_the_horizon_is_the_small_angle_and_the_direction_points_up_for_a_roll() -> None:
    info = _frame().info
    assert info.horizon_deg == pytest.approx(-0.5)
    up = info.replace(roll_deg=90.0, nominal_roll_deg=90.0)
    assert up.direction == pytest.approx((0.0, -1.0), abs=1e-12)


@pytest.mark.parametrize(
    ("text", "word"), [(None, "does not exist"), ("{", "not valid JSON"), ('{"size_px": [8, 6]}', "problems")]
)
def test_a_damaged_index_is_told(tmp_path: Path, text: str | None, word: str) -> None:
    if text is not None:
        (tmp_path / "merged.json").write_text(text)
    with pytest.raises(FlarewrightError, match=word):
        read_run(tmp_path)


@pytest.mark.parametrize("gain", ["9223372036854775808", "1e-30", "0"])
def test_a_gain_that_no_light_has_is_told(tmp_path: Path, gain: str) -> None:
    """The first made single-precision variances of 0, and least squares without a solution."""
    run = MergedRun(size_px=(8, 6), frames=(_frame().info,), axis_px=(2.0, 3.1), px_per_rad=480.0)
    text = run.model_dump_json().replace('"gain":1.0', f'"gain":{gain}')
    (tmp_path / "merged.json").write_text(text)
    with pytest.raises(FlarewrightError, match=r"frames\[0\]\.gain"):
        read_run(tmp_path)


def test_a_missing_or_damaged_frame_is_told(tmp_path: Path) -> None:
    info = _frame().info
    with pytest.raises(FlarewrightError, match="does not exist"):
        read_frame(tmp_path, info)
    write_frame(tmp_path, _frame())
    whole = (tmp_path / info.file).read_bytes()
    for damaged in (b"nonsense", whole[: len(whole) // 2], whole[:-40]):
        (tmp_path / info.file).write_bytes(damaged)
        with pytest.raises(FlarewrightError, match="cannot be read as a merged frame: remove it and merge again"):
            read_frame(tmp_path, info)
