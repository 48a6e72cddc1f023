"""Light, axis and angles of traced lenses, with exposures as in Walch 2017 and as in the guide."""

import json

import numpy as np
import pytest
from synthetic_camera import Setup, make

from flarewright.io.measurement.captures import read_camera, read_captures
from flarewright.measure.pipeline.merge_stage import merge_captures

SETUPS = (
    Setup(
        lens="tessar-brendel", coating=None, exposures_s=(0.25, 1.0, 4.0), size_px=(360, 240), quality="final",
        angles_deg=tuple(0.6 * k for k in range(20)), pitch_deg=0.2, seed=3,
    ),
    Setup(
        lens="biotar-50-f1.4", size_px=(360, 240), quality="final", angles_deg=tuple(1.0 * k for k in range(22)),
        tilt_deg=1.5, pitch_deg=-0.3, f_number=4.0, blades=7, seed=6,
    ),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("setup", SETUPS, ids=lambda setup: setup.lens)
def test_light_axis_and_angles_of_a_traced_lens(setup, tmp_path):
    photographs = make(setup, tmp_path / "photographs")
    captures = read_captures(photographs / "captures.csv")
    run = merge_captures(captures, photographs, tmp_path / "run", camera=read_camera(photographs / "camera.json"))
    poses = json.loads((photographs / "truth.json").read_text())["poses"]
    seen = [(frame, pose) for frame, pose in zip(run.frames, poses, strict=True) if frame.light_found]
    assert len(seen) >= 16
    for frame, pose in seen:
        assert frame.light_px == pytest.approx(pose["light_px"], abs=0.3)
    assert run.axis_px == pytest.approx(setup.axis_px, abs=0.3)
    off = np.array([frame.constellation_deg - pose["constellation_deg"] for frame, pose in seen])
    nominal = np.array([pose["nominal_deg"] - pose["constellation_deg"] for _, pose in seen])
    assert np.std(off) < 0.5 * np.std(nominal)
    assert run.camera.electrons_per_unit == pytest.approx(setup.electrons_per_unit, rel=0.02)
