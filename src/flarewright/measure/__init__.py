"""Measures the flare of a real camera: from photographs of a light source to a model that can be replayed.

A measurement merges the photographs to HDR frames, detects ghosts, fits a model to all frames, tracks each ghost frame
by frame, compacts the model and replays it. The functions of `pipeline` run these stages. The package exports
`merge_captures`, `find_ghosts`, `fit_ghosts`, `track_ghosts`, `compress_ghosts`, `replay_model` and `render_measured`.

- `core`: data and tools that every step shares: views, parameters of a ghost, journal, threads
- `merging`: photographs to merged HDR frames with noise, optical axis and position of the light
- `glow`: fits and subtracts halo and star around the light source
- `detection`: detects ghosts without known positions
- `fitting`: fits ghosts to all constellations
- `tracking`: measures every ghost separately in each frame
- `compression`: reduces a model to the parameters that the frames support
- `residual`: fits sprites to the light that the ghosts do not explain
- `replay`: draws the flare of a model at any position of the light
- `report`: HTML report of a measurement
- `walch`: comparison method after Walch 2017: a fit per frame and polynomials over the constellation
- `pipeline`: the stages merge, find, fit, track and compress
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazy_names

if TYPE_CHECKING:
    from .merging.settings import MergeSettings as MergeSettings
    from .pipeline.compress_stage import compress_ghosts as compress_ghosts
    from .pipeline.find_stage import find_ghosts as find_ghosts
    from .pipeline.fit_stage import fit_ghosts as fit_ghosts
    from .pipeline.merge_stage import merge_captures as merge_captures
    from .pipeline.settings import MeasureSettings as MeasureSettings
    from .pipeline.track_stage import track_ghosts as track_ghosts
    from .replay.measured_project import render_measured as render_measured
    from .replay.model_image import replay_model as replay_model

__all__, __getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".merging.settings": ("MergeSettings",),
        ".pipeline.settings": ("MeasureSettings",),
        ".pipeline.merge_stage": ("merge_captures",),
        ".pipeline.find_stage": ("find_ghosts",),
        ".pipeline.fit_stage": ("fit_ghosts",),
        ".pipeline.track_stage": ("track_ghosts",),
        ".pipeline.compress_stage": ("compress_ghosts",),
        ".replay.model_image": ("replay_model",),
        ".replay.measured_project": ("render_measured",),
    },
)
