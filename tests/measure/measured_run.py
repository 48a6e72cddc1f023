"""Runs that several tests share."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from synthetic_camera import Setup

from flarewright.model.measurement.capture import MergedRun

# the brightest ghosts of the lens, which are enough to find the axis
BRIGHTEST = ("10-6", "8-6", "6-4", "10-8", "10-9", "2-0", "6-2", "6-0", "4-2", "10-4", "9-8", "8-4")
SETUP = Setup(
    size_px=(168, 112), angles_deg=tuple(3.6 * k for k in range(-1, 5)), pitch_deg=0.3, axis_offset_px=(2, -1),
    drift=0.0, paths=BRIGHTEST,
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
