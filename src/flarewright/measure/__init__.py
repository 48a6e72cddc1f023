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

from ..lazy import lazy_names

__all__, __getattr__, __dir__ = lazy_names(__name__)
