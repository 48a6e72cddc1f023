"""Settings of all stages after merging."""

from __future__ import annotations

from dataclasses import dataclass

from ..compression.settings import CompressionSettings
from ..detection.settings import DetectionSettings
from ..fitting.settings import FitSettings
from ..glow.settings import GlowSettings
from ..tracking.settings import TrackingSettings


@dataclass(frozen=True)
class MeasureSettings:
    """Settings of `find_ghosts`, `fit_ghosts`, `track_ghosts` and `compress_ghosts`; each stage reads its part."""

    detection: DetectionSettings = DetectionSettings()  # searches of the stages find and fit
    fit: FitSettings = FitSettings()  # fits of the stage fit
    glow: GlowSettings = GlowSettings()  # halo and star in all stages
    tracking: TrackingSettings = TrackingSettings()  # stage track
    compression: CompressionSettings = CompressionSettings()  # stage compress
