"""Calibrate the camera, merge exposures to HDR frames, and solve the geometry of a run.

`pipeline/merge_stage` combines the modules; their entry points are:

- `calibrate`: `calibrate` determines levels, noise and response of the camera
- `noise`: noise of a pixel value (`noise_of`) and its measurement by photon transfer (`transfers`, `fit_transfer`)
- `exposure_check`: `refuse_contradiction` detects swapped, black or wrongly listed exposures
- `hdr_merge`: `merge_exposures` merges the exposures of one constellation; `exposure_ratios`, `refuse_damage`
- `light_position`: `find_light` locates the light in a frame to a fraction of a pixel
- `camera_geometry`: `solve_geometry` computes axis, focal length, distortion and angles; `believable`
- `optical_axis`: `axis_beside_path` locates the axis across the light's path by mirror symmetry
- `second_light`: `refuse_second_light` detects a second light source
- `settings`: settings of the merge (`MergeSettings`)
- `exposure_drift`: `with_drift_gains` measures the drift of the light source
- `level_horizon`: `make_upright` rotates the frames upright
"""
