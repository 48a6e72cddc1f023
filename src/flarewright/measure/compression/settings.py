"""Settings of the compression of a model."""

from __future__ import annotations

from dataclasses import dataclass

from ..fitting.settings import FitSettings
from ..tracking.settings import TrackingSettings


@dataclass(frozen=True)
class CompressionSettings:
    """Settings of `prune.compact_model`."""

    folds: int = 4  # number of cross-validation folds; with four, each leaves out every fourth constellation
    views: int = 32  # maximum number of views that select the parameters of a ghost
    most_increase: float = 0.002  # maximum relative increase of the cost with fewer parameters, with a free background
    most_increase_bare: float = 0.05  # maximum relative increase of the cost with fewer parameters, without background
    gone: float = 0.15  # a frame that shows less of a ghost than this, over the prediction, shows nothing of it
    rounding: float = 0.05  # rounding step, over the standard deviation of a parameter with all others fixed
    fit: FitSettings = FitSettings()  # refits with fewer parameters
    tracking: TrackingSettings = TrackingSettings()  # poses in each frame, and the curves through them
