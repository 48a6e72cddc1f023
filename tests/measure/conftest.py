"""One run of the synthetic camera, merged once for all tests of this folder."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from synthetic_camera import Setup, make

from flarewright.io.captures import read_camera, read_captures
from flarewright.measure.merge_run import merge_captures
from flarewright.model.capture import MergedRun

SETUP = Setup(
    size_px=(240, 160),
    angles_deg=tuple(1.5 * k for k in range(-2, 13)),
    pitch_deg=0.3,
    axis_offset_px=(2, -1),
    drift=0.0,
)


@dataclass(frozen=True)
class Measured:
    """Photographs, what they were made from, and what merging made of them."""

    photographs: Path
    folder: Path
    truth: dict[str, Any]
    run: MergedRun


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    photographs = make(SETUP, tmp_path_factory.mktemp("photographs"))
    folder = tmp_path_factory.mktemp("run")
    captures = read_captures(photographs / "captures.csv")
    run = merge_captures(captures, photographs, folder, camera=read_camera(photographs / "camera.json"))
    return Measured(photographs, folder, json.loads((photographs / "truth.json").read_text()), run)
