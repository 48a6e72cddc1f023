"""All options of `flarewright predict`."""

from __future__ import annotations

from dataclasses import dataclass

from .camera import PredictCameraOptions
from .curves import CurveOptions
from .general import GeneralOptions
from .scene_search import SceneOptions


@dataclass(frozen=True, kw_only=True)
class PredictOptions(SceneOptions, CurveOptions, PredictCameraOptions, GeneralOptions):
    """The options as given; the last base comes first on the help page."""
