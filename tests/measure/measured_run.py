"""The synthetic run that several tests look at: how it is photographed, and what there is of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from synthetic_camera import Setup

from flarewright.model.capture import MergedRun

SETUP = Setup(
    size_px=(240, 160), angles_deg=tuple(1.8 * k for k in range(-2, 11)), pitch_deg=0.3, axis_offset_px=(2, -1),
    drift=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Measured:
    """Photographs, what they were made from, and what merging made of them."""

    photographs: Path
    folder: Path
    truth: dict[str, Any]
    run: MergedRun
