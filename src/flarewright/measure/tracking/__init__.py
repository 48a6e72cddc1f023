"""Measures every ghost of a model separately in each frame.

The fit describes a ghost by one set of parameters for all constellations. Tracking measures its brightness, shift and
size frame by frame and finds where the ghost appears and disappears.

- `follow`: tracks of all ghosts over all views (`follow`, `lives`)
- `frame_fit`: joint fit of the poses of all ghosts in one view (`measure_together`, `measure_some`, `Measured`)
- `pupil_centre`: image of a ghost's pupil centre over the constellation, with errors (`middles_of`, `Middles`)
- `settings`: settings of tracks, frame fits and curves (`TrackingSettings`)
- `smoothing_spline`: curves through the poses of single frames, by cross-validation (`smooth_curve`,
  `within_standard_error`)
"""
