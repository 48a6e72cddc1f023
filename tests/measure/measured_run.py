"""Runs that several tests share."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from synthetic_camera import Setup

from flarewright.model.measurement.capture import MergedRun

SETUP = Setup(
    size_px=(240, 160), angles_deg=tuple(3.6 * k for k in range(-1, 5)), pitch_deg=0.3, axis_offset_px=(2, -1),
    drift=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Measured:
    """Folders of photographs and of the merged run, the truth, and the run."""

    photographs: Path
    folder: Path
    truth: dict[str, Any]
    run: MergedRun


@dataclass(frozen=True)
class Staged:
    """Folder of a run with all its stages, their reports, and the number of steps of each."""

    folder: Path
    facts: dict[str, Any]
    steps: dict[str, int]
