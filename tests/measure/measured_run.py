"""The runs that several tests look at: how they are made, and what there is of them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from synthetic_camera import Setup

from flarewright.model.capture import MergedRun

SETUP = Setup(
    size_px=(240, 160), angles_deg=tuple(3.6 * k for k in range(-1, 5)), pitch_deg=0.3, axis_offset_px=(2, -1),
    drift=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Measured:
    """Photographs, what they were made from, and what merging made of them."""

    photographs: Path
    folder: Path
    truth: dict[str, Any]
    run: MergedRun


@dataclass(frozen=True)
class Staged:
    """The folder of a run with all its stages, what these reported, and how many steps each had."""

    folder: Path
    facts: dict[str, Any]
    steps: dict[str, int]
